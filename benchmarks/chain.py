"""What every stage of a run has cost, beside what its parts cost on the same machine, measured one by one.

    python benchmarks/chain.py out/demo out/human

The first table of a repository is made of the files that Snakemake's `benchmark` wrote: processor seconds a case (of
mechanics, a heart) and a frame, seconds of the clock, greatest memory, and bytes written. The second has, for one view,
what the stage cost without the start of its processes, and what its parts cost in a short loop in this process, on one
thread:

phantom      seeding
truth        the truth of four frames, for all frames
rf           the full matrix of as many scatterers, evenly spread over the block that they fill, and beamforming; of one
             frame, for all frames
bmode        images from four frames of noise, for all frames
points       the truth at the points
tracking     every tracker on a few frames of ejection, there and back, for all frames; and one score, for all trackers
             and image sizes

To each is added what it takes to round, compress and write what the stage has stored of the view.

Above 1.3, and by more than a second, something is spent between the parts, or the job has compiled, or the machine had
other work. Its speed stands above: figures of machines compare only over it. The results are results/chain.md.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

import numba
import numpy as np
import report
from threadpoolctl import threadpool_limits

from echotruth.config import Config
from echotruth.evaluation.clip import Clip, read_clips
from echotruth.evaluation.points import ground_truth, read_truth
from echotruth.evaluation.scoring import score
from echotruth.imaging.beamforming.scan import scan_lines
from echotruth.imaging.beamforming.scanner import validate_scatterers
from echotruth.imaging.bmode import bmode_clip, pixel_centres, time_gain_compensation
from echotruth.imaging.sequence import Sequence
from echotruth.imaging.truth import pixel_truth
from echotruth.report.account import took
from echotruth.repository import estimates, group
from echotruth.repository.coordinates import coordinates_of
from echotruth.repository.places import OF_HEART, STAGES, groups_of
from echotruth.repository.reader import Repository
from echotruth.section import Section
from echotruth.seeds import generator
from echotruth.tracking.failure import TrackerFailed
from echotruth.tracking.tracker import track

RESULTS = Path(__file__).parent / "results"
EXCERPT = np.array([0, 1, 2, 1, 0])
"""Frames of ejection in the short loops of trackers, there and back: a closed cycle, which is tracked both ways."""
START = 1.0
"""CPU time that a job takes to start, s, as echotruth.workflow.cost has it."""
SOME = 4
"""Frames in the other loops over frames."""
TURNS = 3
"""How often a part is timed; the median counts."""
BEYOND = 1.3
"""Cost over that of its parts above which a stage is marked."""


def timed(work: Callable[[], Any]) -> float:
    """Median of the processor seconds of a call; the first, which compiles, is not counted."""
    work()
    spent = []
    for _ in range(TURNS):
        start = time.process_time()
        work()
        spent.append(time.process_time() - start)
    return median(spent)


def machine() -> dict[str, float]:
    """Seconds of a loop in plain Python and of a product of matrices, which measure the machine."""

    def loop() -> int:
        total = 0
        for number in range(10_000_000):
            total += number & 3
        return total

    matrix = np.random.default_rng(0).standard_normal((2048, 2048), dtype=np.float32)
    return {"loop": timed(loop), "product": timed(lambda: matrix @ matrix)}


def costs(folder: Path) -> list[list[Any]]:
    """Rows of the first table, one a stage."""
    repository = Repository(folder)
    frames, hearts, cases = repository.config.loop.frames, repository.cases["heart"].nunique(), len(repository.present)
    rows = []
    for stage in STAGES:
        if not (files := list(folder.glob(f"benchmarks/{stage}/**/*.tsv"))):
            continue
        table, number, views = took(files), cases, len(repository.views)
        if stage == "mechanics":
            number, views = hearts, 1
        spent = table["cpu_time"].sum() / number
        rows.append([
            stage,
            len(files),
            f"{spent:.1f}",
            f"{spent / frames / views:.3f}",
            f"{table['s'].sum() / number:.1f}",
            f"{table['max_rss'].max():.0f}",
            f"{_written(repository, stage) / number / 1e6:.1f}",
        ])  # fmt: skip
    return rows


def _written(repository: Repository, stage: str) -> int:
    """Bytes of what a stage has written."""
    of = {"mechanics": "hearts", "inference": "inference"}.get(stage, f"clips/*/*/{stage}")
    folder = repository.folder / f"{repository.config.name}.zarr"
    return sum(path.stat().st_size for path in folder.glob(f"{of}/**/*") if path.is_file())


class Parts:
    """The parts of the stages of one view, each by itself.

    Parameters
    ----------
    folder : Path
        Of a repository.
    case, view : str
    """

    def __init__(self, folder: Path, case: str, view: str) -> None:
        self._repository, self._place = Repository(folder), (case, view)
        self._heart, self._config = self._repository.heart(case), self._repository.case(case).config
        self._frames, self._plane = len(self._heart.displacement), self._repository.plane(case, view)
        random = partial(generator, self._repository.case(case), view)
        self._sequence = Sequence(self._config, self._heart, self._plane, random)

    def writing(self, stage: str) -> float:
        """What it takes to write what is stored of a stage, to another folder."""
        trackers = self._config.tracking.trackers if stage == "tracking" else [None]
        groups = [name for tracker in trackers for name in groups_of(stage, self._config.bmode.sizes, tracker)]
        arrays = {name: self._repository.arrays(name, *self._place) for name in groups}
        return sum(timed(partial(_write, name, values, self._config)) for name, values in arrays.items())

    def phantom(self) -> float:
        return timed(self._sequence.scatterers)

    def truth(self) -> float:
        some = replace(self._heart, displacement=self._heart.displacement[:SOME])
        grids = [pixel_centres(self._config.bmode, size) for size in self._config.bmode.sizes]
        spent = timed(lambda: [pixel_truth(some, self._plane, *grid) for grid in grids])
        return self._frames / len(some.displacement) * spent

    def rf(self) -> float:
        scanner = self._sequence.scanner
        position, amplitude, exponent = self._sequence.medium(self._sequence.scatterers())(0)
        even = np.random.default_rng(0).uniform(position.min(0), position.max(0), position.shape)
        scatterers = validate_scatterers(even, amplitude, exponent)
        matrix = scanner.matrix(*scatterers)
        return self._frames * (timed(lambda: scanner.matrix(*scatterers)) + timed(lambda: scanner.beamform(matrix)))

    def bmode(self) -> float:
        config, scanner = self._config, self._sequence.scanner
        shape = (SOME, len(scanner.angle), len(scanner.range))
        lines = np.random.default_rng(0).standard_normal((*shape, 2), np.float32).view(np.complex64)[..., 0]
        scan = scan_lines(config.probe, config.rf)
        gain = time_gain_compensation(config.probe, config.bmode, scanner.range)
        return self._frames / SOME * timed(lambda: bmode_clip(lines, scan, scanner.range, config.bmode, gain))

    def points(self) -> float:
        kind = self._config.views[self._place[1]].plane
        return timed(lambda: ground_truth(self._heart, self._plane, kind, self._config).arrays)

    def tracking(self) -> float:
        trackers = self._config.tracking.trackers
        excerpts = []
        for whole in read_clips(self._repository, *self._place).values():
            part = self._frames // 4 + EXCERPT
            excerpts.append(replace(whole, frames=whole.frames[part], frame_time=whole.frame_time[: len(part)]))
        spent = sum(timed(partial(_try, each, tracker)) for each in excerpts for tracker in trackers.values())
        return (self._frames - 1) / (len(EXCERPT) - 1) * spent + sum(map(self._scoring, trackers))

    def _scoring(self, tracker: str) -> float:
        sizes, true = self._config.bmode.sizes, read_truth(self._repository, *self._place)
        found = estimates.tracked(self._repository, *self._place, tracker, sizes[0], "displacement")["displacement"]
        a_score = timed(lambda: score(found, true))
        return timed(lambda: read_truth(self._repository, *self._place)) + len(sizes) * a_score


def _write(name: str, values: dict[str, Any], config: Config) -> None:
    """Write a group to a folder that goes."""
    with TemporaryDirectory() as folder:
        group.write(Path(folder) / "group", name, values, coordinates_of(name, config), config, {})


def _try(excerpt: Clip, tracker: Section) -> None:
    """Track, with whatever success."""
    with suppress(TrackerFailed):
        track(*excerpt.tracker_arguments, tracker)


def beside(folder: Path) -> list[list[Any]]:
    """Rows of the second table: the stages of the first view of the first heart."""
    repository = Repository(folder)
    case, view = repository.shown[0], repository.views[0]
    parts, rows = Parts(folder, case, view), []
    for stage in (stage for stage in STAGES if stage not in OF_HEART):
        at = folder / "benchmarks" / stage / case
        files = [*at.glob(f"{view}.tsv"), *at.glob(f"{view}/*.tsv")]
        spent = took(files)["cpu_time"].sum() - START * len(files)
        predicted = getattr(parts, stage)() + parts.writing(stage)
        mark = " **" if spent > max(BEYOND * predicted, predicted + 1) else ""
        rows.append([stage, f"{spent:.1f}", f"{predicted:.1f}", f"{spent / predicted:.2f}{mark}"])
    return rows


def section(folder: Path) -> list[str]:
    """Markdown of one repository."""
    head = ["stage", "jobs", "CPU s a case", "CPU s a frame", "wall s", "memory, MB", "MB"]
    parts = report.table(["stage, one view", "CPU s", "CPU s of its parts", "ratio"], beside(folder))
    return [f"## {folder.name}", "", *report.table(head, costs(folder)), "", *parts, ""]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("repositories", type=Path, nargs="+", help="folders of repositories, as out/demo")
    parser.add_argument("--results", type=Path, default=RESULTS, help="folder of chain.md")
    arguments = parser.parse_args()
    numba.set_num_threads(1)
    with threadpool_limits(1):
        speed = machine()
        sections = [line for folder in arguments.repositories for line in section(folder)]
    told = f"A loop of ten million turns in plain Python takes this machine {speed['loop']:.2f} s, a product of two "
    told += f"matrices of 2048 x 2048 in single precision {speed['product']:.2f} s, on one thread."
    remark = f"Wall seconds are added up over the jobs of a case. **: beyond {BEYOND}."
    text = ["# The chain, stage by stage", "", told, "", remark, "", *sections]
    arguments.results.mkdir(parents=True, exist_ok=True)
    (arguments.results / "chain.md").write_text("\n".join(text))
    print("\n".join(text))


if __name__ == "__main__":
    main()
