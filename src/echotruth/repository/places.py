"""Where the groups of a repository are: `hearts/HEART`, `clips/CASE/VIEW` and `inference/CASE` below `NAME.zarr`."""

from collections.abc import Iterable, Iterator
from itertools import product
from pathlib import Path
from typing import NamedTuple

from echotruth.config import Config
from echotruth.repository import schema
from echotruth.repository.checksums import METADATA

STAGES = ("mechanics", "phantom", "rf", "truth", "bmode", "points", "tracking", "inference")
"""Stages in the order of their jobs."""
OF_HEART = ("mechanics", "inference")
"""Stages that have a job for a heart, and not for its views."""
SIZED = ("truth", "bmode")
"""Stages that make a group for each image size."""
NESTED = (*SIZED, "tracking")
"""Stages that make several groups for a view, those of tracking one by each tracker."""
NOT_NEEDED = ("phantom", "rf")
"""Stages whose groups may be deleted once the images are made: a run does not make them again."""

CLIP_STAGES = tuple(stage for stage in STAGES if stage not in OF_HEART)
"""Stages that have jobs for a view of a case."""

DEPTHS = {"hearts": 2, "clips": 3, "inference": 2}
"""Folder of the store -> number of names in the path of a heart, a clip or an inference."""

NOT_A_REPOSITORY = "is not a repository: give the folder that a run made, such as out/demo"
"""What an error says of a folder, whose path stands before it."""


def place(group: str, heart: str, case: str, view: str | None = None) -> str:
    """Path of a group below the store.

    Parameters
    ----------
    group : str
        As `mechanics`, `phantom`, `truth/512`, `tracking/dis` or `inference/fit`; `heart` and `inference` for the
        groups of these.
    heart, case : str
    view : str, optional
        For the groups of a clip.

    Examples
    --------
    >>> place("truth/512", "endo70_17059c", "patient7", "mid")
    'clips/patient7/mid/truth/512'
    """
    stage, _, rest = group.partition("/")
    if stage == "heart":
        return f"hearts/{heart}"
    if stage in schema.HEART:
        return f"hearts/{heart}/{group}"
    if stage == "inference":
        return f"inference/{case}/{rest}".rstrip("/")
    return f"clips/{case}/{view}/{group}"


class JobPlace(NamedTuple):
    """A job by what identifies it: its stage, case and, if it is of a view, view and tracker."""

    stage: str
    case: str
    view: str | None = None
    tracker: str | None = None


def jobs_of(case: str, config: Config) -> Iterator[JobPlace]:
    """Jobs of a case, in the order of their stages, that of its heart first."""
    yield JobPlace("mechanics", case)
    for stage, view in product(CLIP_STAGES, config.views):
        trackers = config.tracking.trackers if stage == "tracking" else [None]
        yield from (JobPlace(stage, case, view, tracker) for tracker in trackers)
    if config.inference.tracker:
        yield JobPlace("inference", case)


def groups_of(stage: str, sizes: Iterable[object], tracker: str | None = None) -> list[str]:
    """Groups that a job makes for a heart or a view, given the names of its images: those of which Snakemake knows."""
    if stage in SIZED:
        return [f"{stage}/{size}" for size in sizes]
    if stage == "tracking":
        return [f"tracking/{tracker}"]
    return ["heart" if stage == "mechanics" else stage]


def group_of(path: str) -> str:
    """Name of a group by its path: of `clips/CASE/VIEW/truth/512`, `truth/512`."""
    top, *rest = path.split("/")
    return "/".join(["inference"] * (top == "inference") + rest[DEPTHS[top] - 1 :])


def job_of(path: str) -> str:
    """Path of the group that a job wrote, as a whole, in which a path below the store is; empty if it is in none.

    Examples
    --------
    >>> job_of("clips/patient7/mid/truth/512/flow/c/0"), job_of("hearts/endo70_17059c/zarr.json")
    ('clips/patient7/mid/truth/512', 'hearts/endo70_17059c')
    """
    names = path.split("/")
    depth = DEPTHS.get(names[0], len(names))
    if names[0] == "clips":
        depth += 2 if names[depth : depth + 1] and names[depth] in NESTED else 1
    return "/".join(names[:depth]) if len(names) > depth else ""


def is_of_a_job(name: str) -> bool:
    """Whether a file, by its path below the folder of a repository, is the metadata of a group that a job wrote."""
    path = name.partition("/")[2]
    return path == f"{job_of(path)}/{METADATA}"


def made(store: Path) -> Iterator[str]:
    """Paths of all groups of a store that jobs wrote."""
    clips = [f"clips/*/*/{name}" for stage in CLIP_STAGES for name in groups_of(stage, "*", "*")]
    for pattern in ("hearts/*", *clips, "inference/*"):
        yield from (path.parent.relative_to(store).as_posix() for path in store.glob(f"{pattern}/{METADATA}"))


def repository_folder(repository: str | Path) -> Path:
    """Folder of a repository, given it or its store.

    Parameters
    ----------
    repository : str or Path
        `out/NAME` or `out/NAME/NAME.zarr`.

    Raises
    ------
    FileNotFoundError
        If the folder holds no repository.
    """
    if "://" in str(repository):
        remedy = "download it, and give the folder; echotruth.Repository reads an address too"
        raise FileNotFoundError(f"{repository}: is an address and not a folder: {remedy}")
    folder = Path(repository)
    folder = folder.parent if folder.suffix == ".zarr" else folder
    configuration = folder / "config.yaml"
    if not configuration.is_file():
        raise FileNotFoundError(f"{repository}: {NOT_A_REPOSITORY}")
    if not configuration.stat().st_size:  # would be read as a configuration of defaults
        raise FileNotFoundError(f"{configuration}: is empty: run the repository again, which writes it")
    return folder
