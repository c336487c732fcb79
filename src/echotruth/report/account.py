"""What a page says of a repository in words and numbers: what was made, what failed, and from what it was made."""

from __future__ import annotations

import json
from itertools import islice
from pathlib import Path
from typing import Any

from echotruth.cases.labels import diagnosis
from echotruth.config import Config
from echotruth.report import style
from echotruth.repository.benchmark_files import total
from echotruth.repository.ledger import STAGES, imaged_statuses, read
from echotruth.repository.reader import Repository

LISTED = 20
"""Largest number of failures of a kind that are listed."""

SAMPLE = 500
"""Records of a stage that are read; the CPU time of the others is taken to be the same on average."""

MAX_FILES = 200_000
"""Files up to which the size of a repository is measured."""

MOTIONS = {
    "beat": "a beating heart, solved by finite elements",
    "rigid": "rigid motion by a formula",
    "affine": "homogeneous deformation by a formula",
    "tube": "deformation of a tube by a formula",
    "file": "motion read from a file",
}
"""Kind of motion -> what it is."""


def lead(config: Config) -> str:
    """What kind of repository it is, in two sentences."""
    motion = MOTIONS.get(config.motion.kind, config.motion.kind)
    species = config.geometry.file or config.geometry.preset
    return (
        f"B-mode clips with the true motion of every pixel of the wall ({species}; {motion}), "
        f"and {counted(len(config.tracking.trackers), 'tracker', 'trackers')} scored against it."
    )


def numbers(repository: Repository) -> list[tuple[str, str]]:
    """The largest facts: label and number."""
    config, present = repository.config, len(repository.present)
    imaged = repository.cases["status"].isin(imaged_statuses(config.physiology.exclude_implausible))
    count, frames, sizes = int(imaged.sum()), config.loop.frames, config.bmode.sizes
    clips = count * len(config.views) * len(sizes)
    found = [
        (_imaged(count, present), spaced(count)),
        ("view a heart" if len(config.views) == 1 else "views a heart", spaced(len(config.views))),
        ("clips", spaced(clips)),
        ("frames", spaced(clips * frames)),
        ("trackers", spaced(len(config.tracking.trackers))),
    ]
    size = _size_on_disk(repository.folder / f"{config.name}.zarr")
    return [*found, *([("in the store", _bytes(size))] if size else [])]


def _imaged(count: int, present: int) -> str:
    """What the number of hearts that were imaged is called."""
    if count < present:
        return f"of {spaced(present)} hearts imaged"
    return "heart" if count == 1 else "hearts"


def facts(config: Config) -> list[tuple[str, str]]:
    """Settings that matter most: label and value."""
    views = ", ".join(
        f"{style.title(name).lower()} ({view.plane.replace('_', ' ')})" for name, view in config.views.items()
    )
    sizes = ", ".join(f"{size} × {size}" for size in config.bmode.sizes)
    probe = config.probe
    return [
        ("Views", views),
        ("Images", f"{sizes} px, {config.bmode.field_of_view_mm:g} mm, {config.loop.frames} frames a cycle"),
        ("Array", f"{probe.elements} elements, {probe.frequency_MHz:g} MHz, pitch {probe.pitch_um:g} µm"),
        ("Wall", f"{counted(config.fibres.layers, 'layer', 'layers')}, 17 AHA segments"),
        ("Trackers", ", ".join(config.tracking.trackers)),
        ("Diagnosis", diagnosis(config).replace("_", " ").replace("+", " + ") + " (of the configuration itself)"),
    ]


def failures(repository: Repository) -> dict[str, Any]:
    """Hearts that are not complete and trackers that found nothing, with their reasons."""
    rows = repository.cases[~repository.cases["status"].isin(["complete", "retired"])]
    found = rows[["status", "reason"]].head(LISTED).reset_index().to_dict("records")
    lost = list(islice(_lost(repository.folder, repository.config), LISTED + 1))
    return {
        "cases": found,
        "more_cases": len(rows) - len(found),
        "trackers": lost[:LISTED],
        "more_trackers": len(lost) > LISTED,
    }


def _lost(folder: Path, config: Config) -> Any:
    """Trackers without a result on a clip."""
    for path in sorted((folder / "ledger/tracking").glob("*/*/[!.]*.json")):
        case, view, size = (*path.parts[-3:-1], path.stem)
        if view in config.views:
            for tracker, reason in sorted(read(path).get("failures", {}).items()):
                yield {"tracker": tracker, "clip": f"{case}, {view}, {size} px", "reason": str(reason)}


def provenance(packages: dict[str, str], config: Config) -> list[tuple[str, str]]:
    """From what the repository was made, with which packages: label and value."""
    return [
        ("Seed", str(config.seed)),
        ("Software", ", ".join(f"{name} {version}" for name, version in packages.items()) or "not recorded"),
    ]


def stages(folder: Path) -> list[dict[str, str]]:
    """What every stage took, from the ledger: its name, number of jobs, CPU time in words and version of the code."""
    found = []
    for name in STAGES:
        paths = sorted((folder / "ledger" / name).glob("**/[!.]*.json"))
        if paths:
            sample = [_record(path) for path in paths[:: -(-len(paths) // SAMPLE)]]
            codes = sorted({str(record.get("code", "")) for record in sample})
            cpu = _duration(total(folder, name))
            took = {"jobs": spaced(len(paths)), "cpu": cpu, "code": ", ".join(codes)}
            found.append({"name": name} | took)
    return found


def opening(config: Config, case: str, view: str, best: str) -> str:
    """Lines of Python that open the repository; the curves are of the best tracker, if there is one."""
    tracker = best or next(iter(config.tracking.trackers))
    return f"""import echotruth as et

repository = et.Repository("out/{config.name}")
clip = repository.clip("{case}", "{view}")  # image, displacement, strain, labels
clip["image"].isel(frame=0).plot(yincrease=False, cmap="gray")
curves = repository.curves("{case}", "{view}", "{tracker}")
curves["tracked_line_strain"].sel(contour="middle").plot(x="time")"""


def _record(path: Path) -> dict[str, Any]:
    try:
        return dict(json.loads(path.read_text(encoding="utf-8")))
    except (ValueError, TypeError):
        return {}


def _size_on_disk(store: Path) -> int:
    """Bytes of the files of a store; 0 if there are too many to look at each."""
    total = 0
    for number, path in enumerate(store.rglob("*")):
        if number > MAX_FILES:
            return 0
        total += path.stat().st_size if path.is_file() else 0
    return total


def _bytes(size: float) -> str:
    for unit in ("B", "kB", "MB", "GB"):
        if size < 1000:
            return f"{size:.3g} {unit}"
        size /= 1000
    return f"{size:.3g} TB"


def _duration(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


def spaced(number: int) -> str:
    """A whole number with spaces between its thousands."""
    return f"{number:,}".replace(",", " ")


def counted(number: int, one: str, many: str) -> str:
    """A number with the word for one thing, or for many."""
    return f"{spaced(number)} {one if number == 1 else many}"
