"""Cells under motions whose answer is known."""

import numpy as np
import pytest

from echotruth.config import Geometry
from echotruth.fem.tetrahedra import Mesh
from echotruth.materials import LAWS, compiled
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.solver import element
from echotruth.mechanics.solver.active_stress import ActiveLaw
from echotruth.mechanics.solver.stress_point import ACTIVE, TOTAL, VOLUMETRIC


@pytest.fixture(scope="module")
def mesh() -> Mesh:
    return left_ventricle(Geometry(circumferential_elements=6, longitudinal_elements=4, transmural_elements=2))


def law(name="fung", power=2.0, beta=1.4, cross_fibre=(0.0, 0.0)):
    constants, active = LAWS[name].Law().constants(), ActiveLaw(beta, power, max_velocity=15.0)
    laws = element.WallLaw(compiled(name), constants, active, 2e6, pointwise_bulk_ratio=20.0, viscosity=5.0)
    return laws._replace(cross_fibre=np.array(cross_fibre))


def cell_state(mesh, pressure=0.0, stiffness=1.1e3, tension=4e4, rate=0.0, taut=0.0):
    fields = (values * np.ones(len(mesh.cells)) for values in (stiffness, tension, pressure))
    previous_c = np.empty((len(mesh.cells), 14, 6))
    element.right_cauchy_green(1.05 * mesh.nodes, elements(mesh), previous_c)
    taut_c = np.empty_like(previous_c)
    element.right_cauchy_green(mesh.nodes * [1.02, 1.0, 0.97], elements(mesh), taut_c)
    return element.CellState(*fields, rate, previous_c, taut * np.ones(len(mesh.cells)), taut_c)


def elements(mesh, directions=None):
    fibres = np.broadcast_to(np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0], (len(mesh.cells), 14, 3, 3))
    directions = np.tile(np.eye(3), (len(mesh.nodes), 1, 1)) if directions is None else directions
    return element.build_elements(mesh, fibres, directions)


def response(mesh, nodes, state, directions=None, laws=None):
    out = element.allocate_response(len(mesh.cells), with_tangent=True)
    element.evaluate(nodes, elements(mesh, directions), laws or law(), state, out)
    return out


def summed(mesh, forces):
    total = np.zeros((len(mesh.nodes), 3))
    np.add.at(total, mesh.cells, forces.reshape(-1, 10, 3))
    return total


def test_cell_that_is_inside_out_has_no_volume(mesh):
    assert np.all(np.isnan(response(mesh, mesh.nodes * [1, 1, -1], cell_state(mesh)).volume))


@pytest.mark.parametrize(
    ("name", "power", "cross_fibre"),
    [
        ("fung", 2.0, (0.0, 0.0)),
        ("holzapfel_ogden", 2.0, (0.0, 0.0)),
        ("fung", 0.0, (0.0, 0.0)),
        ("fung", 2.0, (0.3, 0.2)),
    ],
)
def test_tangent_is_the_derivative_of_the_condensed_force(mesh, name, power, cross_fibre):
    rng, laws = np.random.default_rng(5), law(name, power, cross_fibre=cross_fibre)
    directions = np.linalg.qr(rng.normal(size=(len(mesh.nodes), 3, 3)))[0]
    directions[::2] = np.eye(3)
    nodes, change = mesh.nodes + 1e-5 * rng.normal(size=mesh.nodes.shape), rng.normal(size=mesh.nodes.shape)
    state = cell_state(mesh, pressure=1e4 * rng.normal(size=len(mesh.cells)), rate=200.0, taut=2e4)
    step = 1e-9
    here = response(mesh, nodes, state, directions, laws)
    ends = [response(mesh, nodes + side * step * change, state, directions, laws) for side in (1, -1)]
    forces = [out.force[:, TOTAL] for out in ends]
    growth = (ends[0].volume - ends[1].volume) / np.sum(elements(mesh).weight, axis=1)
    slope = (forces[0] - forces[1] + laws.bulk_modulus * growth[:, None] * here.force[:, 2]) / (2 * step)
    tangent = np.zeros((len(mesh.cells), 30, 30))
    tangent[:, *np.triu_indices(30)] = here.tangent
    tangent += np.triu(tangent, 1).swapaxes(1, 2)
    turned = np.einsum("nij,nj->ni", directions, change)[mesh.cells].reshape(-1, 30)
    predicted = np.einsum("crs,cs->cr", tangent, turned)
    assert np.abs(predicted - slope).max() < 1e-6 * np.abs(slope).max()


def test_each_cell_bears_its_own_stiffness_tension_and_pressure(mesh):
    nodes, factors = mesh.nodes * [1.1, 1.05, 0.95], np.random.default_rng(7).uniform(0.5, 2, size=(3, len(mesh.cells)))
    same = cell_state(mesh, pressure=1e4, rate=200.0)
    scaled = (values * factor for values, factor in zip(same[:3], factors, strict=True))
    state = element.CellState(*scaled, *same[3:])
    unit, mixed = response(mesh, nodes, cell_state(mesh, 1.0, 1.0, 1.0, 200.0)), response(mesh, nodes, state)
    np.testing.assert_array_equal(mixed.force[:, :TOTAL], unit.force[:, :TOTAL])
    parts = np.einsum("pc,cpr->cr", state[:3], mixed.force[:, :TOTAL])
    viscous = response(mesh, nodes, cell_state(mesh, 0.0, 0.0, 0.0, 200.0)).force[:, TOTAL]
    np.testing.assert_allclose(mixed.force[:, TOTAL], parts + viscous, atol=1e-10 * np.abs(parts).max())
    assert not np.allclose(mixed.tangent, response(mesh, nodes, same).tangent)


def test_tension_that_is_the_same_in_all_directions_is_a_pressure(mesh):
    """With full shares and no length dependence the Cauchy stress of stretched fibre axes is T I."""
    frame = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    nodes = mesh.nodes @ (frame.T @ np.diag([1.25, 0.8, 1.0]) @ frame).T

    def parts(*cross_fibre):
        return response(mesh, nodes, cell_state(mesh), laws=law(beta=0.0, cross_fibre=cross_fibre)).force

    tension, scale = parts(1.0, 1.0), np.abs(parts(1.0, 1.0)[:, ACTIVE]).max()
    np.testing.assert_allclose(tension[:, ACTIVE], tension[:, VOLUMETRIC], atol=1e-12 * scale)
    along_fibre, sheet, normal = (parts(*shares)[:, ACTIVE] for shares in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)))
    mixed = along_fibre + 0.5 * (sheet - along_fibre) + 0.25 * (normal - along_fibre)
    np.testing.assert_allclose(parts(0.5, 0.25)[:, ACTIVE], mixed, atol=1e-12 * scale)


def test_viscous_force_does_the_work_of_the_strain_increment(mesh):
    """A wall that swells from 1.05 to 1.1 times its size: S is the increment of E, and its virtual work 3 S l dl."""
    state, wall = cell_state(mesh, 0.0, 0.0, 0.0, rate=0.2), np.sum(elements(mesh).weight)
    work = np.sum(summed(mesh, response(mesh, 1.1 * mesh.nodes, state).force[:, TOTAL]) * mesh.nodes)
    assert work == pytest.approx(3 * (1.1**2 - 1.05**2) / 2 * 1.1 * wall, rel=1e-12)


def test_a_taut_scar_stores_the_energy_of_its_strain_since_end_diastole(mesh):
    """Its forces are the derivative of V G E : E / 2, with E = (F^T F - F_ED^T F_ED) / 2, for an affine deformation."""
    modulus, at_ed = 5e5, np.diag([1.02, 1.0, 0.97])
    rng = np.random.default_rng(3)
    f, change = np.eye(3) + 0.05 * rng.normal(size=(3, 3)), rng.normal(size=(3, 3))

    def energy(deformation):
        strain = (deformation.T @ deformation - at_ed.T @ at_ed) / 2
        return elements(mesh).weight.sum() * modulus * np.sum(strain**2) / 2

    nodes = mesh.nodes @ f.T
    taut, slack = (response(mesh, nodes, cell_state(mesh, taut=value)).force[:, TOTAL] for value in (modulus, 0.0))
    moved = (mesh.nodes @ change.T)[mesh.cells].reshape(-1, 30)
    step = 1e-5
    slope = (energy(f + step * change) - energy(f - step * change)) / (2 * step)
    assert np.sum((taut - slack) * moved) == pytest.approx(slope, rel=1e-8)
