"""Shadow, haze, ring-down and noise in the record of all pairs, against what each should do to it."""

import numpy as np
import pytest
from scenes import medium, random, scene

from echotruth.config import Config, Probe
from echotruth.imaging.acquisition import Acquisition
from echotruth.imaging.beamforming.scanner import Scanner
from echotruth.imaging.rf import ring_down
from echotruth.imaging.rf.haze import reverberation, reverberation_filter
from echotruth.imaging.rf.shadow import Rib
from echotruth.units import mm

SMALL = {"probe": {"elements": 16, "pitch_um": 90.0}, "rf": {"lines": 16}, "phantom": {"density_per_mm3": 300.0}}
ALL = {
    "blood": {"level_dB": -20.0},
    "surroundings": {"level_dB": -12.0},
    "decorrelation": {"time_ms": 50.0},
    "noise": {"snr_dB": 25.0},
    "haze": {"level_dB": -20.0},
    "shadow": {"side": "right"},
}


@pytest.fixture(scope="module")
def scanner():
    config = Config.model_validate(SMALL)
    return Scanner(config.probe, config.rf, config.bmode.field_of_view_mm * mm)


@pytest.fixture(scope="module")
def acquire(twisting_heart, scanner):
    """Make the acquisition and the medium of a view of the heart."""

    def made(**realism):
        config = Config.model_validate(SMALL | {"realism": realism})
        whole, _ = medium(scene(config, twisting_heart), scanner.matrix.in_beam)
        return Acquisition(config, scanner, whole, random), whole

    return made


@pytest.mark.slow
def test_without_realism_the_bytes_are_those_of_the_matrix(acquire, scanner, twisting_heart):
    from echotruth.imaging.medium.wall import Wall

    acquisition, _ = acquire()
    bare = Wall.seed(scene(Config.model_validate(SMALL), twisting_heart))
    assert acquisition(1).tobytes() == scanner.matrix(bare.positions(1), bare.amplitude).tobytes()


@pytest.mark.slow
def test_frames_come_out_the_same_in_any_order_and_again(acquire):
    first, second = acquire(**ALL)[0], acquire(**ALL)[0]
    forwards = [first(frame).tobytes() for frame in (0, 1)]
    backwards = [second(frame).tobytes() for frame in (1, 0)]
    assert forwards == backwards[::-1]


def test_every_tissue_has_the_exponent_of_its_own_key(twisting_heart, scanner):
    keys = {"phantom": {"scattering_exponent": 1.5, "density_per_mm3": 300.0}}
    tissues = {"blood": {"scattering_exponent": 2.0}, "surroundings": {"scattering_exponent": 0.5}}
    realism = {name: ALL[name] | values for name, values in tissues.items()}
    config = Config.model_validate(SMALL | keys | {"realism": realism})
    whole, seeded = medium(scene(config, twisting_heart), scanner.matrix.in_beam)
    position, _, exponent = whole(1)
    wall = len(seeded["wall_cell"])
    assert (exponent[:wall] == 1.5).all() and (whole.wall(1)[2] == 1.5).all()
    assert 0 < (exponent == 2.0).sum() <= len(seeded["blood_cell"])
    assert 0 < (exponent == 0.5).sum() <= len(seeded["surroundings_position"])
    assert len(position) == wall + (exponent == 2.0).sum() + (exponent == 0.5).sum()
    one = Acquisition(config, scanner, whole, random)(1)
    assert one.tobytes() == scanner.matrix(*whole(1)).tobytes()


@pytest.mark.parametrize("snr", [10.0, 30.0])
def test_the_lines_have_the_ratio_of_signal_to_noise_asked_for(acquire, scanner, snr):
    acquisition, whole = acquire(noise={"snr_dB": snr})
    muscle = whole.wall.contains(0, scanner.positions())
    echo = scanner.lines(*whole.wall(0))
    noise = scanner.beamform(np.float32(acquisition.noise) * acquisition.unit_noise(1))
    ratio = np.linalg.norm(echo[muscle]) / np.linalg.norm(noise[muscle])
    assert 20 * np.log10(ratio) == pytest.approx(snr, abs=0.3)


def test_noise_is_what_is_added_to_the_record(acquire):
    noisy, quiet = acquire(noise={"snr_dB": 10.0})[0], acquire()[0]
    added = (noisy(1) - quiet(1)) / noisy.noise
    assert np.abs(added - noisy.unit_noise(1)).max() < 1e-3


def test_noise_is_white_over_pairs_and_band_and_new_in_every_frame(acquire):
    acquisition = acquire()[0]
    now, then = (acquisition.unit_noise(frame).reshape(-1, 256) for frame in (0, 1))
    error = 1 / np.sqrt(len(now))
    covariance = now.conj().T @ now / len(now)
    assert np.abs(covariance - np.eye(256)).max() < 7 * error
    assert np.abs(np.vdot(now, then)) / now.size < 4 / np.sqrt(now.size)
    assert np.abs((now**2).mean()) < 4 / np.sqrt(now.size)
    power = (np.abs(now) ** 2).mean(axis=1)
    assert np.abs(power - 1).max() < 5 / np.sqrt(256)


def test_a_later_echo_is_the_first_one_shifted(scanner):
    # Its wavefront stays that of the near place, so that it is out of focus where it is drawn.
    matrix, samples = scanner.matrix, 300
    deeper = samples / matrix.sampling * 1540 / 2
    echo = matrix(np.array([[0.4e-3, 3e-3, 0.0]]), np.ones(1))
    later = reverberation_filter(np.array([[deeper, 0.25]]), Probe(), matrix.frequency)[:, None, None] * echo
    traces = []
    for spectra in (echo, later):
        whole = np.zeros((matrix.samples // 2 + 1, 16, 16), complex)
        whole[matrix.first_bin : matrix.first_bin + len(matrix.frequency)] = spectra
        traces.append(np.fft.irfft(whole, matrix.samples, axis=0))
    assert np.abs(traces[1] - 0.25 * np.roll(traces[0], samples, axis=0)).max() < 1e-6 * np.abs(traces[0]).max()


def test_a_later_echo_is_attenuated_on_its_way():
    frequency, probe = np.array([20e6, 30e6]), Probe(attenuation_dB_per_cm_MHz=0.5)
    lossless, lossy = (reverberation_filter(np.array([[2e-3, 0.1]]), of, frequency) for of in (Probe(), probe))
    # There and back 0.4 cm of 0.5 dB/cm/MHz.
    np.testing.assert_allclose(20 * np.log10(np.abs(lossy / lossless)), [-4.0, -6.0], rtol=1e-6)


def test_only_near_echoes_are_repeated(acquire):
    hazy, clear = (acquire(**what)[0] for what in ({"haze": {"level_dB": -10.0, "max_source_range_mm": 3.0}}, {}))
    near, far = np.array([[0.2e-3, 2.5e-3, 0.0]]), np.array([[0.2e-3, 3.5e-3, 0.0]])
    one = np.ones(1)
    assert np.array_equal(hazy.echoes(far, one), clear.echoes(far, one))
    assert np.linalg.norm(hazy.echoes(near, one) - clear.echoes(near, one)) > 0.1 * np.linalg.norm(
        clear.echoes(near, one)
    )


def test_later_echoes_have_the_level_asked_for():
    config = Config.model_validate({"realism": {"haze": {"level_dB": -15.0, "mean_extra_range_mm": 1.0}}})
    draws = [reverberation(config.realism.haze, config.probe, 1.0, np.random.default_rng(k)) for k in range(300)]
    power = np.mean([(draw[:, 1] ** 2).sum() for draw in draws])
    assert 10 * np.log10(power) == pytest.approx(-15, abs=0.1)
    assert np.mean([draw[:, 0].mean() for draw in draws]) == pytest.approx(1e-3, rel=0.02)


def test_no_later_echo_seems_to_lie_beyond_the_image():
    config = Config.model_validate(
        {"realism": {"haze": {"level_dB": -15.0, "mean_extra_range_mm": 5.0, "max_source_range_mm": 4.0}}}
    )
    echoes = reverberation(config.realism.haze, config.probe, 12e-3, np.random.default_rng(0))
    assert echoes[:, 0].max() < 8e-3
    assert len(echoes) > 100


@pytest.mark.parametrize("side", ["left", "right"])
def test_an_echo_is_faint_where_its_ray_crosses_the_rib(acquire, scanner, side):
    config = {"side": side, "edge_deg": 8.0, "depth_mm": 1.5, "edge_width_mm": 0.4, "level_dB": -30.0}
    acquisition, _ = acquire(shadow=config)
    draw = np.random.default_rng(7)
    place, amplitude = draw.uniform([-3e-3, 3e-3, 0], [3e-3, 9e-3, 0], (60, 3)), draw.standard_normal(60)
    exact = np.zeros((len(scanner.matrix.frequency), 16, 16), complex)
    sign = 1 if side == "right" else -1
    for k in range(60):
        x, z = sign * place[k, 0], place[k, 1]
        rib = 1.5e-3 * np.tan(np.radians(8))
        # The line from the scatterer through the rib's edge meets the array here.
        projection = x + (rib - x) * z / (z - 1.5e-3)
        ramp = np.clip((projection - sign * scanner.matrix.centres) / 0.4e-3 + 0.5, 0, 1)
        passes = 10**-1.5 + (1 - 10**-1.5) * np.sin(np.pi / 2 * ramp) ** 2
        exact += passes[:, None] * passes * scanner.matrix(place[k : k + 1], amplitude[k : k + 1])
    found = acquisition.echoes(place, amplitude)
    assert np.linalg.norm(found - exact) < 2e-3 * np.linalg.norm(exact)


def test_scatterers_before_the_rib_are_not_shaded_and_those_deep_behind_it_are(acquire, scanner):
    rib = Rib(Config.model_validate({"realism": {"shadow": {"side": "right"}}}).realism.shadow)
    before, behind = np.array([[2e-3, 1.4e-3, 0]]), np.array([[5e-3, 6e-3, 0]])
    acquisition, _ = acquire(shadow={"side": "right", "level_dB": -40.0})
    one = np.ones(1)
    assert np.isinf(rib.projected_edge(before)).all()
    # The clusters with and without a rib have other skeletons, and errors.
    for place, passes, error in ((before, 1.0, 0.01), (behind, 1e-4, 0.03)):
        echo = passes * scanner.matrix(place, one)
        assert np.linalg.norm(acquisition.echoes(place, one) - echo) < error * np.linalg.norm(echo)


def test_ring_down_has_the_level_asked_for_and_is_the_same_in_all_frames(acquire, scanner):
    acquisition, whole = acquire(ring_down={"level_dB": 6.0})
    bare, _ = acquire()
    bands = [scanner.beamform(acquisition(frame) - bare(frame)) for frame in (0, 1)]
    muscle = whole.wall.contains(0, scanner.positions())
    rms = np.sqrt(np.mean(np.abs(scanner.lines(*whole.wall(0))[muscle]) ** 2))
    assert 20 * np.log10(np.abs(bands[0]).max() / rms) == pytest.approx(6.0, abs=0.01)
    assert np.abs(bands[1] - bands[0]).max() < 1e-4 * np.abs(bands[0]).max()


def test_ring_down_is_what_a_mirror_before_the_array_would_send_back(scanner):
    # Straight ahead its bands are one thickness of the lens apart, and the first is the brightest at the middle.
    spectra = ring_down.ring_down(Config.model_validate(SMALL).probe, scanner.matrix.frequency)
    record = np.zeros((len(spectra), 16, 16), np.complex64)
    ring_down.add(record, spectra)
    assert np.array_equal(record, record.swapaxes(1, 2))
    trace = np.fft.irfft(np.pad(spectra[:, 0], (scanner.matrix.first_bin, 0)), scanner.matrix.samples)
    thickness = 12 * 1540 / 25e6
    for trip in (1, 2, 3):
        around = np.arange(len(trace)) / scanner.matrix.sampling * 1540 / 2 - trip * thickness
        near = np.abs(around) < thickness / 2
        assert abs(around[near][np.abs(trace[near]).argmax()]) < 1540 / 25e6 / 4
    # Of elements that lie apart it comes later, over the path to their image in the mirror.
    apart = np.fft.irfft(np.pad(spectra[:, 15], (scanner.matrix.first_bin, 0)), scanner.matrix.samples)
    path = np.abs(apart).argmax() / scanner.matrix.sampling * 1540
    assert path == pytest.approx(np.hypot(2 * thickness, 15 * 90e-6), abs=1540 / 25e6 / 2)
