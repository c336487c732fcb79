"""Delayed tension is the tension of an earlier time."""

import numpy as np
import pytest

from echotruth.mechanics.solver.activation import Activation

STEP = 3e-3
DELAYS = np.array([0.0, 0.4, 1.0, 2.5, 9.0]) * STEP
COURSE = [0.0, 5e3, 18e3, 32e3, 41e3]


@pytest.fixture
def activation():
    return Activation(np.array([1.0, 1.0, 1.0, 1.0, 0.5]), DELAYS, STEP)


def test_tension_is_that_of_the_time_less_the_delay(activation):
    time = np.arange(len(COURSE)) * STEP
    by_hand = [np.interp(time[-1] - delay, time, COURSE, left=0.0) for delay in DELAYS]
    np.testing.assert_allclose(activation.tension(COURSE), np.array(by_hand) * activation.scale)


def test_share_of_the_present_and_what_is_past_add_up_to_the_tension(activation):
    present = COURSE[-1] * activation.share() + activation.before(COURSE[:-1])
    np.testing.assert_allclose(present, activation.tension(COURSE))


def test_infarct_bears_its_part_and_nothing_is_active_before_the_beat(activation):
    assert activation.tension([1e3])[-1] == 0
    infarct = Activation(np.array([0.0]), np.array([0.0]), STEP)
    assert infarct.share() == 0
    assert infarct.tension(COURSE) == 0
