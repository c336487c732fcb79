"""What speaks against a submission: worse results on mirrored clips, an impossible accuracy, an easier test half.

None of them proves anything; each asks for an explanation.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from echotruth.benchmark.records import Records, Suite
from echotruth.benchmark.rerun import result_of
from echotruth.benchmark.splits import DEVELOP, TEST
from echotruth.evaluation.leaderboard import RANKED_BY
from echotruth.evaluation.resampling import CLIP, by_heart, draws, interval

if TYPE_CHECKING:
    import pandas as pd

WORSE = 1.25
"""Ratio of the errors on variants and on clips above which the lower end of its interval is not taken for chance.

A method without memory is the same on both but for its random numbers; a network may prefer one side."""

IMPOSSIBLE = 0.5
"""Fraction of the Cramer-Rao bound below which an error is impossible without knowledge that is not in the images."""

SMALLEST = 1e-6
"""Errors are taken to be as large, %, so that they have logarithms."""


class Ratio(NamedTuple):
    """Ratio of two errors, geometric mean over hearts, and the 95 % interval of a bootstrap over them.

    Attributes
    ----------
    value, low, high : float
        The last two are NaN with a single heart.
    hearts : int
    """

    value: float
    low: float
    high: float
    hearts: int


class Verdict(NamedTuple):
    """What was found of one tracker.

    Attributes
    ----------
    tracker : str
    mirrored : Ratio or None
        Error on mirrored clips over that on the clips; None if it was not run on them.
    impossible, clips : int
        Number of clips with an impossible accuracy, and of all.
    gap : float
        Median error on the test half over that on the other; NaN if it lacks either.
    """

    tracker: str
    mirrored: Ratio | None
    impossible: int
    clips: int
    gap: float

    @property
    def flags(self) -> list[str]:
        """What asks for an explanation."""
        found = []
        if self.mirrored is not None and is_worse(self.mirrored):
            found.append("worse on mirrored clips")
        if self.impossible:
            found.append("impossible accuracy")
        return found

    @property
    def text(self) -> str:
        """The verdict in one line."""
        words = "; ".join(self.flags) or "nothing found"
        parts = [f"{self.impossible} of {self.clips} clips of an impossible accuracy"]
        if self.mirrored is not None:
            value, low, high, hearts = self.mirrored
            between = f", 95 % interval {low:.2f} to {high:.2f}" if hearts > 1 else ""
            counted = f"{hearts} heart{'s' * (hearts > 1)}{between}"
            parts.insert(0, f"error on mirrored clips {value:.2f} times that on the clips ({counted})")
        if np.isfinite(self.gap):
            parts.append(f"test / develop {self.gap:.2f}")
        return f"{self.tracker}: {words} ({'; '.join(parts)})"


def verdict(tracker: str, records: Records, split: str) -> Verdict:
    """Judge a tracker by what is in the repositories.

    Parameters
    ----------
    tracker : str
    records : Records
        Of all hearts.
    split : str
        Half that is reported.
    """
    whole = records.clips[records.clips["tracker"] == tracker]
    clips = whole[whole["split"] == split]
    again = variants_of(records.suites, tracker, "mirrored")
    ratio = None if again is None else paired_ratio(clips, again)
    known_of = impossible(clips, records.difficulty)
    return Verdict(
        tracker, ratio, len(known_of), len(clips), split_gap(whole[whole["size_px"] == whole["size_px"].max()])
    )


def paired_ratio(clips: pd.DataFrame, again: pd.DataFrame, seed: int = 1) -> Ratio | None:
    """Errors of a tracker on variants of clips over those on the clips themselves.

    Parameters
    ----------
    clips : DataFrame
        Clips that count: columns `CLIP` of :mod:`echotruth.evaluation.resampling`, and heart.
    again : DataFrame
        As :func:`variants_of` returns it.
    seed : int
        Of the bootstrap.

    Returns
    -------
    Ratio or None
        None if they have no clip in common.
    """
    both = clips[[*CLIP, "heart"]].merge(again, on=list(CLIP))
    errors = both[["before_percent", "error_percent"]].to_numpy(float)
    both = both.assign(logarithm=np.diff(np.log(np.maximum(errors, SMALLEST)), axis=1)[:, 0])
    means = both[np.isfinite(both["logarithm"])].groupby("heart")["logarithm"].mean().to_numpy()
    return _geometric(means, seed) if len(means) else None


def _geometric(logarithms: np.ndarray, seed: int) -> Ratio:
    """Geometric mean over hearts of values given as logarithms, with its interval."""
    hearts = len(logarithms)
    low, high = np.exp(interval(logarithms[:, None], draws(hearts, seed)))[:, 0]
    return Ratio(float(np.exp(logarithms.mean())), float(low), float(high), hearts)


def is_worse(ratio: Ratio) -> bool:
    """Whether a ratio is above `WORSE` beyond its interval (with a single heart, itself)."""
    return (ratio.low if np.isfinite(ratio.low) else ratio.value) > WORSE


def impossible(clips: pd.DataFrame, difficulty: pd.DataFrame) -> pd.DataFrame:
    """Clips of which a tracker knows more than the images hold.

    Parameters
    ----------
    clips : DataFrame
        Columns `CLIP` of :mod:`echotruth.evaluation.resampling`, tracker and nrmse_percent.
    difficulty : DataFrame
        Columns `CLIP` and floor_crb_percent.

    Returns
    -------
    DataFrame
        Rows of the clips whose error is below `IMPOSSIBLE` times the Cramer-Rao bound.
    """
    known = clips.merge(difficulty[[*CLIP, "floor_crb_percent"]], on=list(CLIP), how="left")
    return known[known["nrmse_percent"] < IMPOSSIBLE * known["floor_crb_percent"]]


def split_gap(clips: pd.DataFrame) -> float:
    """Median error of a tracker over the test hearts, over that over the develop hearts; NaN if it lacks either.

    Parameters
    ----------
    clips : DataFrame
        Of one tracker and image size, both splits: columns heart, split, tracker and nrmse_all_percent.
    """
    medians = [by_heart(clips[clips["split"] == split], RANKED_BY).median() for split in (TEST, DEVELOP)]
    test, develop = (float(one.iloc[0]) if len(one) else np.nan for one in medians)
    return test / develop if develop > 0 else np.nan


def variants_of(suites: list[Suite], tracker: str, variant: str) -> pd.DataFrame | None:
    """Scores of a tracker on variants of the clips of repositories; None if it was not run on any.

    Parameters
    ----------
    suites : list of Suite
    tracker, variant : str
        As :func:`echotruth.benchmark.rerun.result_of` takes them.
    """
    import pandas as pd

    found = [(suite, result_of(suite.folder, tracker, variant)) for suite in suites]
    tables = [table.assign(repository=suite.name) for suite, table in found if table is not None and len(table)]
    return pd.concat(tables, ignore_index=True) if tables else None
