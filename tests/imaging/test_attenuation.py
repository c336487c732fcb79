"""Attenuation in products of time and frequency."""

import numpy as np

from echotruth.imaging.rf.attenuation import separable_damping


def test_few_products_are_the_damping_of_every_frequency_at_every_time():
    rate = 2.0 * np.log(10) / 20 * 1e-4 * np.linspace(-16e6, 16e6, 200) * 1540
    time = np.linspace(0, 17e-6, 1500)
    damping, filters = separable_damping(rate, time)
    exact = np.exp(-np.outer(rate, time))
    assert np.linalg.norm(filters.T @ damping - exact) < 1e-5 * np.linalg.norm(exact)
    assert len(damping) < 14


def test_without_loss_one_product_is_enough():
    damping, filters = separable_damping(np.zeros(20), np.linspace(0, 1, 30))
    assert len(damping) == 1
    np.testing.assert_allclose(filters.T @ damping, 1)
