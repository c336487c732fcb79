"""Transmits: when the elements send and when the wave is where."""

import numpy as np
import pytest

from echotruth.config import Probe, Rf
from echotruth.imaging.beamforming.scan import scan_lines
from echotruth.imaging.beamforming.transmit import TRANSMIT_SEQUENCES

RANGE = np.arange(1, 1001) * 10e-6


def sent(**keys):
    rf = Rf(lines=17, **keys)
    return TRANSMIT_SEQUENCES[rf.transmit](Probe(), rf, scan_lines(Probe(), rf))


def test_zones_beyond_the_lines_are_left_out():
    """Half of the lines end before the second focus, none reaches the third."""
    zones = sent(focal_zones=3, focal_spacing_mm=1.0).zones(RANGE[RANGE < 6e-3])
    assert np.allclose([zone.transmits.foci for zone in zones], [[5.5e-3], [6.5e-3]])
    assert sum(len(zone.blending) for zone in sent(focal_zones=5).zones(RANGE)) < 2 * len(RANGE)


def test_a_diverging_wave_is_on_a_circle_about_its_source():
    transmits = sent(transmit="diverging", transmits=3, angle_span_deg=60.0, virtual_source_mm=3.0)
    source = -3e-3 * np.array([np.sin(np.radians(30)), np.cos(np.radians(30))])
    around = np.linspace(-0.5, 0.5, 7)
    circle = source[:, None] + 8e-3 * np.stack([np.sin(around), np.cos(around)])
    assert np.allclose(transmits.path_length(2, *circle), 5e-3)


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
