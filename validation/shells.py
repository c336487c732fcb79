"""Exact solutions of incompressible thick tubes and spheres, up to one quadrature.

Green & Zerna, Theoretical Elasticity, chapter 3; Holzapfel et al., J Elast 61 (2000) 1, section 5.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echotruth.fem.tetrahedra import Floats
from validation.energies import ConstitutiveModel, first_piola_kirchhoff

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(80)


@dataclass(frozen=True)
class Tube:
    """A tube inflated, stretched and twisted.

    r^2 = a^2 + (R^2 - A^2) / stretch, theta = Theta + twist Z, z = stretch Z.

    Attributes
    ----------
    model : ConstitutiveModel
    inner, outer : float, m
        Unloaded radii A and B.
    inflated : float, m
        Inner radius a that the pressure holds.
    stretch : float
        Along the tube.
    twist : float, rad/m
        Over the unloaded length.
    helix : tuple of float, rad
        Angle of the fibres at the inner and at the outer radius, between which it is linear.
    """

    model: ConstitutiveModel
    inner: float
    outer: float
    inflated: float
    stretch: float = 1.0
    twist: float = 0.0
    helix: tuple[float, float] = (0.0, 0.0)

    def radius(self, unloaded: Floats) -> Floats:
        """Deformed radius, m, of an unloaded one."""
        return np.sqrt(self.inflated**2 + (unloaded**2 - self.inner**2) / self.stretch)

    def axes(self, unloaded: Floats) -> Floats:
        """Fibre axes (..., 3, 3) at an unloaded radius: rows f, s, n, radial, circumferential and axial parts."""
        depth = (unloaded - self.inner) / (self.outer - self.inner)
        angle = self.helix[0] + (self.helix[1] - self.helix[0]) * depth
        cos, sin, zero = np.cos(angle), np.sin(angle), np.zeros_like(angle)
        rows = ([zero, cos, sin], [zero, -sin, cos], [zero + 1, zero, zero])
        return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)

    def stress(self, unloaded: Floats) -> Floats:
        """Cauchy stress (..., 3, 3), Pa, up to the hydrostatic pressure that keeps the volume."""
        r = self.radius(unloaded)
        f = np.zeros((*unloaded.shape, 3, 3))
        f[..., 0, 0], f[..., 1, 1], f[..., 2, 2] = unloaded / (self.stretch * r), r / unloaded, self.stretch
        f[..., 1, 2] = r * self.twist
        axes = self.axes(unloaded)
        f = f @ np.swapaxes(axes, -1, -2)
        return first_piola_kirchhoff(f, self.model.density) @ np.swapaxes(f, -1, -2)

    def _pressure_gradient(self, unloaded: Floats) -> Floats:
        """(sigma_CC - sigma_RR) / r dr/dR, of which the integral over R is the pressure (radial equilibrium)."""
        stress = self.stress(unloaded)
        return (stress[..., 1, 1] - stress[..., 0, 0]) * unloaded / (self.stretch * self.radius(unloaded) ** 2)

    def pressure(self) -> float:
        """Pressure in the tube, Pa."""
        return integral(self._pressure_gradient, self.inner, self.outer)

    def force_and_torque(self) -> tuple[float, float]:
        """Axial force on the wall, N, and torque, N m, at an end."""

        def density(unloaded: Floats) -> Floats:
            r, stress = self.radius(unloaded), self.stress(unloaded)
            radial = -np.array([integral(self._pressure_gradient, radius, self.outer) for radius in unloaded])
            area = 2 * np.pi * unloaded / self.stretch
            axial = (stress[..., 2, 2] - stress[..., 0, 0] + radial) * area
            return np.stack([axial, stress[..., 1, 2] * r * area])

        force, torque = integral(density, self.inner, self.outer)
        return float(force), float(torque)

    def displacement(self, positions: Floats) -> Floats:
        """Exact displacement, m, of unloaded positions (..., 3), m; the end at z = 0 does not turn."""
        x, y, z = np.moveaxis(positions, -1, 0)
        unloaded = np.hypot(x, y)
        angle, r = np.arctan2(y, x) + self.twist * z, self.radius(unloaded)
        return np.stack([r * np.cos(angle), r * np.sin(angle), self.stretch * z], axis=-1) - positions


@dataclass(frozen=True)
class Sphere:
    """A sphere inflated, r^3 = a^3 + R^3 - A^3, whose fibres are radial.

    Attributes
    ----------
    model : ConstitutiveModel
    inner, outer : float, m
        Unloaded radii A and B.
    inflated : float, m
        Inner radius a that the pressure holds.
    """

    model: ConstitutiveModel
    inner: float
    outer: float
    inflated: float

    def radius(self, unloaded: Floats) -> Floats:
        """Deformed radius, m, of an unloaded one."""
        return np.cbrt(self.inflated**3 + unloaded**3 - self.inner**3)

    def pressure(self) -> float:
        """Pressure in the sphere, Pa."""

        def density(unloaded: Floats) -> Floats:
            r = self.radius(unloaded)
            f = np.zeros((*unloaded.shape, 3, 3))
            f[..., 0, 0], f[..., 1, 1] = (unloaded / r) ** 2, r / unloaded
            f[..., 2, 2] = f[..., 1, 1]
            stress = first_piola_kirchhoff(f, self.model.density) @ np.swapaxes(f, -1, -2)
            return 2 * (stress[..., 1, 1] - stress[..., 0, 0]) * unloaded**2 / r**3

        return integral(density, self.inner, self.outer)

    def displacement(self, positions: Floats) -> Floats:
        """Exact displacement, m, of unloaded positions (..., 3), m, from the centre."""
        unloaded = np.linalg.norm(positions, axis=-1, keepdims=True)
        return positions * (self.radius(unloaded) / unloaded - 1)


def integral(density, first: float, last: float):
    """Integral of a smooth function by Gauss's rule of 80 points.

    Parameters
    ----------
    density : callable
        Of arguments (80,), with values (..., 80).
    first, last : float

    Returns
    -------
    float or ndarray of shape (...)
    """
    points = (first + last) / 2 + (last - first) / 2 * _POINTS
    return np.sum(density(points) * _WEIGHTS, axis=-1) * (last - first) / 2
