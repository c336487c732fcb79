"""Interpolation in time, against functions whose values are known."""

import numpy as np
import pytest

from echotruth.mechanics.motion_file.cycle import periodic_weights


@pytest.mark.parametrize("frames, recorded", [(8, 8), (4, 8), (18, 54)])
def test_recorded_frames_are_taken_as_they_are(frames, recorded):
    weights = periodic_weights(np.arange(recorded) / recorded, frames)
    np.testing.assert_array_equal(weights, np.eye(recorded)[:: recorded // frames])


def test_interpolation_of_a_periodic_function_converges_with_the_fourth_power():
    errors = []
    for recorded in (10, 20, 40):
        phase = (np.arange(recorded) + 0.2 * np.sin(2 * np.pi * np.arange(recorded) / recorded)) / recorded
        found = periodic_weights(phase, 64) @ np.sin(2 * np.pi * phase)
        errors.append(np.abs(found - np.sin(2 * np.pi * np.arange(64) / 64)).max())
    rates = np.log2(np.divide(errors[:-1], errors[1:]))
    assert (rates > 3.5).all()


@pytest.mark.parametrize("recorded", [2, 3, 7])
def test_what_does_not_move_stays(recorded):
    weights = periodic_weights(np.arange(recorded) / recorded, 16)
    np.testing.assert_allclose(weights.sum(axis=1), 1, rtol=0, atol=1e-14)
