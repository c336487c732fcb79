"""Blood: it fills the cavity, evenly, in every frame, and never enters the wall."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import scene

from echotruth.config import Config
from echotruth.fem.location import locate
from echotruth.fem.volume import cell_volumes
from echotruth.imaging.medium.blood import Blood, Cavity
from echotruth.mechanics.solver.cavity import cavity_volume
from echotruth.units import per_mm3

CONFIG = Config.model_validate({"realism": {"blood": {"level_dB": -20.0, "density": 0.3}}})


@pytest.fixture(scope="module")
def blood(twisting_heart):
    """At one time in all frames, so that it does not diffuse."""
    return Blood.seed(scene(CONFIG, twisting_heart, step=0.0))


@pytest.fixture(scope="module")
def diffusing(twisting_heart):
    fast = {"level_dB": -20.0, "density": 0.3, "decorrelation_time_ms": 0.5}
    config = Config.model_validate({"realism": {"blood": fast}})
    return Blood.seed(scene(config, twisting_heart, step=30e-3))


def in_heart(blood, frame):
    """Positions of those that are present, in the heart frame."""
    return blood.scene.plane.to_heart(blood(frame)[0])


@pytest.mark.parametrize("frame", [0, 1])
def test_the_cells_of_the_cavity_have_its_volume(twisting_heart, frame):
    cavity, nodes = Cavity(twisting_heart.endo), twisting_heart.positions(frame)
    cells = cell_volumes(cavity.positions(nodes), cavity.cells)
    lid = nodes[cavity.rim].mean(axis=0)
    assert cells.min() > 0
    assert cells.sum() == pytest.approx(cavity_volume(nodes - lid, twisting_heart.endo), rel=1e-12)


@pytest.mark.parametrize("frame", [0, 1])
def test_blood_is_as_dense_in_every_frame(blood, twisting_heart, frame):
    position = in_heart(blood, frame)
    nodes = twisting_heart.positions(frame)
    lid = nodes[Cavity(twisting_heart.endo).rim].mean(axis=0)
    expected = 0.3 * (CONFIG.phantom.density_per_mm3 * per_mm3) * cavity_volume(nodes - lid, twisting_heart.endo)
    assert abs(len(position) - expected) < 4 * np.sqrt(expected)


def test_blood_is_even_over_the_cavity(blood):
    # The endocardium is an ellipsoid of semi-axes 1.45 and 5.4 mm, cut 1.4 mm above its equator.
    position = in_heart(blood, 0)
    height = np.linspace(-6.8e-3, 0, 30001)
    area = 1 - ((height + 1.4e-3) / 5.4e-3) ** 2
    mean = (height * area).sum() / area.sum()
    spread = np.sqrt(((height - mean) ** 2 * area).sum() / area.sum())
    error = spread / np.sqrt(len(position))
    assert abs(position[:, 2].mean() - mean) < 4 * error
    assert np.all(np.abs(position[:, :2].mean(axis=0)) < 4 * error)


def test_blood_follows_an_affine_motion_of_the_wall(blood, affine):
    matrix, shift = affine
    before, after = (in_heart(blood, frame) for frame in (0, 1))
    # Who is left in the smaller cavity was in the larger one, in the same order.
    expected = before @ matrix.T + shift
    found = np.searchsorted(expected[:, 0], after[:, 0], sorter=(order := np.argsort(expected[:, 0])))
    near = order[np.clip(found, 0, len(order) - 1)], order[np.clip(found - 1, 0, len(order) - 1)]
    error = np.minimum(*(np.abs(expected[k] - after).max(axis=1) for k in near))
    assert error.max() < 1e-15
    assert len(after) == pytest.approx(len(before) * np.linalg.det(matrix), rel=0.02)


@pytest.mark.parametrize("frame", [0, 1])
def test_blood_that_diffuses_far_stays_out_of_the_wall_and_below_the_base(blood, diffusing, twisting_heart, frame):
    position, carried = in_heart(diffusing, frame), in_heart(blood, frame)
    nodes = twisting_heart.positions(frame)
    assert (np.abs(position - carried).max() > 1e-4) == (frame == 1)
    assert (locate(nodes, twisting_heart.cells, position).cell < 0).all()
    assert position[:, 2].max() <= nodes[:, 2].max() + 1e-12


@pytest.mark.parametrize("tilt", [-20.0, 20.0])
def test_blood_that_diffuses_far_stays_below_the_plane_of_a_rim_that_tilts(diffusing, twisting_heart, tilt):
    cos, sin = np.cos(np.radians(tilt)), np.sin(np.radians(tilt))
    turn, now = np.array([[1, 0, 0], [0, cos, -sin], [0, sin, cos]]), twisting_heart.positions(1)
    displacement = np.stack([twisting_heart.displacement[0], now @ turn.T - twisting_heart.nodes])
    tilted = replace(diffusing.scene, heart=replace(twisting_heart, displacement=displacement))
    position = in_heart(replace(diffusing, scene=tilted), 1) @ turn
    # Turned back, the base is level.
    assert position[:, 2].max() <= now[:, 2].max() + 1e-12
    assert (position[:, 2] > now[:, 2].max() - 0.05e-3).any()


def test_its_power_in_a_volume_is_that_of_muscle_times_the_level(blood, twisting_heart):
    _, amplitude, _ = blood(0)
    power = (amplitude**2).sum() / cavity_volume(twisting_heart.positions(0), twisting_heart.endo)
    assert 10 * np.log10(power / (CONFIG.phantom.density_per_mm3 * per_mm3)) == pytest.approx(-20, abs=0.1)
