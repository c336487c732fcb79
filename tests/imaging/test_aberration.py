"""Aberration and harmonic imaging: what a screen and a squared beam do to the image of a point, against theory."""

import numpy as np
import pytest
from scenes import random

from echotruth.config import Config, Probe
from echotruth.config.realism import Aberration
from echotruth.imaging.acquisition import Acquisition
from echotruth.imaging.beamforming.aperture import harmonic
from echotruth.imaging.beamforming.scanner import Scanner
from echotruth.imaging.rf.aberration import delays
from echotruth.imaging.rf.probe import element_centres

LONG = Probe(elements=512, pitch_um=50.0)


def drawn(seed, probe=LONG, **keys):
    return delays(Aberration(**keys), probe, np.random.default_rng(seed))


def test_delays_have_the_size_and_the_correlation_asked_for_and_neither_shift_nor_turn():
    """Of 25.6 mm with a correlation length of 0.2 mm; mean of 40 screens."""
    every = np.stack([drawn(seed, delay_ns=20.0, correlation_length_mm=0.2) for seed in range(40)])
    assert np.sqrt((every**2).mean(axis=1)) == pytest.approx(20e-9)
    assert np.abs(every.mean(axis=1)).max() < 1e-15 > np.abs(every @ element_centres(LONG)).max()
    at = {lag: (every[:, lag:] * every[:, : 512 - lag]).mean() / 400e-18 for lag in (2, 4)}
    assert at[2] == pytest.approx(0.5, abs=0.03) and at[4] == pytest.approx(1 / 16, abs=0.03)


def test_no_delay_is_no_screen():
    assert not drawn(0, delay_ns=0.0).any()


class Still:
    """A medium of nothing that moves: what an acquisition of given scatterers needs."""

    wall = None


def image(keys, position, frequency=25.0, **realism):
    """Magnitude of the lines of a point, and the scanner, of a flat array with a narrow band."""
    probe = {"height_mm": 0.05, "bandwidth": 0.1, "frequency_MHz": frequency}
    config = Config.model_validate({"probe": probe, "rf": {"focal_zones": 1, "lines": 65} | keys, "realism": realism})
    scanner = Scanner(config.probe, config.rf, 9e-3)
    acquisition = Acquisition(config, scanner, Still(), random)
    return np.abs(scanner.beamform(acquisition.echoes(np.array([position]), np.ones(1)))), scanner


def focused(weight, delay, frequency=25e6):
    """Amplitude at the focus of elements with weights and delays (elements,), over that without delays."""
    return np.abs(weight @ np.exp(-2j * np.pi * frequency * delay)) / weight.sum()


HANN = np.cos(np.pi * element_centres(Probe()) / (64 * 46e-6)) ** 2


def test_fine_screens_take_from_the_focus_what_the_strehl_ratio_says():
    """Power exp(-(2 pi f tau)^2), and what so few elements send there at random; mean of 200 screens."""
    keys = {"delay_ns": 4.0, "correlation_length_mm": 0.01}
    power = np.mean([focused(HANN, drawn(seed, Probe(), **keys)) ** 2 for seed in range(200)])
    strehl, at_random = np.exp(-((2 * np.pi * 25e6 * 4e-9) ** 2)), (HANN**2).sum() / HANN.sum() ** 2
    assert power == pytest.approx(strehl + (1 - strehl) * at_random, rel=0.02)


def test_a_point_is_seen_through_the_screen_both_ways():
    """By the sum over elements at the focus; and side lobes rise."""
    screen, point = {"delay_ns": 4.0, "correlation_length_mm": 0.02}, [0.0, 6.5e-3, 0.0]
    (clear, scanner), (aberrated, _) = image({}, point), image({}, point, aberration=screen)
    delay = delays(Aberration(**screen), Probe(), random("aberration"))
    at = 32, np.abs(scanner.range - 6.5e-3).argmin()
    assert aberrated[at] / clear[at] == pytest.approx(focused(HANN, delay) ** 2, rel=0.02)
    aside = np.abs(scanner.angle) > np.radians(8)
    assert (aberrated[aside, at[1]] ** 2).sum() > 100 * (clear[aside, at[1]] ** 2).sum()


def test_a_coarse_screen_leaves_a_point_where_it_is():
    """Neither mean nor slope of the delays: within a tenth of a beam and of a pulse."""
    image_, scanner = image({}, [0.0, 6.5e-3, 0.0], aberration={"delay_ns": 2.0, "correlation_length_mm": 1.5})
    line, sample = np.unravel_index(image_.argmax(), image_.shape)
    assert abs(scanner.angle[line]) < 0.02 and abs(scanner.range[sample] - 6.5e-3) < 30e-6


@pytest.mark.parametrize("apodization", ["hann", "none"])
def test_weights_of_the_harmonic_make_the_square_of_the_beam_of_half_the_frequency(apodization):
    """In the focal plane of a steered beam; the square of the field of each element, to far beside it."""
    x, focus, wavenumber = element_centres(Probe()), 10e-3, 2 * np.pi * 25e6 / 1540
    weight = HANN if apodization == "hann" else np.ones(64)
    angle = 0.1 + np.linspace(-0.15, 0.15, 301)
    path = np.hypot(focus * np.sin(angle)[:, None] - x, focus * np.cos(angle)[:, None])
    path -= np.hypot(focus * np.sin(0.1) - x, focus * np.cos(0.1))
    squared = np.abs(np.exp(-0.5j * wavenumber * path) @ weight) ** 2
    beam = np.abs(np.exp(-1j * wavenumber * path) @ harmonic(weight[None])[0])
    assert np.abs(beam / beam.max() - squared / squared.max()).max() < 0.01
    # The square of a beam, if Gaussian, has 1/sqrt(2) of its width.
    half, sent = (beam > beam.max() / 2).sum(), (squared > squared.max() / 4).sum()
    assert half / sent == pytest.approx(np.sqrt(1 / 2), abs=0.05)


def test_the_image_of_a_point_has_the_width_of_the_harmonic_beam():
    """Width of transmit times receive at the focus against a sum over the elements."""
    image_, scanner = image({"harmonic": True, "transmit_apodization": "none", "lines": 256}, [0.0, 6.5e-3, 0.0])
    profile = image_[:, np.abs(scanner.range - 6.5e-3).argmin()]
    x = element_centres(Probe())
    path = np.hypot(6.5e-3 * np.sin(scanner.angle)[:, None] - x, 6.5e-3 * np.cos(scanner.angle)[:, None])
    wave = 2j * np.pi * 25e6 / 1540 * (path - np.hypot(x, 6.5e-3))
    expected = np.abs(np.exp(wave / 2).sum(axis=1) ** 2 * (np.exp(wave) @ HANN))
    near = np.abs(scanner.angle) < 0.1
    assert profile[near] / profile.max() == pytest.approx(expected[near] / expected.max(), abs=0.01)


def test_the_harmonic_grows_in_proportion_to_range_up_to_the_focus():
    ratio = []
    for depth in (3e-3, 8e-3):
        point = np.array([[0.0, depth, 0.0]])
        config = Config.model_validate({"probe": {"elements": 8}, "rf": {"harmonic": True, "lines": 16}})
        scanner = Scanner(config.probe, config.rf, 9e-3)
        grown = Acquisition(config, scanner, Still(), random).echoes(point, np.ones(1))
        ratio.append(np.abs(grown).max() / np.abs(scanner.matrix(point, np.ones(1))).max())
    assert ratio == pytest.approx([3 / 6.5, 1])


def test_a_screen_harms_a_harmonic_as_the_wave_of_half_its_frequency_twice():
    screen, point = {"delay_ns": 4.0, "correlation_length_mm": 0.2}, [0.0, 6.5e-3, 0.0]
    (clear, scanner), (aberrated, _) = (
        image({"harmonic": True}, point, **each) for each in ({}, {"aberration": screen})
    )
    delay = delays(Aberration(**screen), Probe(), random("aberration"))
    at = 32, np.abs(scanner.range - 6.5e-3).argmin()
    expected = focused(HANN, delay) * focused(HANN, delay, 12.5e6) ** 2
    assert aberrated[at] / clear[at] == pytest.approx(expected, rel=0.02)
