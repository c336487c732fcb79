"""Echo of muscle by its fibres: strong across them, weak along them, weaker where they have shortened."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import medium, scene

from echotruth.config import Config
from echotruth.config.realism import Backscatter
from echotruth.fem.tetrahedra import interpolate
from echotruth.imaging.medium.backscatter import FibreEcho, variation
from echotruth.imaging.medium.borders import Endocardium, Epicardium
from echotruth.imaging.medium.wall import Wall

CONFIG = Config.model_validate({"phantom": {"density_per_mm3": 20.0}})


@pytest.fixture(scope="module")
def seeded(twisting_heart):
    return Wall.seed(scene(CONFIG, twisting_heart))


@pytest.fixture(scope="module")
def mid(seeded):
    return seeded.scene.plane


def echo(heart, mid, seeded, direction, **levels):
    """Factors in dB (frame, n) on the echo of muscle of which all fibres have one direction."""
    fibre = np.tile(np.asarray(direction, float), (len(heart.cells), 1))
    heart = replace(heart, arrays={"fibres": {"fibre": fibre}})
    factors = FibreEcho(Backscatter(**levels), heart, mid, seeded.points)
    positions = [seeded.positions(frame) for frame in (0, 1)]
    return np.stack([20 * np.log10(factors(frame, positions[frame])) for frame in (0, 1)]), positions


def test_echo_falls_with_the_angle_between_beam_and_fibres(twisting_heart, mid, seeded):
    """Fibres along the axial direction, and beams from the centre of the array."""
    found, positions = echo(twisting_heart, mid, seeded, mid.axes[1], anisotropy_dB=9.0)
    cosine = positions[0][:, 1] / np.linalg.norm(positions[0], axis=1)
    np.testing.assert_allclose(found[0], 9.0 * (1 / 3 - cosine**2), atol=1e-9)
    across, _ = echo(twisting_heart, mid, seeded, mid.axes[2], anisotropy_dB=9.0)
    steep = np.abs(positions[0][:, 2]) < 0.05e-3  # in the plane, across fibres along the elevation
    np.testing.assert_allclose(across[0][steep], 3.0, atol=0.01)


def test_fibres_turn_with_the_tissue(twisting_heart, mid, seeded, affine):
    matrix, _ = affine
    found, positions = echo(twisting_heart, mid, seeded, mid.axes[1], anisotropy_dB=9.0)
    turned = matrix @ mid.axes[1]
    direction = positions[1] / np.linalg.norm(positions[1], axis=1, keepdims=True)
    cosine = direction @ (mid.axes @ turned) / np.linalg.norm(turned)
    np.testing.assert_allclose(found[1], 9.0 * (1 / 3 - cosine**2), atol=1e-6)


def test_echo_follows_the_stretch_of_the_fibres_since_end_diastole(twisting_heart, mid, seeded, affine):
    matrix, _ = affine
    found, _ = echo(twisting_heart, mid, seeded, mid.axes[0], fibre_strain_dB=30.0)
    np.testing.assert_allclose(found[0], 0, atol=1e-9)
    np.testing.assert_allclose(found[1], 30 * (np.linalg.norm(matrix @ mid.axes[0]) - 1), atol=1e-6)


def test_variation_keeps_the_mean_power_and_has_the_given_spread_and_length():
    """In a large cube, of which pairs of points lie one length apart, where a Gaussian correlation is exp(-1/2)."""
    backscatter = Backscatter(variation_dB=3.0, variation_length_mm=0.5)
    random = np.random.default_rng(1)
    position = random.uniform(0, 0.1, (20_000, 3))
    together = np.vstack([position, position + [0.5e-3, 0, 0]])
    level = 20 * np.log10(variation(backscatter, together, random))
    one, other = level[: len(position)], level[len(position) :]
    assert np.mean(10 ** (one / 10)) == pytest.approx(1, abs=0.05)
    assert np.std(one) == pytest.approx(3, rel=0.05)
    assert np.corrcoef(one, other)[0, 1] == pytest.approx(np.exp(-0.5), abs=0.1)


def test_variation_is_that_of_the_material_in_muscle_and_borders(twisting_heart, coarse_mesh):
    heart = replace(twisting_heart, arrays={"geometry": {"endo": coarse_mesh.endo, "epi": coarse_mesh.epi}})

    def amplitudes(std):
        realism = {"backscatter": {"variation_dB": std}, "borders": {"endocardium_dB": 10.0, "epicardium_dB": 10.0}}
        config = Config.model_validate({"phantom": {"density_per_mm3": 20.0}, "realism": realism})
        at = scene(config, heart)
        return [medium(at)[0](frame)[1] for frame in (0, 1)], at

    (bare, at), (varied, _) = amplitudes(0.0), amplitudes(3.0)
    wall = Wall.seed(at)
    position = interpolate(heart.nodes, heart.cells, wall.points)
    # At end-diastole, which is unloaded here.
    borders = [at.plane.to_heart(border.seed(at).positions(0)) for border in (Endocardium, Epicardium)]
    position = np.vstack([position, *borders])
    wanted = variation(Backscatter(variation_dB=3.0), position, at.random("variation"))
    assert (20 * np.log10(wanted)).std() > 1 and len(position) > len(wall.cell) + 100
    for frame in (0, 1):
        np.testing.assert_allclose(varied[frame] / bare[frame], wanted, rtol=1e-9)
