"""Defaults of array, scan, loop and trackers follow from the heart."""

from math import log, pi

import pytest

from echotruth.config import Bmode, Config, Geometry, Probe, Rf, anatomy
from echotruth.config.loading import ConfigError, validate
from echotruth.config.transducers import ARRAY_PRESETS
from echotruth.units import deg


def configured(**sections):
    return validate(sections, "a.yaml")


@pytest.mark.parametrize("species", anatomy.HEART_PRESETS)
def test_heart_stands_within_the_field_of_view_and_the_sector(species):
    """The ellipsoid a fifth larger, as at end-diastole, in the short axis and along its axis."""
    config = configured(geometry={"preset": species})
    size = config.geometry.lengths()
    across = 1.2 * (size["endo_radius_mm"] + size["wall_mm"])
    along = 1.2 * ((size["endo_length_mm"] + size["base_mm"]) / 2 + size["apex_wall_mm"])
    focus, side = config.rf.focus_mm, config.bmode.field_of_view_mm
    assert max(across, along) < focus < side - max(across, along)
    assert across < focus * (config.rf.sector_deg * deg) / 2


@pytest.mark.parametrize("name", ARRAY_PRESETS)
def test_scan_of_a_preset_has_ten_scatterers_in_its_resolution_cell(name):
    """-6 dB widths of two ways: 4 ln 2 / (pi B) c / 2 in depth, 1.38 wavelengths F# of two Hann apertures, 0.886 in
    elevation, where sinc^2 is one half."""
    config = configured(probe={"preset": name})
    probe, focus = config.probe, config.rf.focus_mm
    wavelength = probe.sound_speed_m_per_s / probe.frequency_MHz / 1e3  # mm
    axial = 4 * log(2) / (pi * probe.bandwidth) * wavelength / 2
    length = probe.elements * probe.pitch_um / 1e3
    lateral = 1.38 * wavelength * max(focus / length, config.rf.f_number)
    elevation = 0.886 * wavelength * probe.elevation_focus_mm / probe.height_mm
    assert config.phantom.density_per_mm3 * axial * lateral * elevation > 10


@pytest.mark.parametrize("name", ARRAY_PRESETS)
def test_focal_zones_of_a_preset_lie_within_each_others_depth_of_field(name):
    config = configured(probe={"preset": name})
    probe, rf = config.probe, config.rf
    f_number = max(1e3 * rf.focus_mm / (probe.elements * probe.pitch_um), rf.f_number)
    depth = 7 * probe.sound_speed_m_per_s / probe.frequency_MHz / 1e3 * f_number**2  # mm
    assert depth / 3 < rf.focal_spacing_mm < depth


def test_default_is_the_mouse():
    config = configured()
    assert config == Config() == Config(probe=Probe(), rf=Rf(), bmode=Bmode())
    assert (config.probe.preset, config.rf.focus_mm, config.bmode.field_of_view_mm) == ("mouse_25MHz", 6.5, 12)


def test_what_is_given_stands():
    config = configured(geometry={"preset": "human"}, rf={"focus_mm": 80.0}, loop={"file": "rat"})
    assert (config.probe.preset, config.rf.focus_mm, config.rf.sector_deg) == ("human_2_7MHz", 80, 75)
    assert config.loop.file == "rat"
    assert configured(geometry={"preset": "human"}).loop.file == "human"


def test_lengths_of_trackers_follow_the_field_of_view():
    trackers = configured(geometry={"preset": "human"}).tracking.trackers
    assert set(trackers) == set(Config().tracking.trackers)
    assert trackers["bspline_dic"].knots_mm == 0.4 * 12.5
    assert trackers["window_deformation"].windows_mm == [1.5 * 12.5, 0.75 * 12.5]
    assert (trackers["corrected"].window_mm, trackers["corrected"].reference) == (1.5 * 12.5, "bidirectional")
    given = configured(bmode={"field_of_view_mm": 24.0}, tracking={"trackers": {"one": {"method": "bspline_dic"}}})
    assert given.tracking.trackers["one"].knots_mm == 0.8
    fixed = {"one": {"method": "bspline_dic", "knots_mm": 0.3}}
    assert (
        configured(geometry={"preset": "human"}, tracking={"trackers": fixed}).tracking.trackers["one"].knots_mm == 0.3
    )


@pytest.mark.parametrize("sections", [{"probe": {"preset": "mouse_25MHz"}}, {"rf": {"focus_mm": 31.0}}])
def test_array_inside_of_the_heart_is_refused(sections):
    with pytest.raises(ConfigError, match=r"rf\.focus_mm = \S+: must exceed 31\.9, the radius of the heart"):
        configured(geometry={"preset": "human"}, **sections)


def test_radius_of_the_heart_is_that_of_its_mesh():
    from echotruth.mechanics.geometry import left_ventricle

    few = {"circumferential_elements": 12, "longitudinal_elements": 4, "transmural_elements": 1}
    geometry = Geometry(preset="rat", dilation=1.3, hypertrophy=1.5, scale=0.9, **few)
    nodes = left_ventricle(geometry).nodes[:, :2]
    assert (nodes**2).sum(axis=1).max() ** 0.5 == pytest.approx(1e-3 * geometry.outer_radius_mm(), rel=0.01)
