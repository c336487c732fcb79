"""New elements in walls of known shape."""

import logging

import numpy as np
import pytest

from echotruth.config import Geometry
from echotruth.fem.volume import cell_volumes
from echotruth.mechanics.geometry import GeometryError, left_ventricle
from echotruth.mechanics.solver.cavity import cavity_volume

FINE = {"circumferential_elements": 48, "longitudinal_elements": 20, "transmural_elements": 1}
FEW = {"circumferential_elements": 12, "longitudinal_elements": 6, "transmural_elements": 1}


@pytest.fixture(scope="module")
def human():
    return left_ventricle(Geometry(preset="human", **FINE))


def surface(mesh):
    return np.vstack([mesh.endo, mesh.epi, mesh.base])


def test_remeshed_ellipsoid_keeps_its_volumes(human, file_heart, write_surface, caplog):
    caplog.set_level(logging.INFO, "echotruth.mechanics")
    file = write_surface(1e3 * human.nodes @ file_heart.turn + file_heart.shift, surface(human))
    mesh = left_ventricle(Geometry(file=file, remesh=True))
    # The file's triangles are flat, and the cut takes 0.2 % of the length.
    assert cavity_volume(mesh.nodes, mesh.endo) == pytest.approx(cavity_volume(human.nodes, human.endo), rel=0.015)
    assert cell_volumes(mesh.nodes, mesh.cells).sum() == pytest.approx(
        cell_volumes(human.nodes, human.cells).sum(), rel=0.015
    )
    assert np.all(mesh.nodes[mesh.base, 2] == 0)
    assert "the new wall lies 0." in caplog.text


def meridians(radius, length, around, rings):
    """Half an ellipsoid whose edges run along meridians and parallels: points (n, 3) and triangles (n, 3)."""
    angle, azimuth = np.pi / 2 * np.arange(1, rings + 1) / rings, 2 * np.pi * np.arange(around) / around
    across, z = radius * np.sin(angle)[:, None], np.repeat(-length * np.cos(angle)[:, None], around, axis=1)
    points = np.stack([across * np.cos(azimuth), across * np.sin(azimuth), z], axis=-1).reshape(-1, 3)
    first = 1 + np.arange(around)
    triangles = [np.column_stack([np.zeros_like(first), first, np.roll(first, -1)])]
    for ring in range(rings - 1):
        triangles.append(between(first + ring * around, first + (ring + 1) * around))
    return np.vstack([[[0, 0, -length]], points]), np.vstack(triangles)


def between(one, other):
    """Triangles between two rings of the same number of points."""
    lower = np.column_stack([one, other, np.roll(other, -1)])
    return np.vstack([lower, np.column_stack([one, np.roll(other, -1), np.roll(one, -1)])])


def test_ellipsoid_whose_edges_run_along_the_lines_through_the_wall(write_surface):
    """Lines from the long axis then meet edges and vertices alone; cavity and wall are 2 pi/3 of the products."""
    (inside, endo), (outside, epi) = meridians(2.0, 5.0, 72, 36), meridians(3.0, 6.0, 72, 36)
    rims = np.arange(len(inside) - 72, len(inside)), len(inside) + np.arange(len(outside) - 72, len(outside))
    file = write_surface(np.vstack([inside, outside]), np.vstack([endo, epi + len(inside), between(*rims)]))
    mesh = left_ventricle(Geometry(file=file, remesh=True, **FINE))
    # The file's triangles are flat, and the cut takes 0.2 % of the length.
    volume = 2 * np.pi / 3 * np.array([2 * 2 * 5, 3 * 3 * 6]) * 1e-9
    found = cavity_volume(mesh.nodes, mesh.endo)
    assert found == pytest.approx(volume[0], rel=0.015)
    assert cell_volumes(mesh.nodes, mesh.cells).sum() + found == pytest.approx(volume[1], rel=0.015)


@pytest.mark.slow
def test_tetrahedra_and_surface_give_the_same_wall(human, file_heart, write_mesh, write_surface):
    nodes = 1e3 * human.nodes @ file_heart.turn + file_heart.shift
    whole = left_ventricle(Geometry(file=write_mesh(nodes, human.cells[:, :4]), remesh=True))
    shell = left_ventricle(Geometry(file=write_surface(nodes, surface(human)), remesh=True))
    np.testing.assert_allclose(whole.nodes, shell.nodes, atol=2e-5)
    np.testing.assert_array_equal(whole.cells, shell.cells)


@pytest.mark.slow
def test_numbering_is_that_of_the_ellipsoid(human, write_surface):
    file = write_surface(1e3 * human.nodes, surface(human))
    mesh, other = left_ventricle(Geometry(file=file, remesh=True, **FEW)), left_ventricle(Geometry(**FEW))
    np.testing.assert_array_equal(np.sort(mesh.cells, axis=1), np.sort(other.cells, axis=1))
    assert [len(mesh.endo), len(mesh.base)] == [len(other.endo), len(other.base)]


@pytest.mark.slow
def test_bent_heart_is_followed(human, write_surface):
    """A heart bent into a banana by 8 mm, with a bulge in the septum."""
    nodes = 1e3 * human.nodes
    nodes[:, 1] += 8 * (nodes[:, 2] / 80) ** 2
    nodes[:, 0] *= 1 - 0.1 * np.exp(-((nodes[:, 2] + 40) ** 2) / 400) * (nodes[:, 0] > 0)
    # The bulge bends the surface within an element; only its size is asked for.
    mesh = left_ventricle(Geometry(file=write_surface(nodes, surface(human)), remesh=True))
    expected = cavity_volume(1e-3 * nodes, human.endo)
    assert cavity_volume(mesh.nodes, mesh.endo) == pytest.approx(expected, rel=0.02)


@pytest.mark.slow
def test_cut_is_as_deep_as_asked(human, write_surface):
    file = write_surface(1e3 * human.nodes, surface(human))
    depth = [-left_ventricle(Geometry(file=file, remesh=True, cut_mm=cut)).nodes[:, 2].min() for cut in (5.0, 15.0)]
    assert depth[0] - depth[1] == pytest.approx(10e-3, rel=0.02)


def test_cut_that_leaves_nothing_is_refused(human, write_surface):
    file = write_surface(1e3 * human.nodes, surface(human))
    with pytest.raises(GeometryError, match=r"the cut would leave .* mm of a cavity of .* mm: set geometry\.cut_mm"):
        left_ventricle(Geometry(file=file, remesh=True, cut_mm=70.0))


@pytest.mark.slow
def test_factors_shape_a_wall_from_a_file_too(human, write_surface):
    file = write_surface(1e3 * human.nodes, surface(human))

    def changed(**factors):
        mesh = left_ventricle(Geometry(file=file, remesh=True, **FEW, **factors))
        return cavity_volume(mesh.nodes, mesh.endo), cell_volumes(mesh.nodes, mesh.cells).sum()

    cavity, wall = changed()
    assert changed(hypertrophy=1.4) == (pytest.approx(cavity), pytest.approx(1.5 * wall, rel=0.1))
    assert changed(dilation=1.2) == (pytest.approx(1.2**3 * cavity), pytest.approx(1.35 * wall, rel=0.1))
    assert changed(elongation=1.2)[0] == pytest.approx(1.2 * cavity)
    assert changed(scale=1.1) == pytest.approx((1.1**3 * cavity, 1.1**3 * wall), rel=1e-3)
