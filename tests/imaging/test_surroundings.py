"""Surroundings: around the heart, never in it, and drawn along by it."""

import numpy as np
import pytest
from scenes import scene

from echotruth.config import Config
from echotruth.imaging.medium.surroundings import Surroundings, SurroundingsMotion, epicardial_nodes, outside_heart
from echotruth.units import per_mm3

CONFIG = Config.model_validate(
    {"realism": {"surroundings": {"level_dB": -12.0, "density": 0.02, "motion_decay_mm": 0.5}}}
)


@pytest.fixture(scope="module")
def seeded(twisting_heart):
    return Surroundings.seed(scene(CONFIG, twisting_heart))


@pytest.fixture(scope="module")
def mid(seeded):
    return seeded.scene.plane


@pytest.fixture(scope="module")
def around(seeded):
    """Positions at end-diastole."""
    return seeded.position


def ellipsoid_radius(position):
    """1 on the epicardium, by the ellipsoid of semi-axes 2.45 and 6.2 mm with its equator at z = -1.4 mm."""
    lateral = np.hypot(position[:, 0], position[:, 1])
    return np.hypot(lateral / 2.45e-3, (position[:, 2] + 1.4e-3) / 6.2e-3)


@pytest.mark.parametrize("frame", [0, 1])
def test_none_is_in_the_heart(around, twisting_heart, affine, frame):
    matrix, shift = affine
    position = SurroundingsMotion(twisting_heart, around, 0.5e-3)(frame)
    position = position[outside_heart(twisting_heart, frame, position)]
    unloaded = (position - shift) @ np.linalg.inv(matrix).T if frame else position
    below = unloaded[:, 2] < 0
    assert len(position) > 1500
    assert ellipsoid_radius(unloaded[below]).min() > 0.99


@pytest.mark.parametrize("length", [0.0, 0.5e-3])
def test_they_lie_up_to_the_heart_and_leave_no_gap_when_it_draws_back(twisting_heart, affine, length):
    matrix, shift = affine
    draw = np.random.default_rng(6)
    azimuth, height = draw.uniform(0, 2 * np.pi, 40_000), draw.uniform(-4e-3, -1e-3, 40_000)
    radius = draw.uniform(1.6e-3, 3.5e-3, 40_000)
    position = np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), height], axis=1)
    for frame in (0, 1):
        position_now = SurroundingsMotion(twisting_heart, position, length)(frame)
        position_now = position_now[outside_heart(twisting_heart, frame, position_now)]
        unloaded = (position_now - shift) @ np.linalg.inv(matrix).T if frame else position_now
        scaled = ellipsoid_radius(unloaded)
        assert ((scaled > 1) & (scaled < 1.04)).sum() > 200


def test_at_the_epicardium_they_move_with_it(twisting_heart):
    nodes = epicardial_nodes(twisting_heart)
    moved = SurroundingsMotion(twisting_heart, twisting_heart.positions(0)[nodes], 0.5e-3)(1)
    assert np.abs(moved - twisting_heart.positions(1)[nodes]).max() < 1e-9


def test_their_motion_fades_exponentially_with_the_distance(twisting_heart):
    # Straight out of a node of the equator, which stays the nearest.
    node = max(epicardial_nodes(twisting_heart), key=lambda k: twisting_heart.nodes[k, 0])
    start = twisting_heart.positions(0)[node]
    distance = np.array([1e-3, 1.5e-3])
    away = start + distance[:, None] * np.array([1.0, 0, 0])
    motion = np.linalg.norm(SurroundingsMotion(twisting_heart, away, 0.5e-3)(1) - away, axis=1)
    assert motion[1] / motion[0] == pytest.approx(np.exp(-1), rel=0.1)


def test_they_fill_the_sector_from_where_they_begin(around, mid):
    lateral, axial, elevation = mid.to_image(around).T
    angle, range_ = np.degrees(np.arctan2(lateral, axial)), np.hypot(lateral, axial)
    assert angle.min() == pytest.approx(-41.6, abs=0.5)
    assert angle.max() == pytest.approx(41.6, abs=0.5)
    assert range_.min() == pytest.approx(2e-3, abs=0.1e-3)
    assert range_.max() == pytest.approx(12e-3, abs=0.1e-3)
    # Within the beam: half the height of the elements by rays, 0.5 mm |1 - r / 6.5 mm|, and lambda r / H.
    at_focus = np.abs(range_ - 6.5e-3) < 0.3e-3
    assert 0.36e-3 < np.abs(elevation[at_focus]).max() < 0.44e-3


def test_as_many_are_in_a_resolution_cell_near_and_far(around, mid):
    # A cell grows as the range: as many between equal ranges in a sector. Across, most are where the beam is brightest.
    lateral, axial, elevation = mid.to_image(around).T
    number, _ = np.histogram(np.hypot(lateral, axial), np.linspace(2e-3, 12e-3, 6))
    assert np.abs(number - number.mean()).max() < 4 * np.sqrt(number.mean())
    near_focus = np.abs(np.hypot(lateral, axial) - 6.5e-3) < 1e-3
    assert (np.abs(elevation[near_focus]) < 0.2e-3).mean() > 0.6


def test_their_power_in_a_volume_is_that_of_muscle_times_the_level(seeded, mid):
    amplitude = seeded.amplitude
    lateral, axial, elevation = mid.to_image(seeded.position).T
    box = (np.abs(lateral) < 2e-3) & (np.abs(axial - 7e-3) < 3e-3) & (np.abs(elevation) < 0.15e-3)
    power = (amplitude[box] ** 2).sum() / (4e-3 * 6e-3 * 0.3e-3)
    error = 10 / np.log(10) * np.sqrt(2 / box.sum())
    assert 10 * np.log10(power / (CONFIG.phantom.density_per_mm3 * per_mm3)) == pytest.approx(-12, abs=4 * error)
