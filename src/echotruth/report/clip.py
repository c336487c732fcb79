"""A B-mode clip, beside itself with the true strain and the true paths of its wall."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize, to_rgb
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image

from echotruth.report import style

WIDTH = 2.3
"""Of the frames, over their height."""

WALL_GREY = 105
"""Grey level, of 255, to which a darker wall is brightened."""

SLOW_RATE = 12
"""Frames per second of the first picture of the docs, slow enough to follow a point."""


@dataclass(frozen=True)
class ClipWithMotion:
    """A clip and the displacement of points in it.

    Attributes
    ----------
    image : ndarray of shape (frame, axial, lateral), uint8
        Grey levels.
    spacing : float
        Distance of pixel centres, m.
    time : ndarray of shape (frame,)
        Since end-diastole, s.
    position : ndarray of shape (point, 2)
        Points in frame 0: lateral, axial, px.
    displacement : ndarray of shape (frame, point, 2)
        Displacement since frame 0: lateral, axial, m; NaN where unknown.
    """

    image: np.ndarray
    spacing: float
    time: np.ndarray
    position: np.ndarray
    displacement: np.ndarray

    @property
    def path(self) -> np.ndarray:
        """Positions of the points in every frame, (frame, point, 2), px."""
        return self.position + self.displacement / self.spacing


def thin(position: np.ndarray, distance: float) -> np.ndarray:
    """Choose points at least a given distance apart, in their order.

    Parameters
    ----------
    position : ndarray of shape (point, 2)
        Any unit.
    distance : float
        In the same unit.

    Returns
    -------
    ndarray of int
        Indices of the chosen points.
    """
    chosen: list[int] = []
    for k, candidate in enumerate(position):
        if not chosen or np.linalg.norm(position[chosen] - candidate, axis=1).min() >= distance:
            chosen.append(k)
    return np.array(chosen, int)


@style.styled
def render(clip: ClipWithMotion, strain: np.ndarray, quantity: style.Quantity, height: int) -> np.ndarray:
    """Draw every frame, cropped to the moving wall: the grey image, and beside it the same with what is true.

    Strain is in colour, and points stay on their tissue. Behind each point is its path since end-diastole, fainter the
    longer ago, so that nothing seems to float where the tissue was.

    Parameters
    ----------
    clip : ClipWithMotion
    strain : ndarray of shape (frame, axial, lateral)
        True strain at every pixel; NaN outside the wall.
    quantity : Quantity
        Which strain it is.
    height : int
        Of the frames, px; even.

    Returns
    -------
    ndarray of shape (frame, height, width, 3), uint8
        RGB; the width is even.
    """
    left, right, bottom, top = crop(clip)
    figure = style.figure(4 * WIDTH, 4)
    figure.set(layout_engine="none", facecolor="black")
    canvas = FigureCanvasAgg(figure)
    seen, known = (figure.add_axes((k * 1.01 / WIDTH, 0, 1 / WIDTH, 1)) for k in (0, 1))
    grey = _brightened(clip.image, np.isfinite(strain))
    pictures = [axes.imshow(grey[0], cmap="gray", vmin=0, vmax=255, interpolation="bilinear") for axes in (seen, known)]
    scale = ScalarMappable(Normalize(-style.STRAIN_LIMIT, style.STRAIN_LIMIT), style.SIGNED)
    tint = known.imshow(scale.to_rgba(quantity.factor * strain[0]), interpolation="nearest")
    trails = LineCollection([], linewidths=1.8)
    known.add_collection(trails)
    (points,) = known.plot(*clip.position.T, "o", color=style.MOTION, markersize=4, markeredgewidth=0)
    for axes, title in ((seen, "B-mode"), (known, "The truth: strain and paths of the tissue")):
        axes.set(xlim=(left, right), ylim=(bottom, top))
        axes.axis("off")
        axes.text(0.04, 0.96, title, color="white", va="top", fontsize=13, transform=axes.transAxes)
    label = _scale_bar(seen, clip, (left, bottom))
    _colour_bar(figure, scale, quantity.label)
    frames = []
    for t in range(len(grey)):
        for picture in pictures:
            picture.set_data(grey[t])
        colours = scale.to_rgba(quantity.factor * strain[t])
        colours[..., 3] = style.OPACITY * np.isfinite(strain[t])
        tint.set_data(colours)
        trails.set_segments(list(np.stack([clip.path[:t], clip.path[1 : t + 1]], axis=2).reshape(-1, 2, 2)))
        trails.set_color(_fading(t, len(clip.position)))
        points.set_data(*clip.path[t].T)
        label.set_text(f"{clip.time[t] * 1e3:.0f} ms")
        figure.set_dpi(height / 4)
        canvas.draw()
        drawn = np.asarray(canvas.buffer_rgba())[..., :3]
        frames.append(drawn[:, : drawn.shape[1] // 2 * 2].copy())
    return np.stack(frames)


def _brightened(image: np.ndarray, in_wall: np.ndarray) -> np.ndarray:
    """Grey levels as a brighter monitor shows them, so that the mean of the wall is not below `WALL_GREY`."""
    return np.minimum(image * max(WALL_GREY / max(float(image[in_wall].mean()), 1.0), 1.0), 255)


def _colour_bar(figure: Figure, scale: ScalarMappable, label: str) -> None:
    """Draw the scale of the colours to the right of the images, white on black."""
    bar = figure.colorbar(scale, cax=figure.add_axes((1 - 0.245 / WIDTH, 0.12, 0.045 / WIDTH, 0.76)))
    bar.set_label(label, color="white", fontsize=11)
    bar.ax.tick_params(colors="white", labelsize=10)
    bar.outline.set_visible(False)


def _fading(steps: int, points: int) -> list[tuple[float, float, float, float]]:
    """Colours of the steps of all points, the last ones the strongest: (steps * points, 4), RGBA."""
    opacity = np.repeat(np.linspace(0.12, 0.85, steps) if steps > 1 else np.full(steps, 0.85), points)
    red, green, blue = to_rgb(style.MOTION)
    return [(red, green, blue, float(alpha)) for alpha in opacity]


def crop(clip: ClipWithMotion) -> tuple[float, float, float, float]:
    """Square around the wall over the whole cycle, within the image: left, right, bottom, top, px.

    Parameters
    ----------
    clip : ClipWithMotion

    Returns
    -------
    tuple of float
        The margin around the wall is a sixth of its extent.
    """
    low, high = np.nanmin(clip.path, (0, 1)), np.nanmax(clip.path, (0, 1))
    half = min(0.66 * (high - low).max(), (min(clip.image.shape[1:]) - 1) / 2)
    size = np.array(clip.image.shape[:0:-1])
    centre = np.clip((low + high) / 2, half, size - 1 - half)
    (left, upper), (right, lower) = centre - half, centre + half
    return left, right, lower, upper


def _scale_bar(axes: Axes, clip: ClipWithMotion, corner: tuple[float, float]) -> Text:
    """Draw a bar of a round length in the lower left corner; returns the label of the time in the lower right one."""
    width = axes.get_xlim()[1] - axes.get_xlim()[0]
    bar = round_length(width * clip.spacing)
    length = bar / clip.spacing
    x, y = corner[0] + 0.05 * width, corner[1] - 0.05 * width
    axes.plot([x, x + length], [y, y], color="white", linewidth=2.5, solid_capstyle="butt")
    text = f"{1e3 * bar:g} mm"
    axes.text(x + length / 2, y - 0.02 * width, text, color="white", ha="center", va="bottom", fontsize=11)
    return axes.text(corner[0] + 0.95 * width, y, "", color="white", ha="right", va="baseline", fontsize=12)


def round_length(side: float) -> float:
    """Length of the bar that shows the scale of a picture: 1, 2 or 5 times a power of ten, about a sixth of its side.

    Parameters
    ----------
    side : float
        m.

    Returns
    -------
    float
        m.
    """
    power = 10.0 ** np.floor(np.log10(side / 5))
    return float(max(step * power for step in (1, 2, 5) if step * power <= side / 5))


def webp(path: Path, frames: np.ndarray) -> Path:
    """Write a looping WebP, which pages of the docs show as a picture.

    Parameters
    ----------
    path : Path
    frames : ndarray of shape (frame, height, width, 3), uint8
        RGB.

    Returns
    -------
    Path
    """
    first, *others = map(Image.fromarray, frames)
    first.save(path, save_all=True, append_images=others, duration=1000 // SLOW_RATE, loop=0, quality=80, method=6)
    return path
