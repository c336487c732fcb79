"""How strongly each cell of the wall is active in a beat: when it is activated, and how long its fibres are then.

A healthy heart in its loop gives T_Ca(t), the tension along its own course of the stretch, lambda_h(t). Another heart
bears, in each cell with its delay d,

    T(t) = g(t) scale T_Ca(t - d),    D = lambda(t) - lambda_h(t - d),
    g = exp(k D) until the cell is activated, then dg/dt = (exp(k D) - g) / tau,

with lambda along the fibre since the end-diastole of the beat, and tau the fall time where g falls, the recovery time
where it rises; each beat begins anew. So g is one in the healthy heart. It puts together two properties of the muscle:
longer sarcomeres are activated more by the same calcium (length-dependent activation), and muscle that has shortened
stays weaker than its length explains (deactivation by shortening; Leach 1980, Am J Physiol 238, H8).
"""

from math import log

import numpy as np

from echotruth.arrays import Floats

MAX_GAIN = 3.0
"""Bound of exp(k D), chosen: the wall of an ejecting heart bears a third of what muscle can (ter Keurs 2012,
PMC3568939).
"""

FALL_TIME, RECOVERY_TIME = 0.04, 3.0
"""Time constants tau over the period of a beat: 5 and 33 ms to fall, .4 and 2.4 s to recover in mouse and human. Muscle
is deactivated while it shortens (Leach 1980), and what shortening takes from the force is long lasting (Herzog 1998, J
Biomech 31, 1163); no source has these numbers for hearts."""


def gain_after(gain: Floats, goal: Floats, duration: float) -> Floats:
    """Gain g of active cells a duration, in beats, after it was `gain`, for a constant goal exp(k D)."""
    time = np.where(goal < gain, FALL_TIME, RECOVERY_TIME)
    return goal + (gain - goal) * np.exp(-duration / time)


class Activation:
    """Tension of the cells of a beating heart, frame by frame, beat after beat.

    Parameters
    ----------
    twitch : ndarray of shape (n_frames,), Pa
        T_Ca of one beat; between frames it is linear in time.
    healthy : ndarray of shape (n_frames, n_cells)
        lambda_h.
    scale : ndarray of shape (n_cells,)
    delay : ndarray of shape (n_cells,)
        In beats.
    sensitivity : float
        k.
    """

    def __init__(self, twitch: Floats, healthy: Floats, scale: Floats, delay: Floats, sensitivity: float) -> None:
        self.twitch, self._healthy, self._scale, self._sensitivity = twitch, healthy, scale, sensitivity
        self._delay = delay * len(twitch)  # in frames
        self._gain, self._at_ed = np.ones(len(scale)), np.ones(len(scale))

    def advance(self, frame: int, stretch: Floats) -> Floats:
        """Tension of the cells in the frame after this one.

        Parameters
        ----------
        frame : int
            0 is end-diastole of the first beat; frames are to come in turn.
        stretch : ndarray of shape (n_cells,)
            Along the fibres, in this frame, from any state.

        Returns
        -------
        ndarray of shape (n_cells,), Pa
        """
        of_beat = frame % len(self.twitch)
        if of_beat == 0:
            self._at_ed, self._gain = stretch, np.ones(len(stretch))
        difference = stretch / self._at_ed - self._healthy_stretch(of_beat)
        goal = np.exp(np.minimum(self._sensitivity * difference, log(MAX_GAIN)))
        active = of_beat + 1 > self._delay
        self._gain = np.where(active, gain_after(self._gain, goal, 1 / len(self.twitch)), goal)
        return self.tension(frame + 1)

    def tension(self, frame: int) -> Floats:
        """Tension of the cells in a frame, (n_cells,), Pa, with the gain that they have now."""
        frames = len(self.twitch)
        t_ca = np.interp(frame - self._delay, np.arange(frames), self.twitch, period=frames)
        return self._gain * self._scale * t_ca

    def _healthy_stretch(self, frame: int) -> Floats:
        """lambda_h(t - d), (n_cells,), of each cell; that of end-diastole until it is activated."""
        phase = np.maximum(frame - self._delay, 0.0)
        before, cells = phase.astype(int), np.arange(len(phase))
        first, second = self._healthy[before, cells], self._healthy[(before + 1) % len(self._healthy), cells]
        return first + (phase - before) * (second - first)
