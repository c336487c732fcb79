"""The active stress and the force of a muscle that shortens against formulas derived by hand."""

import numpy as np
import pytest

from echotruth.mechanics.solver.active_stress import ActiveLaw, active_stress, force_velocity


@pytest.mark.parametrize("stretch", [0.8, 1.0, 1.2])
def test_active_stress_is_the_papers_and_has_its_potential(stretch):
    beta, step, strain = 1.4, 1e-6, (stretch**2 - 1) / 2
    stress, _ = active_stress(stretch**2, 1.0, 0.0, ActiveLaw(beta))
    assert stress == pytest.approx((1 + beta * (np.sqrt(2 * strain + 1) - 1)) / (2 * strain + 1))

    def potential(e):
        return (1 - beta) * np.log(np.sqrt(2 * e + 1)) + beta * (np.sqrt(2 * e + 1) - 1)

    assert stress == pytest.approx((potential(strain + step) - potential(strain - step)) / (2 * step), rel=1e-8)


@pytest.mark.parametrize("power", [0.0, 1.0, 2.0])
@pytest.mark.parametrize("stretch", [0.8, 1.2])
@pytest.mark.parametrize("rate", [0.0, 20.0])
def test_active_tangent_is_the_derivative_of_the_active_stress(power, stretch, rate):
    step, law = 1e-6, ActiveLaw(1.4, power, max_velocity=15.0)
    _, tangent = active_stress(stretch**2, 1.0, rate, law)
    around = [active_stress(stretch**2 + 2 * side * step, 1.0, rate, law)[0] for side in (1, -1)]
    assert tangent == pytest.approx((around[0] - around[1]) / (2 * step), rel=1e-7)


def test_active_stress_of_power_zero_is_the_tension_itself():
    assert active_stress(0.7, 1.0, 0.0, ActiveLaw(power=0.0)) == (1.0, 0.0)


HILL = ActiveLaw(power=1.0, max_velocity=10.0, curvature=0.25, eccentric_max=1.5)
"""With power 1 and no length dependence the first Piola-Kirchhoff stress is h: a load that stays in shortening."""


@pytest.mark.parametrize("load", [0.0, 0.2, 0.5, 1.0])
def test_afterloaded_muscle_shortens_at_the_velocity_of_hills_equation(load):
    """(F + a) (v + b) = (F_0 + a) b with F_0 = 1, a = 0.25 and b = a v_max / F_0 (Hill 1938)."""
    velocity = 2.5 * (1 - load) / (load + 0.25)
    assert force_velocity(-velocity, HILL)[0] == pytest.approx(load, abs=1e-12)
    # A step of an isotonic fibre: implicit, so that the velocity is that of the end of the step.
    stretch, step = 1.0, 1e-3
    stress, _ = active_stress((stretch - velocity * step) ** 2, stretch**2, 1 / step, HILL)
    assert stress * (stretch - velocity * step) == pytest.approx(load, abs=1e-12)


def test_released_muscle_recovers_its_isometric_force_at_once():
    """Quick release: no force while it shortens faster than it can, and all of it, at its new length, when it stops."""
    law = ActiveLaw(1.4, 1.0, max_velocity=10.0)
    released, held = active_stress(0.9**2, 1.0, 1e3, law), active_stress(0.9**2, 0.9**2, 1e3, law)
    assert released == (0.0, 0.0)
    assert held[0] == pytest.approx((1 - 0.14) / 0.9)


def test_force_of_stretched_muscle_is_bounded_and_smooth():
    (below, slope_below), (above, slope_above) = (force_velocity(v, HILL) for v in (-1e-9, 1e-9))
    assert (below, slope_below) == pytest.approx((above, slope_above), rel=1e-7)
    velocities = np.linspace(-12, 1e4, 2001)
    force = np.array([force_velocity(v, HILL)[0] for v in velocities])
    assert np.all(np.diff(force) >= 0)
    assert force[0] == 0
    assert 1.49 < force[-1] < 1.5


def test_muscle_without_a_largest_velocity_does_not_depend_on_it():
    assert active_stress(0.8, 1.0, 100.0, ActiveLaw(1.4)) == active_stress(0.8, 1.0, 0.0, ActiveLaw(1.4))
