"""Every check of the page, on coarse meshes, within the tolerances of the page."""

import numpy as np
import pytest

from validation.page import CHECKS

SLOW = {"ventricle", "elastodynamics", "refinement", "inflation", "beam", "work", "indifference"}


def named(check):
    name = check.__name__.rsplit(".", 1)[-1]
    return pytest.param(check, id=name, marks=[pytest.mark.slow] if name in SLOW else [])


@pytest.mark.parametrize("check", [named(check) for check in CHECKS])
def test_numbers_are_within_their_tolerances(check):
    results = check.measure(quick=True)
    missed = {row.quantity: row.found for row in check.report(results).rows if not row.met}
    assert not missed
    if hasattr(check, "draw"):
        figure = check.draw(results)
        figure.canvas.draw()
        assert np.asarray(figure.canvas.buffer_rgba())[..., :3].min() < 128
