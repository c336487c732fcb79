"""Trackers in their order: means over the hearts of a repository, with what other hearts would have made of them.

The order is that of `nrmse_all_percent`, in which a point without an estimate counts as one that stood still: a tracker
gains nothing by leaving out what is hard, and one that fails has 100 %. Where nothing is lost it is the NRMSE. Figures
that a tracker lacks on one clip it lacks in the mean, for that of its other clips would be better than it is.
Intervals are those of a bootstrap over hearts (Efron, Ann Stat 1979; 7:1): hearts are drawn with replacement, the same
for all trackers, and the middle 95 % of the means (and ranks) are told. One heart has no interval.
"""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

from echotruth.config import Config
from echotruth.config.imaging import ALL
from echotruth.evaluation.digest import digest
from echotruth.evaluation.scoring import row
from echotruth.repository import ledger
from echotruth.repository.ledger import record_path
from echotruth.repository.schema import EVALUATION
from echotruth.tracking.external_program import in_one_line

log = logging.getLogger("echotruth")

PLACE = ("case", "view", "size_px", "tracker")
"""Columns that name a row of :func:`rows`."""

ORDER = "nrmse_all_percent"
"""Figure by which trackers are ranked."""

DRAWS = 2000


def rows(tree: xr.DataTree, config: Config, complete: np.ndarray, folder: Path) -> pd.DataFrame:
    """Scores of every clip by every tracker, guests among them.

    Parameters
    ----------
    tree : DataTree
        The repository.
    config : Config
        What it was made from.
    complete : ndarray of int
        Rows of the hearts that count.
    folder : Path
        Of the repository; its ledger says which tracker failed, its folder `guests` holds the scores of guests.

    Returns
    -------
    DataFrame
        Columns `case`, `view`, `size_px`, `tracker`, those of :func:`echotruth.evaluation.scoring.row`, and `failure`:
        why a tracker gave no answer, or "".

    Raises
    ------
    ValueError
        If a table of a guest cannot be read or lacks a column.
    """
    own = pd.DataFrame([row for size in config.bmode.sizes for row in _own(tree, config, complete, folder, size)])
    visitors = [_guest(file, own.columns) for file in sorted((folder / "guests").glob("*.csv"))]
    hosts = set(own["tracker"])
    visitors = [table[~table["tracker"].isin(hosts) & _of(table, own)] for table in visitors]
    return pd.concat([own, *(table for table in visitors if len(table))], ignore_index=True)


def standings(rows: pd.DataFrame, seed: int) -> pd.DataFrame:
    """The leaderboard.

    Parameters
    ----------
    rows : DataFrame
        As of :func:`rows`.
    seed : int
        Of the draws.

    Returns
    -------
    DataFrame
        One row for every image size, view (`all`: the mean over the views of a heart) and tracker, the best first:
        `rank` (those alike share one; NaN for a tracker that was not tried on every heart and view), `hearts` and
        `failures` (number of clips), the mean over the hearts of every figure, NaN where the tracker failed on a clip
        or lacks what another has there, and `_low` and `_high` of the rank, of `nrmse_all_percent` and of the strains'
        RMS: the bootstrap's interval, NaN with a single heart and where there is no mean.
    """
    cases, views = (list(dict.fromkeys(rows[name])) for name in ("case", "view"))
    draws = np.random.default_rng(seed).integers(len(cases), size=(DRAWS, len(cases)))
    tables = []
    for size in dict.fromkeys(rows["size_px"]):
        of_size = rows[rows["size_px"] == size]
        for view in (ALL, *views):
            clips = of_size if view == ALL else of_size[of_size["view"] == view]
            asked = len(views) if view == ALL else 1
            tables.append(_table(clips, cases, asked, draws).assign(size_px=size, view=view))
    table = pd.concat(tables, ignore_index=True)
    figures = [name for name in rows if name not in (*PLACE, "failure", ORDER)]
    first = ("size_px", "view", "tracker", "hearts", "failures")
    ordered = [f"{name}{end}" for name in ("rank", ORDER, *figures) for end in ("", "_low", "_high")]
    return table[[*first, *(name for name in ordered if name in table)]]


def best(standings: pd.DataFrame) -> list[str]:
    """Trackers from the best to the worst: at the largest image size, over all views.

    Those without a rank come last.
    """
    table = standings[(standings["view"] == ALL) & (standings["size_px"] == standings["size_px"].max())]
    return list(table.sort_values("rank", kind="stable", na_position="last")["tracker"])


def interval(values: np.ndarray, draws: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Interval of the mean over hearts.

    Parameters
    ----------
    values : ndarray of shape (heart, k)
        Any unit.
    draws : ndarray of shape (draw, heart), integer
        Numbers of the hearts drawn.

    Returns
    -------
    low, high : ndarray of shape (k,)
        2.5th and 97.5th percentile; NaN with a single heart.
    """
    return _middle(values[draws].mean(1), len(values))


def ranks(values: np.ndarray) -> np.ndarray:
    """Rank along the last axis, 1 for the smallest; those alike share the better one, NaN has none."""
    better = (values[..., None, :] < values[..., :, None]).sum(-1)
    return np.where(np.isfinite(values), 1.0 + better, np.nan)


def _middle(drawn: np.ndarray, hearts: int) -> tuple[np.ndarray, np.ndarray]:
    if hearts < 2:
        return np.full(drawn.shape[1], np.nan), np.full(drawn.shape[1], np.nan)
    low, high = np.quantile(drawn, (0.025, 0.975), axis=0, method="inverted_cdf")
    return low, high


def _table(clips: pd.DataFrame, cases: list[str], asked: int, draws: np.ndarray) -> pd.DataFrame:
    """Rows of one image size and view; `asked` is the number of clips that a heart has."""
    figures = [name for name in clips if name not in (*PLACE, "failure")]
    tried = clips.groupby(["tracker", "case"], sort=False).size() == asked
    # A mean over views that are not all there would be one of other clips than those of the others.
    means = _by_heart(clips, figures)[tried]
    trackers = list(dict.fromkeys(clips["tracker"]))
    table = pd.DataFrame({"tracker": trackers}).set_index("tracker")
    table["hearts"] = tried.groupby("tracker").sum()
    table["failures"] = (clips["failure"] != "").groupby(clips["tracker"]).sum()
    for name in (ORDER, "ecc_rms_points", "ell_rms_points", "err_rms_points"):
        values = means[name].unstack("case").reindex(index=trackers, columns=cases).to_numpy().T
        if name == ORDER:
            table["rank"] = ranks(values.mean(0))
            table["rank_low"], table["rank_high"] = _middle(ranks(values[draws].mean(1)), len(cases))
        table[f"{name}_low"], table[f"{name}_high"] = interval(values, draws)
    by_tracker = means.groupby("tracker", sort=False)
    whole = by_tracker.count().eq(by_tracker.size(), axis=0)
    table = table.join(by_tracker.mean().where(whole))
    return table.sort_values("rank", kind="stable", na_position="last").reset_index()


def _by_heart(clips: pd.DataFrame, figures: list[str]) -> pd.DataFrame:
    """Means over the views of each heart, a row a tracker and case; NaN where a clip lacks what it could have.

    Views that show a figure to no tracker, as the short axis E_LL, are left out.
    """
    lacking, failed = clips[figures].isna(), (clips["failure"] != "").to_numpy()[:, None]
    shown = (~lacking).groupby([clips["case"], clips["view"]]).transform("any")
    heart = [clips["tracker"], clips["case"]]
    lost = (lacking & (shown | failed)).groupby(heart, sort=False).any()
    return clips[figures].groupby(heart, sort=False).mean().mask(lost)


def _own(tree: xr.DataTree, config: Config, complete: np.ndarray, folder: Path, size: int) -> list[dict]:
    """Rows of the repository's own trackers at one image size."""
    data = tree[f"evaluation/{size}"].to_dataset().isel(case=complete)
    names = [array.name for array in EVALUATION if "tracker" in array.dims and "frame" not in array.dims]
    values = {name: data[name].values for name in names}
    found = []
    for case, view in np.ndindex(len(complete), len(config.views)):
        place = str(data.case.values[case]), list(config.views)[view]
        failures = _failures(folder, *place)
        for k, tracker in enumerate(config.tracking.trackers):
            score = {name: value[case, view, k] for name, value in values.items()}
            named = dict(zip(PLACE, (*place, size, tracker), strict=True))
            why = failures.get(f"{tracker}/{size}", "")
            found.append(named | row(score, config.views[place[1]].plane) | {"failure": why})
    return found


def _failures(folder: Path, case: str, view: str) -> dict[str, str]:
    """Why trackers failed on a clip, by `tracker/size`."""
    path = record_path(folder, "tracking", case, view)
    return ledger.read(path).get("failures", {}) if path.is_file() else {}


def _guest(file: Path, columns: pd.Index) -> pd.DataFrame:
    """Scores of a guest on the clips as they are today, under the name of its file."""
    texts = ("case", "view", "tracker", "failure", "clip")
    kinds = {name: str if name in texts else float for name in (*columns, "clip")} | {"size_px": int}
    try:
        # Only what is empty is missing: a view may well be called null.
        numbers = {name: "" for name, kind in kinds.items() if kind is float}
        table = pd.read_csv(file, dtype=kinds, keep_default_na=False, na_values=numbers)
    except (ValueError, OSError) as error:
        raise ValueError(f"{file}: cannot be read ({in_one_line(str(error))}): evaluate that tracker again") from error
    missing = [name for name in columns if name not in table]
    if missing:
        raise ValueError(f"{file}: has no column {missing[0]}: evaluate that tracker again")
    return _of_today(table.assign(tracker=file.stem), file)[list(columns)]


def _of_today(table: pd.DataFrame, file: Path) -> pd.DataFrame:
    """Rows of clips that are still what they were when they were scored."""
    clips = zip(table["case"], table["view"], table.get("clip", [""] * len(table)), strict=True)
    same = np.array([clip == digest(file.parents[1], case, view) for case, view, clip in clips], bool)
    if not same.all():
        older = f"{(~same).sum()} of {len(same)} rows are of older images"
        log.warning("guests/%s: %s: evaluate that tracker again", file.name, older)
    return table[same]


def _of(table: pd.DataFrame, own: pd.DataFrame) -> np.ndarray:
    """Which rows are of a clip that the repository has."""
    clips = pd.MultiIndex.from_frame(own[["case", "view", "size_px"]].drop_duplicates())
    return pd.MultiIndex.from_frame(table[["case", "view", "size_px"]]).isin(clips)
