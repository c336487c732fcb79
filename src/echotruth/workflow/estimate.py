"""What a run will take, before anything runs: CPU time by stage, time on some cores, bytes, files, jobs, memory."""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil
from pathlib import Path

from echotruth.cases import Case
from echotruth.config import Config
from echotruth.repository import schema
from echotruth.repository.ledger import GATES, VIEW_STAGES
from echotruth.workflow import expected_cost
from echotruth.workflow.compiled import cache_folder
from echotruth.workflow.machine_speed import Speed
from echotruth.workflow.progress import COMPILATION
from echotruth.workflow.requests import existing_records

MAX_SAMPLED = 100
"""Largest number of hearts whose cost is worked out; in a larger sweep it is that of as many, evenly spaced."""
MAX_SIMULATED = 5000
"""Largest number of jobs whose order on the cores is simulated."""
THREADS_GAIN = 0.5
"""What each further thread adds to the speed of the mechanics of a single heart; three add nothing more."""
STRUCTURE_FILES, STRUCTURE_BYTES = 300, 0.6e6
"""Files and bytes of what belongs to no heart: metadata, coordinates, table of cases."""
REPORT_JOBS = 4
"""Jobs of the last part: publication, figures of motion and of images, page."""
REPORT_FILES, REPORT_BYTES = 20, 20e6
"""Files and bytes of figures and report."""
SCRIPTS = Path(__file__).parent / "scripts"
CACHES = Path(".snakemake/numba")
"""Folder of the caches of compiled functions, below the working folder."""
IMAGE_STAGES = ("phantom", "truth", "rf", "bmode")
TRACKING_STAGES = ("tracking", "evaluation")


@dataclass(frozen=True)
class Part:
    """Work of one kind.

    Attributes
    ----------
    jobs : int
    seconds : float
        CPU time of all its jobs.
    seconds_left : float
        CPU time of those that have no record yet.
    """

    jobs: int
    seconds: float
    seconds_left: float


@dataclass(frozen=True)
class Estimate:
    """What a run will take.

    Attributes
    ----------
    hearts, views, sampled : int
        Hearts, views of each, and hearts whose cost was worked out.
    parts : dict
        Work by its name, in the order in which it is done.
    cores : int
    wall_seconds : float
        Time of all of it on that many cores that have nothing else to do.
    wall_seconds_left : float
        Time of what has no record yet.
    bytes, scratch_bytes : float
        Size of the repository, and of what it needs besides while it is made.
    files : int
    megabytes : dict
        Rule -> peak memory of one of its jobs.
    expected : dict
        Rule -> expected duration of one of its jobs, s.
    speed : Speed
        What the constants were multiplied by.
    """

    hearts: int
    views: int
    sampled: int
    parts: dict[str, Part]
    cores: int
    wall_seconds: float
    wall_seconds_left: float
    bytes: float
    scratch_bytes: float
    files: int
    megabytes: dict[str, float]
    expected: dict[str, float]
    speed: Speed

    @property
    def jobs(self) -> int:
        """Number of jobs."""
        return sum(part.jobs for part in self.parts.values())

    @property
    def seconds(self) -> float:
        """CPU time, s."""
        return sum(part.seconds for part in self.parts.values())

    @property
    def seconds_left(self) -> float:
        """CPU time of what has no record yet, s."""
        return sum(part.seconds_left for part in self.parts.values())


def estimate(config: Config, cases: Sequence[Case], cores: int, speed: Speed, folder: Path) -> Estimate:
    """Estimate a run.

    Parameters
    ----------
    config : Config
    cases : sequence of Case
        Its hearts.
    cores : int
        Cores on which jobs run at the same time.
    speed : Speed
    folder : Path
        Folder of the repository, `out/NAME`; it need not exist.
    """
    sample = cases[:: ceil(len(cases) / MAX_SAMPLED)]
    solved, views = _number_solved(cases), len(config.views)
    costs = [_heart_seconds(case.config, speed) for case in sample]
    mean = {stage: sum(cost[stage] for cost in costs) / len(costs) for stage in expected_cost.STAGES}
    clips = len(cases) * views
    left = _shares_left(folder, cases, list(config.views))
    compile_ = _compilation(speed)
    start, taken = expected_cost.START_SECONDS * speed.of(""), len(cases) - solved
    mechanics = solved * (mean["mechanics"] + mean["physiology"] + start) + taken * start
    images = clips * (sum(mean[stage] for stage in IMAGE_STAGES) + start)
    tracked = clips * sum(mean[stage] for stage in TRACKING_STAGES)
    report = (expected_cost.REPORT_SECONDS + expected_cost.VERIFY_SECONDS) * speed.of("")
    report += expected_cost.VERIFY_VIEW_SECONDS * clips * speed.of("")
    jobs = 2 * len(cases) + 2 * clips + REPORT_JOBS + len(compile_)
    overhead = expected_cost.RUN_SECONDS + expected_cost.JOB_SECONDS * jobs
    is_made = max(left.values()) == 0 and (folder / "ledger/repository.json").is_file()
    parts = {
        "mechanics": Part(2 * len(cases), mechanics, mechanics * left["physiology"]),
        "images": Part(clips, images, images * left["bmode"]),
        "tracking": Part(clips, tracked, tracked * left["evaluation"]),
        "report": Part(REPORT_JOBS, report, 0.0 if is_made else report),
        "compilation": Part(len(compile_), sum(compile_.values()), 0.0 if is_made else sum(compile_.values())),
        "snakemake": Part(0, overhead, expected_cost.RUN_SECONDS if is_made else overhead * max(left.values())),
    }
    expected = _durations(parts, len(cases), clips, cores, compile_)
    wall = _wall_seconds(parts, expected, len(cases), views, cores)
    total = sum(part.seconds for part in parts.values())
    scratch = cores * max(_scratch_bytes(case.config, view) for case in sample[:10] for view in config.views)
    return Estimate(
        hearts=len(cases),
        views=views,
        sampled=len(sample),
        parts=parts,
        cores=cores,
        wall_seconds=wall,
        wall_seconds_left=wall * sum(part.seconds_left for part in parts.values()) / total,
        bytes=STRUCTURE_BYTES + REPORT_BYTES + len(cases) * sum(_bytes(case.config) for case in sample) / len(sample),
        scratch_bytes=scratch,
        files=number_of_files(config, len(cases)),
        megabytes=_megabytes(sample),
        expected=expected,
        speed=speed,
    )


def number_of_files(config: Config, hearts: int) -> int:
    """Files of a finished repository, without those of a run: one for each array of a job, records, logs, metadata."""
    views = len(config.views)
    arrays = [array for group, of in schema.groups(config).items() if group != "cases" for array in of]
    of_heart, of_view = (sum(array.leading == number for array in arrays) for number in (1, 2))
    records = len(GATES) + len(VIEW_STAGES) * views
    logs, checkpoints = 2 + 2 * views, 1 + views
    return STRUCTURE_FILES + REPORT_FILES + hearts * (of_heart + views * of_view + records + logs + checkpoints)


def _heart_seconds(config: Config, speed: Speed) -> dict[str, float]:
    """CPU time of each stage of a heart, of a stage of views the mean over them, s."""
    views = [expected_cost.view_seconds(config, view) for view in config.views]
    seconds = {stage: sum(view[stage] for view in views) / len(views) for stage in VIEW_STAGES}
    seconds |= {"mechanics": expected_cost.mechanics_seconds(config), "physiology": expected_cost.PHYSIOLOGY_SECONDS}
    return {stage: value * speed.of(stage) for stage, value in seconds.items()}


def _number_solved(cases: Sequence[Case]) -> int:
    """Hearts whose motion is solved; the others have the motion of one of them, and take over its files."""
    texts: dict[int, str] = {}
    motions = set()
    for case in cases:
        config = case.config
        sections = (config.geometry, config.fibres, config.pathology, config.loop, config.mechanics, config.motion)
        for section in sections:
            if id(section) not in texts:
                texts[id(section)] = section.model_dump_json()
        seed = config.seed if config.fibres.disarray_deg else None
        motions.add((*(texts[id(section)] for section in sections), seed))
    return len(motions)


def _shares_left(folder: Path, cases: Sequence[Case], views: list[str]) -> dict[str, float]:
    """Stage -> share of its jobs without a record."""
    ids = [case.id for case in cases]
    wanted = {stage: set(ids) for stage in GATES}
    wanted |= {stage: {f"{case}/{view}" for case in ids for view in views} for stage in ("bmode", "evaluation")}
    return {
        stage: 1 - len(names & existing_records(folder / "ledger" / stage)) / len(names)
        for stage, names in wanted.items()
    }


def _compilation(speed: Speed) -> dict[str, float]:
    """Group -> CPU time of compilation, s, of those whose functions are not compiled yet."""
    return {
        group: seconds * speed.of("")
        for group, seconds in expected_cost.COMPILE_SECONDS.items()
        if not (CACHES / cache_folder(group, SCRIPTS)).is_dir()
    }


def _durations(
    parts: dict[str, Part], hearts: int, clips: int, cores: int, compiled: dict[str, float]
) -> dict[str, float]:
    """Rule -> duration of one of its jobs, s."""
    threads = max(1, cores // hearts)
    gain = 1 + THREADS_GAIN * min(threads - 1, 3)
    report = parts["report"].seconds
    durations = {
        "mechanics": parts["mechanics"].seconds / hearts / gain,
        "physiology": 0.5,
        "imaging": parts["images"].seconds / clips,
        "tracking": parts["tracking"].seconds / clips,
        COMPILATION: compiled.get("mechanics", 0.0),
        "compile": compiled.get("view", expected_cost.MINIATURE_SECONDS),
        "repository": report * 0.2,
        "report": report * 0.3,
        "report_images": report * 0.3,
        "report_page": report * 0.2,
    }
    return durations


def _wall_seconds(parts: dict[str, Part], expected: dict[str, float], hearts: int, views: int, cores: int) -> float:
    """Time of a run on some cores, s: a heart, then its views; publication and report come last."""
    clip = expected["imaging"] + expected["tracking"]
    first, last = (
        parts["snakemake"].seconds,
        expected["repository"] + max(expected["report"], expected["report_images"]) + expected["report_page"],
    )
    compile_ = expected[COMPILATION] + expected["compile"]
    if hearts * (1 + views) > MAX_SIMULATED:
        return first + last + (compile_ + hearts * (expected["mechanics"] + views * clip)) / cores
    free = [0.0] * cores
    heapq.heapify(free)
    heapq.heappush(free, heapq.heappop(free) + expected["compile"])
    ready = []
    for heart in range(hearts):
        end = heapq.heappop(free) + expected["mechanics"] + (expected[COMPILATION] if heart == 0 else 0.0)
        heapq.heappush(free, end)
        ready += [end] * views
    for begin in ready:
        heapq.heappush(free, max(heapq.heappop(free), begin) + clip)
    return first + max(free) + last


def _bytes(config: Config) -> float:
    return expected_cost.heart_bytes(config) + sum(expected_cost.view_bytes(config, view) for view in config.views)


def _scratch_bytes(config: Config, view: str) -> float:
    """Bytes of what the stages of a view pass to each other: scatterers and lines."""
    kept = config.rf.model_copy(update={"keep": ["lines"]})
    lines = expected_cost.rf_bytes(config.model_copy(update={"rf": kept}))
    return lines + 40 * expected_cost.content(config, view).scatterers


def _megabytes(sample: Sequence[Case]) -> dict[str, float]:
    """Rule -> peak memory of its largest job among some hearts."""
    configs = [case.config for case in sample]
    return {
        "mechanics": max(map(expected_cost.mechanics_megabytes, configs)),
        "imaging": max(map(expected_cost.images_megabytes, configs)),
        "tracking": max(map(expected_cost.tracking_megabytes, configs)),
    }
