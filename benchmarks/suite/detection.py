"""Detection of subtle infarcts from the strain of segments.

A segment with a scar in a part of it shortens a little less than the same segment of a healthy heart. The area under
the ROC curve is the probability that it has the higher strain, equal ones counting half (Mann-Whitney; Hanley & McNeil,
Radiology 1982; 143:29, doi 10.1148/radiology.143.1.7063747). It needs no threshold of strain. Hearts differ, so that
true strain does not find all of them either. It is no ceiling: a tracker that smooths draws a segment at the border of
a scar towards its neighbour in it, whose strain shows more.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from echotruth.arrays import Floats
from echotruth.evaluation.resampling import draws, percentiles
from echotruth.evaluation.segment_strain import SHOWN

SUBTLE = 0.5
"""Share of the tissue of a segment up to which its infarct is subtle."""

STRAIN = "peak_percent"
"""Strain by which segments are distinguished: the largest shortening."""

CLIP = ["heart", "case", "view", "size_px", "tracker"]


def shown(segments: pd.DataFrame) -> pd.DataFrame:
    """Segments of which a view shows more than a corner."""
    return segments[segments["points"] >= SHOWN * segments.groupby(CLIP)["points"].transform("max")]


def subtle(segments: pd.DataFrame) -> pd.DataFrame:
    """Segments with a subtle infarct, `positive`, and the same ones of healthy hearts."""
    found = shown(segments)
    share = found["infarct_share"]
    positive = found["group"].eq("infarct") & share.gt(0) & share.le(SUBTLE)
    return found.assign(positive=positive)[positive | found["group"].eq("healthy")]


def auc(score: ArrayLike, positive: ArrayLike, strata: ArrayLike) -> float:
    """Area under the ROC curve.

    Parameters
    ----------
    score : array_like of shape (n,)
        Of every segment; NaN says nothing, and counts as equal to all.
    positive : array_like of shape (n,), bool
        Whether it has an infarct.
    strata : array_like of shape (n,)
        Only segments with the same value are compared.

    Returns
    -------
    float
        0 to 1; NaN where there is nothing to compare.
    """
    score = np.asarray(score, float)
    won, compared = _comparisons(score, np.asarray(positive, bool), np.zeros(len(score), int), 1, strata)
    return float(won.sum() / compared.sum()) if compared.sum() else np.nan


def detection(segments: pd.DataFrame) -> pd.DataFrame:
    """Detection of subtle infarcts by every tracker.

    Parameters
    ----------
    segments : DataFrame
        As :func:`.columns.segments` returns them, of one species, image size and acoustics.

    Returns
    -------
    DataFrame
        Trackers as rows, and last `true strain`: `auc` with its 95 % interval `low` to `high`, of a bootstrap over
        hearts; `positive` and `healthy`, the numbers of segments; NaN where there is nothing to compare.
    """
    chosen = subtle(segments)
    found = {str(name): _area(of, f"tracked_{STRAIN}") for name, of in chosen.groupby("tracker", sort=False)}
    once = chosen.drop_duplicates([*(name for name in CLIP if name != "tracker"), "aha"])
    found["true strain"] = _area(once, f"true_{STRAIN}")
    return pd.DataFrame.from_dict(found, orient="index", columns=["auc", "low", "high", "positive", "healthy"])


def _area(table: pd.DataFrame, column: str) -> tuple[float, float, float, int, int]:
    """Area, its interval over samples of the hearts, and the numbers of segments with an infarct and of others."""
    names, heart = np.unique(table["heart"].to_numpy(str), return_inverse=True)
    positive = table["positive"].to_numpy(bool)
    same = table["component"].astype(str) + table["aha"].astype(str)
    won, compared = _comparisons(table[column].to_numpy(float), positive, heart, len(names), same)
    counts = int(positive.sum()), int((~positive).sum())
    if not compared.sum():
        return np.nan, np.nan, np.nan, *counts
    drawn = np.stack([np.bincount(sample, minlength=len(names)) for sample in draws(len(names), 1)]).astype(float)
    won_in, compared_in = (np.sum((drawn @ matrix) * drawn, axis=1) for matrix in (won, compared))
    samples = won_in[compared_in > 0] / compared_in[compared_in > 0]
    low, high = percentiles(samples[:, None], len(names))
    return float(won.sum() / compared.sum()), float(low[0]), float(high[0]), *counts


def _comparisons(
    score: Floats, positive: NDArray[np.bool_], heart: NDArray[np.integer], hearts: int, strata: ArrayLike
) -> tuple[Floats, Floats]:
    """Comparisons won, and all of them, of the positive segments of one heart with the others of another.

    Both are (heart, heart); every stratum is compared in itself.
    """
    won, compared = np.zeros((hearts, hearts)), np.zeros((hearts, hearts))
    stratum = np.asarray(strata)
    for value in np.unique(stratum):
        high, low = (score[(stratum == value) & kind, None] for kind in (positive, ~positive))
        place = np.ix_(heart[(stratum == value) & positive], heart[(stratum == value) & ~positive])
        known = np.isfinite(high) & np.isfinite(low.T)
        better = np.where(known, (high > low.T) + 0.5 * (high == low.T), 0.5)
        np.add.at(won, place, better)
        np.add.at(compared, place, 1.0)
    return won, compared


def recovery(segments: pd.DataFrame) -> pd.DataFrame:
    """What trackers leave of the differences between segments in hearts with an infarct.

    Parameters
    ----------
    segments : DataFrame
        As for :func:`detection`.

    Returns
    -------
    DataFrame
        Trackers as rows: `contrast`, the mean strain of segments with more than half of their tissue in the scar less
        that of segments without any, and `spread`, the standard deviation over the segments in or at the scar, each
        tracked over true: sums over the clips, so that clips with small differences do not dominate; and `hearts`.
    """
    found = {}
    infarcts = shown(segments)[lambda rows: rows["group"].eq("infarct")].dropna(subset=[f"tracked_{STRAIN}"])
    for tracker, of in infarcts.groupby("tracker", sort=False):
        sums = np.zeros((2, 2))
        for _, clip in of.groupby(CLIP, sort=False):
            values = clip[[f"tracked_{STRAIN}", f"true_{STRAIN}"]].to_numpy(float)
            share = clip["infarct_share"].to_numpy(float)
            scar, free, touched = values[share > 0.5], values[share == 0], values[share > 0]
            if len(scar) and len(free):
                sums[0] += scar.mean(axis=0) - free.mean(axis=0)
            if len(touched) > 1:
                sums[1] += touched.std(axis=0, ddof=1)
        contrast, spread = sums[:, 0] / np.where(sums[:, 1], sums[:, 1], np.nan)
        found[str(tracker)] = (contrast, spread, of["heart"].nunique())
    return pd.DataFrame.from_dict(found, orient="index", columns=["contrast", "spread", "hearts"])
