"""Between frames a heart moves smoothly through all of them, and a packet sees its scatterers move on."""

from functools import partial

import numpy as np
import pytest

import echotruth as et
from echotruth.cases import Case
from echotruth.imaging.medium.mitral_valve import Leaflets, MitralValve
from echotruth.imaging.packet import MovingHeart, PacketSequence
from echotruth.imaging.sequence import Sequence
from echotruth.imaging.view import before_probe
from echotruth.seeds import generator

FRAMES = 16
LATERAL, AXIAL = 300e-6, -200e-6
ROCKING = {
    "rocking_deg": 4.0,
    "drift": {"lateral_mm": 0.3},
    "breathing": {"axial_mm": 0.2, "rate_per_min": 150.0, "phase_deg": 30.0},
}
SETTINGS = {
    "geometry": {
        "shape": "tube",
        "endo_length_mm": 3,
        "base_mm": 1,
        "circumferential_elements": 12,
        "longitudinal_elements": 4,
        "transmural_elements": 1,
    },
    "motion": {"kind": "rigid", "rigid": {"lateral_um": 1e6 * LATERAL, "axial_um": 1e6 * AXIAL}},
    "loop": {"frames": FRAMES},
    "views": {"mid": {"position": 0.5}, "rocked": {"position": 0.5, "motion": ROCKING}},
    "phantom": {"density_per_mm3": 100.0},
    "probe": {"elements": 16},
    "rf": {"lines": 16, "focal_zones": 1},
}
INTERVAL = 2e-4
"""Between pulses, s."""
IN_WALL = np.array([[0.0, 6.5e-3 - 2.2e-3, 0.0], [0.3e-3, 6.5e-3 + 2.2e-3, 0.0]])


class Imaged:
    """A heart in a view, with what is made of it by its configuration."""

    def __init__(self, view="mid", **keys):
        self.config = et.configure(SETTINGS, **keys)
        heart = et.beat(self.config, progress=False)
        _, self.plane = before_probe(heart, self.config, view)
        self.moving = MovingHeart(heart, self.config, self.plane, view)
        self.random = partial(generator, Case("heart", {}, self.config), view)

    def packets(self, pulses=3):
        return PacketSequence(self.config, self.moving, self.plane, self.random, pulses, INTERVAL)


@pytest.fixture(scope="module")
def mid():
    return Imaged()


def test_velocity_is_the_derivative_of_the_formula(mid):
    for frame in range(FRAMES):
        rate = np.pi / mid.moving.period * np.sin(2 * np.pi * frame / FRAMES)  # of sin^2(pi t / T)
        found, greatest = mid.moving.velocity(frame, IN_WALL), np.pi / mid.moving.period * abs(AXIAL)
        np.testing.assert_allclose(found, rate * np.array([[LATERAL, AXIAL, 0.0]] * 2), atol=1e-3 * greatest)
    assert np.isnan(mid.moving.velocity(0, np.array([[0.0, 1e-3, 0.0]]))).all()


def test_a_ramp_does_not_close_and_moves_evenly_to_its_last_frame():
    moving = Imaged(**{"motion.time_course": "ramp"}).moving
    for frame in (0, 7, FRAMES - 1):
        found = moving.velocity(frame, IN_WALL)
        np.testing.assert_allclose(found, [np.array([LATERAL, AXIAL, 0.0]) / moving.time[-1]] * 2, rtol=1e-6, atol=1e-9)


def test_rigid_motion_before_the_probe_is_the_derivative_of_its_formula():
    moving = Imaged("rocked", **{"motion.rigid.lateral_um": 0.0, "motion.rigid.axial_um": 0.0}).moving
    frame, breath, start = 5, 2 * np.pi * 2.5, np.radians(30)  # rad/s, rad
    time, turn = moving.time[frame], 2 * np.pi / moving.period
    shift = np.array([0.3e-3 * time / moving.period, 0.1e-3 * (np.cos(start) - np.cos(breath * time + start))])
    rate = np.array([0.3e-3 / moving.period, 0.1e-3 * breath * np.sin(breath * time + start)])
    spin = np.radians(4) / 2 * turn * np.sin(turn * time)
    found = moving.velocity(frame, IN_WALL)
    from_array = IN_WALL[:, :2] - shift
    expected = rate + spin * np.column_stack([from_array[:, 1], -from_array[:, 0]])
    np.testing.assert_allclose(found, np.column_stack([expected, [0, 0]]), rtol=1e-6, atol=1e-8)


def test_middle_pulse_is_the_frame_of_the_clip(mid):
    sequence = Sequence(mid.config, mid.moving.at(np.empty(0)), mid.plane, mid.random)
    frame = sequence.scanner.beamform(sequence.acquisition(sequence.scatterers())(5))
    lines = mid.packets().lines(5)
    np.testing.assert_array_equal(lines[1], frame)
    assert np.linalg.norm(lines[0] - frame) > 0.1 * np.linalg.norm(frame)


def test_noise_is_drawn_for_each_pulse_and_packet(mid):
    clean, noisy = mid.packets(2), Imaged(**{"realism.noise.snr_dB": 0.0}).packets(2)
    noise = np.concatenate([noisy.lines(frame) - clean.lines(frame) for frame in (3, 4)]).reshape(4, -1)
    assert np.abs(np.corrcoef(noise) - np.eye(4)).max() < 0.1
    power = np.linalg.norm(noise, axis=1)
    assert power.min() > 0.95 * power.max()


def test_speckle_decorrelates_from_pulse_to_pulse_as_between_frames_in_the_same_time():
    packets, innovation = Imaged(**{"realism.decorrelation.time_ms": 2.0}).packets(), []
    for frame in (3, 4):
        medium = packets.medium(frame)
        first, second, third = (medium(FRAMES + pulse)[1] for pulse in range(3))
        for later, expected in ((second, np.exp(-0.1)), (third, np.exp(-0.2))):
            assert np.corrcoef(first, later)[0, 1] == pytest.approx(expected, abs=0.02)
        innovation.append(second - np.exp(-0.1) * first)
    assert abs(np.corrcoef(innovation)[0, 1]) < 0.1


def test_leaflets_open_between_frames_as_they_do_from_frame_to_frame():
    ellipsoid = SETTINGS["geometry"] | {"shape": "ellipsoid"}
    gradient = [[0.9, 0.0, 0.0], [0.0, 0.9, 0.0], [0.0, 0.0, 0.9]]
    motion = {"kind": "affine", "affine": {"gradient": gradient}}
    realism = {"neighbours": {"leaflets_dB": 12.0}}
    imaged = Imaged(geometry=ellipsoid, motion=motion, realism=realism)
    clip = MitralValve(imaged.moving.at(np.empty(0))).opening
    assert 0 < clip[8] < clip[9]
    medium = imaged.packets(1).medium(8)
    (leaflets,) = (body for body in medium._others if isinstance(body, Leaflets))
    np.testing.assert_allclose(leaflets.in_heart(FRAMES), leaflets.in_heart(8), atol=1e-12)
    heart, step = imaged.moving.at(imaged.moving.time[[8, 9]].mean(keepdims=True)), [8.5]
    assert MitralValve(heart, step).opening[-1] == pytest.approx(clip[8:10].mean())


def test_a_slow_packet_of_the_first_frame_decorrelates_too():
    imaged = Imaged(**{"realism.decorrelation.time_ms": 20.0})
    slow = PacketSequence(imaged.config, imaged.moving, imaged.plane, imaged.random, 3, 0.03).medium(0)
    first, second = (slow(FRAMES + pulse)[1] for pulse in range(2))
    assert np.corrcoef(first, second)[0, 1] == pytest.approx(np.exp(-1.5), abs=0.03)
