"""Matrix products against those in double precision."""

import numpy as np
import pytest

from echotruth.imaging.rf.product import WIDTH, product


def matrices(count, height, width, more=0):
    random = np.random.default_rng(0)
    weights, rows = (random.standard_normal((count, size + more), dtype=np.float32) for size in (height, width))
    return weights, rows, np.full((height, width), np.nan, np.float32)


@pytest.mark.parametrize(
    "count, height, width, more", [(1, 4, 16, 0), (19, 20, 64, 0), (48, 4, 96, 16), (128, 64, 32, 3)]
)
def test_a_product_is_that_of_the_matrices(count, height, width, more):
    weights, rows, found = matrices(count, height, width, more)
    product(weights, rows, found)
    exact = weights[:, :height].astype(float).T @ rows[:, :width]
    assert np.linalg.norm(found - exact) < 1e-6 * np.linalg.norm(exact)


def test_half_a_product_has_all_columns_from_the_row_on():
    weights, rows, found = matrices(24, 64, 64)
    product(weights, rows, found, True)
    exact = weights.astype(float).T @ rows
    upper = np.triu_indices(64)
    assert found[upper] == pytest.approx(exact[upper], abs=1e-4)
    assert np.isnan(found[WIDTH:, 0]).all()
