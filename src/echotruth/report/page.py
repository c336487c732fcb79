"""Page of a repository: one file with figures, playing clips, tables and provenance, which needs no network."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from echotruth.evaluation.leaderboard import best
from echotruth.report import account, board, style, vector
from echotruth.report.clips import STRAIN_LIMIT, clips
from echotruth.report.comparison import Comparison
from echotruth.report.hearts import MEASURES, SHOWN, subjects
from echotruth.repository import durable
from echotruth.repository.choice import main_view
from echotruth.repository.description.citation import PAPER
from echotruth.repository.reader import Repository

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


def write(repository: Repository) -> Path:
    """Write the page of a repository whose figures are drawn.

    Parameters
    ----------
    repository : Repository

    Returns
    -------
    Path
        `report.html` in that folder. The same repository gives the same bytes.
    """
    environment = Environment(
        loader=FileSystemLoader(HERE), autoescape=True, undefined=StrictUndefined, keep_trailing_newline=True
    )
    text = environment.get_template("page.html.jinja").render(_context(repository))
    path = repository.folder / "report.html"
    durable.write(path, text.encode())
    return path


def _context(repository: Repository) -> dict[str, Any]:
    """All that the template sets in."""
    folder, config, shown = repository.folder, repository.config, repository.shown
    packages = repository.attributes("").get("packages", {})
    case = shown[0] if shown else ""
    standings = pd.read_csv(folder / "figures/leaderboard.csv") if case else None
    order = [name for name in best(standings) if name in repository.trackers] if standings is not None else []
    comparison = Comparison(repository, repository.case(case), tuple(order)) if case else None
    leader = comparison.trackers[0] if comparison else ""
    return {
        "name": config.name,
        "version": str(packages.get("echotruth", "")),
        "lead": account.lead(config),
        "contents": [(id, title) for id, title in CONTENTS.items() if case or id not in OF_A_HEART],
        "css": Markup((HERE / "page.css").read_text(encoding="utf-8")),
        "script": Markup((HERE / "player.js").read_text(encoding="utf-8")),
        "figure": lambda name, title: Markup(vector.inline(folder / f"figures/{name}.svg", title)),
        "numbers": account.numbers(repository),
        "facts": account.facts(config),
        "board": board.of(standings, config.bmode.sizes[0], len(shown)) if standings is not None else None,
        "shown": case,
        "best": leader,
        "views": [(view, style.title(view)) for view in config.views],
        "main_view": main_view(config),
        "segment_view": style.title(main_view(config)).lower(),
        "strain_limit": STRAIN_LIMIT,
        "clips": _json(clips(comparison)) if comparison else "",
        "hearts": _hearts(repository),
        "failures": account.failures(repository),
        "provenance": account.provenance(packages, config),
        "stages": account.stages(folder),
        "configuration": (folder / "config.yaml").read_text(encoding="utf-8"),
        "opening": account.opening(config, case or "heart", main_view(config), leader),
        "paper": _reference(),
        "bibtex": _bibtex(str(packages.get("echotruth", ""))),
    }


def _json(values: dict[str, Any]) -> Markup:
    """JSON that may stand in a page: no text in it ends the element that holds it."""
    return Markup(json.dumps(values, separators=(",", ":"), sort_keys=True, allow_nan=False).replace("<", "\\u003c"))


def _hearts(repository: Repository) -> dict[str, Any]:
    config, cases, shown = repository.config, repository.cases, repository.shown
    rows = subjects(repository, main_view(config), config.bmode.sizes[-1]) if shown else []
    sentence = f"{account.counted(len(cases), 'heart', 'hearts')}: {_tally(cases['status'])}."
    if len(cases) > 1:
        sentence += f" Diagnoses: {_tally(cases['diagnosis'])}.".replace("_", " ")
    if len(shown) > len(rows):
        sentence += f" {SHOWN} of those that were imaged are listed, evenly chosen; cases.csv has all."
    return {"sentence": sentence, "rows": rows, "measures": list(MEASURES), "many": len(shown) > 1}


def _tally(words: pd.Series) -> str:
    """Different words, each after the number of times that it occurs."""
    found = zip(*np.unique(words.astype(str), return_counts=True), strict=True)
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
