"""Mechanics against fenicsx-pulse, in one run and on one thread: `python benchmarks/mechanics.py --peer PYTHON`.

Both sides are processes that wait between their turns. Every figure is taken alternately, a turn of ours
and a turn of theirs, so that a machine whose speed drifts is the same for both; medians are reported.
"""

from __future__ import annotations

import argparse
import json
import platform
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path
from statistics import median
from typing import Any

import land
import numpy as np
import report
from worker import Worker, medians

HERE = Path(__file__).parent
OPTIMISED = ["-O3", "-march=native", "-g0"]

PULSE, PULSE_O3, PULSE_DEMO = "pulse", "pulse -O3", "pulse, degree 6"
COMPILED: dict[str, list[str] | None] = {PULSE: None, PULSE_O3: OPTIMISED, PULSE_DEMO: None}
"""Compiler flags of each peer; None leaves what is installed."""
DEGREE = {PULSE: 4, PULSE_O3: 4, PULSE_DEMO: 6}
"""Of the quadrature: 4 is pulse's default and has as many points as ours, 6 is that of its demos with fibres."""

FILLED = 1.5
"""Volume, over that at rest, at which the peer's Newton step is timed: about end-diastole."""

REPORTED_FRAME = 18
"""Frame at which the displacements are compared, just before end-systole."""

MESHES = [(12, 7, 2), (18, 9, 2), (24, 12, 2), (24, 12, 3), (30, 16, 3), (36, 20, 4), (48, 22, 4)]
"""Elements around, along and through the wall, from 5 000 to 100 000 unknowns."""

SEARCHES = {"secant": [PULSE_O3, PULSE], "brentq": [PULSE_O3]}
"""Method to the peers it is run with."""

Result = dict[str, Any]


@dataclass
class Bench:
    """What the parts of the benchmark share.

    Attributes
    ----------
    peer_python : str
        Interpreter that has fenicsx-pulse.
    repeats : int
        Turns of each side.
    frames : int
        Frames of the cycle that are solved.
    folder : Path
        For what is handed over.
    """

    peer_python: str
    repeats: int
    frames: int
    folder: Path

    def ours(self) -> Worker:
        """The process that runs echotruth."""
        return Worker(sys.executable, HERE / "ours.py")

    def peer(self, name: str) -> Worker:
        """A process that runs fenicsx-pulse; its compiled forms are kept in `.cache`."""
        cache = HERE / ".cache" / name.replace(" ", "").replace(",", "-")
        options = cache / "config" / "dolfinx" / "dolfinx_jit_options.json"
        options.parent.mkdir(parents=True, exist_ok=True)
        flags = COMPILED[name]
        options.write_text(json.dumps({"cffi_extra_compile_args": flags} if flags else {}))
        places = {"XDG_CONFIG_HOME": str(cache / "config"), "XDG_CACHE_HOME": str(cache)}
        return Worker(self.peer_python, HERE / "peer.py", places)

    def hand_over(self, ours: Worker, peer: Worker, name: str, **options: Any) -> str:
        """File with our mesh, and the fibres at the peer's quadrature points."""
        file = str(self.folder / f"{name.replace(' ', '')}.npz")
        ours("hand_over", file=file, points=peer("points", degree=DEGREE[name]), **options)
        return file


def steps(bench: Bench) -> Result:
    """Seconds of the parts of a Newton step."""
    with bench.ours() as ours, bench.peer(PULSE) as a, bench.peer(PULSE_O3) as b, bench.peer(PULSE_DEMO) as c:
        peers = {PULSE: a, PULSE_O3: b, PULSE_DEMO: c}
        answer = {"ours": ours("mesh") | ours("build")}
        stiffness = ours("cycle", frames=1)["stiffness"]
        ours("fill", stiffness=stiffness)
        for name, peer in peers.items():
            answer[name] = _filled(bench, ours, peer, name, stiffness)
        turns: dict[str, list[Result]] = {name: [] for name in ("ours", *peers)}
        for _ in range(bench.repeats):
            for name, side in (("ours", ours), *peers.items()):
                turns[name].append(side("step"))
    return {name: answer[name] | {"seconds": medians(taken)} for name, taken in turns.items()}


def _filled(bench: Bench, ours: Worker, peer: Worker, name: str, stiffness: float) -> Result:
    """Build a peer's heart on our present mesh and fill it to end-diastole, by volume; what `build` answers."""
    law = ours("constants") | {"stiffness": stiffness}
    file = bench.hand_over(ours, peer, name)
    built = peer("build", file=file, law=law, base=ours("base"), control="volume", degree=DEGREE[name])
    peer("go", tension=0.0, prescribed=FILLED * built["volume"])
    return {"unknowns": built["unknowns"]}


def cycles(bench: Bench, method: str) -> Result:
    """The loop with pressure and volume given and the active tension found, ours before and after each of theirs."""
    with bench.ours() as ours:
        ours("mesh")
        ours("build")
        stiffness = ours("cycle", frames=1)["stiffness"]
        turns, runs = [ours("cycle", frames=bench.frames, stiffness=stiffness)], []
        moved = _displacement(bench, ours, frame=min(REPORTED_FRAME, bench.frames - 1))
        for name in SEARCHES[method]:
            with bench.peer(name) as peer:
                run = _peer_cycle(bench, ours, peer, name, method, turns[0], moved)
            turns.append(ours("cycle", frames=bench.frames, stiffness=stiffness))
            between = {kind: (turns[-2][kind] + turns[-1][kind]) / 2 for kind in ("wall", "cpu")}
            runs.append(run | {"ratio": {kind: run[kind] / between[kind] for kind in between}})
            _tell(f"{name}, {method}: {run['cpu']:.0f} s, {run['newton_steps']} steps; ours {between['cpu']:.0f} s")
    spent = {kind: median(turn[kind] for turn in turns) for kind in ("wall", "cpu")}
    return {"frames": bench.frames, "ours": turns[0] | spent | {"turns": len(turns)}, "runs": runs}


def _displacement(bench: Bench, worker: Worker, **options: Any) -> np.ndarray:
    file = bench.folder / "displacement.npy"
    worker("displacement", file=str(file), **options)
    return np.load(file)


def _peer_cycle(
    bench: Bench, ours: Worker, peer: Worker, name: str, method: str, asked: Result, moved: np.ndarray
) -> Result:
    """One cycle of a peer, its differences from ours, and what it cost with the filling."""
    law = ours("constants") | {"stiffness": asked["stiffness"]}
    file = bench.hand_over(ours, peer, name)
    peer("build", file=file, law=law, base=ours("base"), control="volume", degree=DEGREE[name])
    frames = [peer("go", tension=0.0, prescribed=asked["volume"][0])]
    run: Result = {"peer": name, "method": method}
    for at, (pressure, volume) in enumerate(zip(asked["pressure"], asked["volume"], strict=True)):
        if at == 0:
            continue
        frames.append(peer("frame", pressure=pressure, volume=volume, method=method))
        if at == min(REPORTED_FRAME, bench.frames - 1):
            theirs = _displacement(bench, peer)
            run["displacement"] = float(np.sqrt(np.sum((theirs - moved) ** 2) / np.sum(moved**2)))
        if "failed" in frames[-1]:
            run["failed"] = {"frame": at, "why": frames[-1]["failed"]}
            break
    totals = {key: sum(frame.get(key, 0) for frame in frames) for key in ("wall", "cpu", "newton_steps", "solves")}
    return run | totals | _differences(frames, asked) | {"steps_of_frame": [frame["newton_steps"] for frame in frames]}


def _differences(frames: list[Result], asked: Result) -> Result:
    """Largest differences from our course: tension over its peak, pressure and volume relative."""
    solved = [(i, frame) for i, frame in enumerate(frames) if i and "failed" not in frame]
    if not solved:
        return {}
    peak = max(asked["tension"][i] for i, _ in solved)
    answer = {"tension": max(abs(frame["tension"] - asked["tension"][i]) for i, frame in solved) / peak}
    for name in ("pressure", "volume"):
        answer[name] = max(abs(frame[name] / asked[name][i] - 1) for i, frame in solved)
    return {"difference": answer}


def scaling(bench: Bench) -> Result:
    """Seconds of a Newton step against the size of the mesh."""
    rows = []
    with bench.ours() as ours, bench.peer(PULSE) as peer:
        for elements in MESHES:
            made = ours("mesh", elements=elements) | ours("build")
            ours("fill", stiffness=1100.0)
            theirs = _filled(bench, ours, peer, PULSE, 1100.0)
            turns: dict[str, list[Result]] = {"ours": [], PULSE: []}
            for _ in range(max(3, bench.repeats // 2)):
                turns["ours"].append(ours("step"))
                turns[PULSE].append(peer("step"))
            seconds = {name: medians(taken) for name, taken in turns.items()}
            rows.append({"elements": elements} | made | {"unknowns_pulse": theirs["unknowns"], "seconds": seconds})
            _tell(f"{made['unknowns']} unknowns: {seconds['ours']['step']['wall']:.2f} s")
    return {"rows": rows}


def land_problems(bench: Bench) -> Result:
    """Problems 2 and 3 of Land et al. 2015 on the same mesh."""
    answer = {}
    with bench.ours() as ours, bench.peer(PULSE_O3) as peer:
        made = ours("mesh_land")
        file = bench.hand_over(ours, peer, PULSE_O3, fibres_of_land=True)
        nodes = np.load(file)["nodes"]
        for number, problem in land.PROBLEMS.items():
            peer("build", file=file, law=problem["law"], base="fixed", control="pressure", degree=DEGREE[PULSE_O3])
            cost = peer("go", tension=problem["tension"], prescribed=problem["pressure"], increments=10)
            theirs = land.apex(nodes, _displacement(bench, peer)) | {"newton_steps": cost["newton_steps"]}
            answer[number] = {"pulse": theirs, "ours": ours("solve_land", number=number)}
            _tell(f"Land problem {number}: {answer[number]}")
    return {"cells": made["cells"], "problems": answer}


PARTS: dict[str, Callable[[Bench], Result]] = {
    "steps": steps,
    "secant": partial(cycles, method="secant"),
    "brentq": partial(cycles, method="brentq"),
    "scaling": scaling,
    "land": land_problems,
}


def machine() -> Result:
    """What the figures were taken on."""
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    model = next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.machine())
    packages = {name: version(name) for name in ("echotruth", "numba", "numpy", "pypardiso", "mkl")}
    return {"processor": model, "python": platform.python_version(), "threads": 1} | packages


def _tell(line: str) -> None:
    print(line, flush=True)


def main() -> None:
    """Run parts of the benchmark, and bring the report up to date."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--peer", required=True, help="Python interpreter that has fenicsx-pulse")
    parser.add_argument("--parts", nargs="+", choices=list(PARTS), default=list(PARTS))
    parser.add_argument("--repeats", type=int, default=7, help="turns of each side for a Newton step")
    parser.add_argument("--frames", type=int, default=40, help="frames of the cycle that are solved")
    parser.add_argument("--results", type=Path, default=HERE / "results")
    given = parser.parse_args()
    given.results.mkdir(parents=True, exist_ok=True)
    file = given.results / "mechanics.json"
    for part in given.parts:
        with tempfile.TemporaryDirectory() as folder:
            found = PARTS[part](Bench(given.peer, given.repeats, given.frames, Path(folder)))
        kept = json.loads(file.read_text()) if file.exists() else {}
        file.write_text(json.dumps(kept | {"machine": machine(), part: found}, indent=1) + "\n")
    report.write(json.loads(file.read_text()), given.results)


if __name__ == "__main__":
    main()
