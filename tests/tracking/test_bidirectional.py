import numpy as np

from echotruth.tracking.bidirectional import blend, share, ways


def test_both_ways_begin_at_end_diastole_and_their_order_is_its_own_inverse():
    forward, backward = ways(5)
    assert forward == [0, 1, 2, 3, 4] and backward == [0, 4, 3, 2, 1]
    np.testing.assert_array_equal(np.array(backward)[backward], forward)


def test_mean_of_two_values_varies_least_with_their_share():
    ours, theirs = np.array([1.0, 2.0, 0.0]), np.array([3.0, 2.0, 4.0])
    best = share(ours, theirs)
    np.testing.assert_allclose(best, [0.75, 0.5, 1.0])

    def variance(weight):
        return weight**2 * ours + (1 - weight) ** 2 * theirs

    for other in np.linspace(0, 1, 11):
        assert (variance(best) <= variance(other) + 1e-15).all()


def test_value_that_is_not_there_has_no_part_in_the_mean():
    weight = share(np.array([np.inf, 1.0, np.inf, 0.0]), np.array([1.0, np.inf, np.inf, 0.0]))
    np.testing.assert_array_equal(weight, [0.0, 1.0, 0.5, 0.5])
    mean = blend(weight, np.array([np.nan, 2.0, np.nan, 1.0]), np.array([5.0, np.nan, 1.0, 3.0]))
    np.testing.assert_array_equal(mean, [5.0, 2.0, np.nan, 2.0])
