"""Table of the cases of a repository, with what is known of each heart."""

from concurrent.futures import ThreadPoolExecutor
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
        said = " ".join(str(error).split()) or type(error).__name__
        remedy = "write it as status == 'complete' and `fibres.endo_deg` > 60, with columns of echotruth.learning.cases"
        raise ValueError(f"query = {query!r}: cannot be evaluated ({said}): {remedy}") from None
