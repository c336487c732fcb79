"""Detection of subtle infarcts from the strain of segments.

A segment of which a fifth to a half is scarred shortens a little less than the segments of the same heart without a
scar, each taken less the mean of the same segment of healthy hearts, as a laboratory has normal values. The area under
the ROC curve is the probability that it has the higher strain, equal ones counting half (Mann-Whitney; Hanley & McNeil,
Radiology 1982; 143:29, doi 10.1148/radiology.143.1.7063747). It needs no threshold of strain.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from echotruth.arrays import Floats
from echotruth.evaluation.resampling import draws, percentiles
from echotruth.evaluation.segment_strain import SHOWN

SUBTLE = (0.2, 0.5)
"""Shares of the tissue of a segment between which its infarct is subtle."""

STRAIN = "peak_percent"
"""Strain by which segments are distinguished: the largest shortening."""

CLIP = ["heart", "case", "view", "size_px", "tracker"]


def shown(segments: pd.DataFrame) -> pd.DataFrame:
    """Segments of which a view shows more than a corner."""
    return segments[segments["points"] >= SHOWN * segments.groupby(CLIP)["points"].transform("max")]


def subtle(segments: pd.DataFrame) -> pd.DataFrame:
    """Segments with a subtle infarct, `positive`, and those without any scar in the same clips."""
    found = shown(segments)[lambda rows: rows["group"].eq("infarct")]
    found = found.assign(positive=found["infarct_share"].between(*SUBTLE))
    found = found[found["positive"] | found["infarct_share"].eq(0)]
    both = found.groupby(CLIP)["positive"].transform("nunique").eq(2)
    return found[both]


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
    found = {str(name): _area(of, f"tracked_{STRAIN}") for name, of in segments.groupby("tracker", sort=False)}
    once = segments.drop_duplicates([*(name for name in CLIP if name != "tracker"), "aha"])
    found["true strain"] = _area(once, f"true_{STRAIN}")
    return pd.DataFrame.from_dict(found, orient="index", columns=["auc", "low", "high", "positive", "healthy"])


def _area(segments: pd.DataFrame, column: str) -> tuple[float, float, float, int, int]:
    """Area, its interval over samples of the hearts, and the numbers of segments with an infarct and of others."""
    healthy = segments[segments["group"].eq("healthy")].groupby(["view", "aha"])[column].mean()
    chosen = subtle(segments).join(healthy.rename("normal"), on=["view", "aha"])
    positive = chosen["positive"].to_numpy(bool)
    counts = int(positive.sum()), int((~positive).sum())
    chosen = chosen.assign(score=chosen[column] - chosen["normal"])
    clips = {str(heart): [comparisons(clip) for _, clip in of.groupby(CLIP)] for heart, of in chosen.groupby("heart")}
    if not clips:
        return np.nan, np.nan, np.nan, *counts
    won, compared = np.array([np.sum(each, axis=0) for each in clips.values()]).T
    taken = np.stack([np.bincount(sample, minlength=len(clips)) for sample in draws(len(clips), 1)])
    low, high = percentiles(((taken @ won) / (taken @ compared))[:, None], len(clips))
    return float(won.sum() / compared.sum()), float(low[0]), float(high[0]), *counts


def comparisons(segments: pd.DataFrame) -> Floats:
    """Comparisons that positive segments win against the others by their `score`, and all of them, (2,).

    A score that is not known counts as equal to all.
    """
    score, positive = segments["score"].to_numpy(float), segments["positive"].to_numpy(bool)
    high, low = score[positive, None], score[None, ~positive]
    known = np.isfinite(high) & np.isfinite(low)
    return np.array([np.where(known, (high > low) + 0.5 * (high == low), 0.5).sum(), known.size], float)


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
