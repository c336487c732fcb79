"""RF against PyMUST, eSDIva, zea and FastSIMUS, in one run: `python benchmarks/acoustics.py --peers PYTHON`.

Where two are compared they take turns in one process on one thread, and medians of CPU time are reported.
"""

from __future__ import annotations

import argparse
import json
import platform
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

import acoustics_report as report
from worker import Worker

HERE = Path(__file__).parent
Result = dict[str, Any]

MOUSE, HUMAN = "mouse, 25 MHz", "human, 2.72 MHz"

SPEED = {
    "ours, few scatterers": 1000,
    "ours": 20000,
    "ours, elevation": 20000,
    "PyMUST": 1000,
    "PyMUST, elevation": 200,
    "PyMUST as it comes": 2000,
    "PyMUST as it comes, elevation": 300,
    "eSDIva": 2000,
    "eSDIva, elevation": 1000,
    "eSDIva, matrix": 200,
    "zea": 200,
    "zea in time": 1000,
    "FastSIMUS": 1000,
    "FastSIMUS as it comes": 2000,
}
"""Party to the scatterers of a turn."""
THICK = ("ours, elevation", "PyMUST, elevation", "PyMUST as it comes, elevation", "eSDIva, elevation")
"""Those whose scatterers fill a slab; those of the others lie in the plane of the image."""

IN_PLANE = ("ours",)

TRANSMITS = (1, 8, 128)
FRAME = 10000
"""Scatterers of a frame for which transmits are counted."""

GROWTH = {
    "ours": (1000, 10000, 100000, 1000000),
    "ours, elevation": (1000, 10000, 100000, 1000000),
    "PyMUST": (100, 1000, 10000),
    "PyMUST as it comes": (100, 1000, 10000),
    "PyMUST, elevation": (100, 1000),
    "eSDIva": (100, 1000, 10000),
    "eSDIva, matrix": (100, 1000),
}
"""Party to numbers of scatterers, as far as it gets in half a minute."""
ELEMENTS = (16, 32, 64, 128)
OF_ELEMENTS = {"ours": 20000, "PyMUST": 1000, "eSDIva": 1000, "eSDIva, matrix": 100}
"""Party to the scatterers with which the number of elements is varied."""

SCANS: dict[str, tuple[int, dict[str, Any]]] = {
    "1 diverging wave": (1, {"transmit": "diverging", "transmits": 1}),
    "5": (5, {"transmit": "diverging", "transmits": 5}),
    "11": (11, {"transmit": "diverging", "transmits": 11}),
    "31": (31, {"transmit": "diverging", "transmits": 31}),
    "192 focused lines": (192, {"transmit": "focused", "lines": 192}),
}
"""Scans of a frame: how many transmits, and how ours are made."""
OURS = {"ours": {"elevation_beam": False}, "ours, elevation": {}}
PEERS = tuple(party for party in SPEED if not party.startswith("ours") and party != "eSDIva, matrix")
LENGTHS = (32, 64, 128, 256)
"""Elements of the arrays of which whole frames are made."""

FEW = 3
"""Turns of which growth is the median."""

LINES, IMAGED = 128, 100000
"""Lines and scatterers of the frame that is imaged."""


@dataclass
class Bench:
    """What the parts of the benchmark share.

    Attributes
    ----------
    python : str
        Interpreter that has echotruth and its peers.
    repeats : int
        Turns of each party.
    """

    python: str
    repeats: int

    def side(self, threads: int = 1) -> Worker:
        """A process that has all parties."""
        return Worker(self.python, HERE / "acoustics_side.py", {"NUMBA_NUM_THREADS": str(threads)})


def speed(bench: Bench) -> Result:
    """Seconds of a turn of every party before both arrays, and the errors."""
    answer = {}
    with bench.side() as side:
        for array in (MOUSE, HUMAN):
            spent: dict[str, list[Result]] = {party: [] for party in SPEED}
            for _ in range(bench.repeats):
                for party, scatterers in SPEED.items():
                    given = {"array": array, "scatterers": scatterers, "thick": party in THICK}
                    spent[party].append(side("turn", party=party, **given))
            rows = {party: _medians(taken) | {"scatterers": SPEED[party]} for party, taken in spent.items()}
            answer[array] = {"turns": rows, "errors": side("errors", array=array)}
            _tell(f"{array}: " + ", ".join(f"{n} {1e6 * r['cpu'] / r['scatterers']:.2f} us" for n, r in rows.items()))
    return answer


def _often(side: Worker, **given: Any) -> Result:
    """Median of a few turns of one party."""
    return _medians([side("turn", **given) for _ in range(FEW)])


def _medians(turns: list[Result]) -> Result:
    return {kind: median(turn[kind] for turn in turns) for kind in ("wall", "cpu")}


def transmits(bench: Bench) -> Result:
    """Seconds of a frame of several transmits: ours from one matrix, the peers' one by one."""
    answer: Result = {"scatterers": FRAME}
    with bench.side() as side:
        for array in (MOUSE, HUMAN):
            given = {"array": array, "scatterers": FRAME}
            ours = {
                str(number): side("transmits", number=number, repeats=bench.repeats, **given) for number in TRANSMITS
            }
            peers = {name: _often(side, party=name, **given) for name in ("PyMUST", "eSDIva")}
            answer[array] = {"ours": ours, "peers": peers}
            _tell(f"{array}: {answer[array]}")
    return answer


def growth(bench: Bench) -> Result:
    """Seconds against scatterers, and against elements, before the mouse's array."""
    answer: Result = {"scatterers": {}, "elements": {}}
    with bench.side() as side:
        for party, numbers in GROWTH.items():
            turns = [
                _often(side, party=party, array=MOUSE, scatterers=number, thick=party in THICK) for number in numbers
            ]
            answer["scatterers"][party] = [[n, turn["cpu"]] for n, turn in zip(numbers, turns, strict=True)]
            _tell(f"{party}: {answer['scatterers'][party]}")
        for party, number in OF_ELEMENTS.items():
            given = {"party": party, "array": MOUSE, "scatterers": number}
            turns = [_often(side, elements=elements, **given) for elements in ELEMENTS]
            answer["elements"][party] = [[e, t["cpu"] / number] for e, t in zip(ELEMENTS, turns, strict=True)]
    return answer


def memory(bench: Bench) -> Result:
    """Greatest resident memory of a process of its own for each turn, MiB, and before the turn."""
    rows = []
    for party, numbers in GROWTH.items():
        for number in numbers[1:]:
            with bench.side() as side:
                idle = side("peak")
                side("turn", party=party, array=MOUSE, scatterers=number, thick=party in THICK)
                rows.append({"party": party, "scatterers": number, "idle": idle, "peak": side("peak")})
            _tell(f"{party}, {number}: {rows[-1]['peak']:.0f} MiB")
    return {"rows": rows}


def frame(bench: Bench) -> Result:
    """Seconds of the parts of a frame of focused lines, from scatterers to uint8, on one and two threads."""
    rows = []
    for threads in (1, 2):
        with bench.side(threads) as side:
            for array in (MOUSE, HUMAN):
                given = {"array": array, "scatterers": IMAGED, "lines": LINES}
                rows.append(given | side("frame", repeats=bench.repeats, **given))
    return {"rows": rows}


def scans(bench: Bench) -> Result:
    """Seconds of a B-mode frame by the scan: ours from scatterers to uint8, the peers' RF alone."""
    answer: Result = {"scatterers": IMAGED, "transmits": {name: number for name, (number, _) in SCANS.items()}}
    with bench.side() as side:
        for array in (MOUSE, HUMAN):
            ours: dict[tuple[str, str], list[float]] = {}
            peers: dict[str, list[float]] = {}
            for _ in range(FEW):
                for party, options in OURS.items():
                    for name, (_, scan) in SCANS.items():
                        row = side("frame", array=array, scatterers=IMAGED, repeats=1, **options, **scan)
                        ours.setdefault((party, name), []).append(_whole(row["seconds"]))
                for party in PEERS:
                    given = {"array": array, "scatterers": SPEED[party], "thick": party in THICK}
                    spent = side("turn", party=party, **given)["cpu"]
                    peers.setdefault(party, []).append(spent / SPEED[party] * IMAGED)
            rows = {party: {name: median(ours[party, name]) for name in SCANS} for party in OURS}
            for party in PEERS:
                rows[party] = {name: number * median(peers[party]) for name, (number, _) in SCANS.items()}
            answer[array] = rows
            _tell(f"{array}: {answer[array]}")
    return answer


def _whole(spent: Result) -> float:
    return sum(spent[part]["cpu"] for part in ("matrix", "channels and receive focus", "image"))


def arrays(bench: Bench) -> Result:
    """CPU seconds of matrix and beamforming, and greatest memory, by the elements of the mouse's array."""
    rows = []
    for elements in LENGTHS:
        given = {"array": MOUSE, "scatterers": FRAME, "lines": LINES, "probe": {"elements": elements}}
        with bench.side() as side:
            idle, _ = side("peak"), side("lines", **given)
            peak, found = side("peak"), side("frame", repeats=1, **given)["seconds"]
            seconds = [found[part]["cpu"] for part in ("matrix", "channels and receive focus")]
            rows.append([elements, *seconds, idle, peak])
        _tell(f"{rows[-1]}")
    return {"scatterers": FRAME, "lines": LINES, "rows": rows}


def floor(bench: Bench) -> Result:
    """What the machine allows, beside what a pair takes."""
    with bench.side() as side:
        rates = side("floor")
        pairs = {party: side("pair", party=party, array=MOUSE) for party in IN_PLANE}
    return {"rates": rates, "pairs": pairs}


def agreement(bench: Bench) -> Result:
    """Likeness to the peers, setting by setting."""
    with bench.side() as side:
        return {array: side("agreement", array=array) for array in (MOUSE, HUMAN)}


def exactness(bench: Bench) -> Result:
    """Relative L2 error against the exact sum."""
    with bench.side() as side:
        return {array: side("exactness", array=array) for array in (MOUSE, HUMAN)}


PARTS: dict[str, Callable[[Bench], Result]] = {
    part.__name__: part
    for part in (scans, speed, transmits, frame, arrays, growth, memory, floor, agreement, exactness)
}


def machine(bench: Bench) -> Result:
    """What the figures were taken on."""
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    model = next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.machine())
    with bench.side() as side:
        return {"processor": model, "python": platform.python_version()} | side("versions")


def _tell(line: str) -> None:
    print(line, flush=True)


def main() -> None:
    """Run parts of the benchmark, and bring the report up to date."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--peers", default=sys.executable, help="Python interpreter that has the peers")
    parser.add_argument("--parts", nargs="+", choices=list(PARTS), default=list(PARTS))
    parser.add_argument("--repeats", type=int, default=5, help="turns of each party")
    parser.add_argument("--results", type=Path, default=HERE / "results")
    given = parser.parse_args()
    given.results.mkdir(parents=True, exist_ok=True)
    file, bench = given.results / "acoustics.json", Bench(given.peers, given.repeats)
    for part in given.parts:
        _tell(f"-- {part}")
        found = PARTS[part](bench)
        kept = json.loads(file.read_text()) if file.exists() else {}
        file.write_text(json.dumps(kept | {"machine": machine(bench), part: found}, indent=1) + "\n")
    report.write(json.loads(file.read_text()), given.results)


if __name__ == "__main__":
    main()
