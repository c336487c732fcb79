"""Cells under motions whose answer is known."""

import numba
import numpy as np
import pytest

from echotruth.config import Geometry
from echotruth.mechanics import element, material
from echotruth.mechanics.geometry import left_ventricle
from echotruth.tetrahedra import Mesh

LAW = element.Law(material.moduli(9.2, 2.0, 3.7), 1.4, 2e6)
SCALE = np.array([1.1e3, 4e4])


@pytest.fixture(scope="module")
def mesh() -> Mesh:
    return left_ventricle(Geometry(circumferential_elements=6, longitudinal_elements=4, transmural_elements=2))


def body(mesh, frame=None):
    fibres = np.broadcast_to(np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0], (len(mesh.cells), 14, 3, 3))
    frame = np.tile(np.eye(3), (len(mesh.nodes), 1, 1)) if frame is None else frame
    return element.elements(mesh, fibres, frame)


def respond(mesh, nodes, pressure, scale=SCALE, frame=None):
    out = element.blocks(len(mesh.cells), with_tangent=True)
    element.respond(nodes, body(mesh, frame), LAW, scale, pressure, out)
    return out


def whole(out, scale, pressure):
    return scale[0] * out.force[:, 0] + scale[1] * out.force[:, 1] + pressure[:, None] * out.force[:, 2]


def summed(mesh, forces):
    total = np.zeros((len(mesh.nodes), 3))
    np.add.at(total, mesh.cells, forces.reshape(-1, 10, 3))
    return total


def test_homogeneous_deformation_leaves_the_inside_in_balance(mesh):
    gradient = np.array([[1.1, 0.2, 0.0], [-0.1, 0.95, 0.1], [0.05, 0.0, 1.02]])
    pressure = np.full(len(mesh.cells), 1e4)
    out = respond(mesh, mesh.nodes @ gradient.T, pressure)
    total = summed(mesh, whole(out, SCALE, pressure))
    inside = np.setdiff1d(mesh.cells, np.concatenate([side.ravel() for side in (mesh.endo, mesh.epi, mesh.base)]))
    assert len(inside) > 50
    assert np.abs(total[inside]).max() < 1e-10 * np.abs(total).max()
    unloaded = np.sum(body(mesh).weight, axis=1)
    np.testing.assert_allclose(out.volume, np.linalg.det(gradient) * unloaded, rtol=1e-12)


def test_rigid_rotation_needs_no_passive_force(mesh):
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    out = respond(mesh, mesh.nodes @ turn.T + 1e-3, np.zeros(len(mesh.cells)))
    stretched = respond(mesh, 1.01 * mesh.nodes * [1, 1, 0.9], np.zeros(len(mesh.cells)))
    assert np.abs(out.force[:, 0]).max() < 1e-10 * np.abs(stretched.force[:, 0]).max()


def test_cell_that_is_inside_out_has_no_volume(mesh):
    assert np.all(np.isnan(respond(mesh, mesh.nodes * [1, 1, -1], np.zeros(len(mesh.cells))).volume))


def test_tangent_is_the_derivative_of_the_condensed_force(mesh):
    rng = np.random.default_rng(5)
    frame = np.linalg.qr(rng.normal(size=(len(mesh.nodes), 3, 3)))[0]
    frame[::2] = np.eye(3)
    nodes, change = mesh.nodes + 1e-5 * rng.normal(size=mesh.nodes.shape), rng.normal(size=mesh.nodes.shape)
    pressure, step = 1e4 * rng.normal(size=len(mesh.cells)), 1e-9
    here = respond(mesh, nodes, pressure, frame=frame)
    ends = [respond(mesh, nodes + side * step * change, pressure, frame=frame) for side in (1, -1)]
    forces = [whole(out, SCALE, pressure) for out in ends]
    growth = (ends[0].volume - ends[1].volume) / np.sum(body(mesh).weight, axis=1)
    slope = (forces[0] - forces[1] + LAW.bulk_modulus * growth[:, None] * here.force[:, 2]) / (2 * step)
    tangent = np.zeros((len(mesh.cells), 30, 30))
    tangent[:, *np.triu_indices(30)] = here.tangent
    tangent += np.triu(tangent, 1).swapaxes(1, 2)
    turned = np.einsum("nij,nj->ni", frame, change)[mesh.cells].reshape(-1, 30)
    predicted = np.einsum("crs,cs->cr", tangent, turned)
    assert np.abs(predicted - slope).max() < 1e-6 * np.abs(slope).max()


def test_bytes_do_not_depend_on_the_number_of_threads(mesh):
    nodes = mesh.nodes + 1e-5 * np.random.default_rng(6).normal(size=mesh.nodes.shape)
    before, results = numba.get_num_threads(), []
    for threads in {1, before}:
        numba.set_num_threads(threads)
        results.append(respond(mesh, nodes, np.full(len(mesh.cells), 1e3)))
    numba.set_num_threads(before)
    assert all(a.tobytes() == b.tobytes() for a, b in zip(results[0], results[-1], strict=True))
