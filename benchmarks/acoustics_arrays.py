"""Two arrays, a mouse's and a human's, and scatterers before them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from echotruth.config import Probe
from echotruth.units import MHz, um

Floats = NDArray[np.float64]

SECTOR = np.deg2rad(64)
"""Opening angle of the sector that is imaged."""

THIN = 0.1
"""Height over wavelength of an element that is a point in elevation: lens and beam then have no effect, and the loss
over distance is 1/r, which a simulator in two dimensions does not have."""


@dataclass(frozen=True)
class Array:
    """An array and where its scatterers are.

    Attributes
    ----------
    preset : str
        Of the probe.
    near, far : float, m
        Ranges between which the scatterers lie.
    slab : float, m
        Half the thickness, in elevation, of the volume they fill.
    focus : float, m
        Range at which lines are focused.
    """

    preset: str
    near: float
    far: float
    slab: float
    focus: float

    def probe(self, **changes: Any) -> Probe:
        """The probe, with other values of some keys."""
        return Probe(preset=self.preset, **changes)

    def thin(self, **changes: Any) -> Probe:
        """The probe with elements that are points in elevation."""
        probe = self.probe()
        return self.probe(height_mm=1e3 * THIN * probe.sound_speed_m_per_s / (probe.frequency_MHz * MHz), **changes)

    def scatterers(self, number: int, *, thick: bool = False) -> tuple[Floats, Floats]:
        """Positions (number, 3; lateral, axial, elevation; m) and amplitudes (number,) of scatterers in the sector.

        They are evenly distributed over its area, in the plane of the image or through the slab.
        """
        random = np.random.default_rng([2026, 0])
        angle = random.uniform(-SECTOR / 2, SECTOR / 2, number)
        range_ = np.sqrt(random.uniform(self.near**2, self.far**2, number))
        elevation = random.uniform(-self.slab, self.slab, number) if thick else np.zeros(number)
        position = np.stack([range_ * np.sin(angle), range_ * np.cos(angle), elevation], axis=1)
        return position, random.standard_normal(number)


ARRAYS = {
    "mouse, 25 MHz": Array("mouse_25MHz", 3e-3, 11e-3, 0.3e-3, 6.5e-3),
    "human, 2.72 MHz": Array("human_2_7MHz", 20e-3, 120e-3, 3e-3, 70e-3),
}


def delays(probe: Probe, focus: tuple[float, float]) -> Floats:
    """Delays that focus at lateral and axial coordinates (m), not negative, shape (elements,), s."""
    centre = (np.arange(probe.elements) - (probe.elements - 1) / 2) * (probe.pitch_um * um)
    flight = np.hypot(focus[0] - centre, focus[1]) / probe.sound_speed_m_per_s
    return flight.max() - flight
