"""Repeated frames and lengths that do not suit the wall are told; clips and settings as they should be are not."""

import numpy as np
import pytest

import echotruth as et
from echotruth.config.tracking import BsplineDic, Dis, WindowDeformation
from echotruth.tracking.plausibility import UNRELATED, consecutive_correlation, doubts, repeated, wall_thickness

FRAMES, SIZE = 8, 64


@pytest.fixture
def frames(clip):
    """Speckle that drifts, faster and slower, as over a cycle."""
    return clip(lambda place, t: place + 3 * np.sin(2 * np.pi * t / FRAMES), FRAMES, SIZE)


@pytest.fixture
def mask():
    """A straight wall, 20 px thick."""
    inside = np.zeros((SIZE, SIZE), bool)
    inside[20:40] = True
    return inside


def told(frames, mask, settings=None, spacing=0.85e-3 / 20):
    return doubts(frames, mask, spacing, settings or BsplineDic())


def test_clip_without_repetition_in_a_wall_that_the_lengths_suit_is_not_doubted(frames, mask):
    for settings in (BsplineDic(), WindowDeformation(), Dis()):
        assert told(frames, mask, settings) == []


def test_repeated_frames_are_named(frames, mask):
    found = told(frames[[0, 1, 2, 2, 3, 3, 3, 4, 5, 6, 7]], mask)
    assert found == [
        "3 of 11 frames show the same image as the one before (3, 5, 6): the tissue seems to halt there and to jump "
        "afterwards"
    ]


def test_frames_in_pairs_and_a_clip_that_stands_still_are_told(frames, mask):
    assert told(np.repeat(frames, 2, axis=0), mask)[0].startswith("every image comes twice: take one frame of each")
    assert told(np.repeat(frames, 2, axis=0)[1:], mask)[0].startswith("every image comes twice")
    assert told(frames[[0, 0, 0]], mask) == ["all frames show the same image: nothing moves"]


def test_what_changes_beside_the_wall_makes_no_frame_another(frames, mask):
    marked = frames[[0, 1, 1, 2, 3, 4]].copy()
    marked[2, -5:] = 255
    assert np.flatnonzero(repeated(marked, mask)).tolist() == [2]
    assert not repeated(marked, np.zeros_like(mask)).any()


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        (BsplineDic(), "knots_mm = 0.4 suits a wall 0.85 mm thick, and this one has 8.5 mm: give about 4"),
        (WindowDeformation(), "windows_mm = 0.75 suits a wall 0.85 mm thick, and this one has 8.5 mm: give about 7.5"),
    ],
)
def test_lengths_of_a_mouse_do_not_suit_the_wall_of_a_human_heart(frames, mask, settings, sentence):
    assert told(frames, mask, settings, spacing=8.5e-3 / 20)[0].startswith(sentence)


def test_lengths_of_a_human_heart_do_not_suit_a_mouse(frames, mask):
    assert (
        "knots_mm = 4 suits a wall 8.5 mm thick, and this one has 0.85 mm"
        in told(frames, mask, BsplineDic(knots_mm=4))[0]
    )


@pytest.mark.parametrize("case", ["healthy", "infarct"])
@pytest.mark.parametrize("view", ["mid", "long_axis"])
def test_no_heart_is_taken_for_noise(case, view):
    clip = et.sample().clip(case, view).transpose("frame", "axial", "lateral", ...)
    assert consecutive_correlation(clip["image"].values[::2], clip["mask"].values[0].astype(bool)) > 2 * UNRELATED


def test_wall_is_as_thick_as_it_was_drawn(mask):
    assert wall_thickness(mask) == pytest.approx(20, abs=1)
