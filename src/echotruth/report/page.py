"""Page of a repository: one file with figures, playing clips, tables and provenance, which needs no network."""

from base64 import b64encode
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup
from matplotlib import colormaps
from matplotlib.colors import to_hex

from echotruth import files
from echotruth.cases import diagnosis
from echotruth.config import shipped
from echotruth.evaluation.leaderboard import best
from echotruth.report import account, board, style, volume
from echotruth.report.clips import clips
from echotruth.report.comparison import Comparison
from echotruth.report.hearts import MEASURES, subjects
from echotruth.repository import inferred
from echotruth.repository.choice import main_view
from echotruth.repository.reader import Repository
from echotruth.repository.version import report_version

HERE = Path(__file__).parent


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
    files.write(path, text.encode())
    return path


def _context(repository: Repository) -> dict[str, Any]:
    """All that the template sets in."""
    folder, config, cases, shown = repository.folder, repository.config, repository.cases, repository.shown
    case, view = shown[0] if shown else "", main_view(config)
    infers = bool(case and config.inference.tracker)
    standings = pd.read_csv(folder / "figures/leaderboard.csv") if case else None
    order = [name for name in best(standings) if name in repository.trackers] if standings is not None else []
    has_curves = case and not config.has_volumes
    comparison = Comparison(repository, repository.case(case), tuple(order)) if has_curves else None
    tracker = comparison.trackers[0] if comparison else next(iter(order), "")
    number = repository.trackers.index(tracker) if tracker else 0
    hearts = subjects(repository, view) if shown else []
    return {
        "config": config,
        "version": report_version(folder),
        "packages": repository.attributes("").get("packages", {}),
        "css": Markup(_colours(number) + (HERE / "page.css").read_text(encoding="utf-8")),
        "script": Markup((HERE / "player.js").read_text(encoding="utf-8")),
        "figure": lambda name: _address(folder / f"figures/{name}.svg"),
        "title": style.title,
        "diagnosis": diagnosis(config),
        "imaged": account.imaged(repository),
        "present": len(repository.present),
        "bytes": account.size_on_disk(folder / f"{config.name}.zarr"),
        "board": board.of(standings, config.image_sizes[0], len(shown)) if standings is not None else None,
        "shown": shown,
        "best": tracker,
        "main_view": view,
        "strain_limit": style.STRAIN_LIMIT,
        "opacity": style.OPACITY,
        "strain_colours": [to_hex(colour) for colour in colormaps[style.SIGNED](np.linspace(0, 1, 17))],
        "clips": clips(comparison) if comparison else volume.clips(repository, view) if case else None,
        "tally": {name: cases[name].value_counts().sort_index().to_dict() for name in ("status", "diagnosis")},
        "measures": list(MEASURES),
        "hearts": hearts,
        "volume": style.volume(max((one["volume"] for one in hearts), default=0.0)),
        "inferred": account.inference(repository, inferred.read(folder / inferred.FILE)) if infers else None,
        "failures": account.failures(repository),
        "stages": account.stages(folder),
        "configuration": (folder / "config.yaml").read_text(encoding="utf-8"),
        "paper": shipped.citation()["preferred-citation"],
    }


def _address(drawing: Path) -> str:
    """An SVG as an address that holds its data."""
    return "data:image/svg+xml;base64," + b64encode(drawing.read_bytes()).decode()


def _colours(tracker: int) -> str:
    """Colours of figures, and of the tracker with a number in the clips, as variables of a style sheet."""
    named = {"paper": style.PAPER, "ink": style.INK, "muted": style.MUTED, "grid": style.GRID, "failed": style.RADIAL}
    named |= {"motion": style.MOTION, "tracked": style.series_colour(tracker)}
    return ":root { " + " ".join(f"--{name}: {colour};" for name, colour in named.items()) + " }\n"
