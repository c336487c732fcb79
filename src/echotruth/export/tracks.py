"""Points of the tissue followed through a clip: those of a grid of pixels that are in the wall at end-diastole."""

from __future__ import annotations

import numpy as np
import xarray as xr

from echotruth.export.clip import Clip
from echotruth.notebook.point_tracks import point_tracks


def tracks(clip: Clip, step: int) -> xr.Dataset:
    """Follow the centres of every so many pixels, exactly, by the mesh.

    Parameters
    ----------
    clip : Clip
    step : int
        Pixels from one point to the next.

    Returns
    -------
    Dataset
        `pixel` (frame, point, plane), px, `elevation` (frame, point), m, and `visible` (frame, point), as
        :func:`echotruth.point_tracks` returns them, of the points in the wall.
    """
    along = np.arange(step // 2, clip.size, step)
    lateral, axial = np.meshgrid(along, along)
    found = point_tracks(clip.heart, clip.truth("image"), np.stack([lateral.ravel(), axial.ravel()], axis=-1))
    return found.isel(point=found["elevation"].isel(frame=0).notnull().values)
