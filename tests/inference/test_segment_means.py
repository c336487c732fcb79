"""Means of segments."""

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
    config = et.configure(geometry=COARSE, mechanics={"regional": {"preset": "even", "contractility": given}})
    body = wall(config, left_ventricle(config.geometry))
    from echotruth.aha import segment

    nodes, cells = body.mesh.nodes, body.mesh.cells
    number = segment(nodes[cells[:, :4]].mean(axis=1), nodes[body.mesh.endo, 2].min())
    due, volume = means_of_cells(nodes, cells, number, body.tissue.tension_scale)
    shown = means.number - 1
    np.testing.assert_allclose(means.means(np.stack([FACTORS, 2 * FACTORS]))[1], 2 * due[shown], rtol=1e-12)
    np.testing.assert_allclose(means.share, volume[shown] / volume.sum(), rtol=1e-12)
