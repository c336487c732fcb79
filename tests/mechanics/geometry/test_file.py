"""From a file to the heart frame; the walls that are refused on the way, and a human heart."""

from importlib.metadata import PackageNotFoundError, files
from pathlib import Path

import numpy as np
import pytest
import pyvista

from echotruth.config import Geometry
from echotruth.config.geometry import CellLabels
from echotruth.config.loading import load
from echotruth.fem.volume import cell_volumes
from echotruth.mechanics.geometry import GeometryError, left_ventricle, mesh_quality
from echotruth.mechanics.geometry.boundary import boundary, quadratic_cells, with_midpoints
from echotruth.mechanics.geometry.boundary_labels import BASE, ENDO, EPI, label_boundary
from echotruth.mechanics.geometry.cut import extract_wall
from echotruth.mechanics.geometry.imported_mesh import read
from echotruth.mechanics.geometry.mesh_quality import scaled_jacobian
from echotruth.mechanics.solver.cavity import cavity_volume

EXAMPLE = Path(__file__).parents[3] / "config/rodero.yaml"


@pytest.fixture
def surface(file_heart):
    return np.vstack([file_heart.mesh.endo, file_heart.mesh.epi, file_heart.mesh.base])


def test_linear_tetrahedra_get_straight_middles(file_heart, write_mesh):
    linear = file_heart.mesh.cells[:, :4]
    mesh = left_ventricle(Geometry(file=write_mesh(file_heart.nodes, linear)))
    assert mesh.cells.shape == file_heart.mesh.cells.shape and len(mesh.nodes) == len(file_heart.mesh.nodes)
    edges, cells = quadratic_cells(linear, len(file_heart.nodes))
    nodes = with_midpoints(file_heart.nodes, edges)
    np.testing.assert_allclose(nodes[cells[:, 4]], nodes[cells[:, :2]].mean(axis=1))
    assert [len(mesh.endo), len(mesh.epi), len(mesh.base)] == [
        len(side) for side in (file_heart.mesh.endo, file_heart.mesh.epi, file_heart.mesh.base)
    ]
    assert np.all(mesh.nodes[mesh.base, 2] == 0) and mesh.nodes[:, 2].max() < 1e-9


def test_septum_is_turned_to_x_by_its_cells(file_heart, write_mesh):
    azimuth = file_heart.mesh.nodes[file_heart.mesh.cells[:, :4]].mean(axis=1)
    septal = np.abs(np.arctan2(azimuth[:, 1], azimuth[:, 0])) < 0.9
    file = write_mesh(file_heart.nodes, file_heart.mesh.cells, part=np.where(septal, 7, 1))
    mesh = left_ventricle(Geometry(file=file, septum=CellLabels(array="part", values=[7])))
    middle = mesh.nodes[mesh.cells[septal, :4]].mean(axis=(0, 1))
    assert middle[0] > 0 and middle[1] == pytest.approx(0, abs=1e-6)


def test_surface_that_does_not_close(file_heart, surface, write_surface):
    with pytest.raises(
        GeometryError, match=r"does not close round the wall \(\d+ open and 0 non-manifold edges of \d+\)"
    ):
        left_ventricle(Geometry(file=write_surface(file_heart.nodes, surface[3:]), remesh=True))


def test_surface_of_triangles_in_any_orientation(file_heart, surface, write_surface):
    turned = surface[:, :3].copy()
    turned[::2] = turned[::2, ::-1]
    one, few = write_surface(file_heart.nodes, surface), {"circumferential_elements": 6, "longitudinal_elements": 4}
    other = write_surface(file_heart.nodes, turned, "turned.stl")
    one, other = (left_ventricle(Geometry(file=file, remesh=True, **few)) for file in (one, other))
    np.testing.assert_allclose(one.nodes, other.nodes, atol=1e-8)


def test_surface_with_a_point_so_far_away_that_all_others_coincide(file_heart, surface, write_surface):
    nodes = file_heart.nodes.copy()
    nodes[surface[0, 0]] = 1e38
    with pytest.raises(GeometryError, match=r"wall\.stl: the corners of all its triangles coincide"):
        left_ventricle(Geometry(file=write_surface(nodes, surface), remesh=True))


def test_two_surfaces(tmp_path):
    pyvista.merge([pyvista.Sphere(radius=5), pyvista.Sphere(radius=3)]).extract_surface(algorithm=None).save(
        tmp_path / "two.stl"
    )
    with pytest.raises(GeometryError, match="holds 2 surfaces that do not touch: join endocardium and epicardium"):
        left_ventricle(Geometry(file=str(tmp_path / "two.stl"), remesh=True))


@pytest.mark.parametrize(
    ("keys", "reason"),
    [
        ({}, r"holds a surface, not tetrahedra: set geometry\.remesh: true"),
        (
            {"remesh": True, "wall_cells": CellLabels(array="part", values=[1])},
            r"geometry\.wall_cells selects tetrahedra",
        ),
        ({"remesh": True, "fibre": "f"}, r"geometry\.fibre selects tetrahedra, and the file holds a surface"),
    ],
)
def test_keys_that_a_surface_cannot_have(file_heart, surface, write_surface, keys, reason):
    with pytest.raises(GeometryError, match=reason):
        left_ventricle(Geometry(file=write_surface(file_heart.nodes, surface), **keys))


@pytest.mark.slow
def test_wrong_unit(file_heart, write_mesh):
    unit = "um"
    with pytest.raises(
        GeometryError, match=rf"the cavity holds .*: set geometry\.unit, now {unit}, to one of m, cm, mm"
    ):
        left_ventricle(Geometry(file=write_mesh(file_heart.nodes, file_heart.mesh.cells), unit=unit))


def test_sliver_is_refused_with_the_remedy(file_heart, write_mesh, monkeypatch):
    monkeypatch.setattr(mesh_quality, "MIN_SCALED_JACOBIAN", 0.3)
    with pytest.raises(GeometryError, match=r"are flat .*: mesh the wall again with geometry\.remesh: true"):
        left_ventricle(Geometry(file=write_mesh(file_heart.nodes, file_heart.mesh.cells)))


@pytest.fixture(scope="module")
def example():
    """The shipped example, with the data where the package that carries them is installed."""
    name = "rodero_01_fullheart_2.0mm.vtu"
    try:
        found = [str(path.locate()) for path in files("ansys-health-heart") or [] if path.name == name]
    except PackageNotFoundError:
        found = []
    if not found:
        pytest.skip("ansys-health-heart is not installed")
    return load(EXAMPLE).geometry.model_copy(update={"file": found[0]})


def test_sides_of_a_human_heart_are_those_of_its_coordinates(example):
    imported = extract_wall(read(example), example.wall_cells)
    surface = label_boundary(imported, boundary(imported.cells)[0], None)
    transmural = imported.node_arrays["transmural"][surface.facets].mean(axis=1)
    assert np.quantile(transmural[surface.labels == ENDO], 0.98) < 0.1
    assert np.median(transmural[surface.labels == EPI]) == 1.0
    assert 500 < np.sum(surface.labels == BASE) < 3000


def test_human_heart_is_remeshed(example):
    mesh = left_ventricle(example)
    assert 85e-6 < cavity_volume(mesh.nodes, mesh.endo) < 130e-6
    assert 100e-6 < cell_volumes(mesh.nodes, mesh.cells).sum() < 165e-6
    assert scaled_jacobian(mesh.nodes, mesh.cells).min() > 0.1
    assert np.all(mesh.nodes[mesh.base, 2] == 0)


def test_human_heart_as_it_is(example):
    mesh = left_ventricle(example.model_copy(update={"remesh": False}))
    assert 100e-6 < cavity_volume(mesh.nodes, mesh.endo) < 160e-6
    assert len(mesh.cells) > 180_000 and scaled_jacobian(mesh.nodes, mesh.cells).min() > 0.1


def test_fibres_of_the_human_heart_are_a_placeholder(example):
    with pytest.raises(GeometryError, match="'fiber' has one direction in all of the wall, a placeholder"):
        left_ventricle(example.model_copy(update={"fibre": "fiber"}))
