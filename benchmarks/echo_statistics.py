"""Statistics of what an echo looks like, of any clip of which the wall is known.

Contrasts are differences of mean levels. Speckle is what remains of the intensity when it is divided by its Gaussian
mean over the wall, whose standard deviation is a third of the thickness of the wall. What depends on the grey map of
the scanner takes the dynamic range as given and the map as linear.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, gaussian_filter, label, map_coordinates
from skimage.feature import match_template
from skimage.morphology import convex_hull_image

ANGLES = 256
"""Directions into which the wall is resampled to find the widths of speckle."""
LOCAL = 1 / 3
"""Standard deviation of local means over the thickness of the wall, by eye: of means as wide as the wall, its bright
strips remain and pass for speckle; of narrower ones, speckle itself is lost."""
SEARCH = 8
"""How far a window is sought to every side in the next frame, px."""

Statistics = dict[str, float]
Masks = NDArray[np.bool_]


@dataclass(frozen=True)
class Echo:
    """A clip of which the wall is known.

    Attributes
    ----------
    frames : ndarray of shape (frame, axial, lateral), uint8
    wall, cavity : ndarray of shape (frame, axial, lateral), bool
    scan : ndarray of shape (axial, lateral), bool
        Pixels within the sector.
    probe : tuple of float
        Row and column of the tip of the sector, px.
    free_side : int
        1 if the free wall is to the right of the cavity, -1 if to the left.
    phase : ndarray of shape (frame,)
        Times of the frames since end-diastole over the cycle.
    es_phase : float
        That of end-systole.
    pairs : list of tuple of int
        Frames of which the second follows the first by 1/27 of a cycle.
    dynamic_range_dB : float
        From black to white.
    """

    frames: NDArray[np.uint8]
    wall: Masks
    cavity: Masks
    scan: Masks
    probe: tuple[float, float]
    free_side: int
    phase: NDArray[np.float64]
    es_phase: float
    pairs: list[tuple[int, int]]
    dynamic_range_dB: float = 60.0

    @cached_property
    def decibels(self) -> NDArray[np.float64]:
        """Levels below white (frame, axial, lateral), dB."""
        return (self.frames / 255.0 - 1) * self.dynamic_range_dB

    @cached_property
    def depth(self) -> NDArray[np.float64]:
        """Distance of the pixels of the wall from its borders (frame, axial, lateral), px."""
        return np.stack([distance_transform_edt(wall) for wall in self.wall])

    @cached_property
    def thickness(self) -> float:
        """Mean thickness of the wall, px: in a slab the mean distance from the nearer face is a quarter of it."""
        return 4 * float(self.depth[self.wall].mean())


def peak(before: np.ndarray, after: np.ndarray, place: tuple[int, int], side: int) -> float:
    """Largest normalised correlation of a window of one frame with windows near it in the next."""
    row, column = (middle - side // 2 for middle in place)
    window = before[row : row + side, column : column + side].astype(float)
    near = after[row - SEARCH : row + side + SEARCH, column - SEARCH : column + side + SEARCH].astype(float)
    return float(match_template(near, window).max()) if window.std() > 0 else np.nan


def cavity_of(wall: Masks) -> Masks:
    """What the wall (axial, lateral) encloses, up to the straight line across its base."""
    parts, _ = label(convex_hull_image(wall) & ~wall)
    return parts == np.argmax(np.bincount(parts.ravel())[1:]) + 1


def statistics(echo: Echo) -> Statistics:
    """All statistics of a clip, with the unit in their names."""
    return _contrasts(echo) | _speckle(echo) | _widths(echo) | _cycle(echo) | _following(echo)


def percentiles(echo: Echo) -> dict[str, list[float]]:
    """Grey levels that 10, 50 and 90 % of the pixels of a tissue do not exceed."""
    outside = echo.scan & ~echo.wall & ~echo.cavity
    tissues = {"wall": echo.wall, "cavity": echo.cavity, "outside": outside}
    return {name: np.percentile(echo.frames[where], (10, 50, 90)).tolist() for name, where in tissues.items()}


def _contrasts(echo: Echo) -> Statistics:
    """Levels of the tissues against each other."""
    wall, cavity = echo.frames[echo.wall].astype(float), echo.frames[echo.cavity].astype(float)
    beyond = np.stack([_beyond_free_wall(echo, k) for k in range(len(echo.frames))])
    free = echo.wall & _on_free_side(echo)
    level = echo.decibels
    return {
        "wall / blood, dB": level[echo.wall].mean() - level[echo.cavity].mean(),
        "wall / blood, contrast to speckle": (wall.mean() - cavity.mean()) / np.hypot(wall.std(), cavity.std()),
        "free wall / tissue beyond, dB": level[free].mean() - level[beyond].mean() if free.any() else np.nan,
        "wall, 10 to 90 %, dB": float(np.ptp(np.percentile(level[echo.wall], (10, 90)))),
        "wall as dark as blood, share": float((wall <= np.median(cavity)).mean()),
    }


def _on_free_side(echo: Echo) -> Masks:
    """Half of the image with the free wall, at the heights of the cavity but for its ends, in every frame."""
    rows, columns = np.indices(echo.scan.shape)
    sides = []
    for cavity in echo.cavity:
        middle, (low, high) = columns[cavity].mean(), np.percentile(rows[cavity], (20, 90))
        sides.append((echo.free_side * (columns - middle) > 0) & (rows > low) & (rows < high))
    return np.stack(sides)


def _beyond_free_wall(echo: Echo, frame: int) -> Masks:
    """Band beside the free wall, half as thick as the wall."""
    heart_ = echo.wall[frame] | echo.cavity[frame]
    near = distance_transform_edt(~heart_) < echo.thickness / 2
    return near & ~heart_ & echo.scan & _on_free_side(replace(echo, cavity=echo.cavity[[frame]]))[0]


def _local_mean(values: NDArray[np.float64], where: Masks, thickness: float) -> NDArray[np.float64]:
    """Gaussian mean of an image over the wall."""
    width = LOCAL * thickness
    weight = gaussian_filter(where.astype(float), width)
    return gaussian_filter(np.where(where, values, 0), width) / np.where(where, weight, 1)


def _speckle(echo: Echo) -> Statistics:
    """Mean over deviation of the envelope, 1.91 if fully developed, and Nakagami's m = mean(I)^2 / var(I), then 1."""
    intensity = []
    for level, wall in zip(echo.decibels, echo.wall, strict=True):
        power = 10 ** (level / 10)
        intensity.append(power[wall] / _local_mean(power, wall, echo.thickness)[wall])
    values = np.concatenate(intensity)
    envelope = np.sqrt(values)
    return {
        "SNR of the envelope": envelope.mean() / envelope.std(),
        "Nakagami m": values.mean() ** 2 / values.var(),
    }


def _widths(echo: Echo) -> Statistics:
    """Full widths at half of the autocorrelation of levels in the wall, along and across the beam."""
    found = [_widths_of_frame(echo, k) for k in range(len(echo.frames))]
    axial, near, far, lateral = np.nanmean(found, axis=0)
    return {
        "axial width / wall": axial / echo.thickness,
        "lateral / axial width": lateral / axial,
        "lateral width, far / near half": far / near,
    }


def _widths_of_frame(echo: Echo, frame: int) -> tuple[float, float, float, float]:
    """Axial width, and lateral ones of the near and the far half of the wall and of all of it, px."""
    wall = echo.wall[frame]
    rows, columns = np.nonzero(wall)
    reach = np.hypot(rows - echo.probe[0], columns - echo.probe[1])
    angle = np.arctan2(columns - echo.probe[1], rows - echo.probe[0])
    ranges, angles = np.arange(reach.min(), reach.max()), np.linspace(angle.min(), angle.max(), ANGLES)
    grid = echo.probe[0] + np.outer(np.cos(angles), ranges), echo.probe[1] + np.outer(np.sin(angles), ranges)
    level = echo.decibels[frame] - _local_mean(echo.decibels[frame], wall, echo.thickness)
    value = map_coordinates(level, grid, order=1)
    inside = map_coordinates(wall.astype(float), grid, order=1) > 0.99
    step, middle = angles[1] - angles[0], len(ranges) // 2
    near = _width(value[:, :middle], inside[:, :middle], 0) * step * ranges[:middle].mean()
    far = _width(value[:, middle:], inside[:, middle:], 0) * step * ranges[middle:].mean()
    return _width(value, inside, 1), near, far, (near + far) / 2


def _width(value: NDArray[np.float64], inside: Masks, axis: int) -> float:
    """Full width at half maximum of the autocorrelation along an axis, samples, by linear interpolation."""
    value, inside = np.moveaxis(np.where(inside, value, 0), axis, 0), np.moveaxis(inside, axis, 0)
    before = 1.0
    power = (value**2).sum() / max(inside.sum(), 1)
    for lag in range(1, len(value)):
        both = inside[lag:] & inside[:-lag]
        now = (value[lag:] * value[:-lag])[both].mean() / power if both.any() else 0.0
        if now < 0.5:
            return 2 * (lag - 1 + (before - 0.5) / (before - now))
        before = now
    return np.nan


def _cycle(echo: Echo) -> Statistics:
    """Power in the middle of the wall over the cycle, by a constant and two harmonics."""
    middle = echo.depth > echo.thickness / 4
    power = [
        10 * np.log10((10 ** (level[where] / 10)).mean()) for level, where in zip(echo.decibels, middle, strict=True)
    ]

    def harmonics(phase: NDArray[np.float64]) -> NDArray[np.float64]:
        turns = 2 * np.pi * np.outer(np.atleast_1d(phase), (1, 2))
        return np.hstack([np.ones((len(turns), 1)), np.cos(turns), np.sin(turns)])

    weights = np.linalg.lstsq(harmonics(echo.phase), np.array(power), rcond=None)[0]
    fine = np.linspace(0, 1, 400, endpoint=False)
    course = harmonics(fine) @ weights
    at_ed, at_es = harmonics(np.array([0.0, echo.es_phase])) @ weights
    return {"ED over ES, dB": at_ed - at_es, "time of the minimum / of ES": fine[course.argmin()] / echo.es_phase}


def _following(echo: Echo) -> Statistics:
    """Mean peak correlation of windows as wide as the wall, in its middle, with those near them in the next frame."""
    side = 2 * round(echo.thickness / 2)
    apart, margin = max(side // 2, 1), side // 2 + SEARCH
    found = []
    for before, after in echo.pairs:
        places = np.argwhere(echo.depth[before] > 0.4 * echo.thickness)
        places = places[(places % apart == 0).all(axis=1)]
        room = (places >= margin) & (places < np.array(echo.scan.shape) - margin)
        both = echo.frames[before], echo.frames[after]
        found += [peak(*both, (int(row), int(column)), side) for row, column in places[room.all(axis=1)]]
    return {"wall, next frame, correlation": float(np.nanmean(found))}
