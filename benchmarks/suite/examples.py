"""Best, median and worst clip of a tracker: the image at end-systole, the points it followed, and where they are."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize

from echotruth.arrays import Floats
from echotruth.evaluation.leaderboard import RANKED_BY
from echotruth.report import style
from echotruth.report.clip import round_length, thin
from echotruth.repository import estimates
from echotruth.repository.reader import Repository
from echotruth.tracking.point_grid import grid_points

DISTANCE = 18
"""Least distance of the points that are drawn, px of the largest image."""

SCALE = Normalize(0, 30)
"""Error that the colours of the points span, % of the RMS displacement."""

COLOURS = matplotlib.colormaps["plasma"]


@dataclass(frozen=True)
class Example:
    """One clip at end-systole.

    Attributes
    ----------
    title : str
    image : ndarray of shape (axial, lateral), uint8
    spacing : float
        Distance of pixel centres, m.
    tracked, true : ndarray of shape (point, 2)
        Position: lateral, axial, px; tracked NaN where unknown.
    error : ndarray of shape (point,)
        Distance of the two, % of the RMS true displacement.
    """

    title: str
    image: np.ndarray
    spacing: float
    tracked: Floats
    true: Floats
    error: Floats


def chosen(clips: pd.DataFrame) -> dict[str, pd.Series]:
    """Best, median and worst clip of a tracker, of those of one size, by `nrmse_all_percent`.

    Parameters
    ----------
    clips : DataFrame
        Rows of one tracker.

    Returns
    -------
    dict of Series
        "best", "median" and "worst" to a row; of one clip alone "best" only, of two "best" and "worst".
    """
    ranked = clips.sort_values([RANKED_BY, "case", "view"], kind="stable")
    places = {"best": 0, "median": (len(ranked) - 1) // 2, "worst": len(ranked) - 1}
    found: dict[int, str] = {}
    for name in ("best", "worst", "median"):
        found.setdefault(places[name], name)
    return {name: ranked.iloc[place] for place, name in sorted(found.items())}


def example(repository: Repository, clip: pd.Series, what: str) -> Example:
    """Read a clip at end-systole.

    Parameters
    ----------
    repository : Repository
    clip : Series
        Columns case, view, size_px, tracker and nrmse_all_percent.
    what : str
        Word for it: best, median or worst.

    Returns
    -------
    Example
    """
    case, view, size = str(clip["case"]), str(clip["view"]), int(clip["size_px"])
    config, es = repository.case(case).config, int(repository.read("mechanics/es_frame", case))
    tracked = estimates.tracked(repository, case, view, str(clip["tracker"]), size, "displacement")["displacement"][es]
    true = estimates.true(repository, case, view, "true_displacement")["true_displacement"][es, ..., :2]
    spacing = config.bmode.si().field_of_view / size
    here = grid_points(config, size)
    wall = np.isfinite(true).all(-1)
    here, tracked, true = here[wall], np.asarray(tracked, float)[wall], np.asarray(true, float)[wall]
    shown = thin(here, DISTANCE * size / config.bmode.sizes[0])
    error = 100 * np.linalg.norm(tracked - true, axis=-1) / np.sqrt((true**2).sum(-1).mean())
    places = here + tracked / spacing, here + true / spacing
    image = repository.read(f"bmode/{size}/image", case, view, es)
    title = f"{what}: {clip[RANKED_BY]:.1f} %\n{clip['case']}, {style.title(str(clip['view'])).lower()}"
    return Example(title, image, spacing, places[0][shown], places[1][shown], error[shown])


@style.styled
def draw(path: Path, examples: list[Example]) -> Path:
    """Draw examples side by side.

    Each point is where the tracker has it, in the colour of its error; a line leads to where its tissue is.

    Parameters
    ----------
    path : Path
        PNG to write.
    examples : list of Example

    Returns
    -------
    Path
        The file.
    """
    figure = style.figure(2.9 * len(examples) + 0.8, 3.5)
    panels = figure.subplots(1, len(examples), squeeze=False)[0]
    for panel, each in zip(panels, examples, strict=True):
        _draw(panel, each)
    colours = matplotlib.cm.ScalarMappable(SCALE, COLOURS)
    bar = figure.colorbar(colours, ax=list(panels), extend="max", shrink=0.85, pad=0.01)
    bar.set_label("error (% of RMS displacement)")
    bar.outline.set_visible(False)  # type: ignore[operator]  # matplotlib's stubs do not know what it is
    return style.save(figure, path, dpi=120)


def _draw(axes: Axes, each: Example) -> None:
    axes.imshow(each.image, cmap="gray", vmin=0, vmax=255, interpolation="bilinear")
    colours = COLOURS(SCALE(np.nan_to_num(each.error)))
    axes.add_collection(LineCollection(list(np.stack([each.tracked, each.true], 1)), colors=colours, linewidths=1.4))
    axes.scatter(
        each.tracked[:, 0], each.tracked[:, 1], c=colours, s=13, linewidths=0.4, edgecolors=style.ON_IMAGE, zorder=3
    )
    low, high = each.true.min(0), each.true.max(0)
    half = 0.62 * (high - low).max()
    centre = (
        np.clip((low + high) / 2, half, len(each.image) - 1 - half) if 2 * half < len(each.image) else (low + high) / 2
    )
    left, right, lower, upper = centre[0] - half, centre[0] + half, centre[1] + half, centre[1] - half
    axes.set(xlim=(left, right), ylim=(lower, upper), xticks=[], yticks=[])
    axes.set_title(each.title, fontsize=8.5, fontweight="normal")
    axes.grid(visible=False)
    for side in axes.spines.values():
        side.set_visible(False)
    length = round_length(2 * half * each.spacing)
    x, y = left + 0.1 * half, lower - 0.1 * half
    axes.plot([x, x + length / each.spacing], [y, y], color=style.ON_IMAGE, linewidth=2.5, solid_capstyle="butt")
    text = f"{1e3 * length:g} mm"
    axes.text(
        x + length / each.spacing / 2, y - 0.04 * half, text, color=style.ON_IMAGE, ha="center", va="bottom", fontsize=8
    )
