"""The channels that a repository keeps are enough to make its lines again."""

import numpy as np
import pytest
import xarray as xr

from echotruth.cases import expand
from echotruth.config import Config, Probe, Rf
from echotruth.config.loading import ConfigError, validate
from echotruth.imaging.recorder import channels, decimated_samples, quantise
from echotruth.imaging.rf.full_matrix import FullMatrix

WAVES = ("focused", "plane", "diverging", "synthetic_aperture")


def opened(folder):
    """What a user sees: the group alone, by xarray alone."""
    with xr.open_zarr(folder / "small.zarr", group="clips/heart/mid/rf", consolidated=False) as group:
        return group.load()


@pytest.fixture(scope="module", params=WAVES)
def rf(request, rf_repository):
    return opened(rf_repository(transmit=request.param, transmits=3))


def way_out(rf, wave, lateral, axial):
    """How far a wave has come since time 0 when it reaches points, m."""
    x, z = rf.transmit_origin[wave].values
    if rf.attrs["transmit"] == "plane":
        return x * lateral + z * axial
    return np.hypot(lateral - x, axial - z) - float(rf.transmit_t0_distance[wave])


def turn(rf, time, cycles):
    return np.exp(2j * np.pi * rf.attrs["sampling_frequency"] * np.multiply.outer(time, cycles))


def focused_again(rf, frame, line, along):
    """Delay and sum of the stored channels, in float64, for points at ranges (n,) on a line."""
    echoes = rf.channels[frame].values * float(rf.channels_step[frame])
    cycles = np.fft.rfftfreq(echoes.shape[-1])[1:-1]
    spectra = 2 * np.fft.rfft(echoes)[..., 1:-1] / echoes.shape[-1]
    element, angle, speed = rf.element.values, float(rf.line_angle[line]), rf.attrs["sound_speed"]
    lateral, axial = float(rf.line_origin[line]) + along * np.sin(angle), along * np.cos(angle)
    back = np.hypot(lateral[:, None] - element, axial[:, None])
    weight = np.cos(np.pi * element / (len(element) * (element[1] - element[0]))) ** 2
    total = np.zeros(len(along), complex)
    foci = np.array(rf.attrs["foci"])
    for wave in range(rf.sizes["transmit"]):
        zone_weight = 1.0
        if len(foci):
            zone, served = divmod(wave, rf.sizes["line"])
            zone_weight = np.interp(along, foci, np.eye(len(foci))[zone]) * (served == line)
        if not np.any(zone_weight):
            continue
        delay, strength = rf.transmit_delay[wave].values, rf.transmit_weight[wave].values
        sent = np.einsum("tf,trf->rf", strength[:, None] * turn(rf, -delay, cycles), spectra)
        arrival = (way_out(rf, wave, lateral, axial)[:, None] + back) / speed
        total += zone_weight * sum(weight[r] * (turn(rf, arrival[:, r], cycles) @ sent[r]) for r in range(len(element)))
    return total * np.exp(-4j * np.pi * rf.attrs["demodulation_frequency"] * along / speed)


@pytest.mark.slow
@pytest.mark.parametrize("frame, line", [(0, 0), (1, 9)])
def test_lines_are_the_delayed_sum_of_the_channels_that_are_stored(rf, frame, line):
    near = np.flatnonzero((rf.range > 4e-3) & (rf.range < 8e-3))[::7]
    found = focused_again(rf, frame, line, rf.range.values[near])
    stored = rf.lines[frame, line].values[near]
    largest = np.abs(rf.lines.values.view(np.float32)).max()
    rounding = 2.0 ** np.ceil(np.log2(largest / 2**15)) / np.sqrt(2)  # half a step in both parts
    assert np.linalg.norm(found - stored) < 3e-4 * np.linalg.norm(stored) + rounding * np.sqrt(len(near))


def test_channel_of_a_point_is_its_pulse_at_the_time_of_both_ways():
    """Its peak, by the Gaussian through the samples of the envelope beside it, within a hundredth of a period, in the
    focus of the lens, which elsewhere delays what is in the plane a little."""
    probe = Probe(elements=8)
    axial = np.sqrt(6.5e-3**2 - 1e-3**2)
    full, point = FullMatrix(probe, 8e-3), np.array([[1e-3, axial, 0.0]])
    found = channels(full, full(point, np.ones(1)))
    spectrum = np.fft.fft(found)
    spectrum[..., found.shape[-1] // 2 :] = 0
    envelope = np.abs(np.fft.ifft(spectrum))
    way = np.hypot(full.centres - 1e-3, axial)
    sampling = full.sampling * decimated_samples(full) / full.samples
    for transmitter, receiver in ((0, 0), (0, 7), (5, 2)):
        trace = envelope[transmitter, receiver]
        top = trace.argmax()
        below, most, above = np.log(trace[top - 1 : top + 2])
        time = (top + (below - above) / (2 * (below - 2 * most + above))) / sampling
        assert time == pytest.approx((way[transmitter] + way[receiver]) / 1540, abs=0.4e-9)


def test_whole_numbers_are_half_a_step_off_at_most():
    echoes = np.random.default_rng(0).standard_normal((4, 4, 1000)).astype(np.float32)
    kept, step = quantise(echoes)
    assert kept.dtype == np.int16 and np.abs(kept).max() == 32767
    assert np.abs(kept * step - echoes).max() <= 0.51 * step
    assert quantise(np.zeros((1, 1, 4), np.float32))[0].max() == 0


@pytest.mark.slow
def test_channels_are_there_if_they_are_kept(rf_repository):
    with_channels, without = set(opened(rf_repository()).variables), set(opened(rf_repository([])).variables)
    assert with_channels - without == {"channels", "channels_step", "transmitter", "receiver", "sample"}
    assert {"lines", "range", "line_angle", "line_origin", "element", "transmit_delay", "time"} <= without


def test_group_says_how_its_rf_was_made(rf_repository):
    settings = opened(rf_repository([], transmit="plane", transmits=3)).attrs
    assert settings["accuracy"] == 0.01 and settings["transmit"] == "plane"
    assert settings["sound_speed"] == 1540 and settings["centre_frequency"] == 25e6
    assert settings["demodulation_frequency"] == pytest.approx(25e6, rel=0.01)


def test_width_of_the_elements_is_swept_where_rf_is_kept():
    cases = expand(Config(rf=Rf(keep=["channels"]), cases={"probe.width_um": [30.0, 41.0]}))
    assert [case.config.probe.width_um for case in cases] == [30, 41]


@pytest.mark.parametrize("keep", ["channels", ["lines"]])
def test_bad_keep_is_refused_in_one_sentence(keep):
    with pytest.raises(ConfigError, match=r"^a\.yaml: rf\.keep"):
        validate({"rf": {"keep": keep}}, "a.yaml")
