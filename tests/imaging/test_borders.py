"""Borders: spread evenly over a surface, as loud as asked for across the beam, and quiet where they are tilted."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import random, scene

from echotruth.config import Config
from echotruth.imaging.beamforming.scanner import Scanner
from echotruth.imaging.medium.borders import Endocardium, Epicardium, border_amplitude
from echotruth.imaging.medium.mitral_valve import Leaflets, Part
from echotruth.units import MHz, mm

CONFIG = Config.model_validate(
    {
        "phantom": {"density_per_mm3": 3000.0},
        "rf": {"focal_zones": 1, "lines": 16},
        "realism": {"neighbours": {"leaflets_dB": 10.0}, "borders": {"endocardium_dB": 10.0, "epicardium_dB": 10.0}},
    }
)
HALF = np.array([0.7e-3, 0.6e-3, 0.6e-3])
"""Half the sides of a block of muscle about the focus, and of a sheet, m."""


@pytest.fixture(scope="module")
def heart(half_sphere, hemispherical_heart):
    """Half a sphere with radii of 2 and 3 mm, which doubles its size in the second frame."""
    return hemispherical_heart(np.stack([0 * half_sphere.nodes, half_sphere.nodes]))


def test_scatterers_are_spread_evenly_over_the_surface(heart):
    border = Epicardium.seed(scene(CONFIG, heart))
    position = border.scene.plane.to_heart(border.positions(0))
    wavelength = CONFIG.probe.sound_speed_m_per_s / (CONFIG.probe.frequency_MHz * MHz)
    expected = np.pi * (3e-3 / wavelength) ** 2  # half a sphere
    assert abs(len(position) - expected) < 5 * np.sqrt(expected) + 0.01 * expected
    np.testing.assert_allclose(np.linalg.norm(position, axis=1), 3e-3, rtol=2e-3)
    # The height of points that are even on a sphere is even.
    height = -position[:, 2] / 3e-3
    assert abs(height.mean() - 0.5) < 0.02 and abs(height.std() - 12**-0.5) < 0.02


def test_amplitude_grows_with_the_area(heart):
    border, unloaded = Endocardium.seed(scene(CONFIG, heart)), border_amplitude(CONFIG, 10.0)
    np.testing.assert_allclose(border(0)[1], unloaded)
    np.testing.assert_allclose(border(1)[1], 4 * unloaded)


@pytest.fixture(scope="module")
def level():
    """Function of positions (n, 3), m, about the focus and amplitudes (n,): greatest power over that of muscle, dB."""
    scanner = Scanner(CONFIG.probe, CONFIG.rf, CONFIG.bmode.field_of_view_mm * mm)
    focus, random = CONFIG.rf.focus_mm * mm, np.random.default_rng(4)
    middle, near = np.argsort(np.abs(scanner.scan.angle))[:6], np.abs(scanner.range - focus) < 0.4e-3

    def power(position, amplitude):
        lines = scanner.lines(position + [0, focus, 0], amplitude)
        return np.abs(lines[middle][:, near]) ** 2

    number = random.poisson(3000e9 * np.prod(2 * HALF))
    reference = power(random.uniform(-1, 1, (number, 3)) * HALF, random.standard_normal(number)).mean()
    return lambda position, amplitude: 10 * np.log10(power(position, amplitude).max(axis=1).mean() / reference)


def tilted(sheet, degrees):
    """Positions (n, 3) on a sheet of coordinates (n, 2), lateral and elevation, across the beam or tilted."""
    turn = np.radians(degrees)
    return np.column_stack([sheet[:, 0] * np.cos(turn), sheet[:, 0] * np.sin(turn), sheet[:, 1]])


def test_flat_border_across_the_beam_has_its_level_and_a_tilted_one_has_not(level):
    probe, random = CONFIG.probe, np.random.default_rng(5)
    count = random.poisson((probe.frequency_MHz * MHz / probe.sound_speed_m_per_s) ** 2 / 2 * 4 * HALF[0] * HALF[2])
    sheet, amplitude = random.uniform(-1, 1, (count, 2)) * HALF[[0, 2]], np.full(count, border_amplitude(CONFIG, 10.0))
    across, oblique = (level(tilted(sheet, tilt), amplitude) for tilt in (0.0, 25.0))
    assert across == pytest.approx(10, abs=3)
    assert oblique < across - 5


def test_a_leaflet_shows_across_the_beam_and_fades_where_it_is_oblique(heart, level):
    at, levels = scene(CONFIG, heart), []
    for k in range(6):
        leaflets = Leaflets.seed(replace(at, random=lambda name, k=k: random(f"{name} {k}")))
        of_it = leaflets.part == Part.ANTERIOR
        position, amplitude = leaflets.in_heart(0)[of_it], leaflets.amplitudes(0)[of_it]
        # The middle of the leaflet, on its mean plane.
        commissural, share, _ = leaflets.place[of_it].T
        part = (np.abs(commissural) < 0.5) & (np.abs(share - 0.5) < 0.35)
        flat = position[part] - position[part].mean(axis=0)
        sheet = flat @ np.linalg.svd(flat, full_matrices=False)[2][:2].T
        inside = (np.abs(sheet) < HALF[[0, 2]]).all(axis=1)
        levels.append([level(tilted(sheet[inside], tilt), amplitude[part][inside]) for tilt in (0.0, 25.0)])
    across, oblique = np.mean(levels, axis=0)
    assert across == pytest.approx(10, abs=3)
    assert oblique < across - 5
