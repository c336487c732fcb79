"""Mode of a posterior by Gauss-Newton steps, and Laplace's approximation of its spread.

Observations y = g(q) + e with e of covariance C, and a prior of mean m and standard deviations s, give the mode

    q* = argmin J(q),    J(q) = (y - g)^T C^-1 (y - g) + sum(((q - m) / s)^2),

within bounds. With the Jacobian G = dg/dq there, the posterior is taken to be normal with the covariance

    (G^T C^-1 G + diag(s)^-2)^-1,

which is exact if g is linear and no bound is reached (Tarantola, Inverse Problem Theory, SIAM 2005, section 3.2).
Models that explain the same observations are compared by their evidence (MacKay, Information Theory, Inference, and
Learning Algorithms, Cambridge 2003, chapter 28), but for a constant that they share

    log Z = -J(q*) / 2 - log det(I + diag(s) G^T C^-1 G diag(s)) / 2 + log(P / P0),

P and P0 being the probabilities that the normal posterior and the normal prior have between the bounds, each parameter
taken by itself and J as stationary: where a bound holds the mode, Z is too large, up to some three times. If model and
prior are true, g is linear and no bound is reached, J(q*) is a chi-squared number of as many degrees of freedom as
there are observations, since it is (y - g(m))^T S^-1 (y - g(m)), S = C + G diag(s)^2 G^T: what they are off from the
mean of the prior.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import lsq_linear
from scipy.stats import chi2, norm

from echotruth.arrays import Floats

logger = logging.getLogger("echotruth.inference")

MAX_STEPS = 8
CLOSE = 0.05
"""Fall of J that the next step promises, below which the mode is found: no parameter is off by a fourth of its
posterior standard deviation."""
MAX_HALVINGS = 4


class NoMode(RuntimeError):
    """Raised if no step from the mean of the prior lowers the misfit."""


@dataclass(frozen=True)
class Prediction:
    """What a model predicts of parameters (p,).

    Attributes
    ----------
    observed : ndarray of shape (n,)
        What would be observed, without errors.
    jacobian : ndarray of shape (n, p)
        Its derivatives by the parameters.
    derived : ndarray of shape (q,)
        What else follows from the parameters, which nothing observes; no search depends on it.
    derived_jacobian : ndarray of shape (q, p)
    """

    observed: Floats
    jacobian: Floats
    derived: Floats
    derived_jacobian: Floats


Model = Callable[[Floats], Prediction]
"""From parameters (p,) to what they predict."""


@dataclass(frozen=True)
class Prior:
    """Independent normal distributions, cut off at bounds.

    Attributes
    ----------
    mean, sd, lower, upper : ndarray of shape (p,)
        In the unit of each parameter; `sd` is positive.
    """

    mean: Floats
    sd: Floats
    lower: Floats
    upper: Floats

    def log_within(self, mean: Floats, sd: Floats) -> float:
        """Logarithm of the probability that independent normal numbers (p,) are within the bounds."""
        return float(np.sum(np.log(norm.cdf(self.upper, mean, sd) - norm.cdf(self.lower, mean, sd))))


@dataclass(frozen=True)
class Posterior:
    """Mode and spread of the parameters.

    Attributes
    ----------
    mean : ndarray of shape (p,)
        The mode.
    covariance : ndarray of shape (p, p)
    start, prediction : Prediction
        Of where the search began, and of the mode.
    log_evidence : float
        log Z.
    promised : float
        By how much the next step would lower J if g were linear.
    misfit : float
        Probability of a J(q*) as large or larger where model and prior are true.
    steps : int
        Number of Gauss-Newton steps.
    """

    mean: Floats
    covariance: Floats
    start: Prediction
    prediction: Prediction
    log_evidence: float
    promised: float
    misfit: float
    steps: int

    @property
    def converged(self) -> bool:
        """Whether the next step promises no more than `CLOSE`; else the point is the best that was found."""
        return self.promised <= CLOSE


def posterior(
    model: Model, observed: Floats, covariance: Floats, prior: Prior, start: Floats | None = None
) -> Posterior:
    """Find the mode of a posterior and its spread.

    Parameters
    ----------
    model : callable
    observed : ndarray of shape (n,)
    covariance : ndarray of shape (n, n)
        Of the errors of the observations; positive definite.
    prior : Prior
    start : ndarray of shape (p,), optional
        Where the search begins. Default: the mean of the prior.

    Returns
    -------
    Posterior

    Raises
    ------
    NoMode
        If no step from the start lowers the misfit.
    """
    problem = _Problem(model, observed, cholesky(covariance, lower=True), prior)
    first = point = problem.at(prior.mean if start is None else start)
    for steps in range(MAX_STEPS + 1):
        change, fall = problem.step(point)
        logger.info("step %d: misfit %.1f, of which the next step promises to take %.2f", steps, point.cost, fall)
        if fall <= CLOSE or steps == MAX_STEPS:
            break
        lower = problem.lowered(point, change)
        if lower is None and not steps:
            said = "the observations contradict the model or the prior"
            raise NoMode(f"no step lowers the misfit of {point.cost:.1f}: {said}")
        if lower is None:
            break
        point = lower
    spread = problem.covariance(point)
    return Posterior(
        mean=point.values,
        covariance=spread,
        start=first.prediction,
        prediction=point.prediction,
        log_evidence=problem.log_evidence(point, spread),
        promised=fall,
        misfit=float(chi2.sf(point.cost, len(observed))),
        steps=steps,
    )


@dataclass(frozen=True)
class _Point:
    values: Floats
    prediction: Prediction
    cost: float


@dataclass(frozen=True)
class _Problem:
    """The least-squares problem; `root` is the lower Cholesky factor of the covariance of the errors."""

    model: Model
    observed: Floats
    root: Floats
    prior: Prior

    def at(self, values: Floats) -> _Point:
        """The model and J at parameters."""
        prediction = self.model(values)
        whitened = solve_triangular(self.root, self.observed - prediction.observed, lower=True)
        cost = np.sum(whitened**2) + np.sum(((values - self.prior.mean) / self.prior.sd) ** 2)
        return _Point(values, prediction, float(cost))

    def step(self, point: _Point) -> tuple[Floats, float]:
        """Step to the mode of the problem that is linear about a point, within the bounds, and the fall of its J."""
        jacobian = solve_triangular(self.root, point.prediction.jacobian, lower=True)
        # In standard deviations of the prior, so that the least squares are well scaled.
        matrix = np.vstack([jacobian * self.prior.sd, np.eye(len(self.prior.sd))])
        residual = solve_triangular(self.root, self.observed - point.prediction.observed, lower=True)
        right = np.concatenate([residual, (self.prior.mean - point.values) / self.prior.sd])
        bounds = [(limit - point.values) / self.prior.sd for limit in (self.prior.lower, self.prior.upper)]
        scaled = lsq_linear(matrix, right, bounds, method="bvls").x
        return np.asarray(scaled * self.prior.sd), float(point.cost - np.sum((right - matrix @ scaled) ** 2))

    def covariance(self, point: _Point) -> Floats:
        """Covariance (p, p) of the posterior that is normal about a point."""
        return np.linalg.inv(self._curvature(point)) * np.outer(self.prior.sd, self.prior.sd)

    def log_evidence(self, point: _Point, covariance: Floats) -> float:
        """log Z of the posterior that is normal about a point, with a covariance (p, p), within the bounds."""
        prior, sd = self.prior, np.sqrt(np.diag(covariance))
        within = prior.log_within(point.values, sd) - prior.log_within(prior.mean, prior.sd)
        return within - 0.5 * (point.cost + float(np.linalg.slogdet(self._curvature(point))[1]))

    def _curvature(self, point: _Point) -> Floats:
        """Half the second derivatives of J (p, p) by parameters in standard deviations of the prior."""
        scaled = solve_triangular(self.root, point.prediction.jacobian * self.prior.sd, lower=True)
        return np.asarray(scaled.T @ scaled + np.eye(len(self.prior.sd)))

    def lowered(self, point: _Point, change: Floats) -> _Point | None:
        """A point with a lower J, along a step that is halved until there is one; None if there is none."""
        for halving in range(MAX_HALVINGS + 1):
            try:
                trial = self.at(point.values + change / 2**halving)
            except (ValueError, RuntimeError) as error:
                logger.info("half the step: %s", error)
                continue
            if trial.cost < point.cost:
                return trial
        return None
