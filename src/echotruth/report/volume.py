"""A heart in three dimensions, in three slices through the middle of its volumes, beside each other."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from PIL import Image

from echotruth.heart import Heart
from echotruth.notebook.volume import voxel_truth
from echotruth.report import style
from echotruth.report.clip import round_length
from echotruth.report.clips import MAX_PIXELS, MAX_VIEWS, STEPS_PER_PIXEL, coloured, entries, sheets
from echotruth.repository.datasets import VOLUME
from echotruth.repository.reader import Repository
from echotruth.repository.schema import LABELS

SLICES = {
    "short axis": ("axial", "lateral", "CC"),
    "long axis, along the beam": ("axial", "elevation", "LL"),
    "long axis, across the beam": ("elevation", "lateral", "LL"),
}
"""Name -> the dimensions of the picture, downwards and to the right, and the strain that is shown in it."""
SHOWN = "true circumferential strain in the short axis, at the left, and longitudinal strain in the long axes (%)"
MAX_WIDTH, GAP = 840, 6
"""Of the three slices, and between them, px."""


class Slice(NamedTuple):
    """A slice through the middle of volumes.

    Attributes
    ----------
    name, component : str
        As in `SLICES`.
    sides : tuple of float, m
        Height and width.
    image : ndarray of shape (frame, height, width), uint8
        B-mode.
    strain : ndarray of shape (frame, height, width)
        True strain since end-diastole; NaN outside the wall.
    """

    name: str
    component: str
    sides: tuple[float, float]
    image: NDArray[np.uint8]
    strain: NDArray[np.float32]


def slices(clip: xr.Dataset, heart: Heart) -> Iterator[Slice]:
    """The slices of `SLICES` of volumes of a heart, as :func:`echotruth.image` returns them."""
    for name, (down, right, component) in SLICES.items():
        (across,) = set(VOLUME) - {down, right}
        part, order = clip.isel({across: [clip.sizes[across] // 2]}), ("frame", down, right, across)
        truth = [voxel_truth(part, heart, frame)["strain"] for frame in range(clip.sizes["frame"])]
        strain = xr.concat(truth, "frame").sel(strain_component=component).transpose(*order).values[..., 0]
        sides = tuple(clip.sizes[dim] * float(clip[dim][1] - clip[dim][0]) for dim in (down, right))
        yield Slice(name, component, (sides[0], sides[1]), part["image"].transpose(*order).values[..., 0], strain)


def clips(repository: Repository, view: str) -> dict[str, Any]:
    """Case -> its volumes in a view, for the player of the page, as :func:`.clips.clips` has views."""
    cases = repository.shown[:MAX_VIEWS]
    return {case: _clip(repository, case, view, len(cases)) for case in cases}


def film(clip: xr.Dataset, heart: Heart, height: int) -> NDArray[np.uint8]:
    """Frames (frame, height, width, 3), RGB, of volumes, of a height, px, or nearly; both sides are even."""
    across, down = _extent(parts := list(slices(clip, heart)))
    grey, strain = (
        each[:, : each.shape[1] // 2 * 2] for each in _arranged(parts, 2 * round(height * across / down / 2))
    )
    tint = np.stack([np.asarray(coloured(Image.fromarray(frame)).convert("RGBA"))[..., :3] for frame in strain])
    opacity = style.OPACITY * (strain > 0)[..., None]
    return np.rint((1 - opacity) * grey[..., None] + opacity * tint).astype(np.uint8)


def _clip(repository: Repository, case: str, view: str, count: int) -> dict[str, Any]:
    """The volumes of one case of several."""
    clip, heart = repository.clip(case, view), repository.heart(case)
    across, down = _extent(parts := list(slices(clip, heart)))
    width = min(MAX_WIDTH, int((MAX_PIXELS / (count * clip.sizes["frame"]) * across / down) ** 0.5))
    grey, strain = _arranged(parts, width)
    bar, scale = round_length(across / 3), width / across
    mean = repository.read("kinematics/strain_mean", case, None, ..., LABELS["strain_component"].index("CC"))
    course = [round(100 * strain, 3) for strain in mean.tolist()]
    return sheets(grey, strain, grey.shape[:0:-1]) | {
        "time_ms": [round(1e3 * float(time), 3) for time in clip["time"].values],
        "es": heart.es,
        "strain_name": SHOWN,
        "points": 0,
        "path": "",
        "steps": STEPS_PER_PIXEL,
        "chosen": [],
        "bar_px": round(bar * scale, 2),
        "bar": f"{1e3 * bar:g} mm",
        "course": {"title": "Circumferential strain, mean of the wall", "true": course},
    }


def _extent(parts: list[Slice]) -> tuple[float, float]:
    """Width of slices beside each other, and height of two rows of them, m."""
    return sum(part.sides[1] for part in parts), 2 * max(part.sides[0] for part in parts)


def _arranged(parts: list[Slice], width: int) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Slices beside each other, and below them once more with their strain.

    Returns
    -------
    grey, strain : ndarray of shape (frame, height, width)
        Grey levels, and steps of the scale of strain.
    """
    across, down = _extent(parts)
    scale, left = (width - GAP * (len(parts) - 1)) / across, 0
    row = round(scale * down / 2)
    grey, strain = np.zeros((2, len(parts[0].image), 2 * row + GAP, width), np.uint8)
    for part in parts:
        size = round(scale * part.sides[1]), round(scale * part.sides[0])
        for number, (image, colour) in enumerate(zip(part.image, entries(part.strain), strict=True)):
            seen = np.asarray(Image.fromarray(image).resize(size, Image.Resampling.LANCZOS))[:, : width - left]
            known = np.asarray(Image.fromarray(colour).resize(size, Image.Resampling.NEAREST))[:, : width - left]
            for top in (0, row + GAP):
                grey[number, top : top + size[1], left : left + size[0]] = seen
            strain[number, row + GAP : row + GAP + size[1], left : left + size[0]] = known
        left += size[0] + GAP
    return grey, strain
