"""Wall depth, axes of the wall and of its fibres, from the rule or from a file."""

from dataclasses import replace

import numpy as np
import pytest

from echotruth.config import Fibres, Geometry
from echotruth.fem.quadrature import tetrahedron
from echotruth.fem.tetrahedra import shape
from echotruth.mechanics import angles, fibres
from echotruth.mechanics.geometry import left_ventricle

COARSE = {"circumferential_elements": 12, "longitudinal_elements": 6, "transmural_elements": 2}
VERTICES = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]) * 0.98 + 0.005
ORTHOTROPIC = Fibres(
    endo_deg=70.0,
    epi_deg=-40.0,
    transverse_endo_deg=-12.0,
    transverse_epi_deg=20.0,
    sheet_endo_deg=-65.0,
    sheet_epi_deg=25.0,
)
HELIX = Fibres(endo_deg=84.0, epi_deg=-42.0, transverse_endo_deg=0.0, transverse_epi_deg=0.0)


@pytest.fixture(scope="module")
def wall():
    mesh = left_ventricle(Geometry(**COARSE))
    return mesh, fibres.wall_depth(mesh)


def assert_right_handed(frames):
    np.testing.assert_allclose(frames @ frames.swapaxes(-1, -2), np.broadcast_to(np.eye(3), frames.shape), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(frames), 1)


def test_depth_is_linear_in_the_radius_of_a_hemisphere():
    sphere = Geometry(endo_radius_mm=2.0, endo_length_mm=2.0, wall_mm=2.0, apex_wall_mm=2.0, base_mm=0.0, **COARSE)
    mesh = left_ventricle(sphere)
    radius = np.linalg.norm(mesh.nodes, axis=1)
    np.testing.assert_allclose(fibres.wall_depth(mesh), (radius - 2e-3) / 2e-3, atol=0.02)


def test_depth_is_exact_on_both_sides(wall):
    mesh, depth = wall
    assert np.all(depth[mesh.endo] == 0)
    assert np.all(depth[mesh.epi] == 1)
    assert 0 <= depth.min() <= depth.max() <= 1


def test_axes_are_orthonormal_right_handed_and_point_as_named(wall):
    mesh, depth = wall
    xi, _ = tetrahedron()
    axes = fibres.wall_axes(mesh, depth, xi)
    assert_right_handed(axes)
    x, y, _ = np.moveaxis(np.einsum("qa,cai->cqi", shape(xi), mesh.nodes[mesh.cells]), -1, 0)
    radial, circumferential, longitudinal = np.moveaxis(axes, -2, 0)
    assert np.all(radial[..., 0] * x + radial[..., 1] * y > 0)
    assert np.all(circumferential[..., 1] * x - circumferential[..., 0] * y > 0)
    assert np.all(longitudinal[..., 2] > 0)


def test_axes_stand_where_no_direction_is_circumferential_or_there_is_no_normal():
    axes = fibres.axes_from_normal(np.array([[0, 0, -2.0], [0, 0, 1e-300], [0, 0, 0]]))
    assert_right_handed(axes)
    np.testing.assert_array_equal(axes[0, 0], [0, 0, -1])
    np.testing.assert_array_equal(axes[2], np.eye(3))


def test_a_cell_without_a_gradient_takes_that_of_its_neighbours(wall):
    mesh, depth = wall
    inside = np.flatnonzero(~np.isin(mesh.cells, mesh.epi).any(axis=1))[7]
    flat = depth.copy()
    flat[mesh.cells[inside]] = 0.3
    normal, before = (fibres.wall_axes(mesh, values, fibres.CENTROID)[inside, 0, 0] for values in (flat, depth))
    assert normal @ before > 0.8


def test_depth_and_frames_are_finite_with_a_ragged_base(wall):
    mesh, _ = wall
    x, y, z = mesh.nodes.T
    ragged = z + 0.25 * np.sin(3 * np.arctan2(y, x)) * np.maximum(z + 1.5e-3, 0)
    # No facets are the base, and one node belongs to no cell.
    nodes = np.vstack([np.column_stack([x, y, ragged]), [1.0, 1.0, 1.0]])
    rough = replace(mesh, nodes=nodes, base=mesh.base[:0])
    depth = fibres.wall_depth(rough)
    assert 0 <= depth.min() <= depth.max() <= 1
    assert_right_handed(fibres.fibre_frames(rough, depth, ORTHOTROPIC, VERTICES))


def test_fibres_without_transverse_and_sheet_angles_are_those_of_a_helix_in_the_wall(wall):
    mesh, depth = wall
    xi, _ = tetrahedron()
    frames, axes = fibres.fibre_frames(mesh, depth, HELIX, xi), fibres.wall_axes(mesh, depth, xi)
    helix = np.radians(84 - 126 * fibres.interpolate_in_cells(mesh, depth, xi))[..., None]
    along = np.cos(helix) * axes[..., 1, :] + np.sin(helix) * axes[..., 2, :]
    np.testing.assert_allclose(frames[..., 0, :], along, atol=1e-14)
    # What is off leaves no trace, not even of rounding.
    np.testing.assert_array_equal(frames[..., 2, :], axes[..., 0, :])
    np.testing.assert_array_equal(frames[..., 1, :], np.cross(axes[..., 0, :], frames[..., 0, :]))


def test_angles_of_both_sides_come_back(wall):
    mesh, depth = wall
    frames, axes = fibres.fibre_frames(mesh, depth, ORTHOTROPIC, VERTICES), fibres.wall_axes(mesh, depth, VERTICES)
    assert_right_handed(frames)
    at = fibres.interpolate_in_cells(mesh, depth, VERTICES)
    helix, transverse, sheet = (np.degrees(angle) for angle in angles.angles_from_frames(frames, axes))
    np.testing.assert_allclose(helix, 70 - 110 * at, atol=1e-9)
    np.testing.assert_allclose(transverse, -12 + 32 * at, atol=1e-9)
    np.testing.assert_allclose(sheet, -65 + 90 * at, atol=1e-9)
    assert (helix.max(), helix.min()) == (pytest.approx(70, abs=2), pytest.approx(-40, abs=2))


def test_stepwise_rule_gives_one_angle_a_layer():
    depth = np.linspace(0, 1, 601)
    helix, transverse, sheet = fibres.rule_angles(
        HELIX.model_copy(update={"stepwise": True, "sheet_epi_deg": 60.0}), depth
    )
    np.testing.assert_allclose(np.degrees(np.unique(helix)), np.arange(-31.5, 74, 21))
    np.testing.assert_allclose(np.degrees(np.unique(sheet)), np.arange(5, 60, 10))
    assert not transverse.any()
    np.testing.assert_array_equal(np.unique(fibres.layer(depth, 6)), np.arange(1, 7))


def test_fibres_of_a_file_stand_at_every_point_of_their_cell_in_a_right_handed_frame(wall):
    mesh, depth = wall
    random = np.random.default_rng(0)
    fibre, sheet = random.normal(size=(2, len(mesh.cells), 3))
    with_fibres = replace(mesh, fibre=fibre, sheet=sheet)
    frames = fibres.fibre_frames(with_fibres, depth, Fibres(source="file"), VERTICES)
    assert_right_handed(frames)
    assert np.ptp(frames, axis=1).max() == 0
    np.testing.assert_allclose(np.cross(frames[:, 0, 0], fibre), 0, atol=1e-12)
    # The sheet stays in the plane of the two, on its own side.
    np.testing.assert_allclose(np.sum(frames[:, 0, 2] * sheet, axis=-1), 0, atol=1e-12)
    assert np.all(np.sum(frames[:, 0, 1] * sheet, axis=-1) > 0)


def test_without_sheets_those_of_a_file_lie_in_the_wall(wall):
    mesh, depth = wall
    rule = fibres.fibre_frames(mesh, depth, Fibres(), fibres.CENTROID)
    with_fibres = replace(mesh, fibre=3 * rule[:, 0, 0])
    np.testing.assert_allclose(
        fibres.fibre_frames(with_fibres, depth, Fibres(source="file"), fibres.CENTROID), rule, atol=1e-12
    )


@pytest.mark.parametrize(
    ("fibre", "sheet", "sentence"),
    [
        (None, None, "the mesh has no fibre directions: name them"),
        ([0.0, 0, 0], None, "1 of 720 cells have no fibre direction: repair the file"),
        ([np.nan, 0, 0], None, "1 of 720 cells have no fibre direction"),
        ([0, 1.0, 0], [0, 2.0, 0], "1 of 720 cells have no sheet direction across the fibre"),
    ],
)
def test_a_file_that_lacks_directions_is_refused(wall, fibre, sheet, sentence):
    mesh, depth = wall
    if fibre is not None:
        directions = np.tile(np.eye(3)[:2, None], (len(mesh.cells), 1))
        directions[0, 5], directions[1, 5] = fibre, [1.0, 0, 0] if sheet is None else sheet
        mesh = replace(mesh, fibre=directions[0], sheet=directions[1])
    with pytest.raises(fibres.FibreError, match=sentence):
        fibres.fibre_frames(mesh, depth, Fibres(source="file"), VERTICES)


@pytest.mark.parametrize("source", ["rule", "file"])
def test_disarray_turns_the_fibres_in_the_wall_by_as_much_as_asked_for(wall, source):
    mesh, depth = wall
    mesh = replace(mesh, fibre=fibres.fibre_frames(mesh, depth, HELIX, fibres.CENTROID)[:, 0, 0])
    straight = HELIX.model_copy(update={"source": source})
    disarrayed = straight.model_copy(update={"disarray_deg": 12.0, "disarray_length_mm": 0.2})
    xi, _ = tetrahedron()
    axes, before = fibres.wall_axes(mesh, depth, xi), fibres.fibre_frames(mesh, depth, straight, xi)
    after = fibres.fibre_frames(mesh, depth, disarrayed, xi, seed=4)
    assert_right_handed(after)
    (helix, *rest), (turned, *still) = angles.angles_from_frames(before, axes), angles.angles_from_frames(after, axes)
    turn = np.degrees((turned - helix + np.pi / 2) % np.pi - np.pi / 2)
    assert np.std(turn) == pytest.approx(12, rel=0.05)
    assert abs(np.mean(turn)) < 1
    if source == "rule":
        np.testing.assert_allclose(still, rest, atol=1e-9)
    same = fibres.fibre_frames(mesh, depth, disarrayed, xi, seed=4)
    assert same.tobytes() == after.tobytes()
    assert np.abs(fibres.fibre_frames(mesh, depth, disarrayed, xi, seed=5) - after).max() > 0.1
