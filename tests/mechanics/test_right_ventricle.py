"""A left ventricle with a right one, imported from a file: its sides, its load, its motion and its images."""

from dataclasses import replace

import numpy as np
import pytest
import pyvista

from echotruth.config import Geometry
from echotruth.config.loading import ConfigError, validate
from echotruth.fem.volume import cell_volumes
from echotruth.heart import Heart, in_right_wall
from echotruth.imaging.bmode import pixel_centres
from echotruth.imaging.labels import TissueLabel, unpack
from echotruth.imaging.medium.tissue_images import TissueImages
from echotruth.imaging.truth import pixel_truth
from echotruth.imaging.view import before_probe
from echotruth.loop.cycle import read_loop
from echotruth.loop.phases import CONTRACTION
from echotruth.mechanics.beat import beat, simulate, unloaded_wall
from echotruth.mechanics.fibres import wall_depth
from echotruth.mechanics.geometry import GeometryError, left_ventricle
from echotruth.mechanics.geometry.boundary import boundary
from echotruth.mechanics.geometry.template import mesh_wall
from echotruth.mechanics.solver.assembly import RIGHT_ENDO
from echotruth.mechanics.solver.cavity import cavity_volume, volume_gradient
from echotruth.mechanics.solver.equilibrium import Load, State
from echotruth.mechanics.solver.stress_point import VOLUMETRIC
from echotruth.mechanics.solver.wall import equilibrium
from validation import bodies
from validation.heart import solved_heart
from validation.work import balance

RADIUS, LENGTH, WALL, APEX_WALL = 1.7e-3, 5.4e-3, 1e-3, 0.6e-3
"""Semi-axes of the left endocardium, half an ellipsoid, and thickness of the wall at the base and at the apex, m."""
SECTOR, BOTTOM = np.radians(75), 0.25
"""Half of the angle that the right ventricle takes of the circumference, and where it ends between apex and base."""
LAYERS = [0, 1 / 3, 2 / 3, 1]
ON_RIGHT = [0, 1, 2.2, 2.6]
"""Borders of the three layers of the mesh, in thicknesses of the left wall: septum, right cavity and free wall."""
TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
"""Rows: the axes of the heart in the coordinates of the file."""
SIDES = {"array": "side", "endo": [1], "epi": [2], "base": [3], "right_endo": [4]}


class TwoVentricles:
    """An ellipsoid of three layers, of which the middle one swells on the right and is taken out.

    Attributes
    ----------
    nodes, cells, parameters : ndarray
        Of the wall; the parameters are depth, distance from the apex and azimuth.
    removed : ndarray of shape (n_cells, 10)
        Cells of the right cavity.
    """

    def __init__(self):
        counts = {"circumferential_elements": 12, "longitudinal_elements": 4, "transmural_elements": 3}
        mesh = mesh_wall(self._position, Geometry(**counts))
        vertices = mesh.cells[:, :4]
        depth, r, _ = self.parameters[vertices].transpose(2, 0, 1)
        x, y, _ = mesh.nodes[vertices].transpose(2, 0, 1)
        inside = (np.abs(np.arctan2(y, x)) < SECTOR + 1e-9) & (r > BOTTOM - 1e-9)
        is_cavity = inside.all(axis=1) & (np.abs(depth.mean(axis=1) - 0.5) < 1 / 6)
        self.nodes, self.cells, self.removed = mesh.nodes, mesh.cells[~is_cavity], mesh.cells[is_cavity]

    def _position(self, depth, r, azimuth):
        self.parameters = np.column_stack([depth, r, azimuth])
        turn = np.clip(np.abs((azimuth + np.pi) % (2 * np.pi) - np.pi) / SECTOR, 0, 1)
        on_right = np.cos(turn * np.pi / 2) * np.clip((r - BOTTOM) / BOTTOM, 0, 1)
        outwards = (1 - on_right) * depth + on_right * np.interp(depth, LAYERS, ON_RIGHT)
        across = (RADIUS + outwards * WALL) * np.sin(r * np.pi / 2)
        z = np.where(r == 1, 0.0, -(LENGTH + outwards * APEX_WALL) * np.cos(r * np.pi / 2))
        return np.column_stack([across * np.cos(azimuth), across * np.sin(azimuth), z])

    def save(self, path, is_open=True):
        facets, _ = boundary(self.cells)
        depth, r, _ = self.parameters[facets].transpose(2, 0, 1)
        label = np.select([(depth == 0).all(1), (depth == 1).all(1), (r == 1).all(1)], [1, 2, 3], 4)
        label[(label == 4) & (r == 1).any(axis=1) & (not is_open)] = 2
        blocks = {24: self.cells.astype(np.int64), 22: facets.astype(np.int64)}
        grid = pyvista.UnstructuredGrid(blocks, 1e3 * self.nodes @ TURN)
        grid.cell_data["side"] = np.zeros(grid.n_cells, int)
        grid.cell_data["side"][grid.celltypes == 22] = label
        grid.point_data["point_side"] = np.zeros(grid.n_points, int)
        grid.save(path)


@pytest.fixture(scope="module")
def body():
    return TwoVentricles()


@pytest.fixture
def file(body, tmp_path, read_here):
    body.save(tmp_path / "heart.vtu")
    return str(tmp_path / "heart.vtu")


def configured(file, sides=SIDES, **sections):
    return validate({"geometry": {"file": file, "surface_labels": sides}} | sections, "here.yaml")


def test_cavities_are_those_of_the_ellipsoid_and_of_what_was_taken_out(body, file):
    """And the right one is rotated to +x, wherever it is in the file."""
    mesh = left_ventricle(configured(file).geometry)
    assert cavity_volume(mesh.nodes, mesh.endo) == pytest.approx(2 / 3 * np.pi * RADIUS**2 * LENGTH, rel=2e-3)
    right = cell_volumes(body.nodes, body.removed).sum()
    assert cavity_volume(mesh.nodes, mesh.right_endo) == pytest.approx(right, rel=1e-6)
    assert np.abs(mesh.nodes[mesh.base, 2]).max() < 1e-9
    x, y, _ = mesh.nodes[np.unique(mesh.right_endo[:, :3])].mean(axis=0)
    assert x > 0.9 * RADIUS and abs(y) < 1e-9
    assert len(mesh.endo) + len(mesh.epi) + len(mesh.base) + len(mesh.right_endo) == len(boundary(mesh.cells)[0])


def test_depth_is_that_of_the_left_wall_and_goes_on_through_the_right_one(body, file):
    mesh = left_ventricle(configured(file).geometry)
    depth, (layer, r, azimuth) = wall_depth(mesh), body.parameters[body.cells].transpose(2, 0, 1)
    turn, layer = np.abs((azimuth + np.pi) % (2 * np.pi) - np.pi), layer.mean(axis=1)
    on_right, on_left = ((side & (r > 0.45)).all(axis=1) for side in (turn < 0.6 * SECTOR, turn > 1.5 * SECTOR))
    is_right = in_right_wall(depth, mesh.cells)
    assert is_right[on_right & (layer > 2 / 3)].all()
    assert not is_right[on_left].any() and not is_right[layer < 1 / 3].any()
    # The template's own depth is linear through each layer.
    nodes = {name: mesh.cells[cells].ravel() for name, cells in (("left", on_left), ("right", on_right))}
    own = body.parameters[body.cells[on_left], 0].ravel()
    assert np.abs(depth[nodes["left"]] - own).max() < 0.05
    own = body.parameters[body.cells[on_right], 0].ravel()
    assert np.abs(depth[nodes["right"]] - np.interp(own, LAYERS, [0, 1, 1, 2])).max() < 0.1


def test_load_is_the_pressure_on_the_area_and_acts_on_no_other_surface(file):
    """Also where the base has moved in its plane."""
    config = configured(file, loop={"right_pressure_ratio": 0.3})
    equations = equilibrium(config, unloaded_wall(config, read_loop(config.loop)))
    assembly, mesh = equations.assembly, equations.mesh
    moved = mesh.nodes + assembly.displacement(5e-5 * np.random.default_rng(1).normal(size=assembly.n_equations))
    area = assembly.rotate(mesh.right_endo, -bodies.nodal_area_vectors(moved, mesh.right_endo))
    expected = 0.3 * assembly.vector(area, RIGHT_ENDO)
    np.testing.assert_allclose(equations._right_unit_load(moved), expected, atol=1e-9 * np.abs(expected).max())
    # A closed surface is in balance, but for the lid.
    total = volume_gradient(mesh.nodes, mesh.right_endo).sum(axis=(0, 1))
    assert np.abs(total[:2]).max() < 1e-6 * abs(total[2])
    equations.close()


def test_tangent_and_slope_by_the_pressure_are_derivatives_of_the_forces(file, monkeypatch):
    """Central differences, with a base that may leave its plane."""
    config = configured(file, mechanics={"base": "elastic"}, loop={"right_pressure_ratio": 0.5})
    wall = unloaded_wall(config, read_loop(config.loop))
    equations, rng, matrices = equilibrium(config, wall), np.random.default_rng(3), []
    monkeypatch.setattr(equations._solver, "factor", matrices.append)
    monkeypatch.setattr(equations, "solve", lambda right: right)
    n, load = equations.assembly.n_equations, Load(0.0, 4e-8)
    pressure, unknown = 2e4, "cavity_pressure"
    state = State(2e-6 * rng.normal(size=n), np.zeros(len(wall.mesh.cells)), 1.0, 0.0, pressure)
    equations.linearize(state, load, unknown)
    slope = equations.scalar_force(unknown, load)
    tangent = matrices[0] + matrices[0].T
    tangent.setdiag(matrices[0].diagonal())
    change, step = rng.normal(size=n), 1e-10
    growth = equations.assembly.of_cells(change) * equations._response.force[:, VOLUMETRIC]
    growth = np.sum(growth, axis=1) / equations.unloaded_volume * equations.law.bulk_modulus

    def force(side, by):
        moved = State(
            state.solution + side * by["u"] * change,
            state.cell_pressure + side * by["u"] * growth,
            *(1.0, 0.0, pressure + side * by["p"]),
        )
        return equations.residual(moved, load, unknown).force

    by_position = (force(1, {"u": step, "p": 0}) - force(-1, {"u": step, "p": 0})) / (2 * step)
    assert np.abs(tangent @ change - by_position).max() < 1e-9 * np.abs(by_position).max()
    by_pressure = (force(1, {"u": 0, "p": 10}) - force(-1, {"u": 0, "p": 10})) / 20
    assert np.abs(slope + by_pressure).max() < 1e-8 * np.abs(slope).max()
    equations.close()


def test_right_pressure_shortens_the_septum_in_isovolumic_contraction(file):
    """As against none: it bears the septum from the other side, and the left cavity keeps its volume."""
    loop = {"frames": 24, "edv_uL": 45, "esv_uL": 20}
    loops = [loop | {"right_pressure_ratio": ratio} for ratio in (0.2, 0.0)]
    hearts = [beat(configured(file, loop=loop), [0, 1, 2]) for loop in loops]
    for heart in hearts:
        mechanics = heart["mechanics"]
        assert mechanics["phase"][2] == CONTRACTION and mechanics["residual"].max() < 1e-6
        np.testing.assert_allclose(mechanics["volume"], mechanics["volume_target"], rtol=1e-6)
    septum = np.isin(hearts[0]["fibres"]["segment"], (8, 9))
    loaded, free = (heart["kinematics"]["strain"][2, septum, 1].mean() for heart in hearts)
    assert loaded < free - 0.002


def test_both_pressures_do_the_work_that_the_wall_takes_up(file):
    """Virtual work of every frame, by energies and volumes written down anew."""
    loop = {"frames": 8, "edv_uL": 45, "esv_uL": 20, "right_pressure_ratio": 0.4}
    solved = solved_heart(configured(file, loop=loop))
    assert balance(solved).error < 1e-6
    deaf = replace(solved, config=configured(file, loop=loop | {"right_pressure_ratio": 0.3}))
    assert balance(deaf).error > 1e-3


def test_right_wall_is_tissue_without_truth(file):
    """Its pixels are muscle, and belong to no segment."""
    views, motion = {"mid": {"plane": "short_axis", "position": 0.5}}, {"kind": "rigid"}
    config = configured(file, views=views, motion=motion, loop={"frames": 2}, bmode={"size_px": 128})
    arrays = simulate(config)
    heart, plane = before_probe(Heart.of(arrays, config), config, "mid")
    pixels = pixel_centres(config.bmode, 128)
    truth = pixel_truth(heart, plane, *pixels, TissueImages(config, heart, plane, *pixels))
    label, tissue = unpack(truth["labels"]), truth["tissue"]
    assert set(np.unique(label["segment"][label["mask"]])) == {*range(7, 13)}
    assert ((tissue == TissueLabel.WALL) == label["mask"]).all()
    # A free wall of 0.4 and half the circumference of a longer outline, beside a wall of 1.
    count = {kind: np.sum(tissue[0] == kind) for kind in (TissueLabel.WALL, TissueLabel.RIGHT_FREE_WALL)}
    assert 0.1 < count[TissueLabel.RIGHT_FREE_WALL] / count[TissueLabel.WALL] < 0.8
    assert np.nanmax(truth["wall_depth"]) <= 1
    assert (arrays["fibres"]["segment"] == 0).sum() == in_right_wall(heart.wall_depth, heart.cells).sum() > 0


@pytest.mark.parametrize(
    ("sides", "sections", "reason"),
    [
        ({"right_endo": [4]}, {}, r"right_endo = \[4\]: needs endo, epi and base too"),
        (SIDES, {"geometry": {"remesh": True}}, "remesh"),
        (SIDES, {"realism": {"blood": {"level_dB": -20}}}, "tissue would fill the right cavity"),
        ({"endo": [1]}, {"loop": {"right_pressure_ratio": 0.3}}, "needs geometry.surface_labels.right_endo"),
    ],
)
def test_what_cannot_be_served_is_refused_in_a_sentence(sides, sections, reason):
    given = {"geometry": {"file": "heart.vtu", "surface_labels": sides} | sections.get("geometry", {})}
    with pytest.raises(ConfigError, match=reason):
        validate(sections | given, "here.yaml")


def test_right_endocardium_over_points_or_away_from_the_base_is_refused(body, file):
    with pytest.raises(GeometryError, match="is over points: name one over its triangles"):
        left_ventricle(configured(file, SIDES | {"array": "point_side"}).geometry)
    body.save(file, is_open=False)
    with pytest.raises(GeometryError, match="right endocardium and base do not meet: name an endocardium that is open"):
        left_ventricle(configured(file).geometry)
