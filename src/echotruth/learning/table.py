"""Table of the cases of a repository, with what is known of each heart."""

import re
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from echotruth.learning.measurements import physiology, scar_size
from echotruth.repository.reader import Repository
from echotruth.repository.table import constants, is_label


def cases(repository: str | Path, query: str | None = None, measurements: bool = True) -> pd.DataFrame:
    """Table of the cases of a repository.

    Parameters
    ----------
    repository : str or Path
        `out/NAME`, `out/NAME/NAME.zarr`, or the address `s3://BUCKET/FOLDER`.
    query : str, optional
        Condition on the columns, as :meth:`pandas.DataFrame.query` takes it, and on all keys, those too that are the
        same in all cases: "status == 'complete' and ejection_fraction < 0.5 and `fibres.endo_deg` > 60". Default: all
        cases.
    measurements : bool
        Whether to read the measurements of each heart; without them the table of a large repository is there sooner.

    Returns
    -------
    DataFrame
        A row a case, indexed by `case`: `status` (complete, implausible, failed, retired or unfinished), `reason`,
        `heart` (the first case with the same motion: cases that differ only in speckle, array or image share one),
        `diagnosis` and `label.*`; measurements of the group physiology in its units (docs/schema.md), `scar_size`
        (fraction of the wall's volume that is infarcted), NaN where a heart was not solved; and the keys whose value
        differs among the cases.

    Raises
    ------
    FileNotFoundError
        If the folder holds no repository.
    ValueError
        If the query cannot be evaluated.

    Examples
    --------
    >>> import echotruth as et
    >>> table = et.learning.cases("out/demo", "status == 'complete'")
    >>> list(table.index), list(table["diagnosis"])
    (['heart'], ['healthy'])
    """
    opened = Repository(repository)
    found = opened.cases
    if measurements:
        known = _measurements(opened, found)
        first = ["status", "reason", "heart", *(name for name in found if is_label(name))]
        found = found.join(known)[[*first, *known, *(name for name in found if name not in first)]]
    return found if query is None else found.loc[_selected(found, constants(opened), query)]


def _measurements(repository: Repository, found: pd.DataFrame) -> pd.DataFrame:
    known = pd.DataFrame(physiology(repository), index=found.index)
    sizes = [
        scar_size(repository, row) if repository.is_written("pathology/region", case) else np.nan
        for row, case in enumerate(found.index)
    ]
    return known.assign(scar_size=sizes)


def _selected(found: pd.DataFrame, constants: dict[str, Any], query: str) -> pd.Index:
    """Cases for which a condition holds."""
    same = pd.DataFrame({key: value for key, value in constants.items() if key not in found}, index=found.index)
    try:
        return found.join(same).query(query).index
    except Exception as error:  # pandas, its parser and its engine have many kinds
        columns = [str(name) for name in (*found, *same)]
        raise ValueError(f"query = {query!r}: {_reason(error, query, columns)}") from None


def _reason(error: Exception, query: str, columns: list[str]) -> str:
    """Why a query cannot be evaluated, and what would be right."""
    match = re.search(r"name '(.+?)' is not defined", str(error))
    if match is None:
        if re.search(r"(?<![=!<>])=(?!=)", query):
            return "has a single =: compare by ==."
        said = re.sub(r" \(<unknown>.*", "", " ".join(str(error).split()))[:200].rstrip(".") or type(error).__name__
        return f"cannot be evaluated ({said}): write it as status == 'complete' and `fibres.endo_deg` > 60."
    name = match[1].replace("BACKTICK_QUOTED_STRING_", "").replace("_DOT_", ".")
    # Without backticks, a name ends for pandas before its first dot.
    whole = next((word for word in re.findall(r"[\w.]+", query) if word == name or word.startswith(f"{name}.")), name)
    if whole in columns:
        return f"{whole} has a dot: write it in backticks, as `{whole}`."
    close = get_close_matches(whole, columns, n=1)
    remedy = f"did you mean {close[0]}?" if close else "echotruth.learning.cases lists them."
    return f"{whole} is not a column: {remedy}"
