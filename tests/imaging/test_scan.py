"""Scan lines of a sector and of a linear scan."""

import numpy as np
import pytest

from echotruth.config import Probe, Rf
from echotruth.imaging.beamforming.scan import sample_positions, scan_lines, scan_width

RANGE = np.linspace(1e-3, 9e-3, 11)


def test_lines_of_a_sector_leave_the_centre_and_span_it_evenly():
    scan = scan_lines(Probe(), Rf(lines=17, sector_deg=64))
    assert np.allclose(np.degrees(scan.angle), np.linspace(-32, 32, 17))
    assert not scan.line_origin.any()


def test_lines_of_a_linear_scan_are_parallel_and_span_the_array_or_the_width_asked_for():
    scan = scan_lines(Probe(), Rf(lines=17, scan="linear"))
    assert np.allclose(scan.line_origin, np.linspace(-1.472e-3, 1.472e-3, 17))
    assert not scan.angle.any()
    assert scan_width(Probe(), Rf(scan="linear", width_mm=2.0)) == pytest.approx(2e-3)


def test_lines_beyond_the_array_are_refused():
    with pytest.raises(ValueError, match=r"Lines over 4 mm need a longer array: this one measures 2\.944 mm"):
        scan_lines(Probe(), Rf(scan="linear", width_mm=4.0))


@pytest.mark.parametrize("kind", ["sector", "linear"])
def test_scan_coordinates_of_a_sample_are_its_line_and_range(kind):
    scan = scan_lines(Probe(), Rf(lines=16, scan=kind))
    line, range_ = scan.to_scan_coordinates(*sample_positions(scan, RANGE))
    assert np.allclose(line, np.arange(16)[:, None], atol=1e-9)
    assert np.allclose(range_, RANGE)


def test_samples_of_a_sector_lie_in_polar_coordinates():
    lateral, axial = sample_positions(scan_lines(Probe(), Rf(lines=17, sector_deg=60)), RANGE)
    assert np.allclose(lateral[-1], RANGE / 2)
    assert np.allclose(axial[-1], RANGE * np.sqrt(3) / 2)
