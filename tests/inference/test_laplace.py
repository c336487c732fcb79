"""The mode and the spread of posteriors that are known."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import minimize
from scipy.stats import kstest, multivariate_normal, norm

from echotruth.inference.laplace import NoMode, Prediction, Prior, posterior

FREE = {"lower": np.full(3, -np.inf), "upper": np.full(3, np.inf)}
PRIOR = Prior(mean=np.array([1.0, -2.0, 30.0]), sd=np.array([0.5, 0.1, 8.0]), **FREE)
MATRIX = np.random.default_rng(1).normal(size=(5, 3)) / PRIOR.sd
NOTHING = np.empty(0), np.empty((0, 3))
"""Derived quantities of a model that has none."""
COVARIANCE = 0.3 * np.eye(5) + 0.2


def linear(values):
    return Prediction(MATRIX @ values + 4, MATRIX, *NOTHING)


def test_posterior_of_a_linear_problem_is_that_of_conditioned_normal_numbers():
    observed = np.array([1.0, 5.0, -2.0, 0.5, 3.0])
    found = posterior(linear, observed, COVARIANCE, PRIOR)
    # Conditioning of the joint normal distribution, without a least-squares problem.
    prior = np.diag(PRIOR.sd**2)
    gain = prior @ MATRIX.T @ np.linalg.inv(MATRIX @ prior @ MATRIX.T + COVARIANCE)
    np.testing.assert_allclose(found.mean, PRIOR.mean + gain @ (observed - linear(PRIOR.mean).observed), rtol=1e-9)
    np.testing.assert_allclose(found.covariance, prior - gain @ MATRIX @ prior, rtol=1e-7, atol=1e-12)
    assert found.converged and found.steps == 1


def test_probability_of_the_residuals_is_uniform_where_the_model_is_true():
    random, probability = np.random.default_rng(2), []
    for _ in range(300):
        values = PRIOR.mean + PRIOR.sd * random.normal(size=3)
        observed = linear(values).observed + np.linalg.cholesky(COVARIANCE) @ random.normal(size=5)
        probability.append(posterior(linear, observed, COVARIANCE, PRIOR).misfit)
    assert kstest(probability, "uniform").pvalue > 0.01
    wrong = posterior(linear, linear(PRIOR.mean).observed + [9, -9, 9, -9, 9], COVARIANCE, PRIOR)
    assert wrong.misfit < 1e-3


def test_evidence_is_the_density_of_what_was_observed():
    observed = np.array([1.0, 5.0, -2.0, 0.5, 3.0])
    found = posterior(linear, observed, COVARIANCE, PRIOR)
    # The observations of a linear model are normal themselves; the constant is that of errors alone.
    spread = MATRIX @ np.diag(PRIOR.sd**2) @ MATRIX.T + COVARIANCE
    due = multivariate_normal(linear(PRIOR.mean).observed, spread).logpdf(observed)
    due -= multivariate_normal(np.zeros(5), COVARIANCE).logpdf(np.zeros(5))
    assert found.log_evidence == pytest.approx(due, abs=1e-6)


@pytest.mark.parametrize("lower", [0.0, -0.3])
def test_evidence_is_that_of_a_prior_that_is_cut_off_at_its_bounds(lower):
    prior = Prior(np.array([0.0]), np.array([0.2]), np.array([lower]), np.array([0.5]))
    found = posterior(lambda q: Prediction(3 * q, np.array([[3.0]]), *NOTHING), np.array([1.4]), np.eye(1), prior)

    def density(value):
        return np.exp(-((1.4 - 3 * value) ** 2) / 2) * norm.pdf(value, 0, 0.2)

    allowed = norm.cdf(0.5, 0, 0.2) - norm.cdf(lower, 0, 0.2)
    assert found.log_evidence == pytest.approx(np.log(quad(density, lower, 0.5)[0] / allowed), abs=1e-6)


def test_search_that_begins_elsewhere_ends_in_the_same_mode():
    observed = curved(np.array([1.6, -2.1, 25.0])).observed
    one, other = (posterior(curved, observed, 1e-2 * COVARIANCE, PRIOR, start) for start in (None, PRIOR.mean * 0.9))
    assert np.all(np.abs(one.mean - other.mean) < 0.1 * np.sqrt(np.diag(one.covariance)))
    assert one.log_evidence == pytest.approx(other.log_evidence, abs=0.05)


def curved(values):
    inner = MATRIX @ values / 20
    return Prediction(np.exp(inner), np.exp(inner)[:, None] * MATRIX / 20, *NOTHING)


@pytest.mark.parametrize("upper", [np.inf, 1.1])
def test_mode_of_a_curved_problem_is_that_of_another_minimiser_within_the_bounds(upper):
    prior = Prior(PRIOR.mean, PRIOR.sd, FREE["lower"], np.array([upper, np.inf, np.inf]))
    observed, inverse = curved(np.array([1.6, -2.1, 25.0])).observed, np.linalg.inv(1e-2 * COVARIANCE)

    def cost(values):
        residual = observed - curved(values).observed
        return residual @ inverse @ residual + np.sum(((values - prior.mean) / prior.sd) ** 2)

    bounds = [(None, limit) for limit in (upper, None, None)]
    best = minimize(cost, prior.mean, bounds=bounds, options={"ftol": 1e-14, "gtol": 1e-10})
    found = posterior(curved, observed, 1e-2 * COVARIANCE, prior)
    assert found.converged
    assert np.all(np.abs(found.mean - best.x) < 0.1 * np.sqrt(np.diag(found.covariance)))
    assert found.mean[0] <= upper


def test_step_into_what_the_model_cannot_do_is_halved():
    def narrow(values):
        if values[0] > 1.3:
            raise ValueError("there is no such heart")
        return linear(values)

    observed = linear(PRIOR.mean + [0.4, 0.0, 0.0]).observed
    free = posterior(linear, observed, 1e-3 * COVARIANCE, PRIOR)
    assert free.mean[0] > 1.3
    found = posterior(narrow, observed, 1e-3 * COVARIANCE, PRIOR)
    assert PRIOR.mean[0] < found.mean[0] <= 1.3
    assert not found.converged


def test_derivatives_of_the_wrong_sign_lead_nowhere():
    with pytest.raises(NoMode, match="no step lowers the misfit"):
        posterior(lambda values: Prediction(linear(values).observed, -MATRIX, *NOTHING), np.ones(5), COVARIANCE, PRIOR)
