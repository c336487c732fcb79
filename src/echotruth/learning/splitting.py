"""Splits of a table of cases by heart."""

from collections.abc import Mapping
from hashlib import sha256

import numpy as np
import pandas as pd


def split(
    table: pd.DataFrame, fractions: Mapping[str, float], seed: int = 0, by: str = "heart"
) -> dict[str, pd.DataFrame]:
    """Split cases at random into parts that share no heart.

    The part of a heart follows from a hash of its id and the seed alone: it stays where it is when other hearts are
    added or left out, in every order and on every machine. The price is that fractions are met on average only, with a
    standard deviation of sqrt(fraction (1 - fraction) / hearts).

    Parameters
    ----------
    table : DataFrame
        As :func:`echotruth.learning.cases` returns it, or part of it.
    fractions : mapping
        Name of each part and its expected fraction of the hearts; they add up to 1. Equal ones make folds for
        cross-validation.
    seed : int
    by : str
        Column whose equal values stay together. `heart` holds together the cases that have one motion, whatever
        their speckle or array.

    Returns
    -------
    dict of DataFrame
        The rows of each part, in the order of the table.

    Raises
    ------
    ValueError
        If the fractions are not a split, the table has no such column, or a part has no heart.

    Examples
    --------
    >>> import pandas as pd
    >>> from echotruth.learning import split
    >>> hearts = pd.DataFrame({"heart": [f"heart{number}" for number in range(100)]})
    >>> {name: len(part) for name, part in split(hearts, {"train": 0.8, "test": 0.2}, seed=1).items()}
    {'train': 82, 'test': 18}
    """
    values = np.array(list(fractions.values()), float)
    if not (len(values) and (values > 0).all() and abs(values.sum() - 1) < 1e-9):
        raise ValueError(f"fractions = {dict(fractions)}: give positive fractions that add up to 1.")
    if by not in table:
        raise ValueError(f"by = {by!r}: is not a column of the table: use heart, or one of its keys.")
    upper = np.cumsum(values)
    upper[-1] = 1
    part = np.searchsorted(upper, [_uniform(f"{seed} {value}") for value in table[by]], side="right")
    parts = {name: table[part == number] for number, name in enumerate(fractions)}
    for name, rows in parts.items():
        if rows.empty:
            hearts = table[by].nunique()
            raise ValueError(f"fractions: none of {hearts} hearts is in {name}: take another seed or more hearts.")
    return parts


def _uniform(text: str) -> float:
    """Number from 0 to below 1 that a text determines."""
    return int.from_bytes(sha256(text.encode()).digest()[:6]) / 2**48
