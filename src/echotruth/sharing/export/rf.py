"""RF as uff, zea and echoxflow need it: channels without quantisation step, and places of the samples of the lines."""

from collections.abc import Iterator

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from echotruth.sharing.export.clip import ExportedClip


def open_rf(clip: ExportedClip) -> xr.Dataset:
    """Open the group `rf` of a view, without reading its arrays."""
    group = clip.repository.path("rf", clip.case.id, clip.view)
    return xr.open_zarr(clip.repository.store, group=group, consolidated=False, chunks=None, zarr_format=3)


def scaled_channels(rf: xr.Dataset) -> Iterator[NDArray[np.float32]]:
    """Channels of each frame, (transmitter, receiver, sample): stored integers times their quantisation step."""
    for channels, step in zip(rf.channels, rf.channels_step, strict=True):
        yield channels.values * np.float32(step)


def sample_positions(rf: xr.Dataset) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lateral and axial coordinates of the samples of all lines, (line, range), m.

    x = x_0 + r sin(theta), z = r cos(theta) for a line of angle theta from x_0.
    """
    distance, angle = rf.range.values, rf.line_angle.values[:, None]
    return rf.line_origin.values[:, None] + np.sin(angle) * distance, np.cos(angle) * distance
