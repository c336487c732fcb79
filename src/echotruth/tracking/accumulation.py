"""Motion along the path of the tissue, gathered from the steps that a tracker of pairs finds."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np


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
    reference : {"ED", "previous"}
        Against `ED` every frame is compared with frame 0 at the points' first place; against `previous` each step is
        read where the point then is, and the steps are added: a point once lost stays lost.

    Returns
    -------
    displacement : ndarray of shape (frame, n, 2)
        Lateral, axial, px.
    quality : ndarray of shape (frame, n)
        1 at frame 0.
    """
    total = np.zeros((len(frames), *points.shape))
    quality = np.ones(total.shape[:2])
    first = pairs.prepare(frames[0])
    for t in range(1, len(frames)):
        second = pairs.prepare(frames[t])
        start = total[t - 1] if reference == "previous" else np.zeros_like(points)
        step, quality[t] = pairs.match(first, second, points + start)
        total[t] = start + step
        if reference == "previous":
            first = second
    quality[np.isnan(total).any(-1)] = np.nan
    return total, quality
