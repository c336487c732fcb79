"""The wall: its scatterers are spread evenly, normally strong, and ride with the tissue."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import scene

from echotruth.config import Config, Phantom
from echotruth.fem.tetrahedra import interpolate
from echotruth.fem.volume import cell_volumes
from echotruth.imaging.medium.wall import Wall

CONFIG = Config(phantom=Phantom(density_per_mm3=1500.0))


@pytest.fixture(scope="module")
def scatterers(twisting_heart):
    return Wall.seed(scene(CONFIG, twisting_heart))


def test_their_number_is_density_times_volume(scatterers, coarse_mesh):
    expected = 1500e9 * cell_volumes(coarse_mesh.nodes, coarse_mesh.cells).sum()
    assert abs(len(scatterers.points) - expected) < 4 * np.sqrt(expected)


def test_every_cell_has_its_share(scatterers, coarse_mesh):
    expected = 1500e9 * cell_volumes(coarse_mesh.nodes, coarse_mesh.cells)
    counted = np.bincount(scatterers.cell, minlength=len(expected))
    chi_squared = ((counted - expected) ** 2 / expected).sum()
    assert abs(chi_squared - len(expected)) < 5 * np.sqrt(2 * len(expected))


def test_density_is_even_within_the_curved_cells(scatterers, coarse_mesh):
    # The first moment of evenly spread points is that of the wall: here of the azimuthally symmetric ellipsoid.
    position = interpolate(coarse_mesh.nodes, coarse_mesh.cells, scatterers.points)
    error = position[:, :2].std() / np.sqrt(len(position))
    assert np.all(np.abs(position[:, :2].mean(axis=0)) < 4 * error)


def test_amplitudes_are_normal(scatterers):
    from scipy.stats import kstest

    assert kstest(scatterers.amplitude, "norm").pvalue > 0.01


def test_scatterers_follow_an_affine_motion_exactly(scatterers, affine):
    matrix, shift = affine
    before, after = (scatterers.scene.plane.to_heart(scatterers.positions(frame)) for frame in (0, 1))
    assert np.abs(after - (before @ matrix.T + shift)).max() < 1e-16


def test_in_plane_only_scatterers_start_in_the_plane_and_stay_there(twisting_heart):
    heart = twisting_heart
    flat = Wall.seed(scene(Config(phantom=Phantom(in_plane_only=True)), heart))
    assert len(flat.points) > 1000
    assert (flat.positions(1)[:, 2] == 0).all()
    started = flat.scene.plane.to_image(interpolate(heart.positions(0), heart.cells, flat.points))
    assert np.abs(started[:, 2]).max() < 1e-15


def test_the_same_seed_gives_the_same_scatterers_and_another_others(twisting_heart, scatterers):
    same = scene(CONFIG, twisting_heart)
    other = replace(same, random=lambda name: np.random.default_rng(6))
    assert np.array_equal(Wall.seed(same).xi, scatterers.xi)
    assert not np.array_equal(Wall.seed(other).xi, scatterers.xi)
