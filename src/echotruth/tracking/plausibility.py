"""What of a clip, and of the lengths of a tracker, should make one doubt its motion before it is tracked."""

from itertools import pairwise
from typing import Any

import numpy as np

REFERENCE_WALL_MM = 0.85
"""Thickness of the wall of the default mouse at end-diastole in a short axis, which the default lengths suit."""
LENGTHS = ("knots_mm", "windows_mm")
"""Settings that say how large a piece of tissue is followed; the last of several windows gives the result."""
MISFIT = 2.5
"""Thickness of the wall over that which the lengths suit, or the inverse, above which there is a warning."""
REPEATED = 0.03
"""Difference of two consecutive frames in the wall, over the upper quartile of these, below which both are the same
image: a video that is compressed anew hardly changes it."""
UNRELATED = 0.08
"""Mean correlation of consecutive frames in the wall below which they show nothing in common. White and blurred noise
of 12 frames is below 0.05, also if its gain changes along the depth; twelve hearts of 20 frames have 0.71 and more, and
those of the sample 0.68, and 0.50 in every second of their ten frames."""
SQUARE = 1 / 8
"""Side of the square of the local mean and contrast, over the longer side of the image: a wall or two."""
LEAST_FRAMES = 6
"""Frames of which one can say so at least: of fewer none need show a heart that hardly moves."""
NOISE = "consecutive frames have nothing in common in the wall, as in noise: they show no motion"
NAMED = 3
"""Frames that are named at most."""


def doubts(frames: np.ndarray, mask: np.ndarray, spacing: float, settings: Any) -> list[str]:
    """What should make one doubt.

    Parameters
    ----------
    frames : ndarray of shape (frame, axial, lateral)
        Grey values.
    mask : ndarray of shape (axial, lateral), bool
        The wall at end-diastole.
    spacing : float
        Distance of pixel centres, m.
    settings : Section
        Of a tracker, see `config/tracking.py`.

    Returns
    -------
    list of str
        A plain sentence each, without a full stop.
    """
    found = (
        NOISE if is_noise(frames, mask) else "",
        _repetition(repeated(frames, mask)),
        _misfit(mask, spacing, settings),
    )
    return [text for text in found if text]


def repeated(frames: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Which frames show the same image as the one before, (frame,), bool; where the mask is empty, none.

    `frames` (frame, axial, lateral) are grey values, `mask` (axial, lateral) is the wall at end-diastole.
    """
    same = np.zeros(len(frames), bool)
    if mask.any():
        wall = np.nan_to_num(frames[:, mask].astype(np.float32))
        change = np.array([np.abs(second - first).mean() for first, second in pairwise(wall)])
        same[1:] = change <= REPEATED * np.quantile(change, 0.75)
    return same


def wall_thickness(mask: np.ndarray) -> float:
    """Twice the largest distance of a pixel of the wall from the rest of the image (axial, lateral), px."""
    from scipy import ndimage  # whoever brings a tracker needs none

    return 2 * float(ndimage.distance_transform_edt(mask).max())


def consecutive_correlation(frames: np.ndarray, mask: np.ndarray) -> float:
    """Mean correlation of consecutive frames (frame, axial, lateral) of even contrast in the wall (axial, lateral).

    No motion is undone: of a heart the frames in which it hardly moves resemble one another, of noise none do. NaN if
    all are even.
    """
    grey = np.nan_to_num(frames.astype(float), posinf=0.0, neginf=0.0)
    wall = np.array([_even_contrast(frame)[mask] for frame in grey])
    wall -= wall.mean(1, keepdims=True)
    power, product = (wall**2).sum(1), (wall[1:] * wall[:-1]).sum(1)
    known = (power[1:] > 0) & (power[:-1] > 0)
    return float(np.mean(product[known] / np.sqrt(power[1:] * power[:-1])[known])) if known.any() else np.nan


def _even_contrast(image: np.ndarray) -> np.ndarray:
    """Grey values (axial, lateral), a little blurred, less their mean in a square about each pixel, over their standard
    deviation there."""
    half = max(2, round(SQUARE * max(image.shape) / 2))
    blurred = _square_mean(image, max(1, half // 8))
    local = _square_mean(blurred, half)
    variance = np.maximum(_square_mean(blurred**2, half) - local**2, 0)
    return (blurred - local) / np.sqrt(variance + 1e-3 * variance.mean() + 1e-12)


def _square_mean(values: np.ndarray, half: int) -> np.ndarray:
    """Mean (axial, lateral) over squares that reach `half` pixels to each side; the border goes on beyond the image."""
    total = np.pad(values, (half + 1, half), mode="edge").cumsum(0).cumsum(1)
    side = 2 * half + 1
    return (total[side:, side:] - total[:-side, side:] - total[side:, :-side] + total[:-side, :-side]) / side**2


def is_noise(frames: np.ndarray, mask: np.ndarray) -> bool:
    """Whether consecutive frames (frame, axial, lateral) have nothing in common in the wall (axial, lateral).

    Frames that repeat the one before do not count. Of fewer than `LEAST_FRAMES` others it is not judged.
    """
    others = frames[~repeated(frames, mask)]
    return bool(mask.any() and len(others) >= LEAST_FRAMES and consecutive_correlation(others, mask) < UNRELATED)


def _repetition(same: np.ndarray) -> str:
    """What is to be said of frames that repeat the one before."""
    numbers = np.flatnonzero(same)
    if not len(numbers):
        return ""
    if len(numbers) == len(same) - 1:
        return "all frames show the same image: nothing moves"
    if len(numbers) > 1 and (np.diff(numbers) == 2).all() and len(numbers) >= (len(same) - 1) // 2:
        return "every image comes twice: take one frame of each pair, with twice the time from frame to frame"
    named = ", ".join(map(str, numbers[:NAMED])) + (", ..." if len(numbers) > NAMED else "")
    return (
        f"{len(numbers)} of {len(same)} frames show the same image as the one before ({named}): the tissue seems to "
        "halt there and to jump afterwards"
    )


def _misfit(mask: np.ndarray, spacing: float, settings: Any) -> str:
    """What is to be said of lengths that do not suit the thickness of the wall."""
    key = next((name for name in LENGTHS if getattr(settings, name, None)), "")
    if not key or not mask.any():
        return ""
    thickness_mm = 1e3 * spacing * wall_thickness(mask)
    default = type(settings).model_fields[key].get_default()
    given, usual = (float(np.ravel(length)[-1]) for length in (getattr(settings, key), default))
    suited = REFERENCE_WALL_MM * given / usual
    if 1 / MISFIT <= thickness_mm / suited <= MISFIT:
        return ""
    return (
        f"{key} = {given:.3g} suits a wall {suited:.2g} mm thick, and this one has {thickness_mm:.2g} mm: give about "
        f"{usual * thickness_mm / REFERENCE_WALL_MM:.2g}, and other lengths of the tracker likewise, or leave them out"
    )
