"""The process that runs echotruth for the benchmark; everything that touches echotruth is in this file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import land
import numpy as np
from worker import Clock, serve

from echotruth.config import Config, Geometry, Loop, Mechanics
from echotruth.config.loading import load
from echotruth.fem.quadrature import tetrahedron
from echotruth.fem.tetrahedra import Floats, Mesh, shape
from echotruth.loop.cycle import Cycle, read_loop
from echotruth.mechanics import fibres
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.solver.cycle import filled_to_end_diastole, solve
from echotruth.mechanics.solver.equilibrium import Equilibrium, Load
from echotruth.mechanics.solver.newton import LoadStepper
from echotruth.mechanics.solver.support import base_support
from echotruth.mechanics.solver.wall import Wall, equilibrium, wall, wall_law
from echotruth.units import kPa

PAPERS = load(Path(__file__).parents[1] / "config" / "paper.yaml")
"""The paper's heart, whose fibres pull along themselves alone and which nothing surrounds, as the peer's."""
ELASTIC = PAPERS.mechanics.model_copy(update={"viscosity_Pa_s": 0.0})
"""Its wall, less its viscosity, which the peer's has not."""

LAND_BULK_KPA = 1e5
"""Bulk modulus for Land et al., whose wall is incompressible."""

OFF = 0.99
"""Factor on the volume of a solved state before a Newton step is timed."""


class Ours:
    """Commands of the benchmark, about one heart at a time."""

    _heart: Equilibrium | None = None

    def mesh(self, elements: list[int] | None = None) -> dict[str, int]:
        """Mesh the paper's ventricle, or one with other numbers of elements around, along and through the wall."""
        geometry = PAPERS.geometry.model_copy(update=_elements(elements))
        config = PAPERS.model_copy(update={"geometry": geometry, "mechanics": ELASTIC})
        self._use(config)
        return {"cells": len(self._wall.mesh.cells)}

    def mesh_land(self) -> dict[str, int]:
        """Mesh the ventricle of Land et al."""
        lengths = {"endo_radius_mm": 7.0, "endo_length_mm": 17.0, "wall_mm": 3.0, "apex_wall_mm": 3.0, "base_mm": 5.0}
        self._use(Config(geometry=Geometry(**lengths, **_elements(land.ELEMENTS))))
        return {"cells": len(self._wall.mesh.cells)}

    def _use(self, config: Config) -> None:
        self._config, self._wall = config, wall(config, left_ventricle(config.geometry))

    def hand_over(self, file: str, points: list[list[float]], fibres_of_land: bool = False) -> None:
        """Save the mesh, with the fibres at local coordinates of each cell."""
        mesh, xi = self._wall.mesh, np.array(points)
        frames = _land_frames(mesh, xi) if fibres_of_land else _frames(self._config, self._wall, xi)
        sides = {side: getattr(mesh, side) for side in ("endo", "epi", "base")}
        np.savez(file, nodes=mesh.nodes, cells=mesh.cells, fibre_frames=frames, **sides)

    def build(self) -> dict[str, int]:
        """Make the heart of the mesh."""
        self._replace(equilibrium(self._config, self._wall))
        return {"unknowns": self._heart.assembly.n_equations}

    def _replace(self, heart: Equilibrium) -> None:
        if self._heart:
            self._heart.close()
        self._heart = heart

    def constants(self) -> dict[str, float]:
        """Constants of the wall, but the stiffness; SI."""
        section, material = self._config.mechanics, self._config.mechanics.material
        exponents = {"fibre": material.fibre, "transverse": material.transverse, "shear": material.shear}
        return exponents | {"beta": section.active.length_dependence, "bulk_modulus": section.bulk_modulus_kPa * kPa}

    def base(self) -> str:
        """Support of the base."""
        return self._config.mechanics.base

    def cycle(self, frames: int | None = None, stiffness: float | None = None) -> dict[str, Any]:
        """Solve the first frames of the loop, its pressure and volume given."""
        clock, whole, everywhere = Clock(), read_loop(Loop()), np.ones(len(self._wall.mesh.cells))
        with clock("cycle"):
            self._beat = solve(self._heart, _first(whole, frames), everywhere, stiffness)[0]
        names = {"tension": "active_tension", "pressure": "pressure", "volume": "volume"}
        course = {name: getattr(self._beat, array).tolist() for name, array in names.items()}
        course |= {"stiffness": float(self._beat.stiffness), "newton_steps": int(self._beat.newton_steps.sum())}
        return course | {"steps_of_frame": self._beat.newton_steps.tolist()} | clock.seconds["cycle"]

    def displacement(self, file: str, frame: int) -> None:
        """Save the displacement of the nodes in a frame of the last cycle."""
        np.save(file, self._beat.displacement[frame])

    def fill(self, stiffness: float) -> None:
        """Go to end-diastole."""
        stepper = filled_to_end_diastole(self._heart, _first(read_loop(Loop()), 1), stiffness)
        load = stepper.load
        self._state, self._load = stepper.state, replace(load, volume=OFF * load.volume, tension_fraction=1.0)

    def step(self) -> dict[str, dict[str, float]]:
        """Seconds of the parts of a Newton step, and of a whole one, near end-diastole.

        A whole step has the active tension among its unknowns: a tangent, its factors, the response to the
        tension, a correction and the residual after it.
        """
        heart, clock, at = self._heart, Clock(), (self._state, self._load, "tension")
        untimed, heart._solver = heart._solver, _Timed(heart._solver, clock)
        with clock("residual"):
            residual = heart.residual(*at)
        with clock("step"):
            tangent = heart.linearize(*at)
            moved = self._state.corrected(tangent.correction(residual), 1.0, "tension")
            heart.residual(moved, self._load, "tension")
        heart._solver = untimed
        spent = clock.seconds
        parts = ("factor", "solve", "residual")
        spent["tangent"] = {k: spent["step"][k] - sum(spent[part][k] for part in parts) for k in ("wall", "cpu")}
        spent["solve"] = {kind: value / 2 for kind, value in spent["solve"].items()}
        return spent

    def solve_land(self, number: str) -> dict[str, float]:
        """Solve a problem of Land et al. on their mesh; the apex in mm."""
        problem, mesh = land.PROBLEMS[number], self._wall.mesh
        exponents = {name: problem["law"][name] for name in ("fibre", "transverse", "shear")}
        section = Mechanics(
            material={"law": "fung", **exponents},
            active={
                "length_dependence": 0.0,
                "stress": "second_piola_kirchhoff",
                "sheet_share": 0.0,
                "normal_share": 0.0,
            },
            bulk_modulus_kPa=LAND_BULK_KPA,
            viscosity_Pa_s=0.0,
        )
        self._replace(
            Equilibrium(mesh, _land_frames(mesh, tetrahedron()[0]), wall_law(section), base_support(mesh, "fixed"))
        )
        stepper = LoadStepper(self._heart, problem["law"]["stiffness"])
        stepper.advance(Load(problem["pressure"], 1.0, 0.0, problem["tension"]), None)
        return land.apex(mesh.nodes, self._heart.positions(stepper.state) - mesh.nodes)


class _Timed:
    """A factorization whose calls are timed."""

    def __init__(self, solver: Any, clock: Clock) -> None:
        self._solver, self._clock = solver, clock

    def factor(self, upper: Any) -> None:
        spent = Clock()
        with spent("factor"):
            self._solver.factor(upper)
        self._clock.add(spent)

    def solve(self, right: Floats) -> Floats:
        spent = Clock()
        with spent("solve"):
            found = self._solver.solve(right)
        self._clock.add(spent)
        return found


def _elements(elements: list[int] | tuple[int, ...] | None) -> dict[str, int]:
    names = ("circumferential_elements", "longitudinal_elements", "transmural_elements")
    return dict(zip(names, elements, strict=True)) if elements else {}


def _frames(config: Config, heart: Wall, xi: Floats) -> Floats:
    return fibres.fibre_frames(heart.mesh, heart.depth, config.fibres, xi)


def _land_frames(mesh: Mesh, xi: Floats) -> Floats:
    return land.fibre_frames(np.einsum("qa,cai->cqi", shape(xi), mesh.nodes[mesh.cells]))


def _first(cycle: Cycle, frames: int | None) -> Cycle:
    """The first frames of a cycle."""
    return replace(cycle, **{name: getattr(cycle, name)[:frames] for name in ("time", "pressure", "volume")})


if __name__ == "__main__":
    ours = Ours()
    made = ("mesh", "mesh_land", "build", "hand_over")
    asked = ("constants", "base", "cycle", "displacement", "fill", "step", "solve_land")
    serve({name: getattr(ours, name) for name in made + asked})
