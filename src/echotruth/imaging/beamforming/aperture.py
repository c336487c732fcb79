"""The aperture: which elements serve a point, and with what weights.

The aperture of a point at range r is r / f_number wide, at most the whole array, and centred on the foot of its
line; where it would stick out of the array it is moved in.
"""

from __future__ import annotations

import numba
import numpy as np

from echotruth.config import Probe, Rf
from echotruth.imaging.rf.probe import element_centres

NARROWEST = 2
"""Pitches that an aperture is wide at least, so that near points have one too."""


@numba.njit(cache=True)
def window(offset, tapered):
    """Weight of an element (float32) at `offset` from the middle of the aperture, as a share of its width (float32).

    cos^2(pi offset) if `tapered`, else 1; 0 outside. The cosine is its Taylor polynomial, right to 1e-8 in the
    aperture, for a polynomial can be taken of many elements at a time.
    """
    s = np.float32(np.pi**2) * offset * offset
    cosine = np.float32(1) - s * (
        np.float32(1 / 2)
        - s
        * (
            np.float32(1 / 24)
            - s
            * (
                np.float32(1 / 720)
                - s * (np.float32(1 / 40320) - s * (np.float32(1 / 3628800) - s * np.float32(1 / 479001600)))
            )
        )
    )
    weight = cosine * cosine if tapered else np.float32(1)
    return weight if abs(offset) <= np.float32(0.5) else np.float32(0)


class Aperture:
    """Rule of the aperture of a probe.

    Parameters
    ----------
    probe, rf
        The array, and `apodization` and `f_number`.

    Attributes
    ----------
    centres : ndarray (elements,)
        Lateral coordinates of the elements, m.
    tapered : bool
        Whether the weights are those of Hann, or all 1.
    """

    def __init__(self, probe: Probe, rf: Rf):
        pitch = probe.si().pitch
        self.centres = element_centres(probe)
        self.tapered = rf.apodization == "hann"
        self._length, self._narrowest, self._f_number = probe.elements * pitch, NARROWEST * pitch, rf.f_number

    def bounds(self, foot: np.ndarray, range_: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Middle and width of the aperture, m, shape as broadcast, of points at ranges (m) of lines with feet (m)."""
        foot, range_ = np.broadcast_arrays(foot, range_)
        width = np.full(foot.shape, self._length)
        if self._f_number:
            width = np.clip(range_ / self._f_number, min(self._narrowest, self._length), self._length)
        room = (self._length - width) / 2
        return np.clip(foot, -room, room), width

    def weights(self, foot: np.ndarray, range_: float) -> np.ndarray:
        """Weights (lines, elements), 1, for points at one range (m) of lines with feet (lines,), m."""
        middle, width = self.bounds(foot, range_)
        offset = (self.centres - middle[:, None]) / width[:, None]
        inside = np.abs(offset) <= 0.5
        return np.where(inside, np.cos(np.pi * offset) ** 2 if self.tapered else 1.0, 0.0)
