"""Doppler of a clip is the velocity of its wall along the beam, in any plane, and wraps beyond that of Nyquist."""

import numpy as np
import pytest

import echotruth as et
from echotruth.repository.datasets import fingerprint

LATERAL, AXIAL = 300e-6, -800e-6
TUBE = {
    "geometry": {
        "shape": "tube",
        "endo_length_mm": 3,
        "base_mm": 1,
        "circumferential_elements": 12,
        "longitudinal_elements": 4,
        "transmural_elements": 1,
    },
    "motion": {
        "kind": "rigid",
        "time_course": "ramp",
        "rigid": {"lateral_um": 1e6 * LATERAL, "axial_um": 1e6 * AXIAL},
    },
    "loop": {"frames": 3},
    "views": {"mid": {"position": 0.5}},
    "phantom": {"density_per_mm3": 300.0},
    "probe": {"elements": 32},
    "rf": {"lines": 33, "focal_zones": 1},
    "bmode": {"size_px": 128, "downsampling": (1, 2)},
    "tracking": {"grid": 0.016},
}


@pytest.fixture(scope="module")
def heart():
    return et.beat(TUBE, progress=False)


@pytest.fixture(scope="module")
def clip(heart):
    return et.image(heart, size=64, progress=False)


@pytest.fixture(scope="module")
def found(heart, clip):
    return et.velocity(heart, clip, [1], packet=2)


def formula(clip, heart):
    """Velocity towards the probe of a ring that moves evenly, at all pixels, m/s."""
    lateral, axial = np.meshgrid(clip["lateral"], clip["axial"])
    moved = lateral * LATERAL + axial * AXIAL
    return -moved / np.hypot(lateral, axial) / float(clip["time"][-1])


def test_true_velocity_is_the_component_towards_the_probe_where_there_is_wall(found, clip, heart):
    mask, true = clip["mask"].values[1], found["true_velocity"].values[0]
    np.testing.assert_array_equal(np.isfinite(true), mask)
    np.testing.assert_allclose(true[mask], formula(clip, heart)[mask], rtol=1e-5)
    assert true[mask].min() > 0


def test_measured_velocity_is_the_true_one(found):
    error = ((found["velocity"] - found["true_velocity"]) / found["nyquist"]).values
    assert abs(np.nanmean(error)) < 3e-3
    assert np.nanstd(error) < 1e-2


def test_result_tells_units_frames_and_settings(found, clip):
    assert found["velocity"].dims == found["nyquist"].dims == ("frame", "axial", "lateral")
    assert all(found[name].attrs["units"] == "m/s" for name in found.data_vars)
    assert list(found["frame"]) == [1] and float(found["time"][0]) == float(clip["time"][1])
    assert found.attrs["packet"] == 2 and found.attrs.items() >= clip.attrs.items()


def test_frequency_by_default_has_a_quarter_of_headroom_over_the_fastest_wall(found):
    fastest, probe = np.hypot(LATERAL, AXIAL) / 0.08, et.Probe()
    nyquist = probe.sound_speed_m_per_s * found.attrs["prf_Hz"] / (4e6 * probe.frequency_MHz)
    assert 1.2 * fastest < nyquist < 1.35 * fastest
    assert float(found["nyquist"].where(found["true_velocity"].notnull()).min()) > fastest


def test_velocity_beyond_that_of_nyquist_is_off_by_twice_as_much(heart, clip):
    aliased = et.velocity(heart, clip, [1], packet=2, prf_Hz=400.0)
    turns = ((aliased["true_velocity"] - aliased["velocity"]) / (2 * aliased["nyquist"])).values
    wall = np.isfinite(turns)
    # The ring moves at 1.1 to 1.7 times that of Nyquist.
    assert np.abs(turns[wall] - 1).mean() < 0.02 and np.abs(aliased["velocity"] / aliased["nyquist"]).max() <= 1


def test_a_frame_is_the_same_whatever_else_is_measured(heart, clip, found):
    both = et.velocity(heart, clip, [2, 1], packet=2)
    assert list(both["frame"]) == [2, 1]
    np.testing.assert_array_equal(both["velocity"].sel(frame=1), found["velocity"].sel(frame=1))


def test_realistic_echoes_of_a_beating_heart_have_its_velocity():
    """The heart with an infarct that comes with the package, in noise, blood and surroundings."""
    sample = et.sample()
    clip = sample.clip("infarct", "mid", variables=("mask", "wall_depth"))
    realistic = {
        "noise": {"snr_dB": 40.0},
        "decorrelation": {"time_ms": 500.0},
        "blood": {"level_dB": -16.5, "density": 0.15},
        "surroundings": {"level_dB": -11.0, "density": 0.15},
    }
    coarse = {"rf.lines": 48, "probe.elements": 32, "phantom.density_per_mm3": 800.0}
    config = et.configure(sample.case("infarct").config, realism=realistic, **coarse)
    heart = sample.heart("infarct")
    found = et.velocity(heart, clip.assign_attrs(config=config.model_dump_json()), [5], packet=2)
    inner = (clip["wall_depth"].sel(frame=5) > 0.3) & (clip["wall_depth"].sel(frame=5) < 0.7)
    error = ((found["velocity"] - found["true_velocity"]) / found["nyquist"]).where(inner).values
    assert abs(np.nanmean(error)) < 0.01
    assert np.nanstd(error) < 0.03


@pytest.mark.parametrize(
    "arguments, words",
    [
        ({"packet": 1}, "packet = 1: give a whole number of pulses, two or more"),
        ({"packet": 2.5}, "packet = 2.5: give a whole number"),
        ({"packet": 10**6}, "packet = 1000000: give at most [0-9]+, which fit into a cycle"),
        ({"prf_Hz": "1000"}, "prf_Hz = '1000': give a number"),
        ({"packet": True}, "packet = True: give a whole number"),
        ({"prf_Hz": 0}, "prf_Hz = 0: give 41.67 to"),
        ({"prf_Hz": float("nan")}, "prf_Hz = nan: give"),
        ({"prf_Hz": 1e6}, "echoes of a pulse before the next one"),
        ({"frames": [3]}, "from 0 to 2, not 3 to 3"),
        ({"frames": [0.5]}, "give whole numbers"),
        ({"frames": []}, "give whole numbers"),
    ],
)
def test_what_cannot_be_sent_is_refused(heart, clip, arguments, words):
    with pytest.raises(ValueError, match=words):
        et.velocity(heart, clip, **arguments)


def test_heart_at_rest_has_no_frequency_by_default(heart, clip):
    at_rest = {"kind": "rigid", "rigid": {"lateral_um": 0.0, "axial_um": 0.0}}
    still = et.beat({**TUBE, "motion": at_rest}, progress=False)
    with pytest.raises(ValueError, match="made of another heart"):
        et.velocity(still, clip, [1])
    of_still = clip.assign_attrs(motion=fingerprint(still), config=still.config.model_dump_json())
    with pytest.raises(ValueError, match="No wall in this view moves along the beam"):
        et.velocity(still, of_still, [1])


def test_part_of_a_clip_is_refused(heart, clip):
    with pytest.raises(ValueError, match="axial is not that of its image"):
        et.velocity(heart, clip.isel(axial=slice(10, 50)))
    with pytest.raises(TypeError, match="must be a Dataset"):
        et.velocity(heart, "clip")
