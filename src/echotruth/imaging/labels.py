"""Labels of the tissue at a pixel: layer, segment and region of disease, packed into one array; and which tissue it is.

:mod:`echotruth.imaging.truth` finds those of the wall, the segment by :func:`echotruth.aha.segment`, and
:mod:`echotruth.imaging.medium.tissue_images` those of its neighbours.
"""

from collections.abc import Mapping
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

LABELS = ("layer", "segment", "region")
"""In their order along the dimension `label`."""


class TissueLabel(IntEnum):
    """Tissues in realistic images; the first four are numbered as in CAMUS, the usual set of clinical clips.

    A label says what is there, however faint its echo.
    """

    OTHER = 0
    CAVITY = 1
    WALL = 2
    LEFT_ATRIUM = 3
    RIGHT_VENTRICLE = 4
    RIGHT_ATRIUM = 5
    RIGHT_FREE_WALL = 6
    ATRIAL_WALL = 7
    MITRAL_LEAFLET = 8
    PAPILLARY_MUSCLE = 9
    LUNG = 10
    CHEST_WALL = 11
    AORTIC_ROOT = 12
    AORTIC_WALL = 13
    AORTIC_CUSP = 14
    TRICUSPID_LEAFLET = 15


def pack(labels: Mapping[str, NDArray[np.generic]]) -> NDArray[np.generic]:
    """Labels in one array.

    Parameters
    ----------
    labels : dict of ndarray of shape (n,), uint8
        layer, segment and region; others are left out.

    Returns
    -------
    ndarray of shape (3, n), uint8
    """
    return np.stack([labels[name] for name in LABELS])


def unpack(labels: NDArray[np.uint8], dims: int = 2) -> dict[str, NDArray[Any]]:
    """Labels by name, as views of the packed array, and the wall.

    Parameters
    ----------
    labels : ndarray of shape (..., 3, axial, lateral), uint8
        As the repository has it: (frame, label, axial, lateral).
    dims : int
        Dimensions of the image: 3 of a volume, whose labels are (..., 3, axial, elevation, lateral).

    Returns
    -------
    dict of ndarray of shape (..., axial, lateral)
        mask (bool; whether the pixel centre is in the wall), layer (1 at the endocardium, 0 outside of the wall), AHA
        segment (0 outside) and region of disease (0 healthy or outside), uint8.
    """
    named = dict(zip(LABELS, np.moveaxis(labels, -1 - dims, 0), strict=True))
    return {"mask": named["layer"] > 0, **named}
