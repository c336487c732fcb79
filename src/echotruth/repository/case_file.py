"""The configuration of one case, cases/CASE.json, which its jobs read."""

from pathlib import Path

from pydantic import ValidationError

from echotruth.cases.case import Case
from echotruth.config import Config


def case_path(folder: Path, case: str) -> Path:
    """File with the configuration of one case, which its jobs read."""
    return folder / "cases" / f"{case}.json"


def read_case(folder: Path, case: str) -> Case:
    """The case of a job.

    Raises
    ------
    FileNotFoundError
        If it has no configuration, or one that is damaged.
    """
    path, remedy = case_path(folder, case), "the ids are in cases.csv; run the repository again, which writes the file"
    # A pipe or a device could be read for ever.
    if path.exists() and not path.is_file():
        raise FileNotFoundError(f"{path}: is not a file: {remedy}")
    try:
        return Case(case, {}, Config.model_validate_json(path.read_bytes()))
    except FileNotFoundError:
        raise FileNotFoundError(f"{path}: is not there: {remedy}") from None
    except ValidationError:
        raise FileNotFoundError(f"{path}: is damaged: {remedy}") from None
