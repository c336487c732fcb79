"""What every stage of a run has cost, beside what its parts cost on the same machine, measured one by one.

    python benchmarks/chain.py out/demo out/human

The first table of a repository is made of the records in its ledger: processor seconds a heart and a frame, how many of
them compiling and starting, seconds of the clock, greatest memory, and bytes written. The second has, for one view,
what the stage cost without compiling and starting, and what its parts cost in a short loop in this process, on one
thread:

phantom      seeding
truth        the truth of four frames, for all frames
rf           the full matrix of as many scatterers, evenly spread over the block that they fill, and beamforming; of one
             frame, for all frames
bmode        images from four frames of noise, for all frames
tracking     every tracker on a few frames of ejection, there and back, for all frames
evaluation   the truth at the points, and one score, for all trackers and image sizes

To each is added what it takes to round, compress and write what the stage has stored of the view.

Above 1.3, and by more than a second, something is spent between the parts. The machine's own speed stands above:
figures of machines compare only over it. The results are results/chain.md.
"""

from __future__ import annotations

import argparse
import shutil
import time
from collections import defaultdict
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

from echotruth.config.loading import load
from echotruth.evaluation.clip import Clip, read_clips
from echotruth.evaluation.scoring import read_truth, score
from echotruth.imaging.beamforming.scan import scan_lines
from echotruth.imaging.beamforming.scanner import validate_scatterers
from echotruth.imaging.bmode import bmode_clip, pixel_centres, time_gain_compensation
from echotruth.imaging.sequence import Sequence
from echotruth.imaging.truth import pixel_truth
from echotruth.imaging.view import Plane
from echotruth.repository import estimates, ledger, schema
from echotruth.repository.ledger import GATES, VIEW_STAGES
from echotruth.repository.reader import Repository
from echotruth.repository.store import Store
from echotruth.section import Section
from echotruth.seeds import generator
from echotruth.tracking.failure import TrackerFailed
from echotruth.tracking.tracker import track
from echotruth.workflow.job import Job

RESULTS = Path(__file__).parent / "results"
EXCERPT = np.array([0, 1, 2, 1, 0])
"""Frames of ejection in the short loops of trackers, there and back: a closed cycle, which is tracked both ways."""
SOME = 4
"""Frames in the other loops over frames."""
TURNS = 3
"""How often a part is timed; the median counts."""
BEYOND = 1.3
"""Cost over that of its parts above which a stage is marked."""

Record = dict[str, Any]


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


def records(folder: Path) -> list[Record]:
    """Records of all jobs that were timed, of a repository."""
    found = [ledger.read(path) for stage in (*GATES, *VIEW_STAGES) for path in folder.glob(f"ledger/{stage}/**/*.json")]
    return [record for record in found if "cpu_seconds" in record]


def costs(folder: Path, found: list[Record]) -> list[list[Any]]:
    """Rows of the first table, one a stage."""
    stages: dict[str, list[Record]] = defaultdict(list)
    for record in found:
        stages[record["stage"]].append(record)
    store = folder / f"{load(folder / 'config.yaml').name}.zarr"
    return [_cost(stage, members, store) for stage, members in stages.items()]


def _cost(stage: str, members: list[Record], store: Path) -> list[Any]:
    def total(name: str) -> float:
        return sum(record[name] for record in members)

    hearts = len({record["case"] for record in members})
    written = sum((store / name).stat().st_size for record in members for name in record["sha256"])
    frames = total("frames") if stage in VIEW_STAGES else hearts * members[0]["frames"]
    return [
        stage,
        len(members),
        f"{total('cpu_seconds') / hearts:.1f}",
        f"{total('cpu_seconds') / frames:.3f}",
        f"{total('compile_seconds') / hearts:.1f}",
        f"{total('start_seconds') / hearts:.1f}",
        f"{total('seconds') / hearts:.1f}",
        f"{max(record['memory_MB'] for record in members):.0f}",
        f"{written / hearts / 1e6:.1f}",
    ]


class Parts:
    """The parts of the stages of one view, each by itself.

    Parameters
    ----------
    folder : Path
        Of a repository.
    case, view : str
    """

    def __init__(self, folder: Path, case: str, view: str) -> None:
        self._job = partial(Job, folder, case=case, view=view)
        self._repository, self._place = Repository(folder), (case, view)
        self._heart, self._config = self._job(stage="truth").heart, self._job(stage="truth").case.config
        self._frames = len(self._heart.displacement)
        place = self._job(stage="truth").read("phantom", "origin", "axes")
        self._plane, random = Plane(**place), partial(generator, self._job(stage="rf").case, view)
        self._sequence = Sequence(self._config, self._heart, self._plane, random)

    def writing(self, stage: str) -> float:
        """What it takes to write what is stored of a stage, to another folder."""
        job = self._job(stage=stage)
        groups = [group for group in schema.groups(self._config) if group.partition("/")[0] == stage]
        with TemporaryDirectory() as folder:
            other, spent = Store(Path(folder)), 0.0
            for group in groups:
                for file in job.store.path.glob(f"{group}/**/zarr.json"):
                    copy = other.path / file.relative_to(job.store.path)
                    copy.parent.mkdir(parents=True, exist_ok=True)
                    shutil.copyfile(file, copy)
                values = job.store.read(group, *job.index)
                spent += timed(partial(other.write, group, values, *job.index))
        return spent

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

    def tracking(self) -> float:
        trackers = self._config.tracking.trackers.values()
        excerpts = []
        for whole in read_clips(self._repository, *self._place).values():
            part = self._frames // 4 + EXCERPT
            excerpts.append(replace(whole, frames=whole.frames[part], frame_time=whole.frame_time[: len(part)]))
        spent = sum(timed(partial(_try, each, tracker)) for each in excerpts for tracker in trackers)
        return (self._frames - 1) / (len(EXCERPT) - 1) * spent

    def evaluation(self) -> float:
        tracker, true = list(self._config.tracking.trackers)[-1], read_truth(self._repository, *self._place)
        sizes = self._config.bmode.sizes
        found = estimates.tracked(self._repository, *self._place, tracker, sizes[0], "displacement")["displacement"]
        times = len(sizes) * len(self._config.tracking.trackers)
        return timed(lambda: read_truth(self._repository, *self._place)) + times * timed(lambda: score(found, true))


def _try(excerpt: Clip, tracker: Section) -> None:
    """Track, with whatever success."""
    with suppress(TrackerFailed):
        track(*excerpt.tracker_arguments, tracker)


def beside(folder: Path, found: list[Record]) -> list[list[Any]]:
    """Rows of the second table: the stages of the first view that has them all."""
    by_view: dict[tuple[str, str], dict[str, Record]] = defaultdict(dict)
    for record in found:
        by_view[record["case"], record["view"]][record["stage"]] = record
    views = [(place, stages) for place, stages in by_view.items() if set(stages) >= set(VIEW_STAGES)]
    if not views:
        return []
    (case, view), stages = views[0]
    parts, rows = Parts(folder, case, view), []
    for stage in VIEW_STAGES:
        record = stages[stage]
        spent = record["cpu_seconds"] - record["compile_seconds"] - record["start_seconds"]
        predicted = getattr(parts, stage)() + parts.writing(stage)
        mark = " **" if spent > max(BEYOND * predicted, predicted + 1) else ""
        rows.append([stage, f"{spent:.1f}", f"{predicted:.1f}", f"{spent / predicted:.2f}{mark}"])
    return rows


def starting(folder: Path, found: list[Record]) -> str:
    """What it takes to start the processes, for each image and of all, in a sentence."""
    sizes = len(load(folder / "config.yaml").bmode.sizes)
    images = sizes * sum(record["frames"] for record in found if record["stage"] == "bmode")
    seconds, total = (sum(record[key] for record in found) for key in ("start_seconds", "cpu_seconds"))
    return f"Starting takes {1e3 * seconds / images:.1f} ms of CPU an image, {seconds / total:.1%} of all CPU seconds."


def section(folder: Path) -> list[str]:
    """Markdown of one repository."""
    found = records(folder)
    head = ["stage", "jobs", "CPU s a heart", "CPU s a frame", "compiling", "starting", "wall s", "memory, MB", "MB"]
    text = [f"## {folder.name}", "", *report.table(head, costs(folder, found)), "", starting(folder, found), ""]
    if rows := beside(folder, found):
        text += [*report.table(["stage, one view", "CPU s", "CPU s of its parts", "ratio"], rows), ""]
    return text


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
    remark = (
        f"Compiling and starting are CPU seconds a heart; wall seconds are added up over views. **: beyond {BEYOND}."
    )
    text = ["# The chain, stage by stage", "", told, "", remark, "", *sections]
    (arguments.results / "chain.md").write_text("\n".join(text))
    print("\n".join(text))


if __name__ == "__main__":
    main()
