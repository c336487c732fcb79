"""Detection of infarcts from the strain of segments.

An infarcted segment hardly shortens, so that its strain is higher than that of others. The area under the ROC curve is
the probability that an infarcted segment has the higher one, equal ones counting half (Mann-Whitney; Hanley & McNeil,
Radiology 1982; 143:29, doi 10.1148/radiology.143.1.7063747). It needs no threshold of strain.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from echotruth.arrays import Floats
from echotruth.evaluation.resampling import CLIP, draws, percentiles
from echotruth.evaluation.segment_strain import SHOWN

INFARCTED = 0.5
"""Share of the innermost layer of a segment above which it is infarcted: infarcts begin at the endocardium (Reimer et
al., Circulation 1977; 56:786, doi 10.1161/01.CIR.56.5.786)."""

TANGENTIAL = ("circumferential", "longitudinal")
"""Components in which the wall shortens."""

ALL = "all"
"""Both of them: segments are compared with those of the same component."""


def infarcted(segments: pd.DataFrame) -> pd.Series:
    """Whether segments are infarcted.

    Parameters
    ----------
    segments : DataFrame
        As :attr:`echotruth.evaluation.clip_metrics.ClipMetrics.segments`.

    Returns
    -------
    Series of float
        1 if more than half of the innermost layer is infarcted, 0 if no tissue is; NaN between.
    """
    extent = segments["infarct_extent"]
    return extent.gt(INFARCTED).astype(float).where(extent.gt(INFARCTED) | segments["infarct_share"].eq(0))


def auc(score: ArrayLike, positive: ArrayLike, strata: ArrayLike | None = None) -> float:
    """Area under the ROC curve.

    Parameters
    ----------
    score : array_like of shape (n,)
        Of every segment; NaN says nothing, and counts as equal to all.
    positive : array_like of shape (n,), bool
        Whether it is infarcted.
    strata : array_like of shape (n,), optional
        Only segments with the same value are compared.

    Returns
    -------
    float
        0 to 1; NaN where there is nothing to compare.
    """
    score = np.asarray(score, float)
    together = np.zeros(len(score), int)
    won, pairs = _comparisons(score, np.asarray(positive, bool), together, 1, together if strata is None else strata)
    return float(won.sum() / pairs.sum()) if pairs.sum() else np.nan


def detection(segments: pd.DataFrame, score: str = "peak_percent", seed: int = 1) -> pd.DataFrame:
    """Detection of infarcted segments by every tracker.

    Parameters
    ----------
    segments : DataFrame
        As :attr:`echotruth.evaluation.clip_metrics.ClipMetrics.segments`, of the clips that are to count.
    score : str
        Strain by which segments are told apart, without `tracked_` or `true_`.
    seed : int
        Of the bootstrap over hearts.

    Returns
    -------
    DataFrame
        For every size_px, tracker and `component` (circumferential, longitudinal and all): `auc` with its interval
        `auc_low` to `auc_high`; `true_auc`, that of the true strain; `infarcted` and `free`, the numbers of segments;
        `hearts`; and `subendocardial_auc`, `true_subendocardial_auc` and `subendocardial`, of those infarcted segments
        whose outermost layer is not infarcted for the most part. Segments in between (:func:`infarcted`) and those of
        which a view shows a corner only (`SHOWN`) are left out. NaN where there is nothing to compare, and in intervals
        of a single heart.
    """
    view = [name for name in CLIP if name in segments]
    label, fullest = infarcted(segments), segments.groupby(view)["points"].transform("max")
    shown = segments["points"].ge(SHOWN * fullest) & segments["component"].isin(TANGENTIAL)
    chosen = segments.assign(infarcted=label)[label.notna() & shown]
    return pd.DataFrame(list(_rows(chosen, score, seed)), columns=list(COLUMNS))


COLUMNS = (
    *("size_px", "tracker", "component", "auc", "auc_low", "auc_high", "true_auc", "infarcted", "free", "hearts"),
    *("subendocardial_auc", "true_subendocardial_auc", "subendocardial"),
)
"""Columns of the table."""


def _rows(segments: pd.DataFrame, score: str, seed: int) -> Iterator[dict[str, str | int | float]]:
    """Rows of the table, from segments that are either infarcted or free."""
    for (size, tracker), of_tracker in segments.groupby(["size_px", "tracker"], sort=False):
        for component in (*TANGENTIAL, ALL):
            table = of_tracker if component == ALL else of_tracker[of_tracker["component"] == component]
            if not len(table):
                continue
            positive = table["infarcted"] == 1
            inner = table[~positive | (table["epicardial_share"] <= INFARCTED)]
            found, true = (_areas(table, f"{what}_{score}", seed) for what in ("tracked", "true"))
            inner_found, inner_true = (_area(inner, f"{what}_{score}") for what in ("tracked", "true"))
            values = (size, tracker, component, *found, true[0], int(positive.sum()), int((~positive).sum()))
            of_inner = (inner_found, inner_true, int((inner["infarcted"] == 1).sum()))
            yield dict(zip(COLUMNS, (*values, table["heart"].nunique(), *of_inner), strict=True))


def _area(table: pd.DataFrame, column: str) -> float:
    return auc(table[column], table["infarcted"] == 1, table["component"])


def _areas(table: pd.DataFrame, column: str, seed: int) -> tuple[float, float, float]:
    """Area, and its interval over samples of the hearts in which there are both kinds of segments."""
    names, heart = np.unique(table["heart"].to_numpy(str), return_inverse=True)
    positive = table["infarcted"].to_numpy(float) == 1
    won, pairs = _comparisons(table[column].to_numpy(float), positive, heart, len(names), table["component"])
    if not pairs.sum():
        return np.nan, np.nan, np.nan
    drawn = np.stack([np.bincount(sample, minlength=len(names)) for sample in draws(len(names), seed)]).astype(float)
    won_in, pairs_in = (np.sum((drawn @ matrix) * drawn, axis=1) for matrix in (won, pairs))
    samples = won_in[pairs_in > 0] / pairs_in[pairs_in > 0]
    low, high = percentiles(samples[:, None], len(names))
    return float(won.sum() / pairs.sum()), float(low[0]), float(high[0])


def _comparisons(
    score: Floats, positive: NDArray[np.bool_], heart: NDArray[np.integer], hearts: int, strata: ArrayLike
) -> tuple[Floats, Floats]:
    """Comparisons won, and all of them, of the infarcted segments of one heart with the free ones of another.

    Both are (heart, heart); every stratum is compared in itself.
    """
    won, pairs = np.zeros((hearts, hearts)), np.zeros((hearts, hearts))
    stratum = np.asarray(strata)
    for value in np.unique(stratum):
        high, low = (score[(stratum == value) & kind, None] for kind in (positive, ~positive))
        place = np.ix_(heart[(stratum == value) & positive], heart[(stratum == value) & ~positive])
        known = np.isfinite(high) & np.isfinite(low.T)
        better = np.where(known, (high > low.T) + 0.5 * (high == low.T), 0.5)
        np.add.at(won, place, better)
        np.add.at(pairs, place, 1.0)
    return won, pairs
