import numpy as np

from echotruth.tracking.bidirectional import combined_variance, forward_backward, inverse_variance_weight, weighted_mean


def test_both_directions_begin_at_end_diastole_and_are_their_own_inverse():
    forward, backward = forward_backward(5)
    assert forward == [0, 1, 2, 3, 4] and backward == [0, 4, 3, 2, 1]
    np.testing.assert_array_equal(np.array(backward)[backward], forward)


def test_mean_of_two_values_has_the_least_variance_with_their_weight():
    first, second = np.array([1.0, 2.0, 0.0]), np.array([3.0, 2.0, 4.0])
    best = inverse_variance_weight(first, second)
    np.testing.assert_allclose(best, [0.75, 0.5, 1.0])

    def variance(weight):
        return weight**2 * first + (1 - weight) ** 2 * second

    for other in np.linspace(0, 1, 11):
        assert (variance(best) <= variance(other) + 1e-15).all()


def test_variance_of_the_mean_is_the_least_and_that_of_the_other_value_where_one_is_missing():
    first, second = np.array([1.0, 2.0, 0.0, np.inf, np.inf, 0.0]), np.array([3.0, 2.0, 4.0, 5.0, np.inf, 0.0])
    np.testing.assert_allclose(combined_variance(first, second), [0.75, 1.0, 0.0, 5.0, np.inf, 0.0])


def test_missing_value_has_no_weight_in_the_mean():
    weight = inverse_variance_weight(np.array([np.inf, 1.0, np.inf, 0.0]), np.array([1.0, np.inf, np.inf, 0.0]))
    np.testing.assert_array_equal(weight, [0.0, 1.0, 0.5, 0.5])
    mean = weighted_mean(weight, np.array([np.nan, 2.0, np.nan, 1.0]), np.array([5.0, np.nan, 1.0, 3.0]))
    np.testing.assert_array_equal(mean, [5.0, 2.0, np.nan, 2.0])
