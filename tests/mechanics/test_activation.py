"""The tension of a beating heart: of an earlier time where it is late, and by the length of its fibres."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from echotruth.mechanics.solver.activation import FALL_TIME, MAX_GAIN, RECOVERY_TIME, Activation, gain_after

FRAMES = 200
TIME = np.arange(FRAMES) / FRAMES  # beats
TWITCH = 1e5 * np.sin(np.pi * TIME) ** 2
HEALTHY = 1 - 0.15 * np.sin(np.pi * TIME) ** 2
SCALE, DELAY = np.array([1.0, 0.5, 1.0, 0.0]), np.array([0.0, 0.01, 0.1025, 0.1])


def driven(stretch, sensitivity=20.0, frames=FRAMES):
    """Tensions (frames, cells) of muscle whose stretch (frames, cells) is given, from the frame after the first on."""
    healthy = np.tile(HEALTHY[:, None], len(SCALE))
    muscle = Activation(TWITCH, healthy, SCALE, DELAY, sensitivity)
    return np.array([muscle.advance(frame, stretch[frame % FRAMES]) for frame in range(frames)])


def delayed(values, delay):
    return np.interp(TIME[:, None] - delay, TIME, values, left=values[0])


def test_muscle_that_follows_the_healthy_course_has_its_tension_later():
    unloaded = 1.1  # stretches count from end-diastole
    found = driven(unloaded * delayed(HEALTHY, DELAY), frames=2 * FRAMES)
    times = (np.arange(1, 2 * FRAMES + 1)[:, None] / FRAMES - DELAY) % 1
    np.testing.assert_allclose(found, SCALE * np.interp(times, TIME, TWITCH, period=1), rtol=1e-9, atol=1e-6)


def test_gain_is_the_solution_of_its_equation():
    """Of dg/dt = (exp(k D) - g) / tau, by an integrator of its own, for muscle that is stretched before it is active,
    shortens faster than the healthy one and is stretched again."""
    k = 12.0

    def difference(t):
        return 0.06 * np.sin(2 * np.pi * 1.7 * t) * np.exp(-t)

    def rate(t, g):
        goal = min(np.exp(k * difference(t)), MAX_GAIN)
        return (goal - g) / (FALL_TIME if goal < g[0] else RECOVERY_TIME)

    start = DELAY[2]
    first = min(np.exp(k * difference(start)), MAX_GAIN)
    exact = solve_ivp(rate, (start, 0.8), [first], rtol=1e-8, atol=1e-10, max_step=1e-3, dense_output=True).sol
    stretch = delayed(HEALTHY, DELAY) + difference(TIME)[:, None]
    frames = np.arange(int(start * FRAMES) + 4, 150)
    usual = np.interp(TIME[frames + 1] - start, TIME, TWITCH)
    found = driven(stretch, k)[frames, 2] / usual
    # The gain of a frame is that of the stretch in the frame before, half a frame off in the mean.
    np.testing.assert_allclose(found, exact(TIME[frames + 1])[0], atol=0.04)
    assert found.min() < 0.75 and found.max() > 1.3


def test_gain_falls_soon_and_hardly_recovers_in_the_beat():
    time = np.array([0.01, 0.04, 0.2])
    np.testing.assert_allclose(gain_after(1.0, 0.4, time), 0.4 + 0.6 * np.exp(-time / 0.04))
    assert np.all(gain_after(0.4, 1.0, time) < 0.48)
    assert gain_after(1.0, 0.4, 0.2) < 0.41


def test_muscle_that_is_stretched_before_it_is_active_begins_stronger():
    stretch = np.tile(delayed(HEALTHY, DELAY), 1)
    stretch[: int(DELAY[2] * FRAMES)] += 0.05
    stretch[0] -= 0.05
    frame = int(DELAY[2] * FRAMES) + 1  # its first tension
    usual, found = driven(delayed(HEALTHY, DELAY))[frame - 1], driven(stretch)[frame - 1]
    assert found[2] == pytest.approx(np.exp(20 * 0.05) * usual[2], rel=0.12)
    np.testing.assert_allclose(driven(stretch - 1.0 + 1.2)[frame - 1, 3], 0)


def test_every_beat_begins_anew():
    stretch = np.clip(delayed(HEALTHY, DELAY) - 0.05 * np.sin(np.pi * TIME)[:, None], 0.7, None)
    found = driven(stretch, frames=2 * FRAMES)
    np.testing.assert_allclose(found[:FRAMES], found[FRAMES:], rtol=1e-12)
