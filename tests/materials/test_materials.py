"""Each law against an independent formula, hand-derived stresses, and the rules common to all laws."""

import subprocess
import sys
from textwrap import dedent

import numpy as np
import pytest

from echotruth.materials import LAWS
from echotruth.mechanics.solver import stress as material
from validation.energies import PASSIVE_ENERGIES

STEP = 1e-30
"""Imaginary part of an argument: the derivative by a complex step has no cancellation."""


def tensor(a):
    return np.array([[a[0], a[3], a[4]], [a[3], a[1], a[5]], [a[4], a[5], a[2]]])


def voigt(a):
    return np.array([a[i, j] for i, j in material.PAIRS])


def strained(seed):
    return np.eye(3) + 0.12 * np.random.default_rng(seed).normal(size=(3, 3))


def energy(c, name):
    """W / C of C of shape (6,), complex or real, by the law's formula and the isochoric split."""
    full = tensor(c)
    return PASSIVE_ENERGIES[name]((np.linalg.det(full) ** (-1 / 3) * full - np.eye(3)) / 2, LAWS[name].Law())


def respond(c, name):
    """W, S and dS/dE of the element's chain, each over C."""
    inverse, e, stress, tangent = np.empty(6), np.empty(6), np.empty(6), np.empty((6, 6))
    scale = material.isochoric_strain(c, material.invert(c, inverse), e)
    energy = LAWS[name].energy(e, LAWS[name].Law().constants(), stress, tangent)
    trace = material.isochoric_stress(c, inverse, scale, stress)
    material.isochoric_tangent(c, inverse, scale, trace, stress, tangent)
    return energy, stress, np.triu(tangent) + np.triu(tangent, 1).T


def complex_step(c, name):
    """S = 2 dW/dC, exact to round-off."""
    steps = 1j * STEP * np.eye(6)
    slope = np.array([energy(c + step, name).imag / STEP for step in steps])
    return 2 * slope / material.MULTIPLICITY


def test_every_law_has_an_independent_formula():
    assert set(PASSIVE_ENERGIES) == set(LAWS)


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("seed", range(4))
def test_energy_and_stress_are_those_of_the_formula(name, seed):
    f = strained(seed)
    c = voigt(f.T @ f)
    w, stress, _ = respond(c, name)
    assert w == pytest.approx(energy(c, name), rel=1e-13)
    np.testing.assert_allclose(stress, complex_step(c, name), rtol=1e-12, atol=1e-12 * np.abs(stress).max())


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("seed", range(4))
def test_tangent_is_the_symmetric_derivative_of_the_stress(name, seed):
    f, step = strained(seed), 1e-6
    c = voigt(f.T @ f)
    _, _, tangent = respond(c, name)
    slope = np.empty((6, 6))
    for k, d in enumerate(np.diag(2 * step / material.MULTIPLICITY)):
        slope[:, k] = (complex_step(c + d, name) - complex_step(c - d, name)) / (2 * step)
    np.testing.assert_allclose(tangent, slope, atol=3e-8 * np.abs(slope).max())
    np.testing.assert_allclose(slope, slope.T, atol=3e-8 * np.abs(slope).max())


@pytest.mark.parametrize("name", LAWS)
def test_nothing_is_stressed_by_a_change_of_volume_or_at_rest(name):
    for swollen in (1.0, 1.3):
        w, stress, _ = respond(np.array([swollen, swollen, swollen, 0, 0, 0]), name)
        assert w == pytest.approx(0, abs=1e-14)
        np.testing.assert_allclose(stress, 0, atol=1e-13)


@pytest.mark.parametrize("name", LAWS)
def test_stiffness_is_the_second_derivative_of_the_energy_summed_over_all_strains(name):
    def summed(name):
        c = np.array([1.21, 1 / 1.1, 1 / 1.1, 0, 0, 0])
        steps = 1e-6 * np.eye(6)
        # Each shear stands twice in C: dS_fs / dC_fs is 2 dS_fs / (2 dE_fs).
        return sum((complex_step(c + d, name)[k] - complex_step(c - d, name)[k]) / 1e-6 for k, d in enumerate(steps))

    law = LAWS[name]
    found = material.relative_stiffness(law.energy, law.Law().constants())
    assert found == pytest.approx(summed(name) / summed("fung"), rel=1e-6)


def pull(c, name):
    """Cauchy stress along f less that along n of a stretch without shear, of an incompressible wall."""
    _, stress, _ = respond(c, name)
    return c[0] * stress[0] - c[2] * stress[2]


@pytest.mark.parametrize("stretch", [0.85, 1.1, 1.25])
class TestByHand:
    """Uniaxial tension along the fibre, a stretch l and 1 / sqrt(l) across, and equibiaxial tension along f and s."""

    def test_fung(self, stretch):
        along, across = (stretch**2 - 1) / 2, (1 / stretch - 1) / 2
        growth = np.exp(9.2 * along**2 + 2 * 2.0 * across**2)
        by_hand = growth * (9.2 * along * stretch**2 - 2.0 * across / stretch)
        assert pull(np.array([stretch**2, 1 / stretch, 1 / stretch, 0, 0, 0]), "fung") == pytest.approx(by_hand)

    def test_guccione(self, stretch):
        along, across = (stretch**2 - 1) / 2, (stretch**-4 - 1) / 2
        growth = np.exp((5 + 6) * along**2 + 3 * across**2)
        by_hand = growth * (5 * along * stretch**2 - 3 * across * stretch**-4)
        assert pull(np.array([stretch**2, stretch**2, stretch**-4, 0, 0, 0]), "guccione") == pytest.approx(by_hand)

    def test_holzapfel_ogden_along_the_fibre(self, stretch):
        """The sheet, which uniaxial stretch shortens, does not bear; it does where the fibre is shortened."""
        growth = np.exp(8.023 * (stretch**2 + 2 / stretch - 3))
        along = max(stretch**2 - 1, 0)
        by_hand = growth * (stretch**2 - 1 / stretch)
        by_hand += 2 * 313.1 * stretch**2 * along * np.exp(16.026 * along**2)
        c = np.array([stretch**2, 1 / stretch, 1 / stretch, 0, 0, 0])
        _, stress, _ = respond(c, "holzapfel_ogden")
        across = max(1 / stretch - 1, 0)
        of_sheet = 2 * 42.05 / stretch * across * np.exp(11.120 * across**2)
        assert pull(c, "holzapfel_ogden") == pytest.approx(by_hand)
        assert c[1] * stress[1] - c[2] * stress[2] == pytest.approx(of_sheet, abs=1e-10)

    def test_neo_hooke(self, stretch):
        """Treloar's l^2 - 1/l in tension along one axis, l^2 - l^-4 along two."""
        uniaxial = pull(np.array([stretch**2, 1 / stretch, 1 / stretch, 0, 0, 0]), "neo_hooke")
        biaxial = pull(np.array([stretch**2, stretch**2, stretch**-4, 0, 0, 0]), "neo_hooke")
        assert uniaxial == pytest.approx(stretch**2 - 1 / stretch)
        assert biaxial == pytest.approx(stretch**2 - stretch**-4)


def test_simple_shear_of_holzapfel_and_ogden():
    """A shear g along f in the fs plane, and along s: a g exp(b g^2) of the matrix, a_fs g exp(b_fs g^2) of the
    shear of the two, and 2 a_i g^3 exp(b_i g^4) of the one of them that is stretched."""
    g = 0.3
    growth, coupled = np.exp(8.023 * g**2), 3.661 * g * np.exp(11.436 * g**2)
    sheared = np.eye(3)
    sheared[0, 1] = g
    for gradient, structure in (
        (sheared, 2 * 42.05 * g**3 * np.exp(11.120 * g**4)),
        (sheared.T, 2 * 313.1 * g**3 * np.exp(16.026 * g**4)),
    ):
        _, stress, _ = respond(voigt(gradient.T @ gradient), "holzapfel_ogden")
        cauchy = gradient @ tensor(stress) @ gradient.T
        assert cauchy[0, 1] == pytest.approx(g * growth + coupled + structure)


DROPPED = '''
"""A law with one key."""

from typing import Literal

import numpy as np

from echotruth.materials.material import Material


class Law(Material):
    """W = C/2 exponent tr(E)^2, plus C tr(E)."""

    law: Literal["dropped"] = "dropped"
    exponent: float = 2.0

    def constants(self):
        return np.array([self.exponent])


def energy(e, b, stress, tangent):
    trace = e[0] + e[1] + e[2]
    stress[:], tangent[:] = 0.0, 0.0
    stress[:3], tangent[:3, :3] = 1 + b[0] * trace, b[0]
    return trace + b[0] * trace**2 / 2
'''

INFLATE = """
    import importlib.util, sys
    spec = importlib.util.find_spec("echotruth.materials")
    spec.submodule_search_locations.append(sys.argv[1])
    sys.modules[spec.name] = package = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(package)

    import numpy as np
    from echotruth.config import Geometry
    from echotruth.config.loading import validate
    from echotruth.mechanics.solver import element
    from echotruth.mechanics.solver.active_stress import ActiveLaw
    from echotruth.mechanics.solver.equilibrium import Equilibrium, Load
    from echotruth.mechanics.geometry import left_ventricle
    from echotruth.mechanics.solver.newton import LoadStepper
    from echotruth.mechanics.solver.support import base_support

    config = validate({"mechanics": {"material": {"law": "dropped", "exponent": 3.0}}}, "test")
    material = config.mechanics.material
    law = element.WallLaw(package.compiled(material.law), material.constants(), ActiveLaw(), 2e6)
    mesh = left_ventricle(Geometry(circumferential_elements=6, longitudinal_elements=4, transmural_elements=1))
    frames = np.tile(np.eye(3), (len(mesh.cells), 14, 1, 1))
    heart = Equilibrium(mesh, frames, law, base_support(mesh, "fixed"))
    stepper = LoadStepper(heart, 1e3)
    empty = stepper.load.volume
    stepper.advance(Load(200.0, 1.0), None)
    print(material.exponent, stepper.load.volume / empty)
"""


def test_law_dropped_as_one_file_is_found_configured_and_solved(tmp_path):
    (tmp_path / "dropped.py").write_text(DROPPED)
    command = [sys.executable, "-c", dedent(INFLATE), str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    exponent, growth = map(float, done.stdout.split())
    assert exponent == 3
    assert 1.05 < growth < 2
