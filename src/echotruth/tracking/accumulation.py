"""Motion along the path of the tissue, gathered from the steps that a tracker of pairs finds."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Protocol

import numpy as np

from echotruth.tracking import bidirectional


class Pairs(Protocol):
    """A tracker that compares two images."""

    def prepare(self, image: np.ndarray) -> Any:
        """Whatever of an image is worth working out once.

        Parameters
        ----------
        image : ndarray of shape (axial, lateral)
            Grey values.
        """

    def match(self, first: Any, second: Any, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Motion from one prepared image to another.

        Parameters
        ----------
        first, second
            What :meth:`prepare` returned.
        points : ndarray of shape (n, 2)
            Places in the first image: lateral, axial, px; not a number where there is none.

        Returns
        -------
        step : ndarray of shape (n, 2)
            Where the tissue at each place goes: lateral, axial, px; NaN where that cannot be told.
        quality : ndarray of shape (n,)
            From 0 to 1.
        """


def accumulate(pairs: Pairs, frames: np.ndarray, points: np.ndarray, reference: str) -> tuple[np.ndarray, np.ndarray]:
    """Displacement of points since the first frame.

    Parameters
    ----------
    pairs : Pairs
        The tracker.
    frames : ndarray of shape (frame, axial, lateral)
        Grey values; frame 0 is end-diastole.
    points : ndarray of shape (n, 2)
        Where the points are at end-diastole: lateral, axial, px (0 is the centre of the first pixel).
    reference : {"ED", "previous", "cycle"}
        Against `ED` every frame is compared with frame 0 at the points' first place; against `previous` each step is
        read where the point then is, and the steps are added: a point once lost stays lost. Over the `cycle` that is
        done from frame 0 both forwards and backwards, and the two are averaged by their :func:`doubt`.

    Returns
    -------
    displacement : ndarray of shape (frame, n, 2)
        Lateral, axial, px.
    quality : ndarray of shape (frame, n)
        1 at frame 0.
    """
    prepared = map(pairs.prepare, frames)
    if reference != "cycle":
        return _path(pairs, prepared, points, reference == "previous")
    images = list(prepared)
    moved, alike, variance = [], [], []
    for way in bidirectional.ways(len(images)):
        # The order in which a way takes the frames is its own inverse.
        total, quality = _path(pairs, (images[t] for t in way), points, True)
        moved.append(total[way])
        alike.append(quality[way])
        variance.append(doubt(quality)[way])
    share = bidirectional.share(*variance)
    return bidirectional.blend(share[..., None], *moved), bidirectional.blend(share, *alike)


def doubt(quality: np.ndarray) -> np.ndarray:
    """Variance of a sum of steps up to a factor, from the correlation of their images.

    Parameters
    ----------
    quality : ndarray of shape (frame, n)
        Correlation, in the order in which the steps were added; not a number where the point is lost.

    Returns
    -------
    ndarray of shape (frame, n)
        Sum of 1 / quality^2 - 1, to which the least variance of a shift found by correlation is proportional (Walker
        and Trahey 1995, IEEE Trans Ultrason Ferroelectr Freq Control 42:301); infinite once lost.
    """
    known = np.where(quality > 0, np.minimum(quality, 1), np.nan)
    return np.cumsum(np.nan_to_num(1 / known**2 - 1, nan=np.inf), axis=0)


def _path(pairs: Pairs, images: Iterator[Any], points: np.ndarray, stepwise: bool) -> tuple[np.ndarray, np.ndarray]:
    """What :func:`accumulate` returns, frame to frame or against the first, from prepared images."""
    total, quality = [np.zeros_like(points)], [np.ones(len(points))]
    first = next(images)
    for second in images:
        start = total[-1] if stepwise else total[0]
        step, alike = pairs.match(first, second, points + start)
        total.append(start + step)
        quality.append(np.where(np.isnan(total[-1]).any(-1), np.nan, alike))
        if stepwise:
            first = second
    return np.array(total), np.array(quality)
