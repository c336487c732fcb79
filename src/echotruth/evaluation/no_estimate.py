"""Why a tracker has no estimate of a strain or a rotation, in words."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from echotruth.arrays import Floats
from echotruth.config import Config
from echotruth.evaluation.strain import MAX_SPACING, RADIUS
from echotruth.tracking.point_grid import spacing_px

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
    return (is_strain and coarse_grid(config)) or LOST


def of_scores(row: Mapping[str, Any], plane: str, config: Config) -> str:
    """Why a row of scores lacks a strain that its view shows; empty if it lacks none.

    Parameters
    ----------
    row : mapping
        The results of :func:`.scoring.metrics`, and `failure`.
    plane : {"short_axis", "long_axis"}
    config : Config
        Of the case.
    """
    tangential, line = ("e_cc", "gcs") if plane == "short_axis" else ("e_ll", "gls")
    regional = (f"{part}_pp" for name in ("e_rr", tangential) for part in (f"{name}_rms", f"segment_{name}_error"))
    shown = np.array([row[name] for name in (*regional, f"{line}_error_pp")], float)
    return reason(shown, np.array(row["coverage_percent"], float), config, row["failure"])


def coarse_grid(config: Config) -> str:
    """Why the points are too far apart for strain at the borders of the wall, with a remedy; empty if they are not."""
    size, apart = config.bmode.sizes[0], spacing_px(config)
    if apart <= MAX_SPACING * RADIUS * size:
        return ""
    too_few = f"points {apart} px apart in an image of {size} px are too few through the wall for strain at its borders"
    if apart == 1:
        return f"bmode.size_px = {config.bmode.size_px}: {too_few}: use a larger one"
    return f"tracking.grid = {config.tracking.grid:g}: {too_few}: use 0.01 or less"
