"""The aortic root: a tube that rises from the base between septum and mitral valve.

It begins at the aortic annulus (:mod:`.annulus`), leans outwards, and is widest at the sinuses. Radii are those of
adults of 24.5 mm across at the annulus, 32 at the sinuses, 27.5 at the sinotubular junction and 28.5 mm above (Lang et
al., J Am Soc Echocardiogr 28 (2015) 1, means of men and women), as the rim of the human preset, 26 mm, is to them;
heights, length and lean were chosen by eye.
"""

from math import radians

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.heart import Heart
from echotruth.imaging.labels import TissueLabel
from echotruth.imaging.medium.annulus import AORTIC_DISTANCE, AORTIC_OUTWARDS, AORTIC_RADIUS, AORTIC_WALL, Rim, Ring

LEAN = radians(25)
"""Angle of the root from the axis of the rim, away from the mitral valve, rad."""
PROFILE = ((0.0, AORTIC_RADIUS), (0.35, 0.65), (0.8, 0.56), (1.1, 0.58))
"""Height above the aortic annulus and inner radius, both over the radius of the rim."""
LENGTH = 1.7
"""Length over the radius of the rim."""
AORTIC_WALL_DB = 6.0
"""Echo power of its wall over that of other walls of chambers, dB; by eye."""
UPWARDS = np.array([0.0, 0.0, 1.0])
VALVE = 0.2
"""Height at which the aortic valve is hinged, along the root and over the radius of the rim: there its annulus, which
lies across the root, reaches down to the base."""


def aortic_tissue(heart: Heart, position: Floats) -> NDArray[np.uint8]:
    """Tissue (n,) of the root at positions (n, 3), m, at end-diastole, its blood or its wall; 0 elsewhere."""
    place = Rim(heart)(0).to_ring(position) - AORTIC_DISTANCE * AORTIC_OUTWARDS
    height = place @ _axis()
    radius = np.linalg.norm(place - height[:, None] * _axis(), axis=1) - np.interp(height, *np.array(PROFILE).T)
    tissue = np.zeros(len(position), np.uint8)
    above = (place[:, 2] >= 0) & (height < LENGTH)
    tissue[above & (radius < AORTIC_WALL)] = TissueLabel.AORTIC_WALL
    tissue[above & (radius < 0)] = TissueLabel.AORTIC_ROOT
    return tissue


def valve_ring(rim: Ring, azimuth: Floats) -> Floats:
    """Points (n, 3), m, at which the aortic valve is hinged at end-diastole, at azimuths (n,), rad, around the root."""
    outwards, axis = np.cos(LEAN) * AORTIC_OUTWARDS - np.sin(LEAN) * UPWARDS, _axis()
    across = np.outer(np.cos(azimuth), outwards) + np.outer(np.sin(azimuth), np.cross(axis, outwards))
    return rim.to_heart(AORTIC_DISTANCE * AORTIC_OUTWARDS + VALVE * axis + AORTIC_RADIUS * across)


def _axis() -> Floats:
    """Unit vector (3,) along the root, anterior, commissural and upwards."""
    return np.sin(LEAN) * AORTIC_OUTWARDS + np.cos(LEAN) * UPWARDS
