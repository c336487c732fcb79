"""Transmits: delays and weights of the elements, and the times at which the wave reaches a point.

A wave passes the centre of the array (a focused one the origin of its line) at time 0.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from echotruth.config import Probe, Rf
from echotruth.imaging.beamforming.aperture import Aperture
from echotruth.imaging.beamforming.scan import Scan
from echotruth.imaging.rf.probe import element_centres
from echotruth.units import deg, mm, um


@dataclass(frozen=True)
class Transmits:
    """Waves sent in one frame.

    Attributes
    ----------
    delay, weight : ndarray (transmits, elements)
        Delay after time 0, s, and apodization, 1.
    origin : ndarray (transmits, 2)
        Lateral and axial coordinate of the real or virtual source of a wave, m; direction of a plane wave.
    t0_distance : ndarray (transmits,)
        Distance of the wavefront from the origin at time 0, m.
    is_plane : bool
        Whether the waves are plane.
    foci : ndarray (zones,)
        Ranges of the foci of focused waves, m, the nearest first. Such a wave serves one line in one zone; those of the
        first zone come first, line by line. Empty for others: they serve all lines, and their sum is taken.
    """

    delay: np.ndarray
    weight: np.ndarray
    origin: np.ndarray
    t0_distance: np.ndarray
    is_plane: bool = False
    foci: np.ndarray = field(default_factory=lambda: np.empty(0))

    def path_length(self, number: int, lateral: np.ndarray, axial: np.ndarray) -> np.ndarray:
        """Transmit path from time 0 to points x of any shape, m: |x - origin| - t0_distance; x . direction if plane."""
        x, z = self.origin[number]
        if self.is_plane:
            return x * lateral + z * axial
        return np.hypot(lateral - x, axial - z) - self.t0_distance[number]

    def zones(self, range_: np.ndarray) -> list[Zone]:
        """Focal zones of samples at ranges (n,), m, blended linearly between foci; the outer ones reach to the ends."""
        if not len(self.foci):
            return [Zone(self, slice(0, len(range_)), np.ones(len(range_), np.float32))]
        weights = [np.interp(range_, self.foci, one).astype(np.float32) for one in np.eye(len(self.foci))]
        samples = [np.flatnonzero(weight) for weight in weights]
        return [
            Zone(self._zone(number), slice(own[0], own[-1] + 1), weight[own[0] : own[-1] + 1])
            for number, (own, weight) in enumerate(zip(samples, weights, strict=True))
            if len(own)
        ]

    def _zone(self, number: int) -> Transmits:
        lines = len(self.delay) // len(self.foci)
        own = slice(number * lines, (number + 1) * lines)
        arrays = {name: getattr(self, name)[own] for name in ("delay", "weight", "origin", "t0_distance")}
        return replace(self, foci=self.foci[number : number + 1], **arrays)


@dataclass(frozen=True)
class Zone:
    """A focal zone: a part of all lines, and the waves that serve it.

    Attributes
    ----------
    transmits : Transmits
    samples : slice
        Samples of a line.
    blending : ndarray (n,), float32
        Weight of the zone in each of these samples, 1.
    """

    transmits: Transmits
    samples: slice
    blending: np.ndarray


def focused_waves(probe: Probe, rf: Rf, scan: Scan) -> Transmits:
    """One transmit per line and zone, focused on the line, with the aperture of the focus.

    The foci are `rf.focal_zones`, `rf.focal_spacing_mm` apart, with `rf.focus_mm` in their middle. A wave reaches its
    focus at (focal range) / (speed of sound), as if it came from the origin of the line.
    """
    aperture, number = Aperture(probe, rf), np.arange(rf.focal_zones) - (rf.focal_zones - 1) / 2
    foci = rf.focus_mm * mm + number * (rf.focal_spacing_mm * mm)
    delay = np.concatenate([_advance(aperture.centres, scan, focus) for focus in foci]) / probe.sound_speed_m_per_s
    weight = np.concatenate([aperture.sent_weights(scan.line_origin, focus) for focus in foci])
    origin = np.tile(np.stack([scan.line_origin, np.zeros(len(scan.line_origin))], axis=1), (len(foci), 1))
    return Transmits(delay, weight, origin, np.zeros(len(origin)), foci=foci)


def _advance(centres: np.ndarray, scan: Scan, focus: float) -> np.ndarray:
    """Focal range minus the distance of each element from the focus on a line, (lines, elements), m."""
    lateral = (scan.line_origin + focus * np.sin(scan.angle))[:, None] - centres
    return focus - np.hypot(lateral, focus * np.cos(scan.angle)[:, None])


def plane_waves(probe: Probe, rf: Rf, scan: Scan) -> Transmits:
    """Plane waves of evenly spaced angles, all elements alike (Montaldo 2009, IEEE Trans UFFC 56:489)."""
    direction = _directions(rf)
    delay = direction[:, :1] * element_centres(probe) / probe.sound_speed_m_per_s
    return Transmits(delay, np.ones(delay.shape), direction, np.zeros(len(delay)), is_plane=True)


def diverging_waves(probe: Probe, rf: Rf, scan: Scan) -> Transmits:
    """Circular waves of evenly spaced angles from virtual sources behind the array, all elements alike.

    A source is `rf.virtual_source_mm` from the centre of the array (Papadacci 2014, IEEE Trans UFFC 61:288), or where
    the array subtends the angle of the sector.
    """
    distance = virtual_source_distance(probe, rf)
    origin = -distance * _directions(rf)
    delay = np.hypot(element_centres(probe) - origin[:, :1], origin[:, 1:]) - distance
    return Transmits(delay / probe.sound_speed_m_per_s, np.ones(delay.shape), origin, np.full(len(delay), distance))


def synthetic_aperture(probe: Probe, rf: Rf, scan: Scan) -> Transmits:
    """Each element alone, with its weight in the whole aperture (Jensen 2006, Ultrasonics 44:e5)."""
    aperture = Aperture(probe, rf.model_copy(update={"f_number": 0.0, "harmonic": False}))
    weight = np.diag(aperture.sent_weights(np.zeros(1), 1.0)[0])
    origin = np.stack([aperture.centres, np.zeros(len(weight))], axis=1)
    return Transmits(np.zeros(weight.shape), weight, origin, np.zeros(len(weight)))


TRANSMIT_SEQUENCES = {
    "focused": focused_waves,
    "plane": plane_waves,
    "diverging": diverging_waves,
    "synthetic_aperture": synthetic_aperture,
}
"""Value of `rf.transmit` to the function that makes the transmits of a frame."""


def virtual_source_distance(probe: Probe, rf: Rf) -> float:
    """Distance of the virtual sources of diverging waves from the centre of the array, m."""
    if rf.virtual_source_mm:
        return rf.virtual_source_mm * mm
    length = probe.elements * (probe.pitch_um * um)
    return length / 2 / np.tan(rf.sector_deg * deg / 2)


def _directions(rf: Rf) -> np.ndarray:
    """Lateral and axial components of the directions of the waves, shape (transmits, 2), 1."""
    half = rf.angle_span_deg * deg / 2
    angle = np.linspace(-half, half, rf.transmits) if rf.transmits > 1 else np.zeros(1)
    return np.stack([np.sin(angle), np.cos(angle)], axis=1)
