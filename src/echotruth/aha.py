"""AHA segments of the left ventricle (Cerqueira 2002, Circulation 105:539) and their bullseye plot."""

from math import pi

import numpy as np

_WALLS = ("anterior", "anteroseptal", "inferoseptal", "inferior", "inferolateral", "anterolateral")
SEGMENT_NAMES = (
    *(f"{level} {wall}" for level in ("basal", "mid") for wall in _WALLS),
    *("apical anterior", "apical septal", "apical inferior", "apical lateral", "apex"),
)
"""Names of segments 1..17."""

APEX_SEGMENT = 17

TIE = 1e-9
"""Sectors and thirds by which points are moved: those on a border, as many centroids of a regular mesh are, belong to
the next segment whatever the last bits of their coordinates."""


def segment(position: np.ndarray, apex_z: float) -> np.ndarray:
    """AHA segment of points of the wall.

    Parameters
    ----------
    position : ndarray of shape (..., 3)
        Unloaded x, y, z in the heart frame, m: the base at z = 0, anterior +y, septal +x.
    apex_z : float
        z of the unloaded endocardial apex, m, negative.

    Returns
    -------
    ndarray of shape (...), uint8
        1..17; 17 is the wall beyond the endocardial apex. 0 where a position is NaN.

    Raises
    ------
    ValueError
        If the apex is not below the base.
    """
    if not apex_z < 0:
        raise ValueError(f"The endocardial apex must lie below the base plane (z < 0), not at z = {apex_z} m.")
    x, y, z = np.moveaxis(np.asarray(position, float), -1, 0)
    third = 3 * z / apex_z + TIE
    # From anterior through the septum, as the numbers run.
    azimuth = pi / 2 - np.arctan2(y, x)
    number = np.full(z.shape, APEX_SEGMENT, float)
    for ring, count, first in ((2, 4, 13), (1, 6, 7), (0, 6, 1)):
        sector = np.floor(azimuth / (2 * pi / count) + 0.5 + TIE) % count
        # The base plane itself moves within rounding, so the basal ring has no upper end.
        number = np.where(third < ring + 1, first + sector, number)
    return np.where(np.isfinite(azimuth + third), number, 0).astype(np.uint8)


def _bullseye() -> tuple[tuple[float, float, float, float], ...]:
    """Sectors counter-clockwise from segment 1 at the top of the page, base outermost."""
    sectors = []
    for count, inner in ((6, 0.75), (6, 0.5), (4, 0.25)):
        width = 2 * pi / count
        for k in range(count):
            start = pi / 2 + (k - 0.5) * width
            sectors.append((inner, inner + 0.25, start, start + width))
    return (*sectors, (0.0, 0.25, 0.0, 2 * pi))


BULLSEYE = _bullseye()
"""Sectors of segments 1..17 in the bullseye plot: inner and outer radius (of a unit disc), start and stop angle, rad,
counter-clockwise on the page from its right. Seen from the apex: anterior at the top, septum on the left."""
