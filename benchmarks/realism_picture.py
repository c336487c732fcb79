"""The picture of docs/realism.md: ideal, realistic and real clips side by side, at end-diastole and end-systole.

    python benchmarks/realism_picture.py --mice FOLDER

The real clips are the example `ybr_color` of the package pydicom (MIT), an apical four-chamber view of a human heart,
and in the folder example/images/segmentation.mp4 of the repository sunjaeyoon/echo_segmentation (MIT), a mouse in short
axis, which is left out without it. The hearts have 12 x 6 x 1 elements and 24 frames, of which two are imaged.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import NamedTuple

import apical_clip
import numpy as np
import realism
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from moving_pictures import LOGO, falls
from numpy.typing import NDArray
from physiology_pictures import ELEMENTS, save

import echotruth as et
from echotruth.config import Config
from echotruth.report import style
from echotruth.report.clip import round_length

REAL_MM, REAL_TIP, REAL_FRAMES = 1.021, (8.5, 169.5), (21, 5)
"""Of the real clip: side of a pixel (its field PhysicalDeltaX is that of the clip at twice the size), row and column of
the tip of its sector (px), and the frames in which the mitral valve shuts and opens."""


class Group(NamedTuple):
    """Pictures of one view of one species.

    Attributes
    ----------
    species, view, title : str
    side : float
        Of what is shown, from the array on, mm.
    """

    species: str
    view: str
    title: str
    side: float


GROUPS = (
    Group("human", "four_chamber", "Human, apical four-chamber view", 190.0),
    Group("mouse", "mid", "Mouse, short axis", 10.5),
)


class Pair(NamedTuple):
    """Frames at end-diastole and end-systole (2, axial, lateral), grey levels, and left, right, bottom and top, mm."""

    frames: NDArray[np.uint8]
    extent: tuple[float, float, float, float]


def imaged(heart: et.Heart, config: Config, view: str) -> Pair:
    """A view of a heart at end-diastole and end-systole."""
    side = config.bmode.field_of_view_mm
    frames = realism.our_clip(config, heart, view, (0, heart.es)).images
    return Pair(frames, (-side / 2, side / 2, side, 0))


def real() -> Pair:
    """The real clip, without the text beside its sector."""
    from pydicom import examples

    frames = apical_clip.real_clip(Path(examples.get_path("ybr_color")))[list(REAL_FRAMES)]
    (top, middle), (rows, columns) = REAL_TIP, frames.shape[1:]
    row, column = np.indices((rows, columns))
    reach, angle = np.hypot(row - top, column - middle), np.degrees(np.arctan2(column - middle, row - top))
    _, _, half, _, last = apical_clip.SECTOR
    frames = np.where((np.abs(angle) < half) & (reach < last / 2), frames, 0).astype(np.uint8)
    left, upper = (-REAL_MM * edge for edge in (middle, top))
    return Pair(frames, (left, left + REAL_MM * columns, upper + REAL_MM * rows, upper))


def real_mouse(folder: Path, side: float) -> Pair:
    """The real mouse with its largest and smallest cavity, which fills a picture of a side, as its scale is unknown."""
    clip = dict(realism.mouse_clips(folder))["segmentation"]
    area = clip.cavity.sum(axis=(1, 2))
    beat = slice(*falls(area)[:2])
    moments = beat.start + np.array([area[beat].argmax(), area[beat].argmin()])
    return Pair(clip.images[moments, LOGO:, LOGO:], (-side / 2, side / 2, side, 0))


def columns(group: Group, mice: Path | None) -> dict[str, Pair]:
    """Ideal, realistic and, where there is one, real pictures of a group by their names."""
    setting = {"geometry": {"preset": group.species, **ELEMENTS}, "loop": {"frames": realism.FRAMES}}
    setting |= {"views": {"preset": "echo"}} if group.view == "four_chamber" else {}
    heart, found = None, {}
    for name, preset in (("Ideal", "none"), ("Realistic", group.species)):
        config = et.configure(**setting, realism={"preset": preset})
        heart = heart or et.beat(config, progress=False)
        found[name] = imaged(heart, config, group.view)
    if group.species == "human":
        return found | {"Real": real()}
    return found | ({"Real": real_mouse(mice, group.side)} if mice else {})


@style.styled
def draw(groups: dict[Group, dict[str, Pair]]) -> Figure:
    """Draw a column for each clip, end-diastole above end-systole."""
    figure = style.figure(2.35 * sum(map(len, groups.values())), 5.3)
    parts = figure.subfigures(1, len(groups), width_ratios=[len(clips) for clips in groups.values()])
    for part, (group, clips) in zip(parts, groups.items(), strict=True):
        part.suptitle(group.title, fontweight="bold", fontsize=11)
        for column, (name, pair) in zip(part.subplots(2, len(clips)).T, clips.items(), strict=True):
            column[0].set_title(name, fontweight="normal")
            for axes, frame, moment in zip(column, pair.frames, ("ED", "ES"), strict=True):
                axes.imshow(frame, cmap="gray", vmin=0, vmax=255, extent=pair.extent)
                axes.set(xlim=(-group.side / 2, group.side / 2), ylim=(group.side, 0), xticks=[], yticks=[])
                axes.set_facecolor("black")
                label = axes.text(0.03, 0.97, moment, color="white", va="top", transform=axes.transAxes)
                label.set(fontweight="bold", path_effects=[withStroke(linewidth=2.5, foreground="black")])
            if name == "Realistic":
                _bar(axes, group.side)
    return figure


def _bar(axes: Axes, side: float) -> None:
    """A bar of a round length at the lower right."""
    bar = round_length(side)
    axes.plot(np.array([0.47, 0.47]) * side - [bar, 0], [0.95 * side] * 2, color="white", linewidth=2)
    axes.text(0.47 * side, 0.935 * side, f"{bar:g} mm", color="white", ha="right")


def main() -> None:
    """Image the hearts and draw them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--mice", type=Path, help="real clips of mice")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/gallery"))
    given = parser.parse_args()
    save(draw({group: columns(group, given.mice) for group in GROUPS}), given.output / "realism.png")


if __name__ == "__main__":
    main()
