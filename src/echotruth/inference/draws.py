"""Draws of the prior and of the posterior, and the values of what is inferred in each.

Contractility and stiffness of segments, and C and the active tension of the wall, follow from the parameters of a draw;
C and the tension to first order about the mode.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from echotruth.arrays import Floats
from echotruth.inference.laplace import Prediction
from echotruth.inference.modes import Mode, weights
from echotruth.inference.parameters import (
    CONTRACTILITY,
    SCAR_CONTRACTILITY,
    SCAR_STIFFNESS,
    STIFFNESS,
    Parameter,
    factors,
    prior_of,
)
from echotruth.inference.segment_means import SEGMENTS, SegmentMeans
from echotruth.repository.schema import DRAWS
from echotruth.units import kPa

MATERIAL, TENSION = "mechanics.material.stiffness_kPa", "active_tension_kPa"
"""C, and the active tension at end-systole, mean of the muscle, which follow from the parameters."""

SEED = 1
"""Of the draws: the same observations give the same ones."""

ATTEMPTS = 100
"""To draw numbers within their limits."""

STEP = 1e-6
"""Change of a parameter by which logarithms of means over the wall are differenced."""


@dataclass(frozen=True)
class Draws:
    """Draws that do not depend on each other.

    Attributes
    ----------
    values : dict of ndarray of shape (draw,)
        Of each parameter by its name, in the unit of its key.
    scar : ndarray of shape (draw, 17)
        Whether an AHA segment is a scar.
    """

    values: dict[str, Floats]
    scar: NDArray[np.bool_]


def standard_normal(number: int, size: int, random: np.random.Generator) -> Floats:
    """Standard normal numbers (number, size); those of each column have their distribution as closely as can be.

    One is drawn in the middle of each of as many equally probable intervals: a Latin hypercube (McKay 1979,
    Technometrics 21:239).
    """
    ranks = np.argsort(random.random((number, size)), axis=0)
    return np.asarray(norm.ppf((ranks + 0.5) / number))


def normal_within(
    mean: Floats, root: Floats, free: Sequence[Parameter], number: int, random: np.random.Generator
) -> Floats:
    """Normal numbers (number, p) within the limits of parameters on their scales.

    Those outside are drawn again, at most :data:`ATTEMPTS` times; what is outside then is put on the limit.

    Parameters
    ----------
    mean : ndarray of shape (p,)
    root : ndarray of shape (p, p)
        Of the covariance: its product with its transpose.
    free : sequence of Parameter
    number : int
    random : Generator
    """
    prior = prior_of(free)
    drawn = mean + standard_normal(number, len(mean), random) @ root.T
    for _ in range(ATTEMPTS):
        outside = np.flatnonzero(np.any((drawn < prior.lower) | (drawn > prior.upper), axis=1))
        if not len(outside):
            break
        drawn[outside] = mean + random.standard_normal((len(outside), len(mean))) @ root.T
    return np.clip(drawn, prior.lower, prior.upper)


def of_posterior(
    modes: Sequence[Mode], segments: SegmentMeans, covariance: Floats, number: int = DRAWS
) -> tuple[Draws, Floats]:
    """Draws of the posterior, and what would be seen of each, with errors, (draw, n).

    Parameters
    ----------
    modes : sequence of Mode
    segments : SegmentMeans
    covariance : ndarray of shape (n, n)
        Of the errors of the observations.
    number : int
    """
    random, parts = np.random.default_rng(SEED), []
    for mode, count in zip(modes, _shares(weights(modes), number), strict=True):
        found = mode.found
        scaled = normal_within(found.mean, np.asarray(np.linalg.cholesky(found.covariance)), mode.free, count, random)
        seen = found.prediction.observed + (scaled - found.mean) @ found.prediction.jacobian.T
        parts.append((_of_mode(mode, segments, scaled), seen))
    order = random.permutation(number)
    errors = standard_normal(number, len(covariance), random) @ np.linalg.cholesky(covariance).T
    values = {name: np.concatenate([part.values[name] for part, _ in parts])[order] for name in parts[0][0].values}
    scar = np.concatenate([part.scar for part, _ in parts])[order]
    return Draws(values, scar), np.concatenate([seen for _, seen in parts])[order] + errors


def of_prior(mode: Mode, segments: SegmentMeans, number: int = DRAWS) -> Draws:
    """Draws of the prior of a wall without a scar, given the mode of such a wall, sought from the mean of the prior."""
    random, prior = np.random.default_rng(SEED), prior_of(mode.free)
    scaled = normal_within(prior.mean, np.diag(prior.sd), mode.free, number, random)
    wall = _Wall.of(mode.free, segments, scaled)
    return Draws(_named(mode, wall, scaled, prior.mean, mode.found.start), np.zeros((number, len(SEGMENTS)), bool))


def _shares(weight: Floats, number: int) -> list[int]:
    """Numbers of draws of each mode, whose sum is the number of all, by the largest remainders."""
    exact = weight * number
    counts = np.floor(exact).astype(int)
    counts[np.argsort(counts - exact, kind="stable")[: number - counts.sum()]] += 1
    return [int(count) for count in counts]


def _of_mode(mode: Mode, segments: SegmentMeans, scaled: Floats) -> Draws:
    """Draws about a mode, given the parameters (draw, p) on their scales."""
    wall = _Wall.of(mode.free, segments, scaled, mode.scarred)
    scar = np.zeros((len(scaled), len(SEGMENTS)), bool)
    scar[:, [number - 1 for number in mode.scarred]] = True
    return Draws(_named(mode, wall, scaled, mode.found.mean, mode.found.prediction), scar)


@dataclass(frozen=True)
class _Wall:
    """Means over segments, by draw.

    Attributes
    ----------
    segments : SegmentMeans
    contractility, stiffness : ndarray of shape (draw, n)
        Factors on those of healthy tissue.
    """

    segments: SegmentMeans
    contractility: Floats
    stiffness: Floats

    @classmethod
    def of(
        cls, free: Sequence[Parameter], segments: SegmentMeans, scaled: Floats, scarred: Sequence[int] = ()
    ) -> _Wall:
        """Means of parameters (draw, p) on their scales, in which some segments are a scar."""
        found = []
        for section, scar in ((CONTRACTILITY, SCAR_CONTRACTILITY), (STIFFNESS, SCAR_STIFFNESS)):
            mean = segments.means(factors(free, scaled, section))
            for column, parameter in enumerate(free):
                if parameter.key == scar:
                    scale = parameter.values(scaled[:, column])[:, None]
                    mean = np.where(np.isin(segments.number, scarred), scale * mean, mean)
            found.append(mean)
        return cls(segments, *found)

    @property
    def log_mean_contractility(self) -> Floats:
        """Logarithm of the mean of the wall, (draw,)."""
        return np.log(self.contractility @ self.segments.share)

    @property
    def log_mean_stiffness(self) -> Floats:
        """Logarithm of the geometric mean of the segments, (draw,)."""
        return np.log(self.stiffness) @ self.segments.share


def _named(mode: Mode, wall: _Wall, scaled: Floats, about: Floats, there: Prediction) -> dict[str, Floats]:
    """Values of all that is inferred, by name, (draw,).

    Parameters
    ----------
    mode : Mode
    wall : _Wall
    scaled : ndarray of shape (draw, p)
    about : ndarray of shape (p,)
        Where C and the active tension and their derivatives are known.
    there : Prediction
        Of it.
    """
    values = {
        parameter.key: parameter.values(scaled[:, column])
        for column, parameter in enumerate(mode.free)
        if not parameter.key.startswith((CONTRACTILITY, STIFFNESS, SCAR_CONTRACTILITY, SCAR_STIFFNESS))
    }
    relative = (
        (CONTRACTILITY, wall.contractility, wall.log_mean_contractility),
        (STIFFNESS, wall.stiffness, wall.log_mean_stiffness),
    )
    for section, means, level in relative:
        if any(parameter.key.startswith(section) for parameter in mode.free):
            name = section.rpartition(".")[2]
            ratio = means / np.exp(level)[:, None]
            values |= {f"{name}.{number}": ratio[:, place] for place, number in enumerate(wall.segments.number)}

    def levels(at: Floats) -> Floats:
        of_wall = _Wall.of(mode.free, wall.segments, at, mode.scarred)
        return np.stack([of_wall.log_mean_stiffness, of_wall.log_mean_contractility])

    slopes = there.derived_jacobian + _slopes(levels, mode.free, about)
    found = there.derived[:, None] + levels(about[None]) + slopes @ (scaled - about).T
    return values | dict(zip((MATERIAL, TENSION), np.exp(found) / kPa, strict=True))


def _slopes(function: Callable[[Floats], Floats], free: Sequence[Parameter], about: Floats) -> Floats:
    """Derivatives (q, p) of a function of parameters (n, p), whose values are (q, n), by differences within limits."""
    prior, steps = prior_of(free), STEP * np.eye(len(about))
    above, below = (np.clip(about + change, prior.lower, prior.upper) for change in (steps, -steps))
    return (function(above) - function(below)) / np.diag(above - below)
