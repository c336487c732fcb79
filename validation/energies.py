"""Strain energies of the wall, implemented independently of the solver, and their derivatives by a complex step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from echotruth.fem.tetrahedra import Floats
from echotruth.materials import LAWS, Material, compiled
from echotruth.mechanics.solver import element
from echotruth.mechanics.solver.active_stress import ActiveLaw

COMPLEX_STEP = 1e-30
"""Imaginary part h added to an argument, f'(x) = Im f(x + ih) / h: far below round-off, for nothing cancels."""


def _fung(e: NDArray, law: Any) -> NDArray:
    across = e[1, 1] ** 2 + e[2, 2] ** 2 + 2 * e[1, 2] ** 2
    q = law.fibre * e[0, 0] ** 2 + law.transverse * across + 2 * law.shear * (e[0, 1] ** 2 + e[0, 2] ** 2)
    return (np.exp(q) - 1) / 2


def _guccione(e: NDArray, law: Any) -> NDArray:
    q = law.fibre * e[0, 0] ** 2 + law.sheet * e[1, 1] ** 2 + law.normal * e[2, 2] ** 2
    q = q + 2 * (law.fibre_sheet * e[0, 1] ** 2 + law.fibre_normal * e[0, 2] ** 2 + law.sheet_normal * e[1, 2] ** 2)
    return (np.exp(q) - 1) / 2


def _holzapfel_ogden(e: NDArray, law: Any) -> NDArray:
    invariant = 2 * (e[0, 0] + e[1, 1] + e[2, 2])
    energy = (np.exp(law.exponent * invariant) - 1) / (2 * law.exponent)
    for i, modulus, exponent in ((0, law.fibre, law.fibre_exponent), (1, law.sheet, law.sheet_exponent)):
        stretched = 2 * e[i, i] * (e[i, i].real > 0)
        energy = energy + modulus / (2 * exponent) * (np.exp(exponent * stretched**2) - 1)
    exponent = law.fibre_sheet_exponent
    return energy + law.fibre_sheet / (2 * exponent) * (np.exp(exponent * (2 * e[0, 1]) ** 2) - 1)


def _neo_hooke(e: NDArray, _: Any) -> NDArray:
    return e[0, 0] + e[1, 1] + e[2, 2]


PASSIVE_ENERGIES: dict[str, Callable[[NDArray, Any], NDArray]] = {
    "fung": _fung,
    "guccione": _guccione,
    "holzapfel_ogden": _holzapfel_ogden,
    "neo_hooke": _neo_hooke,
}
"""Name of a law to its energy over C, of the isochoric strain of shape (3, 3, ...) in the fibre axes."""


@dataclass(frozen=True)
class ConstitutiveModel:
    """Passive and active law of a wall.

    Attributes
    ----------
    material : Material
    stiffness, tension : float, Pa
        C and T_Ca.
    beta, power : float
        Of the active law.
    bulk : float, Pa
        Of the volume: at a point here, of the mean over a cell in the solver.
    pointwise_bulk_ratio : float
        Of the volume at a point, over C.
    """

    material: Material
    stiffness: float
    tension: float = 0.0
    beta: float = 1.4
    power: float = 2.0
    bulk: float = 2e6
    pointwise_bulk_ratio: float = 20.0

    def law(self) -> element.WallLaw:
        """The same model for the solver."""
        active = ActiveLaw(self.beta, self.power)
        energy = compiled(name(self.material))
        return element.WallLaw(
            energy, self.material.constants(), active, self.bulk, pointwise_bulk_ratio=self.pointwise_bulk_ratio
        )

    def density(self, f: NDArray) -> NDArray:
        """Energy per unloaded volume, shape (...), Pa, of F (..., 3, 3) whose columns belong to the fibre axes."""
        volume = (self.bulk + self.stiffness * self.pointwise_bulk_ratio) / 2 * (determinant(f) - 1) ** 2
        return self.stiffness * passive(f, self.material) + self.tension * active(f, self.beta, self.power) + volume


def name(material: Material) -> str:
    """Name of a law."""
    return next(name for name, module in LAWS.items() if isinstance(material, module.Law))


def determinant(f: NDArray) -> NDArray:
    """Determinant of matrices (..., 3, 3), real or complex."""
    return np.sum(f[..., 0] * np.cross(f[..., 1], f[..., 2]), axis=-1)


def passive(f: NDArray, material: Material) -> NDArray:
    """Passive energy over C, shape (...), of F (..., 3, 3) whose columns belong to the fibre axes."""
    c = np.einsum("...ki,...kj->ij...", f, f)
    e = (c * determinant(f) ** (-2 / 3) - np.eye(3).reshape(3, 3, *[1] * (f.ndim - 2))) / 2
    return PASSIVE_ENERGIES[name(material)](e, material)


def active(f: NDArray, beta: float, power: float, axis: int = 0) -> NDArray:
    """Active energy over T_Ca, shape (...), along an axis: the integral of S = [1 + beta (l - 1)] / l^power over E."""
    stretch = np.sqrt(np.sum(f[..., axis] ** 2, axis=-1))
    if power == 2:
        return (1 - beta) * np.log(stretch) + beta * (stretch - 1)
    return (1 - beta) * stretch ** (2 - power) / (2 - power) + beta * stretch ** (3 - power) / (3 - power)


def force_velocity(velocity: NDArray, curvature: float, eccentric_max: float) -> NDArray:
    """Force over the isometric one at velocities over that without load, negative in shortening; of the same shape.

    Hill's equation (F + a) (b - v) = (F_0 + a) b solved for F, with v_max = b F_0 / a, and beyond isometric the
    hyperbola with the same slope whose asymptote is `eccentric_max`.
    """
    a = curvature
    shortening = np.maximum((1 + a) * a / (a + np.maximum(-velocity, 0)) - a, 0)
    room = eccentric_max - 1
    half = room * a / (1 + a)  # velocity at which half of the room is used
    stretched = np.maximum(velocity, 0)
    return np.where(velocity <= 0, shortening, 1 + room * stretched / (half + stretched))


def first_piola_kirchhoff(f: Floats, density: Callable[[NDArray], NDArray]) -> Floats:
    """First Piola-Kirchhoff stress dW/dF by a complex step, exact to round-off.

    Parameters
    ----------
    f : ndarray of shape (..., 3, 3)
        Columns belong to the fibre axes.
    density : callable
        Energy per unloaded volume of such F.

    Returns
    -------
    ndarray of shape (..., 3, 3), Pa
        Its columns belong to the fibre axes too.
    """
    stress = np.empty_like(f)
    for i in range(3):
        for k in range(3):
            step = np.zeros((3, 3), dtype=complex)
            step[i, k] = 1j * COMPLEX_STEP
            stress[..., i, k] = density(f + step).imag / COMPLEX_STEP
    return stress
