"""The picture of docs/realism.md: ideal, realistic and real clips side by side, at end-diastole and end-systole.

    python benchmarks/realism_picture.py

The real clip is the example `ybr_color` of the package pydicom (MIT), an apical four-chamber view of a human heart. The
hearts have 12 x 6 x 1 elements and 16 frames, of which two are imaged.
"""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path
from typing import NamedTuple

import apical_clip
import numpy as np
import realism
from matplotlib.figure import Figure
from numpy.typing import NDArray
from physiology_pictures import ELEMENTS, save

import echotruth as et
from echotruth.config import Config
from echotruth.imaging.bmode import bmode_clip, clip_gain
from echotruth.imaging.sequence import Sequence
from echotruth.imaging.view import before_probe
from echotruth.report import style
from echotruth.report.clip import round_length

FRAMES = 16
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
    shown, plane = before_probe(heart, config, view)
    sequence = Sequence(config, shown, plane, realism.random)
    scanner, acquire = sequence.scanner, sequence.acquisition(sequence.scatterers())
    gain = clip_gain(config.probe, config.bmode, len(scanner.scan.angle), scanner.range, realism.random("dropout"))
    compressed = partial(bmode_clip, scan=scanner.scan, range_=scanner.range, bmode=config.bmode, gain=gain)
    lines = np.stack([scanner.beamform(acquire(frame)) for frame in (0, heart.es)])
    side = config.bmode.field_of_view_mm
    return Pair(compressed(lines)[config.bmode.sizes[0]], (-side / 2, side / 2, side, 0))


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


def columns(group: Group) -> dict[str, Pair]:
    """Ideal, realistic and, where there is one, real pictures of a group by their names."""
    setting = {"geometry": {"preset": group.species, **ELEMENTS}, "loop": {"frames": FRAMES}}
    setting |= {"views": {"preset": "echo"}} if group.view == "four_chamber" else {}
    heart, found = None, {}
    for name, preset in (("Ideal", "none"), ("Realistic", group.species)):
        config = et.configure(**setting, realism={"preset": preset})
        heart = heart or et.beat(config, progress=False)
        found[name] = imaged(heart, config, group.view)
    return found | ({"Real": real()} if group.species == "human" else {})


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
                axes.text(0.03, 0.97, moment, color="white", va="top", fontweight="bold", transform=axes.transAxes)
        bar = round_length(group.side)
        axes.plot(np.array([0.47, 0.47]) * group.side - [bar, 0], [0.95 * group.side] * 2, color="white", linewidth=2)
        axes.text(0.47 * group.side, 0.935 * group.side, f"{bar:g} mm", color="white", ha="right")
    return figure


def main() -> None:
    """Image the hearts and draw them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/gallery"))
    save(draw({group: columns(group) for group in GROUPS}), parser.parse_args().output / "realism.png")


if __name__ == "__main__":
    main()
