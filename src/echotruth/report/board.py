"""Leaderboard as a table of the page."""

from typing import Any

import pandas as pd

from echotruth.config.imaging import ALL_VIEWS
from echotruth.evaluation.paired_ratios import LEAST_HEARTS


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
        `size`; `hearts`, their number; `known`, the columns of which a tracker has a value; `rows`, a dict of each
        tracker, the best first, which lacks what is not known; `interval`, what the intervals in the figure are; and
        `order`, what ranks say.
    """
    table = standings[(standings["view"] == ALL_VIEWS) & (standings["size_px"] == size)]
    table = table.sort_values("rank", kind="stable", na_position="last")
    hearts = int(table["hearts"].max())
    of_cases = f" of the {cases} cases" if hearts < cases else ""
    bootstrap = f"Bars are 95 % intervals of a bootstrap over the {hearts} hearts{of_cases}."
    order = "In brackets are possible ranks: of equal trackers, any are ordered in 5 % of tables at most."
    if hearts < LEAST_HEARTS:
        order = f"It takes {LEAST_HEARTS} hearts to tell trackers apart: so few order none."
    return {
        "size": size,
        "hearts": hearts,
        "known": list(table.dropna(axis="columns", how="all")),
        "rows": [row.dropna().to_dict() for _, row in table.iterrows()],
        "interval": "With a single heart there are no intervals." if hearts < 2 else bootstrap,
        "order": order,
    }
