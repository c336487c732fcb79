"""Requirements of every tracker that knows nothing of hearts."""

import os
import subprocess
import sys

import numpy as np
import pytest

from echotruth.config.tracking import METHODS, OUTSIDE, BsplineCnn, PhaseCorrelation, name_of
from echotruth.tracking import track

SPACING = 3e-5
SHAPE = (160, 120)
CENTRE = np.array([59.5, 79.5])
CORRECTED = {"window_px": 48, "taper": "hann", "reference": "previous"}
"""Options that phase correlation needs for motion that varies in space."""


# bspline_cnn has learned of hearts, and needs the ring of a wall.
@pytest.fixture(params=[method for method in METHODS if method not in (*OUTSIDE, BsplineCnn)], ids=name_of)
def tracker(request):
    return request.param(**CORRECTED if request.param is PhaseCorrelation else {})


STEP = np.array([1.5, 0.5])
CYCLE = np.array([2.8, -5.2])


@pytest.fixture(scope="module")
def clips(clip):
    """Clips of images higher than wide: of a cycle of shifts, of turn and stretch, and of equal steps."""
    motions = {
        "cycle": (4, lambda place, t: place + beat(t, 4) * CYCLE),
        "turn": (10, lambda place, t: CENTRE + (place - CENTRE) @ gradient(t)),
        "steps": (3, lambda place, t: place + t * STEP),
    }
    made = {name: np.ascontiguousarray(clip(m, n)[:, :, : SHAPE[1]]) for name, (n, m) in motions.items()}
    for frames in made.values():
        frames.setflags(write=False)
    return made


def points():
    """Points farther from the border than a window."""
    lateral, axial = np.meshgrid(np.arange(30.0, 91, 12.5), np.arange(30.0, 131, 12.5))
    return np.stack([lateral, axial], -1).reshape(-1, 2)


def found(frames, tracker, places=None):
    places = points() if places is None else places
    return track(frames, places, np.ones(frames.shape[1:], bool), SPACING, np.arange(len(frames)) * 3e-3, 0, tracker)


def rms(error):
    return np.sqrt((error**2).sum(-1).mean())


def beat(t, frames):
    """From 0 at end-diastole to 1 half-way and back."""
    return np.sin(np.pi * t / frames) ** 2


def gradient(t):
    angle, stretch = 0.36 * beat(t, 10), np.diag([1, 1 + 0.1 * beat(t, 10)])
    return stretch @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])


def test_shift_is_lateral_then_axial_and_positive_for_motion_of_the_tissue(clips, tracker):
    moved, quality = found(clips["cycle"], tracker)
    assert moved.shape == (4, len(points()), 2) and quality.shape == moved.shape[:2]
    assert (moved[0] == 0).all() and (quality[0] == 1).all()
    np.testing.assert_allclose(np.median(moved[2], axis=0), CYCLE, atol=0.3)
    assert rms(moved[2] - CYCLE) < 0.5
    assert quality.min() >= 0 and quality.max() <= 1


def test_turn_and_stretch_are_found_and_read_where_the_tissue_is(clips, tracker):
    """Steps of a rotation measured at the initial position of a point would add up along the tangent."""
    arm = points() - CENTRE
    arm = arm[np.hypot(*arm.T) < 45]
    moved, _ = found(clips["turn"], tracker, CENTRE + arm)
    # Windows with enough speckle for phase correlation are too wide to resolve so fast a rotation.
    tolerance = 0.15 if tracker.method == "phase_correlation" else 0.02
    np.testing.assert_allclose(np.linalg.lstsq(arm, moved[5])[0], gradient(5) - np.eye(2), atol=tolerance)


@pytest.mark.parametrize("value", [0, np.nan])
def test_clip_without_texture_has_no_displacement(tracker, value):
    frames = np.full((2, *SHAPE), value, float if np.isnan(value) else np.uint8)
    moved, quality = found(frames, tracker)
    assert np.isnan(moved[1:]).all() and np.isnan(quality[1:]).all()


@pytest.mark.parametrize("patch", ["black", "faint", "nan"])
def test_place_without_texture_has_no_displacement_and_the_rest_has(clips, tracker, patch):
    """Rounding leaves noise of half a grey level of a signal below the resolution of 8 bits (faint)."""
    frames = clips["steps"][:2].astype(float)
    random = np.random.default_rng(3)
    frames[:, :80] = {"black": 0, "nan": np.nan}.get(patch, 90 + (random.uniform(size=(2, 80, 120)) < 0.1))
    frames = frames if patch == "nan" else frames.astype(np.uint8)
    moved, quality = found(frames, tracker, np.array([[60.0, 30.0], [60.0, 125.0]]))
    assert np.isnan(moved[1, 0]).all() and np.isnan(quality[1, 0])
    np.testing.assert_allclose(moved[1, 1], [1.5, 0.5], atol=0.3)


def test_points_outside_the_image_have_no_displacement(clips, tracker):
    outside = np.array([[-40.0, 50.0], [50.0, 300.0], [1e9, -1e9], [np.nan, 50.0], [60.0, 80.0]])
    moved, _ = found(clips["steps"][:2], tracker, outside)
    assert np.isnan(moved[1, :4]).all() and np.isfinite(moved[1, 4]).all()


def test_no_points_are_no_displacement(clips, tracker):
    moved, quality = found(clips["steps"][:2], tracker, np.zeros((0, 2)))
    assert moved.shape == (2, 0, 2) and quality.shape == (2, 0)


def test_one_frame_is_refused(clips, tracker):
    with pytest.raises(ValueError, match="two or more frames"):
        found(clips["steps"][:1], tracker)


@pytest.mark.parametrize(
    "changed, message",
    [
        ({"frames": np.zeros((80, 80))}, "two or more frames"),
        ({"points": np.zeros((1, 3))}, r"shape \(point, 2\), not \(1, 3\)"),
        ({"mask": np.ones((80, 70), bool)}, "shape of a frame"),
        ({"spacing": 0.0}, "positive length in metres, not 0.0"),
        ({"frame_time": np.array([1.0, 1.0])}, "2 increasing times"),
    ],
)
def test_invalid_input_is_refused(changed, message):
    arguments = {
        "frames": np.zeros((2, 80, 80)),
        "points": np.zeros((1, 2)),
        "mask": np.ones((80, 80), bool),
        "spacing": SPACING,
        "frame_time": np.arange(2.0),
        "seed": 0,
    }
    with pytest.raises(ValueError, match=message):
        track(**arguments | changed, settings=PhaseCorrelation())


@pytest.mark.parametrize("kind", [np.int16, np.float32])
def test_any_real_type_of_grey_value_gives_the_same_motion(clips, tracker, kind):
    frames = clips["steps"][:2].copy()
    frames[:, 0, 0], frames[:, 0, 1] = 0, 255
    np.testing.assert_allclose(found(frames.astype(kind), tracker)[0], found(frames, tracker)[0], atol=2e-3)


def test_same_input_gives_the_same_bytes_and_is_not_changed(clips, tracker):
    """Neither frames nor points can be written to."""
    places = points()
    places.setflags(write=False)
    results = [b"".join(array.tobytes() for array in found(clips["steps"], tracker, places)) for _ in range(2)]
    assert results[0] == results[1]


LOOK = """
import numpy as np
from threadpoolctl import threadpool_info
from echotruth.config.tracking import BsplineDic
from echotruth.tracking import tracker

def look(clip, settings):
    print(*(library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"))
    raise ValueError

tracker.tracked_path = look
frames, mask = np.zeros((2, 64, 64)), np.ones((64, 64), bool)
try:
    tracker.track(frames, np.zeros((1, 2)), mask, 3e-5, np.arange(2.0), 0, BsplineDic())
except tracker.TrackerFailed:
    pass
"""


def test_blas_of_numpy_and_scipy_runs_on_one_thread_while_a_method_tracks():
    """In a process of its own, as SciPy's is loaded only by the method."""
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "2"}
    run = subprocess.run([sys.executable, "-c", LOOK], env=environment, check=True, stdout=subprocess.PIPE, text=True)
    assert len(run.stdout.split()) >= 2 and set(run.stdout.split()) == {"1"}
