"""What a run will take, before anything runs: CPU time by rule, time on some cores, bytes, files, jobs, memory."""

import shutil
from collections.abc import Sequence
from math import ceil, sqrt
from pathlib import Path
from typing import NamedTuple

from echotruth.cases import Case
from echotruth.config import Config
from echotruth.repository import schema
from echotruth.repository.ledger import stages
from echotruth.workflow import cost
from echotruth.workflow.jobs import FINAL_RULES, ended, jobs, places, rules
from echotruth.workflow.progress import format_duration
from echotruth.workflow.resources import expected_megabytes

MAX_SAMPLED = 100
"""Largest number of hearts whose cost is worked out; in a larger sweep it is that of as many, evenly spaced."""
THREADS_GAIN, MAX_THREADS = 0.5, 4
"""What each further thread adds to the speed of the mechanics of a single heart, and threads beyond which none does."""
RUN_SECONDS, JOB_SECONDS = 5.0, 0.1
"""Time in which Snakemake plans, and its CPU time for each job."""
FIXED_FILES, FIXED_BYTES = 320, 20e6
"""Files and bytes of what belongs to no heart: metadata, coordinates, table of cases, figures and report."""


class Part(NamedTuple):
    """Jobs of one rule: their number, how many of them have not ended, and the mean CPU time of one, s."""

    jobs: int
    left: int
    seconds: float


class Estimate(NamedTuple):
    """What a run will take.

    Attributes
    ----------
    parts : dict
        Jobs by rule, in the order in which they are done.
    cores : int
    hearts : int
    bytes, files : float, int
        Those of the repository.
    megabytes : dict
        Rule -> peak memory of its largest job, MB.
    basis : str
        What it is based on.
    """

    parts: dict[str, Part]
    cores: int
    hearts: int
    bytes: float
    files: int
    megabytes: dict[str, float]
    basis: str

    @property
    def jobs(self) -> int:
        """Number of jobs."""
        return sum(part.jobs for part in self.parts.values())

    @property
    def seconds(self) -> float:
        """CPU time, s."""
        return sum(part.jobs * part.seconds for part in self.parts.values())

    @property
    def seconds_left(self) -> float:
        """CPU time of what has no record yet, s."""
        return sum(part.left * part.seconds for part in self.parts.values())

    @property
    def wall_seconds(self) -> float:
        """Time on the cores if they have nothing else to do, s: rule after rule, each on as many as it has jobs."""
        threads = min(MAX_THREADS, max(1, self.cores // self.hearts))
        saved = 1 - 1 / (1 + THREADS_GAIN * (threads - 1))
        rules = sum(part.jobs * part.seconds / min(self.cores, part.jobs) for part in self.parts.values())
        return RUN_SECONDS + rules - saved * self.parts["mechanics"].seconds


def estimate(config: Config, cases: Sequence[Case], cores: int, folder: Path) -> Estimate:
    """Estimate a run.

    Parameters
    ----------
    config : Config
    cases : sequence of Case
        Its hearts.
    cores : int
        Cores on which jobs run at the same time.
    folder : Path
        Folder of the repository, `out/NAME`; it need not exist.
    """
    sample = [case.config for case in cases[:: ceil(len(cases) / MAX_SAMPLED)]]
    speed = cost.speed(folder, {case.id: case.config for case in cases})
    parts, megabytes = {}, {}
    for rule in rules(config):
        wanted = jobs(rule, config, [case.id for case in cases])
        configs = [config] if rule in FINAL_RULES else sample
        seconds = JOB_SECONDS + cost.mean_seconds(rule, configs) * speed.get(rule, 1.0)
        parts[rule] = Part(len(wanted), len(wanted - ended(folder, rule, config)), seconds)
        megabytes[rule] = max(expected_megabytes(rule, heart, *at) for heart in configs for at in places(rule, heart))
    basis = f"jobs of {', '.join(speed)} in {folder}" if speed else "a reference, a core of an Intel Xeon"
    basis += "" if len(sample) == len(cases) else f"; {len(sample)} of the hearts, evenly spaced"
    size = FIXED_BYTES + len(cases) * sum(map(_bytes, sample)) / len(sample)
    return Estimate(parts, cores, len(cases), size, number_of_files(config, len(cases)), megabytes, basis)


def number_of_files(config: Config, hearts: int) -> int:
    """Files of a finished repository: of arrays of hearts and views, records, logs, benchmarks, and metadata."""
    views = len(config.views)
    arrays = [array for group, of in schema.groups(config).items() if group != "cases" for array in of]
    of_heart, of_view = (sum(array.leading == number for array in arrays) for number in (1, 2))
    jobs_of_heart = sum(len(places(rule, config)) for rule in stages(config))
    of_jobs = 1 + 3 * jobs_of_heart  # configuration; record, log and benchmark
    return FIXED_FILES + hearts * (of_heart + views * of_view + of_jobs)


def _bytes(config: Config) -> float:
    """Bytes of a heart: motion of its mesh, and of each view truth, images, what was tracked, and RF that is kept."""
    frame, sizes = 35 * cost.cells(config), config.bmode.sizes
    for view in config.views:
        walls = [cost.wall_pixels(config, view, size) for size in sizes]
        points = max(walls) / config.tracking.grid_px**2
        frame += sum(13 * wall + 550 * sqrt(wall) for wall in walls) + _rf_bytes(config)
        frame += len(sizes) * (points * (4.6 * len(config.tracking.trackers) + 6.6))
        # Surroundings and noise fill the sector, which is three quarters of the square.
        is_filled = config.realism.surroundings.level_dB is not None or config.realism.noise.snr_dB is not None
        frame += 0.64 * sum(size**2 for size in sizes) if is_filled else 0.0
    return config.loop.frames * frame


def _rf_bytes(config: Config) -> float:
    """Bytes of the RF of one frame that is kept; channels are sampled at about three times the rate of lines."""
    probe = config.probe
    samples = 2.24 * config.bmode.field_of_view_mm * probe.frequency_MHz * 1e3 / probe.sound_speed_m_per_s
    kept = {"lines": 12 * config.rf.lines, "channels": 6 * probe.elements**2}
    return samples * sum(kept[name] for name in config.rf.keep)


def short(found: Estimate) -> str:
    """One line: CPU time, time, place and jobs."""
    place = f"{format_bytes(found.bytes)} in {found.files} files"
    return f"{format_duration(found.seconds)} of CPU time, {_wall(found)}; {place}; {found.jobs} jobs"


def _wall(found: Estimate) -> str:
    cores = "1 core" if found.cores == 1 else f"{found.cores} cores"
    return f"about {format_duration(found.wall_seconds)} on {cores}"


def table(found: Estimate, folder: Path) -> str:
    """The whole estimate, a line for each rule; `folder` is that of the repository, which need not exist."""
    rows = {rule: (part.jobs, part.jobs * part.seconds) for rule, part in found.parts.items()}
    lines = [f"{'':13} {'jobs':>7} {'CPU time':>9}"]
    for name, (number, seconds) in (rows | {"all": (found.jobs, found.seconds)}).items():
        lines.append(f"{name:13} {number:>7} {format_duration(seconds):>9}")
    lines += ["", f"Time:     {_wall(found)} with nothing else to do"]
    if found.seconds_left < found.seconds:
        left = f"{format_duration(found.seconds_left)} of CPU time"
        lines.append(f"Left:     {left}, if settings and code are still those of what is made")
    rule = max(found.megabytes, key=lambda name: found.megabytes[name])
    return "\n".join([
        *lines,
        f"Disk:     {format_bytes(found.bytes)} in {found.files} files; free: {format_bytes(free_bytes(folder))}",
        f"Memory:   {found.megabytes[rule] / 1e3:.1f} GB for the largest job ({rule})",
        f"Based on: {found.basis}",
    ])  # fmt: skip


def free_bytes(folder: Path) -> int:
    """Free bytes of the file system of a folder, which need not exist."""
    place = next(path for path in (folder.absolute(), *folder.absolute().parents) if path.is_dir())
    return shutil.disk_usage(place).free


def format_bytes(number: float) -> str:
    """Rounded size, such as `1.2 GB`."""
    for unit, factor in (("TB", 1e12), ("GB", 1e9)):
        if number >= factor:
            return f"{number / factor:.3g} {unit}"
    return f"{number / 1e6:.0f} MB" if number >= 1e6 else "less than 1 MB"
