"""What speaks against a submission: worse results on mirrored clips, an impossible accuracy, an easier test half.

None of them proves anything; each asks for an explanation.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd

from echotruth.evaluation.leaderboard import RANKED_BY
from echotruth.evaluation.resampling import CLIP, draws, interval

from .comparison import by_heart
from .records import Records, Suite
from .results import Result, result_of
from .splits import DEVELOP, TEST

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
    part : str
        Of which clips it is, as "24 of 72 clips (512 px)"; empty if it is of all.
    """

    value: float
    low: float
    high: float
    hearts: int
    part: str


class Verdict(NamedTuple):
    """What was found of one tracker.

    Attributes
    ----------
    tracker : str
    mirrored : Ratio or None
        Error on mirrored clips over that on the clips; None if it was not run on them.
    older : int
        Number of results on mirrored clips that do not count, because clips or settings have changed since.
    impossible, clips : int
        Number of clips with an impossible accuracy, and of all.
    gap : float
        Median error on the test half over that on the other, of the main species at the largest size that its
        repositories have in common; NaN if it lacks either.
    """

    tracker: str
    mirrored: Ratio | None
    older: int
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
    def words(self) -> str:
        """What was found, and what was not looked at."""
        found = "; ".join(self.flags) or "nothing found"
        if self.mirrored is None:
            found += ", not run on mirrored clips"
        elif self.mirrored.part:
            found += f", run on mirrored ones of {self.mirrored.part}"
        if self.older:
            found += f"; {self.older} older results on mirrored clips do not count: check it again"
        return found

    @property
    def text(self) -> str:
        """The verdict in one line."""
        parts = [f"{self.impossible} of {self.clips} clips of an impossible accuracy"]
        if self.mirrored is not None:
            value, low, high, hearts, _ = self.mirrored
            between = f", 95 % interval {low:.2f} to {high:.2f}" if hearts > 1 else ""
            counted = f"{hearts} heart{'s' * (hearts > 1)}{between}"
            parts.insert(0, f"error on mirrored clips {value:.2f} times that on the clips ({counted})")
        if np.isfinite(self.gap):
            parts.append(f"test / develop {self.gap:.2f}")
        return f"{self.tracker}: {self.words} ({'; '.join(parts)})"


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
    ratio = paired_ratio(clips, again.rows)
    known_of = impossible(clips, records.difficulty)
    largest, main = records.of_split(split).of_main_species().largest, records.of_main_species().clips
    gap = split_gap(main[(main["tracker"] == tracker) & (main["size_px"] == largest)])
    return Verdict(tracker, ratio, again.older, len(known_of), len(clips), gap)


def paired_ratio(clips: pd.DataFrame, again: pd.DataFrame) -> Ratio | None:
    """Errors of a tracker on variants of clips over those on the clips themselves.

    Parameters
    ----------
    clips : DataFrame
        Clips that count: columns `CLIP` of :mod:`echotruth.evaluation.resampling`, and heart.
    again : DataFrame
        Rows as :func:`variants_of` returns them.

    Returns
    -------
    Ratio or None
        None if they have no clip in common.
    """
    both = clips[[*CLIP, "heart"]].merge(again, on=list(CLIP))
    if both.empty:
        return None
    errors = both[["before_percent", "error_percent"]].to_numpy(float)
    both = both.assign(logarithm=np.diff(np.log(np.maximum(errors, SMALLEST)), axis=1)[:, 0])
    means = both[np.isfinite(both["logarithm"])].groupby("heart")["logarithm"].mean().to_numpy()
    if not (hearts := len(means)):
        return None
    low, high = np.exp(interval(means[:, None], draws(hearts, 1)))[:, 0]
    return Ratio(float(np.exp(means.mean())), float(low), float(high), hearts, _part(clips, both))


def _part(clips: pd.DataFrame, some: pd.DataFrame) -> str:
    """Which of the clips some of them are; empty if they are all."""
    if len(some) == len(clips):
        return ""
    sizes, known = (sorted(set(table["size_px"]), reverse=True) for table in (some, clips))
    listed = "" if sizes == known else f" ({' and '.join(map(str, sizes))} px)"
    return f"{len(some)} of {len(clips)} clips{listed}"


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


def variants_of(suites: list[Suite], tracker: str, variant: str) -> Result:
    """Scores of a tracker on variants of the clips of repositories.

    Parameters
    ----------
    suites : list of Suite
    tracker, variant : str
        As `results.result_of` takes them.

    Returns
    -------
    Result
        Of all repositories, with the column `repository`.
    """
    found = [result_of(suite.repository, tracker, variant) for suite in suites]
    tables = [result.rows.assign(repository=suite.name) for suite, result in zip(suites, found, strict=True)]
    filled = [table for table in tables if len(table)] or tables[:1]
    return Result(pd.concat(filled, ignore_index=True), sum(result.older for result in found))
