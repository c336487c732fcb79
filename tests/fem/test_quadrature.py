"""Quadrature against the integrals of monomials."""

from itertools import product
from math import factorial

import numpy as np
import pytest

from echotruth.fem import quadrature


@pytest.mark.parametrize(("rule", "degree"), [(quadrature.tetrahedron, 5), (quadrature.triangle, 4)])
def test_rule_is_exact_to_its_degree(rule, degree):
    xi, weight = rule()
    assert weight.min() > 0
    for powers in product(range(degree + 1), repeat=xi.shape[1]):
        if sum(powers) > degree:
            continue
        exact = np.prod([factorial(n) for n in powers]) / factorial(sum(powers) + xi.shape[1])
        assert np.sum(weight * np.prod(xi**powers, axis=1)) == pytest.approx(exact, rel=1e-13)
