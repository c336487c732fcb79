"""Borders of the wall: scatterers on endocardium and epicardium that echo in phase, as a mirror does.

A sheet of N scatterers of equal amplitude within a beam returns N^2 times the power of one where it is perpendicular
to the beam, and N times elsewhere, as their echoes are in phase or not: a line that is bright where the border faces
the probe and fainter at the sides, as that of a real border, which is a rough mirror. With one scatterer per two
squares of the wavelength, N is some 8 in the default mouse. They are carried by the surface; their amplitude grows with
its area, so that the echo of a border is that of its area.
"""

from dataclasses import dataclass
from functools import cached_property
from math import pi, sqrt
from typing import ClassVar, Self

import numpy as np

from echotruth.arrays import Floats
from echotruth.config import Config
from echotruth.fem.tetrahedra import Integers, shape, shape_gradient
from echotruth.imaging.medium.backscatter import variation
from echotruth.imaging.medium.body import Body, Echoes, Scene, echoes
from echotruth.imaging.medium.wall import cube_to_simplex
from echotruth.imaging.rf.probe import wavelength
from echotruth.units import MHz, mm, per_mm3, um

BEAM_STD, PULSE_STD = 0.376, 0.375
"""Standard deviation of the two-way beam at its focus, a sinc squared, over wavelength x focus / aperture; and of the
envelope of a Gaussian pulse over 1 / bandwidth."""


@dataclass(frozen=True, eq=False)
class Border(Body):
    """Scatterers spread uniformly over a surface of the unloaded wall.

    Attributes
    ----------
    facets : ndarray of shape (n, 6)
        Nodes of the quadratic triangle of each.
    xi : ndarray of shape (n, 2)
        Local coordinates in it.
    """

    surface: ClassVar[str]
    facets: Integers
    xi: Floats

    @classmethod
    def seed(cls, scene: Scene) -> Self:
        facets, random = scene.heart.arrays["geometry"][cls.surface], scene.random(cls.name)
        middle = np.full((len(facets), 2), 1 / 3)
        area = _area(scene.heart.nodes, facets, middle) / 2
        number = random.poisson(border_density(scene.config) * area.sum())
        chosen = random.choice(len(facets), size=number, p=area / area.sum())
        return cls(scene, facets[chosen].astype(np.int32), cube_to_simplex(random.random((number, 2))))

    def positions(self, frame: int) -> Floats:
        return self.scene.plane.to_image(self._carried(self.scene.heart.positions(frame)))

    def __call__(self, frame: int) -> Echoes:
        area = _area(self.scene.heart.positions(frame), self.facets, self.xi)
        amplitude = self._amplitude * area / _area(self.scene.heart.nodes, self.facets, self.xi)
        return echoes(self.scene.config.phantom, self.positions(frame), amplitude)

    def _carried(self, nodes: Floats) -> Floats:
        """Positions (n, 3), m, for nodes (n_nodes, 3), m."""
        return np.einsum("na,nai->ni", shape(self.xi), nodes[self.facets])

    @cached_property
    def _amplitude(self) -> Floats:
        """Amplitudes (n,) at the unloaded area, relative to the standard deviation of those of muscle."""
        config, unloaded = self.scene.config, self._carried(self.scene.heart.nodes)
        varied = variation(config.realism.backscatter, unloaded, self.scene.random("variation"))
        return border_amplitude(config, self.level_dB(config)) * varied


class Endocardium(Border):
    """Scatterers on the endocardium."""

    name, level, surface = "endocardium", "borders.endocardium_dB", "endo"


class Epicardium(Border):
    """Scatterers on the epicardium."""

    name, level, surface = "epicardium", "borders.epicardium_dB", "epi"


def border_amplitude(config: Config, level_dB: float) -> float:
    """Amplitude of the scatterers of a border, relative to the standard deviation of those of muscle.

    With Gaussian beam and pulse of standard deviations s_x, s_y and s_z at the focus, muscle of density rho returns the
    power rho pi s_x s_y sqrt(pi) s_z, and a sheet across the beam of areal density sigma (2 pi s_x s_y sigma a)^2.

    Parameters
    ----------
    config : Config
    level_dB : float
        Echo power of a flat border across the beam at its focus over that of muscle.
    """
    probe, focus = config.probe, config.rf.focus_mm * mm
    lateral = BEAM_STD * wavelength(probe) * focus / (probe.elements * (probe.pitch_um * um))
    elevation = BEAM_STD * wavelength(probe) * focus / (probe.height_mm * mm)
    axial = PULSE_STD * probe.sound_speed_m_per_s / 2 / (probe.bandwidth * (probe.frequency_MHz * MHz))
    power = config.phantom.density_per_mm3 * per_mm3 * sqrt(pi) * axial / (4 * pi * lateral * elevation)
    return 10 ** (level_dB / 20) * sqrt(power) / border_density(config)


def border_density(config: Config) -> float:
    """Scatterers of a border per area, 1/m^2: one per two squares of the wavelength."""
    return (config.probe.frequency_MHz * MHz / config.probe.sound_speed_m_per_s) ** 2 / 2


def _area(nodes: Floats, facets: Integers, xi: Floats) -> Floats:
    """Area per area of local coordinates (n,), m^2, at a point of each facet."""
    tangent = np.einsum("nak,nai->nki", shape_gradient(xi), nodes[facets])
    return np.linalg.norm(np.cross(tangent[:, 0], tangent[:, 1]), axis=1)
