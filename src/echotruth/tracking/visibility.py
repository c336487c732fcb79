"""Places of the image in which tissue is not seen: its speckle is no more alike from frame to frame than noise is.

A shadow, a dropout or blood stays where it is, and tissue moves through it. So what the correlations of single frames
cannot tell, since they scatter, their mean over all frames at a place of the image can.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from echotruth.tracking.flow import interpolate_field

NOISE_NCC = 0.15
"""Mean correlation below which a place shows noise. In a small window noise has one that scatters by some 0.4 from
frame to frame, thus by 0.06 over 20 frames and two ways."""


@dataclass(frozen=True)
class Visibility:
    """Where in the image tissue is seen.

    Attributes
    ----------
    seen : ndarray of shape (rows, columns)
        1 in blocks of the image in which tissue is seen or was never looked for, 0 in the others.
    side : float
        Side of a block, px.
    """

    seen: np.ndarray
    side: float

    def at(self, positions: np.ndarray) -> np.ndarray:
        """How far tissue is seen at positions (n, 2), lateral, axial, px: from 0 to 1, linear between the blocks."""
        place = (positions + 0.5) / self.side - 0.5
        inside = np.clip(place, 0, np.array(self.seen.shape[::-1]) - 1)
        return interpolate_field(self.seen[..., None], inside)[:, 0]


def visibility(
    likeness: Iterable[tuple[np.ndarray, np.ndarray]], shape: tuple[int, int], side: float, edge: int
) -> Visibility:
    """Where in the image tissue is seen.

    Parameters
    ----------
    likeness : iterable of (positions, correlation)
        Of every match of two frames: positions (n, 2) in the later one, lateral, axial, px, and the correlation around
        each (n,); NaN where there is no texture.
    shape : tuple of int
        Axial and lateral size of the image, px.
    side : float
        Side of the blocks over which correlations are averaged, px.
    edge : int
        Blocks around such a place that count as part of it: the edge of a shadow looks like tissue that is at rest.
    """
    blocks = tuple(max(1, int(np.ceil(length / side))) for length in shape)
    total, count = np.zeros(blocks), np.zeros(blocks)
    for positions, correlation in likeness:
        known = np.isfinite(correlation)
        place = np.clip(((positions[known] + 0.5) / side).astype(int), 0, np.array(blocks[::-1]) - 1)
        np.add.at(total, (place[:, 1], place[:, 0]), correlation[known])
        np.add.at(count, (place[:, 1], place[:, 0]), 1.0)
    total, count = (ndimage.gaussian_filter(values, 1.0, mode="constant") for values in (total, count))
    mean = np.divide(total, count, out=np.ones(blocks), where=count > 0)
    unseen = ndimage.binary_dilation(mean < NOISE_NCC, iterations=edge) if edge else mean < NOISE_NCC
    return Visibility((~unseen).astype(float), side)
