"""Parameters of a heart that are inferred: their priors, and the scale on which these are normal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from echotruth.arrays import Floats
from echotruth.config import Config
from echotruth.inference.laplace import Prior
from echotruth.inference.segment_means import SEGMENTS

CONTRACTILITY, STIFFNESS = "mechanics.regional.contractility", "mechanics.regional.stiffness"
SCAR_CONTRACTILITY, SCAR_STIFFNESS = "pathology.infarct.tension_scale", "pathology.infarct.stiffness_scale"

FACTOR_LIMITS = (0.05, 20.0)
"""Those of the keys of `mechanics.regional`."""

EDP_SD_MMHG, ESP_SD_MMHG = 0.5, 4.0
"""Standard deviation of measured pressures."""
EDV_SD, EJECTION_FRACTION_SD = 0.02, 0.02
"""Standard deviation of the end-diastolic volume over it, and of the ejection fraction."""

LIMITS: dict[str, tuple[float, float]] = {
    **{f"{section}.{number}": FACTOR_LIMITS for section in (CONTRACTILITY, STIFFNESS) for number in SEGMENTS},
    **dict.fromkeys(("mechanics.active.sheet_share", "mechanics.active.normal_share"), (0.0, 1.0)),
    **dict.fromkeys(("fibres.endo_deg", "fibres.epi_deg"), (-90.0, 90.0)),
    **dict.fromkeys(("loop.edp_mmHg", "loop.esp_mmHg", "loop.edv_uL", "loop.esv_uL"), (1e-6, np.inf)),
}
"""Keys that are inferred, and the smallest and largest value of each."""

Given = Mapping[str, Sequence[float] | None]


class PriorError(ValueError):
    """Raised if a prior cannot be used."""


@dataclass(frozen=True)
class Parameter:
    """A key of the configuration and its prior.

    Attributes
    ----------
    key : str
    mean, sd : float
        Of the value of the key or, on a logarithmic scale, of its logarithm.
    limits : tuple of float
        Smallest and largest value of the key.
    logarithmic : bool
    """

    key: str
    mean: float
    sd: float
    limits: tuple[float, float]
    logarithmic: bool = False

    def values(self, scaled: Floats) -> Floats:
        """Values of the key, of an array on its scale."""
        return np.clip(np.exp(scaled) if self.logarithmic else scaled, *self.limits)

    def value(self, scaled: float) -> float:
        """Value of the key."""
        return float(self.values(np.asarray(scaled)))


def parameters(config: Config, given: Given) -> list[Parameter]:
    """Parameters of a model and their priors.

    Parameters
    ----------
    config : Config
        Of the model; its values are the means of the priors of fibres, shares and loop.
    given : mapping
        Dotted key to the mean and standard deviation of its value instead, or to None for what is not inferred; a key
        of `mechanics.regional` without a segment stands for all of them.

    Raises
    ------
    PriorError
        If a key is none of these, or a number cannot be used.
    """
    check_prior(given)
    active, fibres, loop = config.mechanics.active, config.fibres, config.loop
    assert loop.edv_uL and loop.esv_uL and loop.edp_mmHg and loop.esp_mmHg
    usual = {
        **{f"{CONTRACTILITY}.{number}": (1.0, 0.5) for number in SEGMENTS},
        **{f"{STIFFNESS}.{number}": (1.0, 1.0) for number in SEGMENTS},
        "mechanics.active.sheet_share": (active.sheet_share, 0.1),
        "mechanics.active.normal_share": (active.normal_share, 0.1),
        "fibres.endo_deg": (fibres.endo_deg, 8.0),
        "fibres.epi_deg": (fibres.epi_deg, 8.0),
        "loop.edp_mmHg": (loop.edp_mmHg, EDP_SD_MMHG),
        "loop.esp_mmHg": (loop.esp_mmHg, ESP_SD_MMHG),
        "loop.edv_uL": (loop.edv_uL, EDV_SD * loop.edv_uL),
        "loop.esv_uL": (loop.esv_uL, EJECTION_FRACTION_SD * loop.edv_uL),
    }
    pairs = {key: given.get(_named(key, given), pair) for key, pair in usual.items()}
    return [_parameter(key, *pair) for key, pair in pairs.items() if pair is not None]


def check_prior(given: Given) -> None:
    """Refuse priors that cannot be used.

    Parameters
    ----------
    given : mapping
        As of :func:`parameters`.

    Raises
    ------
    PriorError
    """
    for key, pair in given.items():
        of_all = key in (CONTRACTILITY, STIFFNESS)
        if key not in LIMITS and not of_all:
            others = [name for name in LIMITS if not name.startswith((CONTRACTILITY, STIFFNESS))]
            shown = ", ".join([f"{CONTRACTILITY}.N", f"{STIFFNESS}.N", *others])
            raise PriorError(f"prior: {key} is not inferred: the keys are {shown}")
        low, high = FACTOR_LIMITS if of_all else LIMITS[key]
        if pair is not None and not _is_prior(pair, low, high):
            remedy = f"a mean from {low:g} to {high:g} and a positive standard deviation of at most their difference"
            raise PriorError(f"prior: {key} = {pair!r}: give {remedy}, or None")
    if all(given.get(_named(key, given), True) is None for key in LIMITS):
        raise PriorError("prior: leaves nothing to infer: give a mean and a standard deviation of one key")


def _is_prior(pair: Sequence[float], low: float, high: float) -> bool:
    try:
        mean, sd = (float(number) for number in pair)
    except (TypeError, ValueError):
        return False
    return low <= mean <= high and bool(np.isfinite([mean, sd]).all()) and 0 < sd <= high - low


def _named(key: str, given: Given) -> str:
    """The key by which the prior of a key is given: its own, or that of all segments."""
    return key if key in given else key.rpartition(".")[0]


def _parameter(key: str, mean: float, sd: float) -> Parameter:
    """A parameter, of the mean and standard deviation of its value; of stiffness, the median and that over it."""
    if key.startswith(STIFFNESS):
        return Parameter(key, float(np.log(mean)), sd / mean, LIMITS[key], logarithmic=True)
    return Parameter(key, float(mean), float(sd), LIMITS[key])


def scar_parameters(free: Sequence[Parameter], scarred: Sequence[int]) -> list[Parameter]:
    """Parameters of a heart in which some AHA segments are a scar, in place of those of these segments.

    A scar does not contract, or little, and is about 20 times as stiff: the means are the defaults of `pathology`.
    """
    replaced = {f"{section}.{number}" for section in (CONTRACTILITY, STIFFNESS) for number in scarred}
    return [
        *(parameter for parameter in free if parameter.key not in replaced),
        Parameter(SCAR_CONTRACTILITY, 0.0, 0.15, (0.0, 1.0)),
        Parameter(SCAR_STIFFNESS, float(np.log(20.0)), 0.5, (1.0, 100.0), logarithmic=True),
    ]


def factors(free: Sequence[Parameter], scaled: Floats, section: str) -> Floats:
    """Factors of all segments (n, 17) of `mechanics.regional`, 1 where one is not inferred.

    Parameters
    ----------
    free : sequence of Parameter
    scaled : ndarray of shape (n, p)
        Parameters on their scales.
    section : str
        :data:`CONTRACTILITY` or :data:`STIFFNESS`.
    """
    found = np.ones((len(scaled), len(SEGMENTS)))
    for column, parameter in enumerate(free):
        if parameter.key.startswith(section):
            found[:, int(parameter.key.rpartition(".")[2]) - 1] = parameter.values(scaled[:, column])
    return found


def prior_of(parameters: Sequence[Parameter]) -> Prior:
    """The prior of parameters, on their scales."""
    limits = np.array([np.log(p.limits) if p.logarithmic else p.limits for p in parameters], float)
    mean, sd = (np.array([getattr(p, name) for p in parameters], float) for name in ("mean", "sd"))
    return Prior(mean, sd, limits[:, 0], limits[:, 1])


def slopes(parameters: Sequence[Parameter], scaled: Floats) -> Floats:
    """Derivative of the value of each key by its scale, (p,)."""
    return np.array([p.value(x) if p.logarithmic else 1.0 for p, x in zip(parameters, scaled, strict=True)])
