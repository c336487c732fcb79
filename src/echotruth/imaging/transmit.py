"""Transmits: when and how strongly each element sends, and when the wave comes to a point.

A wave passes the centre of the array (a focused one the foot of its line) at time 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echotruth.config import Probe, Rf
from echotruth.imaging.aperture import Aperture
from echotruth.imaging.probe import element_centres
from echotruth.imaging.scan import Scan


@dataclass(frozen=True)
class Transmits:
    """Waves sent in one frame.

    Attributes
    ----------
    delay, weight : ndarray (transmits, elements)
        After time 0, s; and strength, 1.
    origin : ndarray (transmits, 2)
        Lateral and axial coordinate of the point from which a wave seems to come, m; of a plane one, its direction.
    lead : ndarray (transmits,)
        Distance from the origin at which a wave is at time 0, m.
    plane : bool
        Waves are plane.
    focused : bool
        A wave serves the line of its own number alone; else it serves all lines, and their sum is taken.
    """

    delay: np.ndarray
    weight: np.ndarray
    origin: np.ndarray
    lead: np.ndarray
    plane: bool = False
    focused: bool = False

    def path(self, number: int, lateral: np.ndarray, axial: np.ndarray) -> np.ndarray:
        """How far a wave has come since time 0 when it reaches points, any shape, m; less than 0 before time 0."""
        x, z = self.origin[number]
        if self.plane:
            return x * lateral + z * axial
        return np.hypot(lateral - x, axial - z) - self.lead[number]


def focused(probe: Probe, rf: Rf, scan: Scan) -> Transmits:
    """One transmit a line, focused at `rf.focus_mm` on it, with the aperture of that point.

    The wave reaches the focus at (focus distance) / (speed of sound), as if it came from the foot of the line.
    """
    aperture, focus = Aperture(probe, rf), rf.si().focus
    lateral = (scan.foot + focus * np.sin(scan.angle))[:, None] - aperture.centres
    delay = (focus - np.hypot(lateral, focus * np.cos(scan.angle)[:, None])) / probe.si().sound_speed
    origin = np.stack([scan.foot, np.zeros(len(scan.foot))], axis=1)
    weight = aperture.weights(scan.foot, focus)
    return Transmits(delay, weight, origin, np.zeros(len(origin)), focused=True)


def plane(probe: Probe, rf: Rf, scan: Scan) -> Transmits:
    """Plane waves of evenly spaced tilts, from all elements alike (Montaldo 2009, IEEE Trans UFFC 56:489)."""
    direction = _directions(rf)
    delay = direction[:, :1] * element_centres(probe) / probe.si().sound_speed
    return Transmits(delay, np.ones(delay.shape), direction, np.zeros(len(delay)), plane=True)


def diverging(probe: Probe, rf: Rf, scan: Scan) -> Transmits:
    """Circular waves of evenly spaced tilts from sources behind the array, all elements alike.

    A source stands `rf.source_mm` from the centre of the array (Papadacci 2014, IEEE Trans UFFC 61:288), or where the
    array is seen under the angle of the sector.
    """
    distance = source_distance(probe, rf)
    origin = -distance * _directions(rf)
    delay = np.hypot(element_centres(probe) - origin[:, :1], origin[:, 1:]) - distance
    return Transmits(delay / probe.si().sound_speed, np.ones(delay.shape), origin, np.full(len(delay), distance))


def synthetic_aperture(probe: Probe, rf: Rf, scan: Scan) -> Transmits:
    """Every element in its turn, weighted as over the whole aperture (Jensen 2006, Ultrasonics 44:e5)."""
    aperture = Aperture(probe, rf.model_copy(update={"f_number": 0.0}))
    weight = np.diag(aperture.weights(np.zeros(1), 1.0)[0])
    origin = np.stack([aperture.centres, np.zeros(len(weight))], axis=1)
    return Transmits(np.zeros(weight.shape), weight, origin, np.zeros(len(weight)))


KINDS = {
    "focused": focused,
    "plane": plane,
    "diverging": diverging,
    "synthetic_aperture": synthetic_aperture,
}
"""Value of `rf.transmit` to the transmits of a frame."""


def source_distance(probe: Probe, rf: Rf) -> float:
    """Distance of the sources of diverging waves from the centre of the array, m."""
    length = probe.elements * probe.si().pitch
    return rf.si().source or length / 2 / np.tan(rf.si().sector / 2)


def _directions(rf: Rf) -> np.ndarray:
    """Lateral and axial components of the directions in which waves are sent, shape (transmits, 2), 1."""
    half = rf.si().tilt / 2
    tilt = np.linspace(-half, half, rf.transmits) if rf.transmits > 1 else np.zeros(1)
    return np.stack([np.sin(tilt), np.cos(tilt)], axis=1)
