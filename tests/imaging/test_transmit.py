"""Transmits: when the elements send and when the wave is where."""

import numpy as np
import pytest

from echotruth.config import Probe, Rf
from echotruth.imaging.beamforming.scan import scan_lines
from echotruth.imaging.beamforming.transmit import TRANSMIT_SEQUENCES, virtual_source_distance

SPEED, LENGTH = 1540.0, 64 * 46e-6
X = (np.arange(64) - 31.5) * 46e-6
RANGE = np.arange(1, 1001) * 10e-6


def sent(**keys):
    rf = Rf(lines=17, **keys)
    return TRANSMIT_SEQUENCES[rf.transmit](Probe(), rf, scan_lines(Probe(), rf))


@pytest.mark.parametrize("scan", ["sector", "linear"])
def test_focused_delays_bring_all_elements_to_the_focus_at_once(scan):
    rf = Rf(lines=17, scan=scan, focal_zones=1)
    lines = scan_lines(Probe(), rf)
    lateral, axial = lines.line_origin + 6.5e-3 * np.sin(lines.angle), 6.5e-3 * np.cos(lines.angle)
    flight = np.hypot(lateral[:, None] - X, axial[:, None]) / SPEED
    transmits = TRANSMIT_SEQUENCES["focused"](Probe(), rf, lines)
    assert np.allclose(transmits.delay + flight, 6.5e-3 / SPEED, atol=1e-15)
    assert np.allclose([transmits.path_length(k, lateral[k], axial[k]) for k in range(17)], 6.5e-3)


def test_foci_are_evenly_spaced_about_the_middle_one():
    assert np.allclose(sent(focal_zones=5, focal_spacing_mm=1.0).foci, [4.5e-3, 5.5e-3, 6.5e-3, 7.5e-3, 8.5e-3])
    assert np.allclose(sent(focal_zones=2, focal_spacing_mm=3.0).foci, [5e-3, 8e-3])
    assert np.allclose(sent(focal_zones=1).foci, [6.5e-3])
    assert sent(transmit="plane").foci.size == 0


def test_a_zone_has_the_waves_of_its_own_focus():
    transmits = sent(focal_zones=3, focal_spacing_mm=1.5, f_number=2.0)
    for zone, focus in zip(transmits.zones(RANGE), (5.0, 6.5, 8.0), strict=True):
        alone = sent(focal_zones=1, focus_mm=focus, f_number=2.0)
        assert np.allclose(zone.transmits.delay, alone.delay, atol=1e-18, rtol=0)
        assert np.allclose(zone.transmits.weight, alone.weight, atol=1e-12)


def test_zones_fade_into_one_another_between_their_foci_and_end_with_the_line():
    zones, weights = sent(focal_zones=3, focal_spacing_mm=1.0).zones(RANGE), np.zeros((3, len(RANGE)))
    for zone, weight in zip(zones, weights, strict=True):
        weight[zone.samples] = zone.blending
    assert np.allclose(weights.sum(axis=0), 1)
    assert np.allclose(weights[:, RANGE <= 5.5e-3], [[1], [0], [0]])
    assert np.allclose(weights[:, np.abs(RANGE - 5.75e-3).argmin()], [0.75, 0.25, 0])
    assert np.allclose(weights[:, np.abs(RANGE - 6.5e-3).argmin()], [0, 1, 0])
    assert np.allclose(weights[:, RANGE >= 7.5e-3], [[0], [0], [1]])


def test_zones_beyond_the_lines_are_left_out():
    """Half of the lines end before the second focus, none reaches the third."""
    zones = sent(focal_zones=3, focal_spacing_mm=1.0).zones(RANGE[RANGE < 6e-3])
    assert np.allclose([zone.transmits.foci for zone in zones], [[5.5e-3], [6.5e-3]])
    assert sum(len(zone.blending) for zone in sent(focal_zones=5).zones(RANGE)) < 2 * len(RANGE)


@pytest.mark.parametrize("keys", [{"transmit": "plane"}, {"transmit": "diverging"}])
def test_a_wave_is_at_each_element_when_that_sends(keys):
    transmits = sent(**keys)
    assert transmits.delay.shape == (11, 64)
    for number, delay in enumerate(transmits.delay):
        assert np.allclose(transmits.path_length(number, X, 0.0), SPEED * delay, atol=1e-15)
        assert transmits.path_length(number, 0.0, 0.0) == pytest.approx(0, abs=1e-15)
    assert (transmits.weight == 1).all()


def test_plane_waves_are_tilted_evenly_about_straight_ahead():
    transmits = sent(transmit="plane", transmits=5, angle_span_deg=40.0)
    slope = SPEED * (transmits.delay[:, -1] - transmits.delay[:, 0]) / (X[-1] - X[0])
    assert np.allclose(np.degrees(np.arcsin(slope)), [-20, -10, 0, 10, 20])


def test_a_diverging_wave_is_on_a_circle_about_its_source():
    transmits = sent(transmit="diverging", transmits=3, angle_span_deg=60.0, virtual_source_mm=3.0)
    source = -3e-3 * np.array([np.sin(np.radians(30)), np.cos(np.radians(30))])
    around = np.linspace(-0.5, 0.5, 7)
    circle = source[:, None] + 8e-3 * np.stack([np.sin(around), np.cos(around)])
    assert np.allclose(transmits.path_length(2, *circle), 5e-3)


def test_sources_stand_where_the_array_is_seen_under_the_angle_of_the_sector():
    assert np.arctan2(LENGTH / 2, virtual_source_distance(Probe(), Rf(sector_deg=70.0))) == pytest.approx(
        np.radians(35)
    )


def test_in_a_synthetic_aperture_each_element_sends_alone():
    transmits = sent(transmit="synthetic_aperture")
    assert np.allclose(transmits.weight, np.diag(np.cos(np.pi * X / LENGTH) ** 2))
    assert not transmits.delay.any()
    assert transmits.path_length(5, X[5], 3e-3) == pytest.approx(3e-3)


def test_a_least_f_number_narrows_the_aperture_that_focuses():
    transmits = sent(f_number=4.0, apodization="none", focal_zones=1)
    assert (transmits.weight == (np.abs(X) <= 6.5e-3 / 4 / 2)).all()


@pytest.mark.parametrize(
    "keys",
    [
        {"focus_mm": 0.0},
        {"f_number": -1.0},
        {"lines": 4},
        {"transmits": 0},
        {"virtual_source_mm": 0.0},
        {"width_mm": -1.0},
        {"focal_zones": 0},
        {"focal_spacing_mm": 0.0},
    ],
)
def test_impossible_transmits_are_refused(keys):
    with pytest.raises(ValueError, match=next(iter(keys))):
        Rf(**keys)


def test_zones_that_reach_behind_the_array_are_refused_where_they_are_used():
    with pytest.raises(ValueError, match="must exceed 2, so that its focal_zones = 5 foci, focal_spacing_mm = 1 apart"):
        Rf(focus_mm=2.0)
    assert Rf(focus_mm=2.0, transmit="plane").focus_mm == Rf(focus_mm=2.0, focal_zones=1).focus_mm == 2
