"""The estimate of a run as text."""

from __future__ import annotations

import shutil
from pathlib import Path

from echotruth.workflow.estimate import Estimate
from echotruth.workflow.progress import format_duration

CONTENTS = {
    "mechanics": "motion of the hearts and their measures",
    "images": "phantom, truth, RF and B-mode of every view",
    "tracking": "trackers and their scores",
    "report": "verification, figures and report",
    "compilation": "compiled functions, once",
    "snakemake": "planning and starting of jobs",
}
"""What the parts of a run consist of."""


def heading(path: str, estimate: Estimate) -> str:
    """What is estimated.

    Parameters
    ----------
    path : str
        Configuration file.
    estimate : Estimate
    """
    views = _number(estimate.views, "view")
    return f"{path}: {_number(estimate.hearts, 'heart')} with {views}" + (" each" if estimate.hearts > 1 else "")


def short(estimate: Estimate) -> str:
    """One line: CPU time, time, place and jobs."""
    wall = f"about {format_duration(estimate.wall_seconds)} on {_number(estimate.cores, 'core')}"
    place = f"{format_bytes(estimate.bytes)} in {estimate.files} files"
    return f"{format_duration(estimate.seconds)} of CPU time, {wall}; {place}; {estimate.jobs} jobs"


def table(estimate: Estimate, folder: Path) -> str:
    """The whole estimate, a line for each part.

    Parameters
    ----------
    estimate : Estimate
    folder : Path
        Folder of the repository, `out/NAME`; it need not exist.
    """
    lines = [f"{'':12} {'jobs':>7} {'CPU time':>9}"]
    for name, part in estimate.parts.items():
        if not part.seconds:
            continue
        jobs = str(part.jobs or "")
        lines.append(f"{name:12} {jobs:>7} {format_duration(part.seconds):>9}  {CONTENTS[name]}")
    lines.append(f"{'all':12} {estimate.jobs:>7} {format_duration(estimate.seconds):>9}")
    rule = max(estimate.megabytes, key=lambda name: estimate.megabytes[name])
    lines += [
        "",
        f"Time:     about {format_duration(estimate.wall_seconds)} on {_number(estimate.cores, 'core')} "
        "with nothing else to do",
        *_left(estimate),
        f"Disk:     {format_bytes(estimate.bytes)} in {estimate.files} files, {format_bytes(estimate.scratch_bytes)} "
        f"more while it runs; free: {format_bytes(_free(folder))}",
        f"Memory:   {estimate.megabytes[rule] / 1e3:.1f} GB for the largest job ({rule})",
        f"Based on: {_basis(estimate)}",
    ]
    return "\n".join(lines)


def _left(estimate: Estimate) -> list[str]:
    if estimate.seconds_left >= 0.999 * estimate.seconds:
        return []
    left = f"{format_duration(estimate.seconds_left)} of CPU time, about {format_duration(estimate.wall_seconds_left)}"
    return [f"Left:     {left}, if settings and code are still those of what is made"]


def _basis(estimate: Estimate) -> str:
    speed = estimate.speed
    sampled = "" if estimate.sampled == estimate.hearts else f"; {estimate.sampled} of the hearts, evenly spaced"
    if not speed.repositories:
        return f"constants measured on one core of an AMD EPYC (docs/estimate.md){sampled}"
    measured = f"jobs in {', '.join(speed.repositories)}, which took {speed.of(''):.2f} times the reference"
    return f"{measured}{sampled}"


def _number(number: int, thing: str) -> str:
    return f"{number} {thing}" + ("" if number == 1 else "s")


def _free(folder: Path) -> int:
    place = next(path for path in (folder.absolute(), *folder.absolute().parents) if path.is_dir())
    return shutil.disk_usage(place).free


def format_bytes(number: float) -> str:
    """Rounded size, such as `1.2 GB`."""
    for unit, factor in (("TB", 1e12), ("GB", 1e9)):
        if number >= factor:
            return f"{number / factor:.3g} {unit}"
    return f"{number / 1e6:.0f} MB" if number >= 1e6 else "less than 1 MB"
