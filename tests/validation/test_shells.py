"""The exact solutions against closed formulas, and against themselves."""

from dataclasses import replace

import numpy as np
import pytest

from echotruth.materials import LAWS
from validation.energies import ConstitutiveModel
from validation.shells import Sphere, Tube, integral

RUBBER = ConstitutiveModel(LAWS["neo_hooke"].Law(), 2e3)


def test_pressure_in_a_sphere_of_rubber_is_the_closed_formula():
    """p = mu/2 [l^-4 + 4/l] from the inner to the outer stretch l (Green & Zerna, section 3.10)."""
    sphere = Sphere(RUBBER, 2e-3, 3e-3, 2.6e-3)
    inner, outer = 2.6 / 2, sphere.radius(3e-3) / 3e-3
    by_hand = 1e3 * (outer**-4 + 4 / outer - inner**-4 - 4 / inner)
    assert sphere.pressure() == pytest.approx(by_hand, rel=1e-10)


def test_pressure_in_a_tube_of_rubber_is_the_closed_formula():
    """p = mu [ln(l_a / l_b) + (l_b^-2 - l_a^-2) / 2] for the stretches l at its inner and outer radius, by hand."""
    tube = Tube(RUBBER, 1.5e-3, 2.5e-3, 1.9e-3)
    outer = tube.radius(2.5e-3)
    inner_stretch, outer_stretch = 1.9 / 1.5, outer / 2.5e-3
    by_hand = 2e3 * (np.log(inner_stretch / outer_stretch) + (outer_stretch**-2 - inner_stretch**-2) / 2)
    assert tube.pressure() == pytest.approx(by_hand, rel=1e-10)


def test_loads_of_a_tube_are_the_rates_of_its_energy():
    """By twist and by stretch: the pressure does no work where the inner radius stays."""
    model = ConstitutiveModel(LAWS["guccione"].Law(), 880.0, tension=1e4)
    tube, step = Tube(model, 1.5e-3, 2.5e-3, 1.8e-3, 1.1, 150.0, (1.0, -0.7)), 1e-5
    force, torque = tube.force_and_torque()
    by_twist = [_energy(replace(tube, twist=150 + side * step)) for side in (1, -1)]
    by_stretch = [_energy(replace(tube, stretch=1.1 + side * step)) for side in (1, -1)]
    assert torque == pytest.approx((by_twist[0] - by_twist[1]) / (2 * step), rel=1e-6)
    assert force == pytest.approx((by_stretch[0] - by_stretch[1]) / (2 * step), rel=1e-6)


def _energy(tube):
    """Energy of the wall over the unloaded length, J/m."""

    def density(unloaded):
        r, f = tube.radius(unloaded), np.zeros((*unloaded.shape, 3, 3))
        f[..., 0, 0], f[..., 1, 1], f[..., 2, 2] = unloaded / (tube.stretch * r), r / unloaded, tube.stretch
        f[..., 1, 2] = r * tube.twist
        return tube.model.density(f @ np.swapaxes(tube.axes(unloaded), -1, -2)) * 2 * np.pi * unloaded

    return integral(density, tube.inner, tube.outer)


def test_motion_keeps_the_volume():
    tube, sphere = Tube(RUBBER, 1.5e-3, 2.5e-3, 1.9e-3, 1.1, 150.0), Sphere(RUBBER, 2e-3, 3e-3, 2.6e-3)
    place, step = np.array([1.2e-3, 1.4e-3, 0.9e-3]), 1e-9
    for shell in (tube, sphere):
        ends = [np.eye(3) * side * step + place for side in (1, -1)]
        ends = [point + shell.displacement(point) for point in ends]
        gradient = (ends[0] - ends[1]) / (2 * step)
        assert np.linalg.det(gradient) == pytest.approx(1, rel=1e-5)
