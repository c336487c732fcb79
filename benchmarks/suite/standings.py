"""Trackers by condition: medians over the hearts with intervals, differences to the first, and ranges of ranks."""

from __future__ import annotations

import numpy as np
import pandas as pd

from echotruth.evaluation.leaderboard import RANKED_BY
from echotruth.evaluation.resampling import CLIP

from .comparison import bland_altman, by_heart, standing
from .conditions import PLAIN, groups, main_conditions, variations
from .detection import detection

METRICS = {
    RANKED_BY: False,
    "delta_avg_percent": True,
    "average_jaccard_percent": True,
    "median_trajectory_error_px256": False,
    "survival_8px_percent": True,
    "flow_epe_px256": False,
    "flow_angular_error_deg": False,
    "gls_error_pp": False,
    "gcs_error_pp": False,
    "segment_peak_error_pp": False,
    "segment_time_to_peak_error_ms": False,
    "segment_strain_rate_error_per_s": False,
    "drift_um": False,
    "coverage_percent": True,
}
"""Column of the clips -> whether more of it is better."""

FEW = (RANKED_BY, "delta_avg_percent", "average_jaccard_percent")
"""Metrics by group."""

STRAINS = ("gls", "gcs")
"""Strains of the heart whose agreement is shown."""


def standings(clips: pd.DataFrame) -> pd.DataFrame:
    """Standing of every tracker in every condition, at every image size, by every metric.

    Parameters
    ----------
    clips : DataFrame
        Of one split, as `records.Records` holds them.

    Returns
    -------
    DataFrame
        Columns condition, is_main (whether it is one of disease and acoustics), size_px, metric, tracker, and those of
        :func:`.comparison.standing`; the best tracker of each first.
    """
    conditions = [(name, True, part) for name, part in main_conditions(clips).items()]
    conditions += [(name, False, part) for name, part in groups(clips).items()]
    tables = []
    for condition, is_main, part in conditions:
        for size in sorted(part["size_px"].unique(), reverse=True):
            of_size = part[part["size_px"] == size]
            for metric, descending in METRICS.items():
                if not (is_main or metric in FEW) or not of_size[metric].notna().any():
                    continue
                table = standing(by_heart(of_size, metric), descending=descending)
                keys = {"condition": condition, "is_main": is_main, "size_px": size, "metric": metric}
                tables.append(table.rename_axis("tracker").reset_index().assign(**keys))
    found = pd.concat(tables, ignore_index=True)
    first = ["condition", "is_main", "size_px", "metric", "tracker"]
    return found[[*first, *(name for name in found if name not in first)]]


def main_errors(standings: pd.DataFrame) -> pd.DataFrame:
    """Rows of the main conditions with the metric by which trackers are ranked."""
    return standings[standings["is_main"] & (standings["metric"] == RANKED_BY)]


def shown_size(table: pd.DataFrame, largest: int) -> int:
    """Image size of a table by which trackers are ranked, px: a given one, or the largest where it has not that."""
    sizes = set(table["size_px"])
    return largest if largest in sizes else int(max(sizes))


def order(standings: pd.DataFrame, largest: int | None = None) -> list[str]:
    """Trackers by the mean of their medians over the main conditions at one size, the best first.

    A tracker without a median in a condition stands behind those that have one in all of them.

    Parameters
    ----------
    standings : DataFrame
        As :func:`standings` returns them.
    largest : int, optional
        Image size, px; conditions that do not have it do not count. Default: the largest.
    """
    main = main_errors(standings)
    table = main[main["size_px"] == (main["size_px"].max() if largest is None else largest)]
    # A tracker from outside may have been evaluated at smaller sizes only.
    medians = table.pivot(index="tracker", columns="condition", values="value").reindex(main["tracker"].unique())
    medians = medians.rename_axis("tracker")
    means = medians.mean(axis=1, skipna=False)
    keys = means.to_frame("mean").assign(partial=medians.mean(axis=1)).reset_index()
    return list(keys.sort_values(["mean", "partial", "tracker"], na_position="last", kind="stable")["tracker"])


def varied(clips: pd.DataFrame) -> pd.DataFrame:
    """Errors under a variation beside those of the same hearts without it.

    Parameters
    ----------
    clips : DataFrame
        As :func:`standings` takes them.

    Returns
    -------
    DataFrame
        Columns variation, size_px, tracker, hearts, `varied` and `plain` (medians over the hearts), %.
    """
    rows = []
    for name, parts in variations(clips).items():
        for size in sorted(parts[0]["size_px"].unique(), reverse=True):
            errors, before = (by_heart(part[part["size_px"] == size], RANKED_BY) for part in parts)
            for tracker in errors:
                keys = {"variation": name, "size_px": size, "tracker": tracker, "hearts": len(errors)}
                plain = before[tracker].median(skipna=False) if tracker in before else float("nan")
                rows.append(keys | {"varied": errors[tracker].median(skipna=False), "plain": plain})
    return pd.DataFrame(rows)


def agreement(clips: pd.DataFrame) -> pd.DataFrame:
    """Bias and limits of agreement of GLS and GCS over the hearts, by acoustics and image size.

    Parameters
    ----------
    clips : DataFrame
        As :func:`standings` takes them; clips of a variation are left out.

    Returns
    -------
    DataFrame
        Columns acoustics, size_px, tracker, strain (gls or gcs) and those of
        :func:`.comparison.bland_altman`, percentage points; and of_hearts, the number of hearts of
        which the true strain is known.
    """
    columns = ["acoustics", "size_px", "tracker", "strain", *bland_altman(np.empty(0), np.empty(0)), "of_hearts"]
    rows = []
    plain = clips[clips["variation"].isin(PLAIN)]
    for (acoustics, size), part in plain.groupby(["acoustics", "size_px"], sort=True):
        for strain in STRAINS:
            # A clip of another plane has nothing to say of this strain, also if its tracker failed.
            shown = part[part[f"true_{strain}_percent"].notna()]
            if shown.empty:
                continue
            clip = [name for name in CLIP if name in shown]
            truth = shown.drop_duplicates(clip).groupby("heart")[f"true_{strain}_percent"].mean()
            tracked = by_heart(shown, f"tracked_{strain}_percent")
            for tracker in tracked:
                pair = tracked[tracker], truth.reindex(tracked.index)
                found = bland_altman(*(values.to_numpy(float) for values in pair))
                keys = {"acoustics": acoustics, "size_px": size, "tracker": tracker, "strain": strain}
                rows.append(keys | found | {"of_hearts": len(truth)})
    return pd.DataFrame(rows, columns=columns)


def detections(segments: pd.DataFrame) -> pd.DataFrame:
    """How well infarcted segments are told by their tracked peak strain, by acoustics, size and tracker.

    Parameters
    ----------
    segments : DataFrame
        As `records.Records` holds them; those of a variation are left out.

    Returns
    -------
    DataFrame
        Columns acoustics and those of :func:`.detection.detection`, of both components together;
        empty if no segment is infarcted.
    """
    tables = []
    for acoustics, part in segments[segments["variation"].isin(PLAIN)].groupby("acoustics", sort=True):
        if (part["infarct_share"] > 0).any():
            table = detection(part)
            tables.append(table[table["component"] == "all"].assign(acoustics=acoustics))
    return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame({"acoustics": []})
