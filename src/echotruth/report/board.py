"""Leaderboard as a table of the page."""

from __future__ import annotations

from typing import Any

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


def of(standings: pd.DataFrame, size: int, cases: int) -> dict[str, Any]:
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
    dict
        `size`; `columns`, name and heading of each metric; `rows`, the best tracker first; `sentence`, who is first;
        `interval`, what the intervals in the figure are.
    """
    table = standings[(standings["view"] == ALL_VIEWS) & (standings["size_px"] == size)]
    table = table.sort_values("rank", kind="stable", na_position="last")
    metrics = [name for name in COLUMNS if name in table and table[name].notna().any()]
    hearts = int(table["hearts"].max())
    of_cases = f" (label.heart) of the {cases} cases" if hearts < cases else ""
    bootstrap = f"Bars are 95 % intervals of a bootstrap over the {hearts} hearts{of_cases}."
    return {
        "size": size,
        "columns": [{"name": name, "label": COLUMNS[name][0]} for name in metrics],
        "rows": [_row(entry, metrics) for entry in table.to_dict("records")],
        "sentence": _sentence(table, hearts),
        "interval": "With a single heart there are no intervals." if hearts < 2 else bootstrap,
    }


def _row(entry: dict, metrics: list[str]) -> dict[str, Any]:
    """One tracker: its rank, its metrics in words, and the number of clips on which it failed."""
    cells = [_cell(entry, name) for name in metrics]
    return {"rank": _rank(entry), "tracker": entry["tracker"], "cells": cells, "failures": int(entry["failures"])}


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
