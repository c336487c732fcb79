"""Table of the cases of a repository, with what is known of each heart."""

import re
from concurrent.futures import ThreadPoolExecutor
from difflib import get_close_matches
from functools import partial
from pathlib import Path

import pandas as pd

from echotruth.learning.measurements import PHYSIOLOGY
from echotruth.learning.measurements import measurements as measured
from echotruth.repository.reader import Repository
from echotruth.repository.status import ALWAYS, is_label


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
        A row a case, indexed by `case`: `status` (complete, implausible, failed or unfinished), `reason`,
        `heart` (its id: cases that differ only in speckle, array or image share one),
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
        first = [*ALWAYS, *filter(is_label, found)]
        found = found.join(known)[[*first, *known, *(name for name in found if name not in first)]]
    return found if query is None else found.loc[_selected(found, opened.parameters, query)]


def _measurements(repository: Repository, found: pd.DataFrame) -> pd.DataFrame:
    """Measurements of each case; a heart is read once, several at a time, since object storage is slow to answer."""
    first = found.index.to_series().groupby(found["heart"]).first()
    with ThreadPoolExecutor() as pool:
        known = dict(zip(first.index, pool.map(partial(measured, repository), first), strict=True))
    columns = [*PHYSIOLOGY, "scar_size"]
    return pd.DataFrame([known[heart] for heart in found["heart"]], found.index, columns, dtype=float)


def _selected(found: pd.DataFrame, parameters: pd.DataFrame, query: str) -> pd.Index:
    """Cases for which a condition holds."""
    known = found.join(parameters[[key for key in parameters if key not in found]])
    try:
        return known.query(query).index
    except Exception as error:  # pandas, its parser and its engine have many kinds
        raise ValueError(f"query = {query!r}: {_reason(error, query, list(known))}") from None


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
