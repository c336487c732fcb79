"""Means of segments and their derivatives."""

import numpy as np
import pytest

import echotruth as et
from echotruth.inference.segment_means import SegmentMeans, means_of_cells
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.solver.wall import wall

COARSE = {"circumferential_elements": 12, "longitudinal_elements": 6, "transmural_elements": 1}
FACTORS = np.random.default_rng(1).uniform(0.3, 1.5, 17)


@pytest.fixture(scope="module")
def means():
    return SegmentMeans.of(et.configure(geometry=COARSE))


def test_means_are_those_of_the_tissue_that_a_configuration_makes(means):
    given = {str(number): float(factor) for number, factor in enumerate(FACTORS, 1)}
    config = et.configure(geometry=COARSE, mechanics={"regional": {"contractility": given}})
    body = wall(config, left_ventricle(config.geometry))
    from echotruth.aha import segment

    nodes, cells = body.mesh.nodes, body.mesh.cells
    number = segment(nodes[cells[:, :4]].mean(axis=1), nodes[body.mesh.endo, 2].min())
    due, volume = means_of_cells(nodes, cells, number, body.tissue.tension_scale)
    shown = means.number - 1
    np.testing.assert_allclose(means.weights @ FACTORS, due[shown], rtol=1e-12)
    np.testing.assert_allclose(means.relative(FACTORS)[0] @ volume[shown] / volume.sum(), 1, rtol=1e-12)


@pytest.mark.parametrize("name", ["relative", "log_relative", "log_mean", "log_geometric_mean"])
def test_derivatives_are_those_of_differences_and_a_common_factor_cancels(means, name):
    function, step = getattr(means, name), 1e-6
    value, slope = function(FACTORS)
    for column in range(17):
        moved = step * np.eye(17)[column]
        difference = (np.asarray(function(FACTORS + moved)[0]) - function(FACTORS - moved)[0]) / (2 * step)
        np.testing.assert_allclose(np.asarray(slope)[..., column], difference, rtol=1e-6, atol=1e-8)
    common = 0.0 if name.endswith("relative") else np.log(3)
    np.testing.assert_allclose(function(3 * FACTORS)[0], value + common, rtol=1e-12, atol=1e-12)
