"""Where the groups of a repository are: `hearts/HEART`, `clips/CASE/VIEW` and `inference/CASE` below `NAME.zarr`."""

from pathlib import Path

from echotruth.repository import schema

METADATA = "zarr.json"
"""File of a group, which is written last: without it there is no group."""

NOT_A_REPOSITORY = "is not a repository: give the folder that a run made, such as out/demo"
"""What an error says of a folder, whose path stands before it."""


def place(group: str, heart: str, case: str, view: str | None = None) -> str:
    """Path of a group below the store.

    Parameters
    ----------
    group : str
        As `mechanics`, `phantom`, `truth/512` or `inference/fit`; `heart` and `inference` for the groups of these.
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
