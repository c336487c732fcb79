"""Reliability of the quality of trackers, added up over clips."""

from __future__ import annotations

import pandas as pd

from echotruth.evaluation.reliability import COUNTS, expected_error
from echotruth.evaluation.statistics import ratio


def curve(table: pd.DataFrame) -> pd.DataFrame:
    """Stated and observed share of right points by step of quality.

    Parameters
    ----------
    table : DataFrame
        As :attr:`echotruth.evaluation.clip_metrics.ClipMetrics.reliability`.

    Returns
    -------
    DataFrame
        For every size_px, tracker and step of quality, over the clips of the table: count, stated_percent (the mean
        quality) and observed_percent (the share of right points); NaN where no point has such a quality.
    """
    keys = [name for name in ("size_px", "tracker", "quality_low", "quality_high") if name in table]
    added = table.groupby(keys, sort=False)[list(COUNTS)].sum().reset_index()
    count = added["count"].to_numpy(float)
    shares = {
        "stated_percent": 100 * ratio(added["quality_sum"].to_numpy(float), count),
        "observed_percent": 100 * ratio(added["within_count"].to_numpy(float), count),
    }
    return added[[*keys, "count"]].assign(**shares)


def stated_and_right(table: pd.DataFrame) -> tuple[float, float, float]:
    """Stated and observed share of right points, and the calibration error, %; the parameter as below."""
    stated, right, count = (table[name].sum() for name in ("quality_sum", "within_count", "count"))
    return 100 * stated / count, 100 * right / count, calibration_error(table)


def calibration_error(table: pd.DataFrame) -> float:
    """Expected calibration error (Naeini et al., Proc AAAI 2015; 29, doi 10.1609/aaai.v29i1.9602).

    Parameters
    ----------
    table : DataFrame
        As :func:`curve` takes it, of one tracker and image size.

    Returns
    -------
    float
        Mean over the points of the difference between stated and observed share of their step, in %; NaN without
        points.
    """
    added = table.groupby("quality_low")[list(COUNTS)].sum()
    return expected_error(*(added[name].to_numpy(float) for name in COUNTS))
