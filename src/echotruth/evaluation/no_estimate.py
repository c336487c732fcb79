"""Why a tracker has no estimate of a strain or a rotation, in words."""

import numpy as np

from echotruth.arrays import Floats
from echotruth.config import Config
from echotruth.evaluation.strain import largest_grid

FAILED = "the tracker failed"
NOT_SHOWN = "the view does not show it"
LOST = "too few of its points were followed"


def reason(tracked: Floats, true: Floats, config: Config, failure: str = "", is_strain: bool = True) -> str:
    """Why tracked values are not known; empty if all of them are.

    Parameters
    ----------
    tracked, true : ndarray of any shape
        Values of a curve or of a moment of it; NaN where unknown.
    config : Config
        Of the case.
    failure : str
        Why the tracker failed on the clip; "" if it did not.
    is_strain : bool
        Whether they are strains, which need points close together; a rotation does not.
    """
    if np.isfinite(tracked).all():
        return ""
    if not np.isfinite(true).any():
        return NOT_SHOWN
    if failure:
        return f"{FAILED}: {failure}"
    most = largest_grid(config.bmode.size_px)
    if is_strain and config.tracking.grid_px > most:
        remedy = f"use {most} or less" if most else "raise bmode.size_px"
        return f"with tracking.grid_px = {config.tracking.grid_px} there are too few points through the wall: {remedy}"
    return LOST
