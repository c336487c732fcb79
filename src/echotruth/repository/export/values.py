"""What the formats share: the echoes as numbers with a unit step, and where the samples of the lines are."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray as xr


def echoes(rf: xr.Dataset) -> Iterator[NDArray[np.float32]]:
    """Channels of each frame, (transmitters, receivers, samples), from the whole numbers that are stored."""
    for channels, step in zip(rf.channels, rf.channels_step, strict=True):
        yield channels.values * np.float32(step)


def places(rf: xr.Dataset) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lateral and axial coordinates of the samples of all lines, (lines, ranges), m."""
    along = rf.range.values
    lateral = rf.line_foot.values[:, None] + np.sin(rf.line_angle.values)[:, None] * along
    return lateral, np.cos(rf.line_angle.values)[:, None] * along
