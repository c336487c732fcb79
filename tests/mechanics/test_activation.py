"""Delayed tension is the tension of an earlier time."""

import numpy as np
import pytest

from echotruth.mechanics.solver.activation import Activation

STEP = 3e-3
DELAYS = np.array([0.0, 0.4, 1.0, 2.5, 9.0]) * STEP
T_CA = [0.0, 5e3, 18e3, 32e3, 41e3]


@pytest.fixture
def activation():
    return Activation(np.array([1.0, 1.0, 1.0, 1.0, 0.5]), DELAYS, STEP)


def test_tension_is_that_of_the_time_less_the_delay(activation):
    time = np.arange(len(T_CA)) * STEP
    by_hand = [np.interp(time[-1] - delay, time, T_CA, left=0.0) for delay in DELAYS]
    np.testing.assert_allclose(activation.tension(T_CA), np.array(by_hand) * activation.scale)


def test_tension_of_this_frame_and_of_earlier_ones_adds_up_to_the_tension(activation):
    present = T_CA[-1] * activation.tension_fraction() + activation.tension([*T_CA[:-1], 0.0])
    np.testing.assert_allclose(present, activation.tension(T_CA))


def test_infarct_bears_its_part_and_nothing_is_active_before_the_beat(activation):
    assert activation.tension([1e3])[-1] == 0
    infarct = Activation(np.array([0.0]), np.array([0.0]), STEP)
    assert infarct.tension_fraction() == 0
    assert infarct.tension(T_CA) == 0
