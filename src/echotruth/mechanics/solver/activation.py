"""When and how strongly each cell of the wall is active."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from echotruth.arrays import Floats


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

    def tension_fraction(self) -> Floats:
        """dT/dT_Ca of each cell within one frame, shape (n_cells,)."""
        return self.scale * np.clip(1 - self.delay / self.step, 0, 1)

    def tension(self, t_ca: Sequence[float] | Floats) -> Floats:
        """Tension of each cell, shape (n_cells,), Pa, in the last of the frames whose T_Ca (Pa) is given."""
        frame = np.arange(-1, len(t_ca))
        return self.scale * np.interp(len(t_ca) - 1 - self.delay / self.step, frame, [0.0, *t_ca], left=0.0)

    def periodic_tension(self, t_ca: Floats, frame: int) -> Floats:
        """Tension of each cell, shape (n_cells,), Pa, in a frame of any beat; T_ca (n_frames,), Pa, is that of one."""
        frames = np.arange(len(t_ca))
        return self.scale * np.interp(frame - self.delay / self.step, frames, t_ca, period=len(t_ca))
