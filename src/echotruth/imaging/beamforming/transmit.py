"""Transmits: when and how strongly each element sends, and when the wave comes to a point.

A wave passes the centre of the array (a focused one the foot of its line) at time 0.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from echotruth.config import Probe, Rf
from echotruth.imaging.beamforming.aperture import Aperture
from echotruth.imaging.beamforming.scan import Scan
from echotruth.imaging.rf.probe import element_centres


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
    foci : ndarray (zones,)
        Ranges of the foci of focused waves, m, the nearest first. Such a wave serves one line in one zone; those of the
        first zone come first, line by line. Empty for others: they serve all lines, and their sum is taken.
    """

    delay: np.ndarray
    weight: np.ndarray
    origin: np.ndarray
    lead: np.ndarray
    plane: bool = False
    foci: np.ndarray = field(default_factory=lambda: np.empty(0))

    def path(self, number: int, lateral: np.ndarray, axial: np.ndarray) -> np.ndarray:
        """How far a wave has come since time 0 when it reaches points, any shape, m; less than 0 before time 0."""
        x, z = self.origin[number]
        if self.plane:
            return x * lateral + z * axial
        return np.hypot(lateral - x, axial - z) - self.lead[number]

    def zones(self, range_: np.ndarray) -> list[Zone]:
        """Zones that have a share in the samples of lines at ranges (n,), m.

        Between two foci they fade over linearly from one zone to the next; the first and the last go on to the ends.
        """
        if not len(self.foci):
            return [Zone(self, slice(0, len(range_)), np.ones(len(range_), np.float32))]
        shares = [np.interp(range_, self.foci, one).astype(np.float32) for one in np.eye(len(self.foci))]
        parts = [np.flatnonzero(share) for share in shares]
        return [
            Zone(self._zone(number), slice(part[0], part[-1] + 1), share[part[0] : part[-1] + 1])
            for number, (part, share) in enumerate(zip(parts, shares, strict=True))
            if len(part)
        ]

    def _zone(self, number: int) -> Transmits:
        lines = len(self.delay) // len(self.foci)
        own = slice(number * lines, (number + 1) * lines)
        arrays = {name: getattr(self, name)[own] for name in ("delay", "weight", "origin", "lead")}
        return replace(self, foci=self.foci[number : number + 1], **arrays)


@dataclass(frozen=True)
class Zone:
    """A part of all lines, and the waves that serve it.

    Attributes
    ----------
    transmits : Transmits
        The waves.
    part : slice
        The samples of a line.
    share : ndarray (n,), float32
        Of the zone in each of them, 1.
    """

    transmits: Transmits
    part: slice
    share: np.ndarray


def focused(probe: Probe, rf: Rf, scan: Scan) -> Transmits:
    """One transmit a line and zone, focused on the line, with the aperture of the focus.

    The foci are `rf.zones`, `rf.zone_mm` apart, and `rf.focus_mm` is the middle of them. A wave reaches its focus at
    (focus distance) / (speed of sound), as if it came from the foot of the line.
    """
    aperture, values = Aperture(probe, rf), rf.si()
    foci = values.focus + (np.arange(rf.zones) - (rf.zones - 1) / 2) * values.zone
    delay = np.concatenate([_delay(aperture.centres, scan, focus) for focus in foci]) / probe.si().sound_speed
    weight = np.concatenate([aperture.weights(scan.foot, focus) for focus in foci])
    origin = np.tile(np.stack([scan.foot, np.zeros(len(scan.foot))], axis=1), (len(foci), 1))
    return Transmits(delay, weight, origin, np.zeros(len(origin)), foci=foci)


def _delay(centres: np.ndarray, scan: Scan, focus: float) -> np.ndarray:
    """By how much elements at `centres` are nearer to the focus on a line than its foot is, (lines, elements), m."""
    lateral = (scan.foot + focus * np.sin(scan.angle))[:, None] - centres
    return focus - np.hypot(lateral, focus * np.cos(scan.angle)[:, None])


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
