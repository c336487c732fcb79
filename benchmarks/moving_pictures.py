"""Moving pictures of docs/gallery: a real mouse beside ours, and an infarct as it is seen, is and is tracked; and the
error of trackers as haze rises.

    python benchmarks/moving_pictures.py --mice FOLDER

In the folder is example/images/segmentation.mp4 of the repository sunjaeyoon/echo_segmentation (MIT), a mouse in short
axis with the mask of its cavity; without it the first picture is left out. --cache keeps the beats of the hearts.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import realism
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray
from physiology_pictures import ELEMENTS, save
from scipy.interpolate import LinearNDInterpolator
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import cKDTree

import echotruth as et
from echotruth.config import Config
from echotruth.config.merging import nested
from echotruth.evaluation.points import ground_truth
from echotruth.imaging.labels import TissueLabel
from echotruth.imaging.view import before_probe
from echotruth.report import style
from echotruth.report.clip import webp
from echotruth.units import mm

Floats = NDArray[np.float64]

VIEW, SIZE, TRACKER = "mid", 256, "bspline_dic"
COARSE: dict[str, Any] = {
    "phantom": {"density_per_mm3": 1000},
    "rf": {"lines": 128, "focal_zones": 2},
    "bmode": {"size_px": SIZE, "downsampling": [1]},
}
"""Fewer scatterers, lines and foci than the default, for pictures of 256 px."""
INFARCT = {"infarct": {"age": "fresh", "segments": [7, 8, 12, 13, 14]}}
"""As in the pictures of docs/physiology.md."""
HAZE_DB = (-20.0, -5.0, 10.0)
"""Levels of the last picture; that of the preset is -9."""
TRACKERS = ("bspline_dic", "dis", "corrected")
PANEL, DPI = 3.0, 112
"""Side of a panel, inch, and its resolution."""
WHITE = {"color": "white", "ha": "center", "va": "center"}
GREY, ERROR_LIMIT = 85.0, 10.0
"""Mean grey level of what is shown, and the error of strain at the ends of its scale, percentage points."""
LOGO = 9
"""Rows and columns at the top and at the left of the real clip that are cut off: a logo is in the upper corner, px."""
CAVITY = (TissueLabel.CAVITY, TissueLabel.PAPILLARY_MUSCLE)


def mouse() -> Config:
    """The mouse of the table of looks."""
    mesh = {f"geometry.{key}": value for key, value in realism.MESH.items()}
    return et.configure(realism.HERE.parent / "config/realistic.yaml", **nested(mesh | {"loop.frames": realism.FRAMES}))


def hazy(level: float) -> Config:
    """The mouse behind haze of a level, dB."""
    return et.configure(mouse(), **COARSE, realism={"haze": {"level_dB": level}})


def infarct() -> Config:
    """A coarse mouse with an infarct, in a circulation."""
    loop = {"kind": "circulation", "frames": realism.FRAMES}
    geometry = {"preset": "mouse", **ELEMENTS}
    return et.configure(geometry=geometry, loop=loop, pathology=INFARCT, realism={"preset": "mouse"}, **COARSE)


class Bar(NamedTuple):
    """A colour bar, to the right of the panel before it."""

    scale: ScalarMappable
    label: str


@dataclass(frozen=True)
class Panel:
    """A clip, with values in colour over it where they are known.

    Attributes
    ----------
    title : str
    grey : ndarray of shape (frame, row, column)
        Grey levels.
    box : tuple of float
        Left, right, bottom and top of what is shown, px.
    spacing : float, optional
        Side of a pixel, m; a bar of 1 mm is drawn if it is given.
    values : ndarray of shape (frame, row, column), optional
        NaN where there is none.
    scale : ScalarMappable, optional
        Colours of the values.
    opacity : float
        Of the colours.
    outline : ndarray of shape (frame, row, column), bool, optional
        What a dashed line goes round.
    """

    title: str
    grey: Floats
    box: tuple[float, float, float, float]
    spacing: float | None = None
    values: Floats | None = None
    scale: ScalarMappable | None = None
    opacity: float = style.OPACITY
    outline: NDArray[np.bool_] | None = None

    def draw(self, axes: Axes, frame: int) -> None:
        """Draw a frame."""
        axes.clear()
        axes.imshow(self.grey[frame], cmap="gray", vmin=0, vmax=255, interpolation="bicubic")
        if self.values is not None and self.scale is not None:
            colours = self.scale.to_rgba(self.values[frame])
            colours[..., 3] = self.opacity * np.isfinite(self.values[frame])
            axes.imshow(colours, interpolation="bilinear")
        if self.outline is not None:
            colour = style.ON_IMAGE if self.values is None else style.INK
            axes.contour(self.outline[frame], [0.5], colors=colour, linewidths=1.2, linestyles="--")
        left, right, bottom, top = self.box
        axes.set(xlim=(left, right), ylim=(bottom, top))
        axes.axis("off")
        if self.spacing is not None:
            start, height = left + 0.05 * (right - left), bottom - 0.05 * (bottom - top)
            axes.plot([start, start + 1 * mm / self.spacing], [height, height], color="white", linewidth=2.5)
            axes.text(start, height - 0.02 * (bottom - top), "1 mm", color="white", va="bottom", fontsize=10)


@style.styled
def film(parts: list[Panel | Bar], caption: str = "") -> NDArray[np.uint8]:
    """Draw panels and colour bars in a row on black, (frame, height, width, 3), RGB; the caption is below."""
    top, below = 0.4, 0.4 if caption else 0.0
    widths = [0.9 if isinstance(part, Bar) else PANEL + 0.04 for part in parts]
    width, height = sum(widths), PANEL + top + below
    figure = style.figure(width, height)
    figure.set(layout_engine="none", facecolor="black", dpi=DPI)
    canvas, moving = FigureCanvasAgg(figure), {}
    for part, left in zip(parts, np.cumsum([0, *widths]), strict=False):
        if isinstance(part, Bar):
            where = left + 0.06, below + 0.1 * PANEL, 0.12, 0.8 * PANEL
            bar = figure.colorbar(part.scale, cax=figure.add_axes(_share(where, width, height)))
            bar.set_ticks(np.linspace(part.scale.norm.vmin, part.scale.norm.vmax, 5))
            bar.set_label(part.label, color="white", fontsize=10)
            bar.ax.tick_params(colors="white", labelsize=9)
            bar.outline.set_visible(False)
        else:
            moving[figure.add_axes(_share((left, below, PANEL, PANEL), width, height))] = part
            figure.text((left + PANEL / 2) / width, 1 - top / 2 / height, part.title, fontsize=12, **WHITE)
    figure.text(0.5, below / 2 / height, caption, fontsize=11, **WHITE)
    frames = []
    for frame in range(realism.FRAMES):
        for axes, panel in moving.items():
            panel.draw(axes, frame)
        canvas.draw()
        frames.append(np.asarray(canvas.buffer_rgba())[..., :3].copy())
    return np.stack(frames)


def _share(box: tuple[float, float, float, float], width: float, height: float) -> tuple[float, float, float, float]:
    """A box in inch (left, bottom, width, height) in shares of the figure."""
    left, bottom, wide, high = box
    return left / width, bottom / height, wide / width, high / height


def strain_scale(limit: float = style.STRAIN_LIMIT) -> ScalarMappable:
    """The colours of strain, %."""
    return ScalarMappable(Normalize(-limit, limit), style.SIGNED)


def falls(area: Floats) -> NDArray[np.int64]:
    """Frames after which the area of a cavity falls through its median."""
    smooth = gaussian_filter1d(np.asarray(area, float), 1.5, mode="nearest")
    above = smooth >= np.median(smooth)
    return np.flatnonzero(above[:-1] & ~above[1:])


def beat_like(area: Floats, cavity: Floats) -> NDArray[np.int64]:
    """Frames of the first whole beat of a real clip, in step with a beat of ours that begins at end-diastole.

    Parameters
    ----------
    area : ndarray of shape (frame,)
        Of the real cavity.
    cavity : ndarray of shape (frame of ours,)
        Area of ours. Both fall through their medians at the same time.
    """
    first, last = falls(area)[:2]
    share = (np.arange(len(cavity)) - falls(cavity)[0]) / len(cavity) % 1
    return first + np.floor(share * (last - first)).astype(int)


def bright(clip: Floats, box: tuple[float, float, float, float]) -> Floats:
    """Grey levels times a factor with which the mean of what is not black within a box is `GREY`."""
    left, right, bottom, top = (round(edge + 0.5) for edge in box)
    shown = clip[:, top:bottom, left:right]
    return np.minimum(clip * (GREY / shown[shown > realism.BLACK].mean()), 255)


def square(centre: Floats, side: float) -> tuple[float, float, float, float]:
    """Left, right, bottom and top of a square about a place, row and column, px."""
    (row, column), half = centre, side / 2
    return column - half, column + half, row + half, row - half


def beside_real(real: realism.Clip, clip: xr.Dataset) -> NDArray[np.uint8]:
    """The real mouse, ours, and ours with its true strain, the cavities equally large at end-diastole."""
    cavity = np.isin(clip["tissue"].values, CAVITY)
    frames = beat_like(real.cavity.sum(axis=(1, 2)), cavity.sum(axis=(1, 2)))
    rows, columns = real.images.shape[1:]
    box = LOGO - 0.5, columns - 0.5, rows - 0.5, LOGO - 0.5
    largest = real.cavity[frames].sum(axis=(1, 2)).max()
    side = (rows - LOGO) * np.sqrt(cavity[0].sum() / largest)
    where = square(np.argwhere(cavity[0]).mean(axis=0), side)
    ours, spacing = bright(clip["image"].values, where), float(clip["axial"][1] - clip["axial"][0])
    scale, quantity = strain_scale(), style.QUANTITIES["CC"]
    strain = quantity.factor * clip["strain"].sel(strain_component="CC").values
    return film(
        [
            Panel("A real mouse", bright(real.images[frames], box), box),
            Panel("A simulated mouse", ours, where, spacing),
            Panel("Its true strain", ours, where, spacing, strain, scale),
            Bar(scale, quantity.label),
        ]
    )


def on_pixels(position: Floats, values: Floats, size: int, reach: float) -> Floats:
    """Values at points (point, 2: lateral, axial, px) on the pixels that are within reach of a point; NaN elsewhere."""
    known = np.isfinite(position).all(-1) & np.isfinite(values)
    rows, columns = np.indices((size, size))
    pixels = np.stack([columns, rows], axis=-1).reshape(-1, 2)
    distance, _ = cKDTree(position[known]).query(pixels, distance_upper_bound=reach)
    near, image = np.isfinite(distance), np.full(size * size, np.nan)
    image[near] = LinearNDInterpolator(position[known], values[known])(pixels[near])
    return image.reshape(size, size)


def tracked_infarct(heart: et.Heart, clip: xr.Dataset) -> NDArray[np.uint8]:
    """Echo, true strain, tracked strain and their difference, on the tissue as it moves and as it was tracked.

    Both strains are those of displacement at the points of the trackers' grid, by one operator.
    """
    config, tracked = heart.config, et.track(clip, TRACKER)
    truth = ground_truth(*before_probe(heart, config, VIEW), "short_axis", config)
    found = tracked["displacement"].values[:, truth.inside]
    corner, spacing = [float(clip["lateral"][0]), float(clip["axial"][0])], float(clip["axial"][1] - clip["axial"][0])
    true, seen = (100 * truth.operator.strain(motion)[..., 1] for motion in (truth.displacement, found))
    at, followed = ((truth.wall.position + motion - corner) / spacing for motion in (truth.displacement, found))
    reach = 0.8 * float(clip["grid_axial"][1] - clip["grid_axial"][0]) / spacing
    maps = [
        np.stack([on_pixels(*frame, SIZE, reach) for frame in zip(place, values, strict=True)])
        for place, values in ((at, true), (followed, seen), (at, seen - true))
    ]
    low, high = at.min(axis=(0, 1)), at.max(axis=(0, 1))
    box = square((low + high)[::-1] / 2, 1.15 * (high - low).max())
    grey, outline = bright(clip["image"].values, box), clip["region"].values > 0
    scale, error, quantity = strain_scale(), strain_scale(ERROR_LIMIT), style.QUANTITIES["CC"]
    about = {"opacity": 0.85, "outline": outline}
    nrmse = et.evaluate(tracked, heart)["nrmse_percent"]
    rms = np.sqrt(np.nanmean((seen - true)[truth.es] ** 2))
    return film(
        [
            Panel("Echo", grey, box, spacing, outline=outline),
            Panel("True strain", grey, box, None, maps[0], scale, **about),
            Panel(f"Tracked strain ({TRACKER})", grey, box, None, maps[1], scale, **about),
            Bar(scale, quantity.label),
            Panel("Tracked less true", grey, box, None, maps[2], error, **about),
            Bar(error, "Error (percentage points)"),
        ],
        "Mouse with a fresh infarct (dashed), mid short axis. At end-systole:"
        f" RMS error of strain {rms:.1f} percentage points, NRMSE of displacement {nrmse:.0f} %.",
    )


def haze_errors(hearts: dict[float, et.Heart], clips: dict[float, xr.Dataset]) -> dict[str, list[float]]:
    """Tracker -> its NRMSE at each level, %."""
    return {tracker: [_nrmse(clip, tracker, hearts[level]) for level, clip in clips.items()] for tracker in TRACKERS}


def _nrmse(clip: xr.Dataset, tracker: str, heart: et.Heart) -> float:
    """Of a tracker in a clip, %."""
    return float(et.evaluate(et.track(clip, tracker), heart)["nrmse_percent"])


@style.styled
def draw_haze(clips: dict[float, xr.Dataset], errors: dict[str, list[float]]) -> Figure:
    """Draw error over the level of haze between frames at its ends.

    Parameters
    ----------
    clips : dict of Dataset
        Level, dB -> clip.
    errors : dict of list of float
        Tracker -> NRMSE at each level, %.
    """
    figure, levels = style.figure(11.4, 3.9), list(clips)
    first, middle, last = figure.subplots(1, 3, width_ratios=[1, 1.35, 1])
    for axes, level in ((first, levels[0]), (last, levels[-1])):
        axes.imshow(clips[level]["image"][0], cmap="gray", vmin=0, vmax=255)
        axes.set_title(f"Haze {level:+.0f} dB".replace("-", "\N{MINUS SIGN}"))
        axes.axis("off")
    for number, (tracker, error) in enumerate(errors.items()):
        middle.plot(levels, error, marker="o", color=style.series_colour(number), label=tracker)
    middle.set(xlabel="Power of the haze over that of the echoes it repeats (dB)", ylabel="NRMSE of displacement (%)")
    middle.set(xticks=levels, ylim=(0, None))
    middle.legend()
    middle.set_title("Error at end-systole")
    figure.supxlabel(
        "One mouse heart, mid short axis, 24 frames of 256 px, imaged behind three levels of haze.",
        fontsize=9,
        color=style.MUTED,
    )
    return figure


def main() -> None:
    """Beat, image and track the hearts, and draw them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--mice", type=Path, help="real clips of mice")
    parser.add_argument("--cache", type=Path, default=realism.HERE / ".cache")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/gallery"))
    given = parser.parse_args()
    healthy = given.cache / "mouse.npz"
    if given.mice:
        real = dict(realism.mouse_clips(given.mice))["segmentation"]
        ours = et.image(realism.solved(mouse(), healthy), VIEW, size=SIZE)
        webp(given.output / "beside_real.webp", beside_real(real, ours))
    heart = realism.solved(infarct(), given.cache / "infarct.npz")
    webp(given.output / "infarct.webp", tracked_infarct(heart, et.image(heart, VIEW)))
    hearts = {level: realism.solved(hazy(level), healthy) for level in HAZE_DB}
    clips = {level: et.image(heart, VIEW) for level, heart in hearts.items()}
    save(draw_haze(clips, haze_errors(hearts, clips)), given.output / "haze.png")


if __name__ == "__main__":
    main()
