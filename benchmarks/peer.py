"""The process that runs fenicsx-pulse for the benchmark; `mechanics.py` starts it in pulse's interpreter."""

from __future__ import annotations

import logging
import warnings
from pathlib import Path
from typing import Any

warnings.filterwarnings("ignore", category=DeprecationWarning)

import numpy as np  # noqa: E402
from pulse_heart import Law, PulseHeart, quadrature_points  # noqa: E402
from pulse_search import Course, Failed  # noqa: E402
from worker import Clock, serve  # noqa: E402

logging.getLogger("pulse").setLevel(logging.ERROR)

OFF = 1e3
"""Active tension (Pa) that is added to a solved state before a Newton step is timed."""


class Peer:
    """Commands of the benchmark, about one heart at a time."""

    heart: PulseHeart

    def points(self, degree: int) -> list[list[float]]:
        """Local coordinates at which fibres are wanted."""
        return quadrature_points(degree).tolist()

    def build(self, file: str, law: dict[str, Any], base: str, control: str, degree: int) -> dict[str, Any]:
        """Make the heart; compiles its forms where that was not done before."""
        clock = Clock()
        with clock("build"):
            self.heart = PulseHeart(Path(file), Law(**law), base, control, degree)
        self._course = Course(self.heart)
        return {"unknowns": self.heart.n_unknowns, "volume": self.heart.volume} | clock.seconds["build"]

    def go(self, tension: float, prescribed: float, increments: int = 1) -> dict[str, float]:
        """Go to a load in equal increments, and take the state as the first frame."""
        clock, before = Clock(), self._course.count.newton_steps
        loads = np.linspace(self._course.load, (tension, prescribed), increments + 1)
        with clock("go"):
            for load in loads[1:]:
                self._course.go(*load)
        self._course.begin()
        steps = self._course.count.newton_steps - before
        state = {"pressure": self.heart.pressure, "volume": self.heart.volume, "newton_steps": steps}
        return state | clock.seconds["go"]

    def frame(self, pressure: float, volume: float, method: str) -> dict[str, Any]:
        """Find the tension of the next frame."""
        clock, count, answer = Clock(), self._course.count, {}
        before = (count.newton_steps, count.solves, count.failures)
        with clock("frame"):
            try:
                answer["tension"] = self._course.frame(pressure, volume, method)
            except Failed as failure:
                answer["failed"] = str(failure)
        spent = np.subtract((count.newton_steps, count.solves, count.failures), before).tolist()
        answer |= {"pressure": self.heart.pressure, "volume": self.heart.volume}
        return answer | dict(zip(("newton_steps", "solves", "failures"), spent, strict=True)) | clock.seconds["frame"]

    def displacement(self, file: str) -> None:
        """Save the displacement of the nodes."""
        np.save(file, self.heart.displacement)

    def step(self) -> dict[str, dict[str, float]]:
        """Seconds of the parts of a Newton step, and of a whole one, near the last state."""
        clock, problem, kept = Clock(), self.heart.problem.problem, self.heart.state()
        tension, prescribed = self._course.load
        self.heart.load(tension + OFF, prescribed)
        snes, correction, x = problem.solver, problem.b.duplicate(), problem.x.copy()
        _, _, (assemble, _, options) = snes.getJacobian()
        with clock("residual"):
            snes.computeFunction(x, problem.b)
        with clock("tangent"):
            assemble(snes, x, problem.A, problem.A, **options)
        linear = snes.getKSP()
        linear.setOperators(problem.A, problem.A)
        with clock("factor"):
            linear.setUp()
        with clock("solve"):
            linear.solve(problem.b, correction)
        whole = self._whole_step()
        clock.seconds["step"] = {kind: whole[kind] - spent for kind, spent in clock.seconds["residual"].items()}
        self.heart.restore(kept)
        return clock.seconds

    def _whole_step(self) -> dict[str, float]:
        """One step as pulse takes it, line search and all, with the residual at its start."""
        snes, clock = self.heart.problem.problem.solver, Clock()
        rtol, atol, stol, most = snes.getTolerances()
        snes.setTolerances(rtol=0, atol=0, stol=0, max_it=1)
        with clock("whole"):
            self.heart.solve()
        snes.setTolerances(rtol=rtol, atol=atol, stol=stol, max_it=most)
        return clock.seconds["whole"]


if __name__ == "__main__":
    peer = Peer()
    names = ("points", "build", "go", "frame", "displacement", "step")
    serve({name: getattr(peer, name) for name in names})
