"""RF as uff and zea need it: channels without quantisation step, and positions of the samples of the lines."""

from collections.abc import Iterator

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from echotruth.export.clip import Clip


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


def open_rf(clip: Clip) -> xr.Dataset:
    """Open the group `rf` of one case and view, without reading its arrays; the size of the elements is the case's."""
    rf = xr.open_zarr(clip.repository.store, group="rf", consolidated=False, chunks=None, zarr_format=3)
    probe = clip.case.config.probe.si()
    rf = rf.assign_attrs(element_width=probe.width, element_height=probe.height)
    return rf.sel(case=clip.case.id, view=clip.view)


def missing_rf(clip: Clip) -> str:
    """Why a view has no RF that could be exported, in one sentence; "" if it has."""
    repository = clip.repository
    kept = [name for name in ("lines", "channels") if name in repository.names("rf")]
    if not kept:
        return f"{repository.store} keeps no RF: set rf.keep to [lines, channels] and run it again"
    if not all(repository.is_written(f"rf/{name}", clip.case.id, clip.view) for name in kept):
        why = "see cases/reason for why, or run it to its end"
        return f"{clip.case.id} has no RF of {clip.view} in {repository.store}: {why}"
    return ""
