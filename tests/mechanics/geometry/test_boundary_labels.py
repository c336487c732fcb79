"""Endocardium, epicardium and base of an ellipsoid at any position and orientation."""

import numpy as np
import pytest
import pyvista

from echotruth.config import Geometry
from echotruth.config.geometry import BoundaryLabels
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.geometry.boundary import boundary
from echotruth.mechanics.geometry.boundary_labels import label_boundary
from echotruth.mechanics.geometry.imported_mesh import ImportedMesh
from echotruth.mechanics.geometry.mesh_quality import GeometryError

NAMES = ("endo", "epi", "base")


def as_imported(nodes, mesh, side=None):
    triangles = np.vstack([getattr(mesh, name)[:, :3] for name in NAMES])
    known = np.repeat([11, 12, 13], [len(getattr(mesh, name)) for name in NAMES])
    return ImportedMesh("heart.vtu", nodes, mesh.cells, triangles, {}, {"side": known if side is None else side})


def counts(surface):
    return [int(np.sum(surface.labels == number)) for number in range(3)]


@pytest.mark.slow
@pytest.mark.parametrize(
    "geometry",
    [
        {},
        {"circumferential_elements": 12, "longitudinal_elements": 6, "transmural_elements": 1},
        {"preset": "human", "circumferential_elements": 48, "longitudinal_elements": 24},
        {"preset": "rat", "hypertrophy": 1.5},
        {"dilation": 1.5, "elongation": 0.6, "wall_mm": 0.7},
        {"base_mm": 0.0},
    ],
    ids=str,
)
def test_sides_are_found_by_shape(geometry, file_heart):
    mesh = left_ventricle(Geometry(**geometry))
    imported = as_imported(mesh.nodes @ file_heart.turn + 1e-3 * file_heart.shift, mesh)
    surface = label_boundary(imported, boundary(imported.cells)[0], None)
    assert counts(surface) == [len(mesh.endo), len(mesh.epi), len(mesh.base)]
    for number, name in enumerate(NAMES):
        assert {tuple(f) for f in surface.facets[surface.labels == number]} == {tuple(f) for f in getattr(mesh, name)}


def test_sloping_base_is_found(file_heart):
    """The base cut at an angle of 20 degrees, as segmented hearts have it."""
    mesh = file_heart.mesh
    lift = np.clip(1 + mesh.nodes[:, 2] / 6.8e-3, 0, 1)
    nodes = mesh.nodes + np.outer(0.36 * lift * mesh.nodes[:, 0], [0, 0, 1])
    surface = label_boundary(as_imported(nodes, mesh), boundary(mesh.cells)[0], None)
    assert counts(surface) == [len(mesh.endo), len(mesh.epi), len(mesh.base)]


def test_rim_goes_once_round_the_cavity(file_heart):
    mesh = file_heart.mesh
    rim = label_boundary(as_imported(file_heart.nodes * 1e-3, mesh), boundary(mesh.cells)[0], None).rim()
    assert len(rim) == 18 and np.all(np.unique(rim, return_counts=True)[1] == 2)
    assert set(rim.ravel()) <= set(mesh.endo.ravel()) & set(mesh.base.ravel())


def test_sides_as_the_file_names_them(file_heart):
    mesh = file_heart.mesh
    sides = BoundaryLabels(array="side", endo=[11], epi=[12], base=[13])
    assert counts(label_boundary(as_imported(file_heart.nodes, mesh), boundary(mesh.cells)[0], sides)) == [
        *(len(getattr(mesh, name)) for name in NAMES)
    ]


def test_sides_that_the_file_does_not_name_are_found(file_heart):
    """The base named with a facet of the endocardium: that one stays as named."""
    mesh = file_heart.mesh
    side = np.zeros(len(mesh.endo) + len(mesh.epi) + len(mesh.base), dtype=int)
    side[-len(mesh.base) :], side[0] = 13, 13
    imported = as_imported(file_heart.nodes * 1e-3, mesh, side)
    surface = label_boundary(imported, boundary(mesh.cells)[0], BoundaryLabels(array="side", base=[13]))
    assert counts(surface) == [len(mesh.endo) - 1, len(mesh.epi), len(mesh.base) + 1]


def test_facets_without_a_name_follow_their_neighbours(file_heart):
    mesh = file_heart.mesh
    side = as_imported(file_heart.nodes, mesh).triangle_arrays["side"].copy()
    side[[5, len(mesh.endo) + 40]] = 0
    surface = label_boundary(
        as_imported(file_heart.nodes, mesh, side),
        boundary(mesh.cells)[0],
        BoundaryLabels(array="side", endo=[11], epi=[12], base=[13]),
    )
    assert counts(surface) == [len(mesh.endo), len(mesh.epi), len(mesh.base)]


def test_sides_named_over_points(file_heart):
    """A facet takes the value that all its corners have; the rim has one value only."""
    mesh = file_heart.mesh
    values = np.zeros(len(mesh.nodes), dtype=int)
    values[mesh.epi], values[mesh.endo], values[mesh.base] = 2, 1, 3
    imported = ImportedMesh(
        "heart.vtu", file_heart.nodes * 1e-3, mesh.cells, np.empty((0, 3), np.int32), node_arrays={"at": values}
    )
    surface = label_boundary(imported, boundary(mesh.cells)[0], BoundaryLabels(array="at", endo=[1], epi=[2], base=[3]))
    assert counts(surface) == [len(mesh.endo), len(mesh.epi), len(mesh.base)]


def test_wrong_array_or_value(file_heart):
    imported, facets = as_imported(file_heart.nodes, file_heart.mesh), boundary(file_heart.mesh.cells)[0]
    with pytest.raises(
        GeometryError, match=r"geometry\.surface_labels\.array = 'sid' is no array of the file: .* are side"
    ):
        label_boundary(imported, facets, BoundaryLabels(array="sid", endo=[11]))
    with pytest.raises(
        GeometryError, match=r"geometry\.surface_labels\.base = \[99\]: no facet of the wall has these values"
    ):
        label_boundary(imported, facets, BoundaryLabels(array="side", base=[99]))


def test_solid_body_has_no_cavity():
    grid = pyvista.ImageData(dimensions=(6, 6, 6), spacing=(1e-3,) * 3).to_tetrahedra()
    cells = grid.cells_dict[np.uint8(10)].astype(np.int32)
    imported = ImportedMesh("brick.vtu", np.asarray(grid.points, float), cells, np.empty((0, 3), np.int32))
    with pytest.raises(
        GeometryError, match="no cavity was found, the wall looks solid or flat: give a wall around a cavity"
    ):
        label_boundary(imported, boundary(cells)[0], None)


def test_shell_without_an_opening():
    """A ball with a hole inside, of one piece by a bridge of nothing: two surfaces, the cavity closed."""
    spheres = [pyvista.Sphere(radius=radius, theta_resolution=24, phi_resolution=24) for radius in (5e-3, 3e-3)]
    nodes = np.vstack([np.asarray(shell.points, float) for shell in spheres])
    outer, inner = (shell.regular_faces.astype(np.int32) for shell in spheres)
    facets = np.vstack([outer, inner[:, ::-1] + len(spheres[0].points)])
    imported = ImportedMesh("ball.stl", nodes, np.empty((0, 4), np.int32), facets)
    with pytest.raises(GeometryError, match="the cavity is closed, there is no base: cut the wall open"):
        label_boundary(imported, facets, None)
