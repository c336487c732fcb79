"""When and how strongly each cell of the wall is active."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from echotruth.fem.tetrahedra import Floats


@dataclass(frozen=True)
class Activation:
    """Tension of the cells from that of the healthy, undelayed wall: T(x, t) = scale(x) T_Ca(t - delay(x)).

    Before end-diastole T_Ca is zero; between frames it is linear in time.

    Attributes
    ----------
    scale : ndarray of shape (n_cells,)
    delay : ndarray of shape (n_cells,), s
    step : float, s
        Time between frames.
    """

    scale: Floats
    delay: Floats
    step: float

    def share(self) -> Floats:
        """Part of T_Ca at a frame that each cell bears in that frame, shape (n_cells,)."""
        return self.scale * np.clip(1 - self.delay / self.step, 0, 1)

    def before(self, past: Sequence[float]) -> Floats:
        """What each cell bears, shape (n_cells,), Pa, of the T_Ca (Pa) of the frames before this one."""
        return self.scale * self._course([*past, 0.0])

    def tension(self, course: Sequence[float]) -> Floats:
        """Tension of each cell, shape (n_cells,), Pa, in the last of the frames whose T_Ca (Pa) is given."""
        return self.scale * self._course(course)

    def _course(self, course: Sequence[float]) -> Floats:
        frame = np.arange(-1, len(course))
        return np.interp(len(course) - 1 - self.delay / self.step, frame, [0.0, *course], left=0.0)
