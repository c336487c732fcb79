"""Page of a repository: one file with figures, playing clips, tables and provenance, which needs no network."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from echotruth.cases import find_case
from echotruth.config import Config
from echotruth.evaluation import kept
from echotruth.evaluation.leaderboard import best
from echotruth.report import account, board, style, vector
from echotruth.report.clips import STRAIN_LIMIT, clips
from echotruth.report.comparison import Comparison
from echotruth.report.figures import main_view, shown_hearts
from echotruth.report.hearts import MEASURES, SHOWN, diagnoses, statuses, subjects
from echotruth.repository import durable
from echotruth.repository.description.citation import PAPER

HERE = Path(__file__).parent

CONTENTS = {
    "made": "What was made",
    "trackers": "Ranking of the trackers",
    "clip": "A clip with its truth",
    "hearts": "Hearts at a glance",
    "heart": "The heart that is shown",
    "strain": "Strain, tracked against true",
    "failures": "What failed",
    "provenance": "Provenance",
    "use": "How to open it",
    "cite": "How to cite",
}
"""Sections of the page: id -> title."""

OF_A_HEART = ("trackers", "clip", "heart", "strain")
"""Sections that need a complete heart."""


def write(folder: Path, config: Config) -> Path:
    """Write the page of a repository whose figures are drawn.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.
    config : Config
        Of the repository.

    Returns
    -------
    Path
        `report.html` in that folder. The same repository gives the same bytes.
    """
    tree = xr.open_datatree(folder / f"{config.name}.zarr", engine="zarr")
    shown = shown_hearts(tree, config)
    environment = Environment(
        loader=FileSystemLoader(HERE), autoescape=True, undefined=StrictUndefined, keep_trailing_newline=True
    )
    text = environment.get_template("page.html.jinja").render(_context(tree, folder, config, shown))
    path = folder / "report.html"
    durable.write(path, text.encode())
    return path


def _context(tree: xr.DataTree, folder: Path, config: Config, shown: np.ndarray) -> dict[str, Any]:
    """All that the template sets in."""
    version = str(tree.attrs.get("packages", {}).get("echotruth", ""))
    case = str(tree["cases"].to_dataset()["case"].values[shown[0]]) if len(shown) else ""
    standings = pd.read_csv(folder / "figures/leaderboard.csv") if case else None
    stored = kept.trackers(folder, config)
    order = [name for name in best(standings) if name in stored] if standings is not None else []
    comparison = Comparison(folder, find_case(config, case), tuple(order)) if case else None
    leader = comparison.trackers[0] if comparison else ""
    return {
        "name": config.name,
        "version": version,
        "lead": account.lead(config),
        "contents": [(id, title) for id, title in CONTENTS.items() if case or id not in OF_A_HEART],
        "css": Markup((HERE / "page.css").read_text(encoding="utf-8")),
        "script": Markup((HERE / "player.js").read_text(encoding="utf-8")),
        "figure": lambda name, title: Markup(vector.inline(folder / f"figures/{name}.svg", title)),
        "numbers": account.numbers(tree, folder, config),
        "facts": account.facts(config),
        "board": board.of(standings, config.bmode.sizes[0], len(shown)) if standings is not None else None,
        "shown": case,
        "best": leader,
        "views": [(view, style.title(view)) for view in config.views],
        "main_view": main_view(config),
        "segment_view": style.title(main_view(config)).lower(),
        "strain_limit": STRAIN_LIMIT,
        "clips": _json(clips(tree, comparison)) if comparison else "",
        "hearts": _hearts(tree, config, shown),
        "failures": account.failures(tree, folder, config),
        "provenance": account.provenance(tree, config),
        "stages": account.stages(folder),
        "configuration": (folder / "config.yaml").read_text(encoding="utf-8"),
        "opening": account.opening(config, case or "heart", main_view(config), leader),
        "paper": _reference(),
        "bibtex": _bibtex(version),
    }


def _json(values: dict[str, Any]) -> Markup:
    """JSON that may stand in a page: no text in it ends the element that holds it."""
    return Markup(json.dumps(values, separators=(",", ":"), sort_keys=True, allow_nan=False).replace("<", "\\u003c"))


def _hearts(tree: xr.DataTree, config: Config, shown: np.ndarray) -> dict[str, Any]:
    rows = subjects(tree, shown, main_view(config), config.bmode.sizes[-1]) if len(shown) else []
    count = int(tree["cases"].sizes["case"])
    sentence = f"{account.counted(count, 'heart', 'hearts')}: {_tally(statuses(tree))}."
    if count > 1:
        sentence += f" Diagnoses: {_tally(diagnoses(tree))}.".replace("_", " ")
    if len(shown) > len(rows):
        sentence += f" {SHOWN} of those that were imaged are listed, evenly chosen; cases.csv has all."
    return {"sentence": sentence, "rows": rows, "measures": list(MEASURES), "many": len(shown) > 1}


def _tally(words: np.ndarray) -> str:
    """Different words, each after the number of times that it occurs."""
    found = zip(*np.unique(words, return_counts=True), strict=True)
    return ", ".join(f"{account.spaced(number)} {word}" for word, number in found)


def _reference() -> str:
    """The paper in one sentence."""
    names = ", ".join(f"{one['family-names']} {one['given-names'][0]}" for one in PAPER["authors"])  # type: ignore[index]
    return f"{names}. {PAPER['title']}."


def _bibtex(version: str) -> str:
    people = " and ".join(
        f"{one['family-names']}, {one['given-names']}"  # type: ignore[index]
        for one in PAPER["authors"]
    )
    number = f"\n  version = {{{version}}}," if version else ""
    return (
        f"@software{{echotruth,\n  title = {{echotruth}},\n  author = {{{{The echotruth developers}}}},{number}\n}}\n\n"
        f"@inproceedings{{mukherjee_synthetic,\n  title = {{{PAPER['title']}}},\n  author = {{{people}}},\n}}"
    )
