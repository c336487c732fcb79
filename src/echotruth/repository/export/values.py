"""Arrays that both formats need: channels without quantisation step, and positions of the samples of the lines."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray as xr


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
