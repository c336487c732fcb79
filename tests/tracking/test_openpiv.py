"""The example of an external tracker."""

import sys
from pathlib import Path

import numpy as np
import pytest

from echotruth.config.tracking import External
from echotruth.tracking import track

pytest.importorskip("openpiv")
EXAMPLES = Path(__file__).parents[2] / "examples"


def motion(place, t):
    """Positions (lateral, axial; px) after t rotations by 1.5 degrees about a point that is shifted."""
    turn, middle = np.radians(1.5 * t), np.array([80, 80])
    matrix = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    return (place - middle) @ matrix.T + middle + t * np.array([1.3, -0.6])


def test_openpiv_follows_a_turn_and_a_shift_of_speckle_to_a_fifth_of_a_pixel(clip, monkeypatch):
    monkeypatch.syspath_prepend(EXAMPLES)
    sys.modules.pop("openpiv_tracker", None)
    frames, along = clip(motion, 4), np.arange(40, 121, 10.0)
    points = np.stack(np.meshgrid(along, along), axis=-1).reshape(-1, 2)
    given = (frames, points, np.ones(frames.shape[1:], bool), 12e-3 / 512, np.arange(4) * 1e-3, 1)
    displacement, quality = track(*given, External(track="openpiv_tracker:track"))
    true = np.stack([motion(points, t) - points for t in range(4)])
    assert np.hypot(*true[-1].T).mean() > 4
    assert np.sqrt(((displacement - true) ** 2).sum(-1).mean(-1)).max() < 0.2
    assert (quality == 1).all()
