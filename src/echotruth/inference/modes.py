"""Modes of the posterior: a wall whose segments are weak and soft to any degree, and one in which some are a scar.

A segment that hardly shortens may contract a little and be soft, or be a stiff scar that does not contract at all. Both
look alike at end-systole, and no step leads from one to the other. So the posterior is a mixture of normal
distributions, one about each mode, whose weights are

    Z_k p^n_k (1 - p)^(17 - n_k),

with the evidence Z_k of its model, the number n_k of its scarred segments, and the probability p that a segment is a
scar before anything is seen: a spike and slab (Mitchell & Beauchamp 1988, J Am Stat Assoc 83:1023).
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import xarray as xr

from echotruth.arrays import Floats
from echotruth.config import Config
from echotruth.inference.heart_model import HeartModel, with_scar
from echotruth.inference.laplace import NoMode, Posterior, posterior
from echotruth.inference.observation import ObservationError
from echotruth.inference.parameters import (
    CONTRACTILITY,
    STIFFNESS,
    Given,
    Parameter,
    factors,
    parameters,
    prior_of,
    scar_parameters,
)
from echotruth.inference.segment_means import SEGMENTS, SegmentMeans
from echotruth.mechanics.pathology import PathologyError
from echotruth.mechanics.solver.newton import Diverged

logger = logging.getLogger("echotruth.inference")

SCAR_PROBABILITY = 0.1
"""That a segment is a scar before anything is seen: as if half of the hearts had an infarct of three segments."""

WEAK = 0.75
"""Contractility, over the mean of the wall, below which a segment that was found weak and soft may be a scar."""

MAX_SCARRED = 3
"""Most segments of a scar that are tried."""

NEGLIGIBLE = 0.01
"""Weight of a mode, over the largest, up to which its search need not end."""


@dataclass(frozen=True)
class Mode:
    """A mode of the posterior.

    Attributes
    ----------
    scarred : tuple of int
        AHA segments that are a scar.
    free : sequence of Parameter
    model : HeartModel
    found : Posterior
    """

    scarred: tuple[int, ...]
    free: Sequence[Parameter]
    model: HeartModel
    found: Posterior

    @property
    def log_weight(self) -> float:
        """Logarithm of its weight in the posterior, but for a constant that all modes share."""
        odds = np.log(SCAR_PROBABILITY / (1 - SCAR_PROBABILITY))
        return self.found.log_evidence + len(self.scarred) * float(odds)

    @property
    def may_have_scar(self) -> bool:
        """Whether contractility and stiffness of all segments are inferred, so that one of them may be a scar."""
        keys = {parameter.key for parameter in self.free}
        return keys >= {f"{section}.{number}" for section in (CONTRACTILITY, STIFFNESS) for number in SEGMENTS}


class Modes(NamedTuple):
    """Modes of the posterior.

    Attributes
    ----------
    found : list of Mode
        That without a scar first.
    missed : list of tuple of int
        AHA segments that may be a scar together, of which no heart or no mode was found.
    """

    found: list[Mode]
    missed: list[tuple[int, ...]]

    @property
    def converged(self) -> bool:
        """Whether every search ended at a mode, but for those that could not find one that counts."""
        least = max(mode.log_weight for mode in self.found) + np.log(NEGLIGIBLE)
        return not self.missed and all(
            mode.found.converged or mode.log_weight + mode.found.promised / 2 < least for mode in self.found
        )


def modes(config: Config, given: Given, observed: xr.Dataset, segments: SegmentMeans) -> Modes:
    """Find the modes of the posterior.

    Parameters
    ----------
    config : Config
        As :func:`.heart_model.model_config` makes it.
    given : mapping
        Priors, as of :func:`.parameters.parameters`. Where the stiffness is known there is no scar.
    observed : Dataset
        As :func:`.observation.observe` returns it.
    segments : SegmentMeans
        Of the model.

    Raises
    ------
    NoMode
        If no step lowers the misfit of the model without a scar.
    """
    free = parameters(config, given)
    found, missed = [_mode(config, free, (), observed, None)], []
    for scarred in _candidates(found[0], segments):
        try:
            found.append(_with_scar(found[0], config, scarred, observed))
        except (NoMode, Diverged, ObservationError, PathologyError) as error:
            logger.info("scar in %s: %s", scarred, error)
            missed.append(scarred)
    return Modes(found, missed)


def weights(found: Sequence[Mode]) -> Floats:
    """Weights of modes in the posterior, (n,); their sum is 1."""
    logarithms = np.array([mode.log_weight for mode in found])
    relative = np.exp(logarithms - logarithms.max())
    return np.asarray(relative / relative.sum())


def _mode(
    config: Config,
    free: Sequence[Parameter],
    scarred: tuple[int, ...],
    observed: xr.Dataset,
    start: Floats | None,
) -> Mode:
    model = HeartModel(config, free, observed["view"].values.tolist(), observed["aha"].values.tolist())
    found = posterior(model, observed["value"].values, observed["covariance"].values, prior_of(free), start)
    return Mode(scarred, free, model, found)


def _with_scar(without: Mode, config: Config, scarred: tuple[int, ...], observed: xr.Dataset) -> Mode:
    """The mode in which some segments are a scar, sought from that without one."""
    free = scar_parameters(without.free, scarred)
    before = {one.key: float(value) for one, value in zip(without.free, without.found.mean, strict=True)}
    start = np.array([before.get(one.key, one.mean) for one in free])
    return _mode(with_scar(config, scarred), free, scarred, observed, start)


def _candidates(without: Mode, segments: SegmentMeans) -> Iterator[tuple[int, ...]]:
    """Segments that may be a scar together: the weakest, the two weakest, and so on, of those that were seen."""
    if not without.may_have_scar:
        return
    seen = set(without.model.aha)
    mean = segments.means(factors(without.free, without.found.mean[None], CONTRACTILITY))[0]
    relative = dict(zip(segments.number.tolist(), mean / (segments.share @ mean), strict=True))
    weak = sorted((value, number) for number, value in relative.items() if value < WEAK and number in seen)
    for count in range(1, min(len(weak), MAX_SCARRED) + 1):
        yield tuple(sorted(number for _, number in weak[:count]))
