"""Colours over the wall: a number at every pixel of every frame as an entry of a palette, and the scale that says
what it means.
"""

from dataclasses import dataclass, field

import matplotlib
import numpy as np
from matplotlib.colors import to_hex
from numpy.typing import NDArray

from echotruth.aha import SEGMENT_NAMES
from echotruth.imaging.labels import TissueLabel
from echotruth.report import style
from echotruth.report.palette import TISSUES
from echotruth.report.style import layer_colours
from echotruth.viewer.clip import Clip
from echotruth.viewer.points import Points

COLOURS = {
    "none": "B-mode alone",
    "strain": "true strain, every pixel",
    "tracked_strain": "tracked strain",
    "strain_error": "error of tracked strain",
    "displacement_error": "error of displacement",
    "layer": "layers of the wall",
    "segment": "AHA segments",
    "region": "regions of disease",
    "wall_depth": "wall depth",
    "flow": "speed of the tissue",
    "tissue": "tissues",
}
"""What the colour can show, and its name."""
NEEDS = {
    **dict.fromkeys(("strain", "layer", "segment", "region", "wall_depth", "flow", "tissue"), "truth"),
    **dict.fromkeys(("tracked_strain", "strain_error", "displacement_error"), "tracking"),
}
"""Part of a clip that a colour is made of."""
LABELLED = ("layer", "segment", "region", "tissue")
"""Colours of what has a number and a name."""
ENTRIES = 255
"""Of a palette: entry 0 of an image of indices is transparent."""
DISEASE = {1: ("infarct", "#d55e00"), 2: ("border zone", "#f0e442"), 3: ("late activation", "#56b4e9")}
"""Region to its name and its colour, of Okabe & Ito's palette for all kinds of colour vision
(doi:10.1038/nmeth.1618)."""
WALL_COMPONENTS = ("RR", "TT", "RT")
STEPS = (1, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10)
"""First digits of the end of a scale."""


@dataclass(frozen=True)
class Tint:
    """Colours of a clip.

    Attributes
    ----------
    index : ndarray of shape (frame, axial, lateral), uint8
        Entry of the palette, from 1; 0 is transparent.
    palette : list of str
        Colours as #rrggbb.
    low, high : float
        Values at the ends of the palette, in the unit of the title.
    names : dict
        Value -> name, for what is not a quantity.
    """

    index: NDArray[np.uint8]
    palette: list[str]
    low: float
    high: float
    title: str
    names: dict[int, str] = field(default_factory=dict)


def tint(clip: Clip, points: Points, colour: str, component: str, tracker: str | None) -> Tint | None:
    """Colours of one kind; None for `none`, or if what they are made of is not written.

    Parameters
    ----------
    clip : Clip
    points : Points
    colour : str
        A key of `COLOURS`.
    component : str
        Of strain, as "CC" or "TT".
    tracker : str or None
        None for the truth at the points of the trackers.
    """
    if colour == "none" or NEEDS[colour] not in clip.parts:
        return None
    if NEEDS[colour] == "tracking":
        return _of_points(points, colour, component, tracker)
    if colour in LABELLED:
        return _labels(clip, colour)
    if colour == "strain":
        values = 100 * clip.strain(component)
        limit = nice(largest(values[:, ::7, ::7]))
        return _scaled(values, -limit, limit, style.SIGNED, component_quantity(component, clip).plain)
    if colour == "wall_depth":
        return _scaled(clip.wall_depth(), 0, 1, style.UNSIGNED, "Wall depth, 0 at the endocardium")
    return _speed(clip)


def components(colour: str) -> tuple[str, ...]:
    """Components of strain that a colour can show; none for those that are not a strain."""
    if colour in ("tracked_strain", "strain_error"):
        return WALL_COMPONENTS
    return ("RR", "CC", "LL", "RC", "RL", "CL") if colour == "strain" else ()


def component_quantity(component: str, clip: Clip) -> style.Quantity:
    """A component of strain as a quantity; TT and RT depend on the view."""
    return style.QUANTITIES[component.replace("T", "C" if clip.is_short_axis else "L")]


def component_name(component: str, clip: Clip) -> str:
    """A component of strain in words and as a symbol, as "circumferential strain E_CC"."""
    quantity = component_quantity(component, clip)
    return f"{quantity.words.lower()} {quantity.symbol}"


def _of_points(points: Points, colour: str, component: str, tracker: str | None) -> Tint | None:
    """Colours of a number at points of the trackers, at the pixels that these cover; the truth has no error."""
    if tracker is None and colour != "tracked_strain":
        return None
    if tracker is not None and colour == "displacement_error":
        true = points.true_displacement
        error = np.linalg.norm(points.tracked_displacement(tracker) - true, axis=-1)
        factor, unit = (1e6, "µm") if points.clip.side < 0.03 else (1e3, "mm")
        # One scale for all trackers of a clip: up to a quarter of its largest motion.
        limit = nice(factor * largest(np.linalg.norm(true, axis=-1), 100) / 4)
        return _scaled(_at_pixels(points, factor * error), 0, limit, style.UNSIGNED, f"Error of displacement ({unit})")
    number, name = WALL_COMPONENTS.index(component), component_name(component, points.clip)
    shown = true = 100 * points.true_strain()[..., number]
    limit, title = nice(largest(true)), f"True {name} (%)"
    if tracker is not None:
        shown, title = 100 * points.tracked_strain(tracker)[..., number], f"Tracked {name} (%)"
    if colour == "strain_error":
        shown, title = shown - true, f"Error of {name} (% points)"
    return _scaled(_at_pixels(points, shown), -limit, limit, style.SIGNED, title)


def _at_pixels(points: Points, values: NDArray[np.float64]) -> NDArray[np.float32]:
    """Numbers of points, (frame, n), at the pixels, (frame, axial, lateral); NaN where there is no point."""
    known = np.concatenate([np.full((len(values), 1), np.nan), values], axis=1).astype(np.float32)
    return np.stack([row[covered] for row, covered in zip(known, points.coverage, strict=True)])


def _labels(clip: Clip, name: str) -> Tint:
    """Colours of numbered parts of the wall."""
    if name == "tissue":
        names = {int(one): one.name.lower().replace("_", " ") for one in TissueLabel if one}
        return Tint(clip.tissue(), list(TISSUES), 0.5, len(names) + 0.5, "Tissue", names)
    label = clip.label(name)
    if name == "segment":
        return _segments(label)
    if name == "layer":
        layers = clip.config.fibres.layers
        palette = [to_hex(colour) for colour in layer_colours(layers)]
        names, title = {number: str(number) for number in range(1, layers + 1)}, "Layer, 1 at the endocardium"
    else:
        palette, title = [colour for _, colour in DISEASE.values()], "Region of disease"
        names = {number: word for number, (word, _) in DISEASE.items()}
    return Tint(label, palette, 0.5, len(palette) + 0.5, title, names)


def _segments(label: NDArray[np.uint8]) -> Tint:
    """Colours of the AHA segments that a view shows; the entries of the palette are these, in their order."""
    shown = [number for number in range(1, 18) if (label == number).any()] or [1]
    entry = np.zeros(256, np.uint8)
    entry[shown] = np.arange(1, len(shown) + 1)
    table = matplotlib.colormaps["tab10" if len(shown) <= 10 else "tab20"]
    names = {rank: f"{number} {SEGMENT_NAMES[number - 1]}" for rank, number in enumerate(shown, start=1)}
    palette = [to_hex(table(rank)) for rank in range(len(shown))]
    return Tint(entry[label], palette, 0.5, len(shown) + 0.5, "AHA segment", names)


def _speed(clip: Clip) -> Tint:
    """Colours of the speed in the plane, from each frame to the next."""
    flow = clip.flow()
    frame_time = float(clip.time[1] - clip.time[0]) if clip.frames > 1 else 1.0
    speed = 1e3 * np.hypot(flow[..., 0], flow[..., 1]) / frame_time
    limit = nice(largest(speed[:, ::7, ::7]))
    return _scaled(speed, 0, limit, style.UNSIGNED, "Speed in the plane (mm/s)")


def _scaled(values: NDArray[np.floating], low: float, high: float, colours: str, title: str) -> Tint:
    palette = [to_hex(colour) for colour in matplotlib.colormaps[colours](np.linspace(0, 1, ENTRIES))]
    return Tint(indices(values, low, high), palette, low, high, title)


def indices(values: NDArray[np.floating], low: float, high: float) -> NDArray[np.uint8]:
    """Entries of a palette for values between two ends; what is beyond has the entry of the end, NaN has 0."""
    found = np.empty(values.shape, np.uint8)
    for row, frame in zip(found, values, strict=True):  # one frame at a time, for the sake of memory
        with np.errstate(invalid="ignore"):
            step = np.clip((frame - low) * (ENTRIES / (high - low)), 0, ENTRIES - 1) + 1
            row[:] = np.where(np.isfinite(step), step, 0).astype(np.uint8)
    return found


def largest(values: NDArray[np.floating], share: float = 99) -> float:
    """Magnitude that a share of the known values does not exceed, in percent; 0 if none is known."""
    known = np.abs(values[np.isfinite(values)])
    return float(np.percentile(known, share)) if known.size else 0.0


def nice(value: float) -> float:
    """A round number that is not below a value; 1 if the value is zero or unknown."""
    if not (np.isfinite(value) and value > 0):
        return 1.0
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(step for step in STEPS if step * power >= value * (1 - 1e-9)) * power)
