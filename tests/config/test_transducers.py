"""Presets of arrays: complete, sufficiently sampled, and equal to their sources."""

import numpy as np
import pytest

from echotruth.cases import expand, table
from echotruth.config import Config, Probe
from echotruth.config.loading import ConfigError, override, validate
from echotruth.config.transducers import ARRAY_PRESETS
from echotruth.imaging.rf.probe import MAX_FREQUENCY, pulse_band


@pytest.mark.parametrize("name", ARRAY_PRESETS)
def test_preset_is_sampled_to_the_faint_edge_of_its_pulse(name):
    """The Gaussian spectrum is below 1 % at sqrt(ln 100 / ln 2) times its -6 dB half-width."""
    probe = Probe(preset=name)
    edge = probe.frequency_MHz * (1 + probe.bandwidth * np.sqrt(np.log(100) / np.log(2)) / 2)
    assert probe.sampling_MHz * MAX_FREQUENCY > edge
    assert pulse_band(probe)[1] == pytest.approx(edge * 1e6, rel=1e-3)


def test_human_array_is_the_p4_2v():
    """Frequency, bandwidth, pitch, width, height and focus of PyMUST's getparam('P4-2v')."""
    probe = Probe(preset="human_2_7MHz")
    found = (probe.frequency_MHz, probe.bandwidth, probe.pitch_um, probe.width_um)
    assert found == pytest.approx((2.72, 0.74, 300, 250))
    assert (probe.height_mm, probe.elevation_focus_mm) == (14, 60)
    assert probe.elements == 64


@pytest.mark.parametrize(
    "preset, elements, frequency, length",
    [("human_3MHz", 80, 3, 20.3e3), ("mouse_linear_30MHz", 256, 30, 14.1e3)],
)
def test_array_is_as_long_as_its_maker_says(preset, elements, frequency, length):
    probe = Probe(preset=preset)
    assert (probe.elements, probe.frequency_MHz) == (elements, frequency)
    assert probe.elements * probe.pitch_um == pytest.approx(length, rel=2e-3)


def test_lines_of_the_linear_array_are_parallel_unless_they_are_told_otherwise():
    linear = {"probe": {"preset": "mouse_linear_30MHz"}}
    assert (validate(linear, "a.yaml").rf.scan, validate(linear, "a.yaml").rf.f_number) == ("linear", 2)
    assert validate(linear | {"rf": {"scan": "sector"}}, "a.yaml").rf.scan == "sector"


def test_sampling_follows_a_band_that_is_given():
    assert Probe(frequency_MHz=50.0).sampling_MHz == 200
    assert Probe(bandwidth=1.0).sampling_MHz * MAX_FREQUENCY > 25 * (1 + np.sqrt(np.log(100) / np.log(2)) / 2)
    assert Probe(frequency_MHz=20.0, sampling_MHz=70.0).sampling_MHz == 70


@pytest.mark.parametrize(
    "keys",
    [{"bandwidth": 1.1, "sampling_MHz": 100.0}, {"frequency_MHz": 40.0, "sampling_MHz": 100.0}],
)
def test_band_above_the_nyquist_frequency_is_refused(keys):
    with pytest.raises(ConfigError, match=r"^a\.yaml: probe\.frequency_MHz = .*: its band reaches .*, or sample at"):
        validate({"probe": keys}, "a.yaml")


def test_unknown_array_is_refused_with_those_there_are():
    with pytest.raises(
        ConfigError, match=r"probe\.preset = 'mouse': should be 'mouse_25MHz', .* or 'mouse_row_column_15MHz'"
    ):
        validate({"probe": {"preset": "mouse"}}, "a.yaml")


def test_values_of_a_preset_are_not_pinned_when_a_case_changes_it():
    cases = expand(Config(probe=Probe(width_um=30.0), cases={"probe.preset": ["mouse_25MHz", "mouse_40MHz"]}))
    assert [case.config.probe.pitch_um for case in cases] == [46, 38]
    assert [case.config.probe.width_um for case in cases] == [30, 30]
    assert list(table(cases)["probe.pitch_um"]) == [46, 38]


def test_a_configuration_written_and_read_is_the_same():
    config = validate({"probe": {"preset": "human_2_7MHz", "elements": 96}}, "a.yaml")
    again = validate(config.model_dump(), "b.yaml")
    assert again == config
    assert override(again, {"probe.preset": "mouse_30MHz"}).probe.pitch_um == 50
