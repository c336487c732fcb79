"""Draws of posteriors that are known, and the values that follow from them."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import kstest, norm, truncnorm

import echotruth as et
from echotruth.inference import modes
from echotruth.inference.draws import MATERIAL, TENSION, normal_within, of_posterior, of_prior, standard_normal
from echotruth.inference.laplace import Posterior, Prediction
from echotruth.inference.modes import Mode, Modes, weights
from echotruth.inference.parameters import (
    CONTRACTILITY,
    parameters,
    prior_of,
    scar_parameters,
)
from echotruth.inference.segment_means import SegmentMeans

COARSE = {"circumferential_elements": 12, "longitudinal_elements": 6, "transmural_elements": 1}
LOOP = {"edp_mmHg": 5.0, "esp_mmHg": 100.0, "edv_uL": 45.0, "esv_uL": 20.0}
CONFIG = et.configure(geometry=COARSE, loop=LOOP)
FREE = parameters(CONFIG, {})
SCARRED = (8, 9)
SEEN = 3
"""Number of observations."""


@pytest.fixture(scope="module")
def segments():
    return SegmentMeans.of(CONFIG)


def mode(scarred=(), log_evidence=0.0, sd=0.1, seen=(8, 9, 10), promised=0.0):
    """A mode at the mean of the prior, of which each parameter is known to a share of its prior."""
    free = scar_parameters(FREE, scarred) if scarred else FREE
    prior = prior_of(free)
    there = Prediction(np.zeros(SEEN), np.zeros((SEEN, len(free))), np.log([1e3, 50e3]), np.zeros((2, len(free))))
    found = Posterior(
        mean=prior.mean,
        covariance=np.diag((sd * prior.sd) ** 2),
        start=there,
        prediction=there,
        log_evidence=log_evidence,
        promised=promised,
        misfit=0.5,
        steps=1,
    )
    return Mode(scarred, free, SimpleNamespace(aha=list(seen)), found)


def test_columns_are_standard_normal_and_do_not_depend_on_each_other():
    drawn = standard_normal(512, 8, np.random.default_rng(1))
    for column in drawn.T:
        assert kstest(column, "norm").statistic < 1 / 512 + 1e-12  # as close as 512 numbers can be
    assert np.abs(np.corrcoef(drawn.T) - np.eye(8)).max() < 0.15


def test_weight_of_a_mode_is_its_evidence_times_the_odds_of_its_scars():
    found = [mode(log_evidence=-20.0), mode((8,), -17.0), mode(SCARRED, -14.0)]
    odds = np.exp([-20.0, -17.0, -14.0]) * (0.1 / 0.9) ** np.arange(3)
    np.testing.assert_allclose(weights(found), odds / odds.sum(), rtol=1e-12)


@pytest.mark.parametrize(
    ("other", "missed", "due"),
    [
        ({"log_evidence": 0.0}, [], True),
        ({"log_evidence": 0.0, "promised": 0.2}, [], False),
        ({"log_evidence": -4.0, "promised": 0.2}, [], True),
        ({"log_evidence": -4.0, "promised": 8.0}, [], False),
        ({"log_evidence": -4.0}, [(9,)], False),
    ],
)
def test_modes_are_found_if_none_was_missed_and_each_search_ended_that_might_count(other, missed, due):
    assert Modes([mode(), mode((8,), **other)], missed).converged == due


def test_draws_are_of_both_modes_as_often_as_they_are_probable(segments):
    odds = float(np.log(0.75 / 0.25) - 2 * np.log(0.1 / 0.9))
    found, _ = of_posterior([mode(), mode(SCARRED, odds)], segments, np.eye(SEEN))
    np.testing.assert_array_equal(found.scar[:, 7], found.scar[:, 8])
    assert found.scar[:, 7].mean() == pytest.approx(0.75, abs=1 / 512) and not found.scar[:, 9].any()
    ratio = found.values["contractility.8"]
    scar = found.scar[:, 7]
    # A scar hardly contracts: half a normal distribution of a tenth of the prior's deviation. The rest is the wall.
    lost = segments.share[[number in SCARRED for number in segments.number]].sum()
    assert ratio[scar].mean() == pytest.approx(0.015 * np.sqrt(2 / np.pi) / (1 - lost), rel=0.1)
    assert ratio[~scar].mean() == pytest.approx(1, abs=0.02)
    stiff = found.values["stiffness.8"]
    assert np.median(stiff[scar]) > 8 and np.median(stiff[~scar]) == pytest.approx(1, abs=0.05)


def test_draws_at_a_bound_are_of_the_part_of_the_normal_distribution_within_it():
    free = [one for one in FREE if one.key in ("fibres.endo_deg", "fibres.epi_deg")]
    root = np.linalg.cholesky([[25.0, 15.0], [15.0, 25.0]])
    drawn = normal_within(np.array([88.0, -40.0]), root, free, 512, np.random.default_rng(1))
    part = truncnorm(-np.inf, (90 - 88) / 5, 88, 5)
    assert kstest(drawn[:, 0], part.cdf).pvalue > 0.01
    # What lies with it moves with it.
    assert drawn[:, 1].mean() == pytest.approx(-40 + 0.6 * (part.mean() - 88), abs=0.5)


def test_wall_has_the_mean_of_its_segments_in_every_draw(segments):
    found, _ = of_posterior([mode(), mode(SCARRED, 4.0)], segments, np.eye(SEEN))
    ratios = np.stack([found.values[f"contractility.{number}"] for number in segments.number], axis=1)
    np.testing.assert_allclose(ratios @ segments.share, 1, rtol=1e-12)
    stiff = np.stack([found.values[f"stiffness.{number}"] for number in segments.number], axis=1)
    np.testing.assert_allclose(np.log(stiff) @ segments.share, 0, atol=1e-12)
    assert (ratios >= 0).all() and (stiff > 0).all()


def test_quantiles_are_those_of_the_mixture(segments):
    """Of two modes that lie apart the quantiles are those of the sum of their distributions."""
    wide = mode(SCARRED, 4.0, sd=0.5)
    weight, place = weights([mode(sd=0.2), wide]), [one.key for one in wide.free].index("loop.esp_mmHg")
    pressure = wide.free[place]
    wide.found.mean[place] += pressure.sd
    found, seen = of_posterior([mode(sd=0.2), wide], segments, np.diag([1.0, 4.0, 9.0]))
    one, other = norm(pressure.mean, 0.2 * pressure.sd), norm(pressure.mean + pressure.sd, 0.5 * pressure.sd)
    for level in (0.05, 0.3, 0.6, 0.95):
        at = np.quantile(found.values[pressure.key], level)
        assert weight @ [one.cdf(at), other.cdf(at)] == pytest.approx(level, abs=0.02)
    np.testing.assert_allclose(seen.std(axis=0), [1, 2, 3], rtol=0.05)


def test_c_and_tension_follow_their_slopes_and_the_means_of_the_wall(segments):
    single = mode()
    column = [one.key for one in single.free].index("loop.esp_mmHg")
    single.found.prediction.derived_jacobian[1, column] = 0.1
    found, _ = of_posterior([single], segments, np.eye(SEEN))
    assert np.median(found.values[TENSION]) == pytest.approx(50, rel=0.02)
    assert np.median(found.values[MATERIAL]) == pytest.approx(1, rel=0.01)
    pressure = found.values["loop.esp_mmHg"]
    assert np.corrcoef(pressure, np.log(found.values[TENSION]))[0, 1] > 0.5


def test_prior_is_of_a_wall_without_a_scar_and_nothing_may_be_one_if_the_stiffness_is_known(segments):
    before = of_prior(mode(), segments)
    assert not before.scar.any() and before.values["contractility.8"].mean() == pytest.approx(1, abs=0.05)
    known = parameters(CONFIG, {"mechanics.regional.stiffness": None})
    assert mode().may_have_scar and not Mode((), known, mode().model, mode().found).may_have_scar


def test_what_was_seen_weak_may_be_a_scar_the_weakest_first(segments):
    single, mean = mode(), prior_of(FREE).mean.copy()
    for number, value in ((8, 0.3), (9, 0.5), (10, 0.9), (3, 0.1)):  # no view shows segment 3
        mean[[one.key for one in FREE].index(f"{CONTRACTILITY}.{number}")] = value
    weak = Mode((), FREE, single.model, Posterior(**{**vars(single.found), "mean": mean}))
    assert list(modes._candidates(weak, segments)) == [(8,), (8, 9)]
