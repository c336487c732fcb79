"""Rate of reading items of a training set, against that of reading their chunks alone.

    python benchmarks/loaders.py out/learning               # some seconds for each kind of item
    python benchmarks/loaders.py out/learning --size 128 --seconds 10

The chunks of an item are read by the same calls of Zarr, from arrays that are open, and thrown away: what is left is
what the sequences do beside it. Both are done in turns, in random order of the items, in one process; files are in the
memory of the operating system after a first round. The results stand in benchmarks/results/loaders.md.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from echotruth import learning
from echotruth.repository.reader import Repository

ROUNDS = 5
RESULT = Path(__file__).parent / "results/loaders.md"

KINDS: dict[str, Callable[..., learning.Items]] = {
    "FlowPairs": learning.FlowPairs,
    "Segmentation": learning.Segmentation,
    "Clips": learning.Clips,
    "Clips with displacement": partial(learning.Clips, truth=["displacement"]),
    "PointTracks": learning.PointTracks,
    "Strain": learning.Strain,
    "Diagnosis": learning.Diagnosis,
}


class Recorder(Repository):
    """A repository that notes what is read through it."""

    def __init__(self, repository: str | Path) -> None:
        super().__init__(repository)
        self.noted: list[tuple[str, tuple[Any, ...]]] = []

    def read(self, path: str, *index: Any, store: Path | None = None) -> np.ndarray:
        self.noted.append((path, index))
        return super().read(path, *index, store=store)


def reads_of(items: learning.Items, number: int) -> list[tuple[str, tuple[Any, ...]]]:
    """Arrays, and their parts, that are read for an item."""
    recorder = Recorder(items.repository.folder)
    usual, items.repository = items.repository, recorder
    try:
        _ = items[number]
    finally:
        items.repository = usual
    return recorder.noted


def rates(items: learning.Items, seconds: float) -> tuple[float, float]:
    """Items a second: whole, and their chunks alone; medians of `ROUNDS` turns."""
    order = np.random.default_rng(0).permutation(len(items))
    for number in order[:3]:
        _ = items[number]
    reads = {number: reads_of(items, number) for number in order}
    arrays = {path: items.repository.array(path) for each in reads.values() for path, _ in each}

    def raw(number: int) -> None:
        for path, index in reads[number]:
            _ = np.asarray(arrays[path][index])

    found: dict[str, list[float]] = {"items": [], "chunks": []}
    for _ in range(ROUNDS):
        found["items"].append(rate(items.__getitem__, order, seconds / ROUNDS))
        found["chunks"].append(rate(raw, order, seconds / ROUNDS))
    return float(np.median(found["items"])), float(np.median(found["chunks"]))


def rate(read: Callable[[int], object], order: np.ndarray, seconds: float) -> float:
    """Calls a second of processor time, of all threads of this process."""
    start, wall, count = time.process_time(), time.perf_counter(), 0
    while time.perf_counter() - wall < seconds:
        read(int(order[count % len(order)]))
        count += 1
    return count / (time.process_time() - start)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("repository", type=Path)
    parser.add_argument("--size", type=int, help="pixels along a side (default: the largest)")
    parser.add_argument("--seconds", type=float, default=5.0, help="for each kind of item, and as long for its chunks")
    arguments = parser.parse_args()
    lines = []
    for name, kind in KINDS.items():
        items = kind(arguments.repository, size=arguments.size)
        whole, chunks = rates(items, arguments.seconds)
        lines.append(f"| {name} | {len(items)} | {whole:.0f} | {chunks:.0f} | {100 * whole / chunks:.0f} % |")
        print(lines[-1], flush=True)
    text = (__doc__ or "").strip().partition("\n\n")
    head = f"# {text[0]}\n\nItems per second of processor time, of {items.size} px."
    columns = "| item | in the set | items/s | chunks alone, items/s | share |\n|---|---|---|---|---|"
    RESULT.write_text("\n".join([head, "", columns, *lines, ""]), encoding="utf-8")


if __name__ == "__main__":
    main()
