"""Stress and tangent against finite differences and formulas derived by hand."""

import numpy as np
import pytest

from echotruth.mechanics import material

MODULI = material.moduli(9.2, 2.0, 3.7)


def voigt(tensor):
    return np.array([tensor[i, j] for i, j in material.PAIRS])


def passive(c, moduli=MODULI):
    inverse, stress, tangent = np.empty(6), np.empty(6), np.empty((6, 6))
    j = material.invert(c, inverse)
    energy = material.passive(c, inverse, j, moduli, stress, tangent)
    return energy, stress, tangent


def strained(seed=0):
    f = np.eye(3) + 0.15 * np.random.default_rng(seed).normal(size=(3, 3))
    return voigt(f.T @ f)


def difference(function, c, step=1e-6):
    """Derivative by the Green-Lagrange strain, shear doubled."""
    columns = []
    for k in range(6):
        d = np.zeros(6)
        d[k] = step * (2 if k < 3 else 1)
        columns.append((function(c + d) - function(c - d)) / (2 * step))
    return np.array(columns).T


def test_inverse_and_determinant():
    c = strained()
    full = np.array([[c[0], c[3], c[4]], [c[3], c[1], c[5]], [c[4], c[5], c[2]]])
    inverse = np.empty(6)
    assert material.invert(c, inverse) ** 2 == pytest.approx(np.linalg.det(full))
    np.testing.assert_allclose(inverse, voigt(np.linalg.inv(full)))


@pytest.mark.parametrize("seed", range(3))
def test_passive_stress_and_tangent_are_derivatives(seed):
    c = strained(seed)
    _, stress, tangent = passive(c)
    np.testing.assert_allclose(stress, difference(lambda x: passive(x)[0], c), rtol=1e-7, atol=1e-8)
    scale = np.abs(tangent).max()
    np.testing.assert_allclose(tangent, difference(lambda x: passive(x)[1], c), atol=1e-8 * scale)


def test_passive_stress_does_not_see_a_change_of_volume():
    _, stress, _ = passive(np.array([1.3, 1.3, 1.3, 0, 0, 0]))
    np.testing.assert_allclose(stress, 0, atol=1e-14)


@pytest.mark.parametrize("stretch", [0.85, 1.1, 1.25])
def test_uniaxial_stress_along_the_fibre_is_the_formula_by_hand(stretch):
    along, across = (stretch**2 - 1) / 2, (1 / stretch - 1) / 2
    growth = np.exp(9.2 * along**2 + 2 * 2.0 * across**2)
    by_hand = growth * (9.2 * along * stretch**2 - 2.0 * across / stretch)
    _, stress, _ = passive(np.array([stretch**2, 1 / stretch, 1 / stretch, 0, 0, 0]))
    assert stretch**2 * stress[0] - stress[1] / stretch == pytest.approx(by_hand)


def test_pressure_stress_and_tangent_are_derivatives_of_the_volume():
    def volume_ratio(c):
        return material.invert(c, np.empty(6))

    def stress_of(c):
        inverse, stress, tangent = np.empty(6), np.empty(6), np.zeros((6, 6))
        material.volumetric(inverse, material.invert(c, inverse), 3.0, stress, tangent)
        return stress, tangent

    c = strained()
    np.testing.assert_allclose(stress_of(c)[0], difference(volume_ratio, c), rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(stress_of(c)[1], 3 * difference(lambda x: stress_of(x)[0], c), atol=1e-8)


@pytest.mark.parametrize("stretch", [0.8, 1.0, 1.2])
def test_active_stress_is_the_papers_and_has_its_potential(stretch):
    beta, step = 1.4, 1e-6
    stress, tangent = material.active(stretch**2, beta)
    strain = (stretch**2 - 1) / 2
    assert stress == pytest.approx((1 + beta * (np.sqrt(2 * strain + 1) - 1)) / (2 * strain + 1))

    def potential(e):
        return (1 - beta) * np.log(np.sqrt(2 * e + 1)) + beta * (np.sqrt(2 * e + 1) - 1)

    assert stress == pytest.approx((potential(strain + step) - potential(strain - step)) / (2 * step), rel=1e-8)
    around = [material.active(stretch**2 + 2 * side * step, beta)[0] for side in (1, -1)]
    assert tangent == pytest.approx((around[0] - around[1]) / (2 * step), rel=1e-7)
