"""Leaderboard as a table of the page."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from echotruth.config.imaging import ALL_VIEWS

COLUMNS = {
    "nrmse_all_percent": ("NRMSE of displacement (%)", 1),
    "gcs_error_pp": ("GCS error", 1),
    "gls_error_pp": ("GLS error", 1),
    "e_cc_rms_pp": ("RMS error, circumf.", 1),
    "e_ll_rms_pp": ("RMS error, longitud.", 1),
    "e_rr_rms_pp": ("RMS error, radial", 1),
    "time_to_peak_error_ms": ("Time to peak error (ms)", 0),
    "rotation_error_deg": ("Rotation error (deg)", 1),
    "coverage_percent": ("Tissue tracked (%)", 0),
}
"""Metric -> heading and decimals; a metric that no tracker has is left out."""


@dataclass(frozen=True)
class Column:
    """Column of the table: name of the metric, and heading."""

    name: str
    label: str


@dataclass(frozen=True)
class Row:
    """One tracker: its rank, its metrics in words, and the number of clips on which it failed."""

    rank: str
    tracker: str
    cells: list[str]
    failures: int


@dataclass(frozen=True)
class Board:
    """The table.

    Attributes
    ----------
    size : int
        Of the images, px.
    columns : list of Column
    rows : list of Row
        The best tracker first.
    sentence : str
        Who is first.
    interval : str
        What the intervals in the figure are.
    """

    size: int
    columns: list[Column]
    rows: list[Row]
    sentence: str
    interval: str


def of(standings: pd.DataFrame, size: int, cases: int) -> Board:
    """The table at one image size, over all views.

    Parameters
    ----------
    standings : DataFrame
        As :func:`echotruth.evaluation.leaderboard.standings` returns it.
    size : int
        px.
    cases : int
        Their number; several may be of one heart.

    Returns
    -------
    Board
    """
    table = standings[(standings["view"] == ALL_VIEWS) & (standings["size_px"] == size)]
    table = table.sort_values("rank", kind="stable", na_position="last")
    metrics = [name for name in COLUMNS if name in table and table[name].notna().any()]
    rows = [
        Row(
            _rank(entry),
            str(entry["tracker"]),
            [_cell(entry, name) for name in metrics],
            int(entry["failures"]),
        )
        for entry in table.to_dict("records")
    ]
    hearts = int(table["hearts"].max())
    of_cases = f" (label.heart) of the {cases} cases" if hearts < cases else ""
    interval = (
        "With a single heart there are no intervals."
        if hearts < 2
        else f"Bars are 95 % intervals of a bootstrap over the {hearts} hearts{of_cases}."
    )
    return Board(size, [Column(name, COLUMNS[name][0]) for name in metrics], rows, _sentence(table, hearts), interval)


def _rank(entry: dict) -> str:
    if not np.isfinite(entry["rank"]):
        return "–"
    low, high = entry.get("rank_low", np.nan), entry.get("rank_high", np.nan)
    return f"{entry['rank']:.0f}" + (f" ({low:.0f}–{high:.0f})" if np.isfinite(low) and low != high else "")


def _cell(entry: dict, name: str) -> str:
    value, decimals = entry[name], COLUMNS[name][1]
    if not np.isfinite(value):
        return "–"
    text = f"{value:.{decimals}f}"
    low, high = entry.get(f"{name}_low", np.nan), entry.get(f"{name}_high", np.nan)
    if name == "nrmse_all_percent" and np.isfinite(low):
        text += f" ({low:.{decimals}f}–{high:.{decimals}f})"
    return text.replace("-", "−")


def _sentence(table: pd.DataFrame, hearts: int) -> str:
    ranked = table[table["rank"].notna()]
    if ranked.empty:
        return "No tracker has a result on every clip, so that none has a rank."
    first = ranked.iloc[0]
    text = f"{first['tracker']} is first with an error of {first['nrmse_all_percent']:.1f} % of the true displacement"
    if len(ranked) > 1:
        second = ranked.iloc[1]
        text += f", before {second['tracker']} with {second['nrmse_all_percent']:.1f} %"
    return f"{text} (mean of {hearts} {'heart' if hearts == 1 else 'hearts'})."
