import numpy as np

from echotruth.tracking.bidirectional import combined_variance, inverse_variance_weight, weighted_mean


def test_variance_of_the_mean_is_the_least_and_that_of_the_other_value_where_one_is_missing():
    first, second = np.array([1.0, 2.0, 0.0, np.inf, np.inf, 0.0]), np.array([3.0, 2.0, 4.0, 5.0, np.inf, 0.0])
    np.testing.assert_allclose(combined_variance(first, second), [0.75, 1.0, 0.0, 5.0, np.inf, 0.0])


def test_missing_value_has_no_weight_in_the_mean():
    weight = inverse_variance_weight(np.array([np.inf, 1.0, np.inf, 0.0]), np.array([1.0, np.inf, np.inf, 0.0]))
    np.testing.assert_array_equal(weight, [0.0, 1.0, 0.5, 0.5])
    mean = weighted_mean(weight, np.array([np.nan, 2.0, np.nan, 1.0]), np.array([5.0, np.nan, 1.0, 3.0]))
    np.testing.assert_array_equal(mean, [5.0, 2.0, np.nan, 2.0])
