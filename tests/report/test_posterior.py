"""The corner plot of what was inferred of a heart."""

import numpy as np
import pytest

from echotruth.report import posterior
from echotruth.repository.schema import LABELS

NAMES = list(LABELS["parameter"])
SHOWN = ["contractility.8", "active_tension_kPa"]


def fit(**changes):
    """A fit in which all is as uncertain as before, but for what is given: mean, standard deviation, identifiable."""
    size = len(NAMES)
    found = {"mean": np.ones(size), "sd": np.ones(size), "prior_sd": np.ones(size), "identifiable": np.zeros(size)}
    for name, (mean, sd, known) in changes.items():
        at = NAMES.index(name)
        found["mean"][at], found["sd"][at], found["identifiable"][at] = mean, sd, known
    return found


def test_weakest_identifiable_segment_is_shown_with_those_beside_it_and_what_was_learned_of_the_wall():
    known = {"contractility.7": (0.4, 0.2, 1), "contractility.9": (0.9, 0.1, 1), "contractility.2": (0.1, 0.9, 0)}
    wall = {"active_tension_kPa": (50.0, 0.3, 1), "fibres.epi_deg": (-40.0, 0.6, 1), "loop.edv_uL": (45.0, 0.5, 1)}
    assert posterior.chosen(fit(**known, **wall)) == [
        *("contractility.7", "contractility.12", "contractility.8"),
        *("active_tension_kPa", "loop.edv_uL", "fibres.epi_deg"),
    ]


def test_weakest_segment_of_all_is_shown_where_none_is_identifiable_and_nothing_that_was_not_inferred():
    found = fit(**{"contractility.17": (0.5, 0.9, 0), "fibres.endo_deg": (np.nan, np.nan, 0)})
    chosen = posterior.chosen(found)
    assert chosen[0] == "contractility.17" and "fibres.endo_deg" not in chosen and len(chosen) == 1 + posterior.OF_WALL


def test_areas_hold_as_many_draws_as_they_say():
    random = np.random.default_rng(1)
    edges = np.linspace(-5, 5, posterior.BINS + 1)
    counts = np.histogram2d(*random.normal(size=(2, 20_000)), bins=edges)[0]
    # Of independent normal numbers, a circle holds the share 1 - exp(-r^2 / 2).
    inside = [counts[counts >= level].sum() / counts.sum() for level in posterior._levels(counts)]
    np.testing.assert_allclose(inside, posterior.PROBABLE, atol=0.02)
    area = np.sum(counts >= posterior._levels(counts)[0]) * (edges[1] - edges[0]) ** 2
    assert area == pytest.approx(-2 * np.pi * np.log(1 - posterior.PROBABLE[0]), rel=0.1)


def test_figure_marks_true_values_and_outlines_the_prior():
    random = np.random.default_rng(1)
    after, before = random.normal([0.5, 60], [0.05, 3], (512, 2)), random.normal([1, 50], [0.5, 20], (512, 2))
    figure = posterior.draw(SHOWN, after, before, np.array([0.9, np.nan]))
    panels = np.reshape(figure.axes, (2, 2))
    (true,) = panels[0, 0].lines
    assert true.get_xdata()[0] == 0.9 and not panels[1, 1].lines
    low, high = panels[0, 0].get_xlim()
    assert low < np.quantile(before[:, 0], 0.02) and high > np.quantile(before[:, 0], 0.98)
    assert [bool(panel.collections) for panel in panels.ravel()] == [False, False, True, False]
    assert "of segment 8" in panels[1, 0].get_xlabel() and "tension" in panels[1, 0].get_ylabel()


def test_parameter_that_is_the_same_in_all_draws_is_drawn():
    figure = posterior.draw(SHOWN, np.tile([0.0, 50.0], (512, 1)), np.tile([0.0, 50.0], (512, 1)), np.full(2, np.nan))
    figure.draw_without_rendering()
