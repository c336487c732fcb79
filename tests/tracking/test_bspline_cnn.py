from dataclasses import replace

import numpy as np
import pytest

import echotruth as et
from echotruth.config.tracking import BsplineCnn, BsplineDic
from echotruth.tracking import TrackerFailed, track
from echotruth.tracking.ray_network import DILATIONS, OUTPUTS, PHASES, read
from echotruth.tracking.tracker_input import TrackerInput
from echotruth.tracking.trackers.bspline_cnn import (
    CHANNELS,
    MIRRORED,
    ODD,
    WEIGHTS,
    contraction,
    correction_weight,
    over_frames,
    over_phases,
    ray_features,
    seen_twice,
)
from echotruth.tracking.wall_rays import DEPTHS, RAYS

SIZE, SPACING, FRAMES, WIDTH = 128, 25e-6, 6, 4
MIDDLE = np.array([63.5, 63.5])


@pytest.fixture(scope="module")
def ring():
    """Ring about the middle of the image, and points in it."""
    column, row = np.meshgrid(np.arange(SIZE), np.arange(SIZE))
    radius = np.hypot(column - MIDDLE[0], row - MIDDLE[1])
    mask = (radius > 22) & (radius < 48)
    return mask, np.argwhere(mask)[::41, ::-1].astype(float)


@pytest.fixture(scope="module")
def frames(clip):
    return clip(lambda place, t: contracting(place, t, FRAMES), FRAMES, SIZE)


def found(frames, ring, settings):
    mask, points = ring
    return track(frames, points, mask, SPACING, np.arange(FRAMES) * 5e-3, 0, settings)


def weights(path, **last_bias):
    """File of weights that give the same output everywhere: `last_bias`, at the numbers that are its keys."""
    layers = len(DILATIONS)
    shapes = {"first": (WIDTH, len(CHANNELS)), "first_bias": (WIDTH,), "layers": (layers, WIDTH, WIDTH, 3, 3)}
    shapes |= {"biases": (layers, WIDTH), "last": (OUTPUTS, WIDTH), "last_bias": (OUTPUTS,)}
    arrays = {name: np.zeros(shape, np.float32) for name, shape in shapes.items()}
    arrays |= {"least": np.full(len(CHANNELS), -np.inf), "largest": np.full(len(CHANNELS), np.inf)}
    arrays["last_bias"][2 * DEPTHS :] = last_bias.get("log_deviation", 0.0)
    np.savez(path, **arrays)
    return str(path)


def features(frames, ring):
    mask, points = ring
    return ray_features(TrackerInput(frames, points, mask, SPACING, np.arange(len(frames)) * 5e-3, 0), BsplineCnn())


def test_network_that_adds_nothing_leaves_the_motion_of_bspline_dic(frames, ring, tmp_path):
    sure, unsure = (
        found(frames, ring, BsplineCnn(weights=weights(tmp_path / f"{log}.npz", log_deviation=log)))
        for log in (-6.0, 0.0)
    )
    plain, _ = found(frames, ring, BsplineDic())
    np.testing.assert_array_equal(sure[0], plain)
    assert (sure[1][1:] > 0.99).all() and (unsure[1][1:] < 0.3).all() and (sure[1][0] == 1).all()


def test_features_are_of_the_ring_as_it_moves(frames, ring):
    given, path = features(frames, ring)
    assert given.channels.shape == (len(CHANNELS), PHASES, RAYS) and np.isfinite(given.channels).all()
    assert given.displacement.shape == (FRAMES, DEPTHS, RAYS, 2) and path.displacement.shape == (
        FRAMES,
        len(ring[1]),
        2,
    )
    along, across = given.displacement[3, DEPTHS // 2].T
    depths = 22 + 26 * (np.arange(DEPTHS) + 0.5) / DEPTHS
    shift = np.sqrt(depths**2 - (1 - 0.75**2) * 22**2) - depths
    assert np.abs(along - shift[DEPTHS // 2]).max() < 0.3 and np.abs(across).max() < 0.3
    assert given.scale == pytest.approx(np.sqrt(np.mean(shift**2)), rel=0.1)


def test_weights_of_the_package_follow_a_wall_that_thickens_as_it_contracts(clip, ring):
    """An incompressible ring, as the wall of a short axis: each circle goes to one of so much less area.

    It has speckle everywhere, also in its cavity, as no echo has, which the network takes for worse than it is.
    """

    def motion(place, t):
        offset = place - MIDDLE
        less = 200 * np.sin(np.pi * t / 12) ** 2
        radius = np.linalg.norm(offset, axis=-1, keepdims=True)
        return MIDDLE + offset * np.sqrt(np.maximum(1 - less / np.maximum(radius, 15) ** 2, 0.05))

    mask, points = ring
    images = clip(motion, 12, SIZE)
    moved, quality = track(images, points, mask, SPACING, np.arange(12) * 5e-3, 0, BsplineCnn())
    true = motion(points, 6) - points
    assert np.sqrt(((moved[6] - true) ** 2).sum() / (true**2).sum()) < 0.2
    assert (moved[0] == 0).all() and (quality[0] == 1).all() and ((quality >= 0) & (quality <= 1)).all()


def test_phases_and_frames_of_a_cycle_are_turned_into_one_another():
    cycle = np.sin(2 * np.pi * np.arange(48) / 48)[:, None]
    np.testing.assert_allclose(over_phases(cycle), cycle[::2], atol=1e-12)
    np.testing.assert_allclose(over_frames(over_phases(cycle), 48), cycle, atol=0.01)


def test_wall_without_a_cavity_is_told(frames):
    with pytest.raises(TrackerFailed, match="surrounds no cavity"):
        found(frames, (np.ones((SIZE, SIZE), bool), np.array([[60.0, 60.0]])), BsplineCnn())


def test_two_frames_are_no_beat(frames, ring):
    mask, points = ring
    with pytest.raises(TrackerFailed, match="needs 6 frames or more; the clip has 2: take bspline_dic"):
        track(frames[[0, 3]], points, mask, SPACING, np.array([0, 15e-3]), 0, BsplineCnn())


def test_mirrored_clip_is_corrected_as_the_clip(frames, ring):
    network = read(WEIGHTS, len(CHANNELS))
    given = features(frames, ring)[0].channels
    other = given[..., MIRRORED]
    other[ODD] *= -1
    correction, deviation = seen_twice(network, given)
    mirrored, its_deviation = seen_twice(network, other)
    np.testing.assert_allclose(mirrored, correction[:, :, MIRRORED] * [1, -1], atol=1e-5)
    np.testing.assert_allclose(its_deviation, deviation[:, :, MIRRORED], rtol=1e-4)


def test_nothing_is_found_without_a_wall(frames):
    moved, quality = found(frames, (np.zeros((SIZE, SIZE), bool), np.array([[60.0, 60.0]])), BsplineCnn())
    assert np.isnan(moved).all() and np.isnan(quality).all()


def test_clip_of_floating_point_is_tracked_as_that_of_8_bits(frames, ring):
    grey = frames.copy()
    grey[0, 0, :2] = 0, 255
    whole = grey.astype(np.float32) / 4
    np.testing.assert_allclose(features(whole, ring)[0].channels, features(grey, ring)[0].channels, atol=1e-3)


def test_points_that_are_nowhere_are_lost(frames, ring):
    mask, points = ring
    path, _ = found(frames, (mask, np.concatenate([points, [[np.nan, np.nan]]])), BsplineCnn())
    assert np.isnan(path[1:, -1]).all() and np.isfinite(path[:, :-1]).all()


def test_file_of_weights_that_is_not_there_is_told(frames, ring):
    with pytest.raises(TrackerFailed, match=r"nowhere\.npz: holds no weights"):
        found(frames, ring, BsplineCnn(weights="nowhere.npz"))


BEAT = 12


def radius(place):
    return np.hypot(*(place - MIDDLE).T)[:, None]


def still(place, t):
    return place


def turning_by_layer(place, t):
    """Layers turn by up to 15 degrees at the endocardium and not at all at the epicardium."""
    angle = np.radians(15) * np.sin(np.pi * t / BEAT) ** 2 * np.clip((48 - radius(place)) / 26, 0, 1)
    lateral, axial = (place - MIDDLE).T[..., None]
    turned = lateral * np.cos(angle) - axial * np.sin(angle), lateral * np.sin(angle) + axial * np.cos(angle)
    return MIDDLE + np.concatenate(turned, 1)


def shrinking(place, t):
    """The wall gets thinner as it gets narrower."""
    return MIDDLE + (place - MIDDLE) * (1 - 0.15 * np.sin(np.pi * t / BEAT) ** 2)


def contracting(place, t, frames=BEAT):
    """The wall keeps its area and gets thicker; the radius of the cavity falls by 25 %."""
    square = radius(place) ** 2
    kept = np.maximum(square - (1 - 0.75**2) * 22**2 * np.sin(np.pi * t / frames) ** 2, 1)
    return MIDDLE + (place - MIDDLE) * np.sqrt(kept / np.maximum(square, 1))


@pytest.fixture(scope="module")
def beat(clip):
    """Clip of a ring of scatterers, of which the motion is exact, in much weaker ones."""

    def in_ring(place):
        return np.abs(radius(place)[:, 0] - 35) < 13

    return lambda motion, frames=BEAT: clip(motion, frames, SIZE, inside=in_ring)


def tracked(frames, ring, settings):
    mask, points = ring
    return track(frames, points, mask, SPACING, np.arange(len(frames)) * 5e-3, 0, settings)


def error(moved, motion, ring):
    return np.sqrt(((moved[BEAT // 2] - motion(ring[1], BEAT // 2) + ring[1]) ** 2).mean())


def test_still_wall_does_not_thicken(beat, ring):
    moved, quality = tracked(beat(still), ring, BsplineCnn())
    offset = ring[1] - MIDDLE
    distance = np.hypot(*offset.T)
    slope = np.polyfit(distance, (moved[BEAT // 2] * offset).sum(1) / distance, 1)[0]
    assert abs(slope) < 0.015 and quality.min() > 0.9


def test_scale_below_what_was_learned_counts_as_the_least(beat, ring):
    """Without, the network takes a wall that stands still for a systole of which nothing was tracked."""
    given, network = features(beat(still), ring)[0], read(WEIGHTS, len(CHANNELS))
    free = replace(network, least=np.full_like(network.least, -np.inf))
    clamped, unclamped = (np.abs(seen_twice(each, given.channels)[0]).max() for each in (network, free))
    assert clamped < 0.4 * unclamped


@pytest.mark.parametrize("motion", [turning_by_layer, shrinking])
def test_layers_that_turn_and_a_wall_that_thins_as_it_contracts_are_left_as_they_are_tracked(beat, ring, motion):
    frames = beat(motion)
    network, plain = (
        error(tracked(frames, ring, settings)[0], motion, ring) for settings in (BsplineCnn(), BsplineDic())
    )
    assert network <= 1.1 * plain
    uncorrected, _ = features(frames, ring)
    correction, _ = seen_twice(read(WEIGHTS, len(CHANNELS)), uncorrected.channels)
    assert uncorrected.scale * np.abs(correction).max() > 1, "the network alone would change it"


def test_healthy_heart_keeps_the_correction():
    hearts = et.sample()
    stored = hearts.scores.query("case == 'healthy' and view == 'mid' and tracker == 'bspline_dic'")
    found = et.evaluate(et.track(hearts.clip("healthy", "mid"), "bspline_cnn"), hearts.heart("healthy"))
    assert found["nrmse_percent"] < 0.85 * stored["nrmse_percent"].item()


@pytest.mark.parametrize(
    ("frames", "reason"),
    [
        (range(BEAT // 2 + 1), "the clip is no closed cycle, which"),
        ([*range(BEAT)] * 2, "the motion comes again after 12 frames, and the clip has 24, which"),
        (
            [0, 0, 1, 0, 0, 0, 0],
            "moves inwards by less than 10 % of its thickness, or thins by more than 3 %, which",
        ),
    ],
)
def test_clip_of_another_kind_than_it_has_learned_is_tracked_by_bspline_dic(beat, ring, frames, reason, caplog):
    images = beat(contracting)[frames]
    (moved, quality), (plain, its_quality) = (tracked(images, ring, each()) for each in (BsplineCnn, BsplineDic))
    np.testing.assert_array_equal(moved, plain)
    np.testing.assert_allclose(quality, its_quality, atol=0.1)
    assert f"{reason} the network does not know: tracked by bspline_dic" in caplog.text


def test_deviation_lies_between_those_of_network_and_bspline_dic(beat, ring, tmp_path, monkeypatch):
    frames = beat(contracting)
    _, plain = tracked(frames, ring, BsplineDic())
    file, once = weights(tmp_path / "unsure.npz", log_deviation=0.0), features(frames, ring)
    monkeypatch.setattr("echotruth.tracking.trackers.bspline_cnn.ray_features", lambda *_: once)
    found = {}
    for weight in (0.0, 0.5, 1.0):
        monkeypatch.setattr("echotruth.tracking.trackers.bspline_cnn.CORRECTION_WEIGHTS", (weight,))
        found[weight] = tracked(frames, ring, BsplineCnn(weights=file))[1][1:].mean()
    assert found[0.0] == pytest.approx(plain[1:].mean(), abs=0.05)
    assert found[1.0] < found[0.5] < found[0.0] - 0.1


@pytest.mark.parametrize(("too_much", "weight"), [(0.0, 1.0), (0.2, 0.5), (-0.4, 0.0)])
def test_images_weigh_a_correction_that_is_right_goes_too_far_or_the_wrong_way(beat, ring, too_much, weight):
    """A motion that is found to four fifths lacks a fifth; a correction has that and `too_much`."""
    frames = beat(contracting)
    found, _ = features(frames, ring)
    step = (0.2 + too_much) * found.rays.in_image(found.displacement)[:, :, found.rays.crosses]
    given = TrackerInput(frames, ring[1], ring[0], SPACING, np.arange(BEAT) * 5e-3, 0)
    assert correction_weight(given, replace(found, displacement=0.8 * found.displacement), step) == weight


def test_contraction_of_a_ring_is_that_of_its_formula_also_if_the_whole_ring_moves(beat, ring):
    found, _ = features(beat(contracting), ring)
    place = MIDDLE + np.array([[22 + 26 * depth, 0.0] for depth in (0.1, 0.5, 0.9)])
    shift = (contracting(place, BEAT // 2) - place)[:, 0]
    inwards, thickening = contraction(found)
    assert inwards == pytest.approx(-shift.mean() / 26, rel=0.1)
    assert thickening == pytest.approx((shift[2] - shift[0]) / (0.8 * 26), rel=0.15)
    moved = found.rays.along_and_across(np.broadcast_to([9.0, -4.0], found.displacement.shape))
    assert contraction(replace(found, displacement=found.displacement + moved)) == pytest.approx((inwards, thickening))
    thinner = contraction(features(beat(shrinking), ring)[0])
    assert thinner[0] > 0.1 and thinner[1] < -0.1
