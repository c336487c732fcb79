"""Packets for Doppler: pulses in quick succession around a frame, between which the scatterers of the clip move.

Between frames the nodes of the heart move along cubic splines through their positions in all frames, periodic where
the motion closes, and the rigid motion before the probe by its formula. All lines of a pulse see one instant.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from echotruth.arrays import Floats
from echotruth.config import Config
from echotruth.fem.location import locate
from echotruth.fem.tetrahedra import MaterialPoints, interpolate
from echotruth.heart import Heart
from echotruth.imaging.medium.body import Scene
from echotruth.imaging.medium.medium import Medium
from echotruth.imaging.medium.random_process import Random
from echotruth.imaging.sequence import Sequence
from echotruth.imaging.view import Plane, moved
from echotruth.loop.cycle import frame_times, period

INSTANT = 1e-7
"""Half the time over which a velocity is a difference quotient, in periods of the cycle: even one that turns from each
of 1000 frames to the next is right to 1e-7."""


class MovingHeart:
    """A heart before the probe of a view, at any time.

    Parameters
    ----------
    heart : Heart
        Without the motion of the view.
    config : Config
    plane : Plane
    view : str
    """

    def __init__(self, heart: Heart, config: Config, plane: Plane, view: str) -> None:
        self._heart, self._config, self._plane, self._view = heart, config, plane, config.views[view]
        self.period, self.time = period(config.loop), frame_times(config.loop)
        frames, closes = np.eye(len(self.time)), not (_prescribed(config) and config.motion.time_course == "ramp")
        if closes:
            times = np.append(self.time, self.period)
            self._spline = CubicSpline(times, np.vstack([frames, frames[:1]]), bc_type="periodic")
        else:
            self._spline = CubicSpline(self.time, frames)

    def at(self, time: Floats) -> Heart:
        """The heart in the frames of the clip and, after these, at times (n,), s."""
        heart, time = self._heart, np.asarray(time)
        between = np.tensordot(self._spline(time), heart.displacement, 1)
        heart = replace(heart, displacement=np.concatenate([heart.displacement, between]))
        return moved(heart, self._plane, self._view.motion, self._config.loop, np.append(self.time, time))

    def velocity(self, frame: int, position: Floats) -> Floats:
        """Velocity in a frame of the tissue that is at positions in the image then.

        Parameters
        ----------
        frame : int
        position : ndarray of shape (n, 3), m
            Lateral, axial, elevation.

        Returns
        -------
        ndarray of shape (n, 3), m/s
            Lateral, axial, elevation; NaN outside the wall.
        """
        step = INSTANT * self.period
        around = self.at(self.time[frame] + step * np.array([-1, 1]))
        points = locate(around.positions(frame), around.cells, self._plane.to_heart(position))
        inside, velocity = points.cell >= 0, np.full(position.shape, np.nan)
        tissue = MaterialPoints(points.cell[inside], points.xi[inside])
        change = around.displacement[-1] - around.displacement[-2]
        velocity[inside] = interpolate(change, around.cells, tissue) @ self._plane.axes.T / (2 * step)
        return velocity


class PacketSequence:
    """Packets around the frames of one view.

    The scatterers are those of the clip. What changes at random from pulse to pulse, noise and decorrelation, is drawn
    for each packet.

    Parameters
    ----------
    config : Config
    heart : MovingHeart
    plane : Plane
    random : Random
    pulses : int
    interval : float, s
        From one pulse to the next.

    Attributes
    ----------
    scanner : Scanner
    """

    def __init__(
        self, config: Config, heart: MovingHeart, plane: Plane, random: Random, pulses: int, interval: float
    ) -> None:
        self._config, self._heart, self._plane, self._random = config, heart, plane, random
        self._pulses, self._interval = pulses, interval
        sequence = Sequence(config, heart.at(np.empty(0)), plane, random)
        self.scanner, self._scatterers = sequence.scanner, sequence.scatterers()
        self._acquisition = sequence.acquisition(self._scatterers)

    def lines(self, frame: int) -> NDArray[np.complex64]:
        """Demodulated lines of the packet whose middle is the instant of a frame, (pulses, lines, ranges)."""
        medium, first = self.medium(frame), len(self._heart.time)
        records = (
            self._acquisition.record(medium(first + pulse), f"{frame} pulse {pulse}") for pulse in range(self._pulses)
        )
        return np.stack([self.scanner.beamform(record) for record in records])

    def medium(self, frame: int) -> Medium:
        """Scatterers in the frames of the clip and, after these, in the pulses of a packet."""
        heart = self._heart
        time = heart.time[frame] + self._interval * (np.arange(self._pulses) - (self._pulses - 1) / 2)
        between = tuple(time / (heart.time[1] - heart.time[0]))
        # For random processes, which go on in time, the first pulse is that of the next cycle, whatever its frame.
        times = np.append(heart.time, heart.period + time - time[0])
        scene = Scene(self._config, heart.at(time), self._plane, self._of_packet(frame), times, between)
        return Medium(scene, self._scatterers)

    def _of_packet(self, frame: int) -> Random:
        """Random numbers in which those with the number of a pulse in their names are drawn for one packet."""
        return lambda name: self._random(f"{name} of packet {frame}" if name[-1].isdecimal() else name)


def _prescribed(config: Config) -> bool:
    return config.motion.kind in ("rigid", "affine", "tube")
