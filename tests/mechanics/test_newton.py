"""Inflation against the exact sphere, and the errors when there is no equilibrium."""

import logging

import numpy as np
import pytest
from scipy.integrate import quad

from echotruth.config import Fibres, Geometry
from echotruth.fem.quadrature import tetrahedron
from echotruth.materials import LAWS, compiled
from echotruth.mechanics import fibres
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.solver import element
from echotruth.mechanics.solver.active_stress import ActiveLaw
from echotruth.mechanics.solver.equilibrium import Equilibrium, Load
from echotruth.mechanics.solver.newton import Diverged, LoadStepper
from echotruth.mechanics.solver.support import base_support

INNER, OUTER, B, C = 2e-3, 3e-3, 3.0, 1.5e3
COARSE = {"circumferential_elements": 12, "longitudinal_elements": 6, "transmural_elements": 2}


def sphere_pressure(inner):
    """Pressure in a thick incompressible sphere whose cavity has grown from INNER to `inner`.

    The radial equilibrium of an isotropic Fung law, int 2 (s_t - s_r) / r dr (Green & Zerna,
    Theoretical Elasticity, section 3.10).
    """

    def difference(stretch):
        """Tangential less radial Cauchy stress at the stretches stretch^-2, stretch, stretch."""
        radial, tangential = (stretch**-4 - 1) / 2, (stretch**2 - 1) / 2
        factor = C * B * np.exp(B * (radial**2 + 2 * tangential**2))
        return factor * (stretch**2 * tangential - stretch**-4 * radial)

    def integrand(r):
        return 2 * difference(r / (r**3 - inner**3 + INNER**3) ** (1 / 3)) / r

    return quad(integrand, inner, (OUTER**3 + inner**3 - INNER**3) ** (1 / 3))[0]


@pytest.fixture(scope="module")
def hemisphere():
    yield from half_sphere(COARSE)


@pytest.fixture
def small_hemisphere():
    yield from half_sphere({"circumferential_elements": 6, "longitudinal_elements": 4, "transmural_elements": 1})


def half_sphere(elements):
    size = {"endo_radius_mm": 2.0, "endo_length_mm": 2.0, "wall_mm": 1.0, "apex_wall_mm": 1.0, "base_mm": 0.0}
    mesh = left_ventricle(Geometry(**size, **elements))
    frames = fibres.fibre_frames(mesh, fibres.wall_depth(mesh), Fibres(), tetrahedron()[0])
    constants = LAWS["fung"].Law(fibre=B, transverse=B, shear=B).constants()
    law = element.WallLaw(compiled("fung"), constants, ActiveLaw(), 1e8)
    equations = Equilibrium(mesh, frames, law, base_support(mesh, "radial_free"))
    yield equations
    equations.close()


def test_half_a_sphere_inflates_as_the_exact_one(hemisphere):
    stepper = LoadStepper(hemisphere, C)
    for inner in (2.2e-3, 2.5e-3):
        state = stepper.advance(Load(sphere_pressure(inner), 1.0), None)
        radius = (3 * hemisphere.volume(state) / (2 * np.pi)) ** (1 / 3)
        assert radius == pytest.approx(inner, rel=3e-3)


def test_stiffness_is_found_from_pressure_and_volume(hemisphere):
    stepper = LoadStepper(hemisphere, 0.7 * C)
    pressure, volume = sphere_pressure(2.3e-3), 2 / 3 * np.pi * 2.3e-3**3
    stepper.advance(Load(pressure, volume), None)
    state = stepper.advance(Load(pressure, volume), "stiffness")
    assert state.stiffness == pytest.approx(C, rel=0.01)
    assert hemisphere.volume(state) == pytest.approx(volume, rel=1e-7)
    assert hemisphere.residual(state, Load(pressure, volume), "stiffness").force_error < 1e-7


def test_load_without_equilibrium_ends_in_one_sentence(small_hemisphere, caplog):
    stepper = LoadStepper(small_hemisphere, C)
    with (
        caplog.at_level(logging.DEBUG, "echotruth.mechanics"),
        pytest.raises(Diverged, match=r"kPa and a volume of .* uL"),
    ):
        stepper.advance(Load(1e3, 1e-12), "tension")
    assert any("load step halved" in message for message in caplog.messages)
