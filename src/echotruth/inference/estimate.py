"""Parameters of a heart from what a tracker saw of it, with their intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import xarray as xr
from scipy.stats import norm

import echotruth
from echotruth.arrays import Floats
from echotruth.inference.heart_model import HeartModel, model_config
from echotruth.inference.laplace import Posterior, posterior
from echotruth.inference.observation import ObservationError
from echotruth.inference.parameters import CONTRACTILITY, STIFFNESS, Given, Parameter, parameters, prior_of
from echotruth.inference.segment_means import SEGMENTS, SegmentMeans
from echotruth.notebook.simulation import progress_line
from echotruth.section import UNITS

MESH = (12, 8, 2)
"""Elements around, along and through the wall of the model."""

COVERED = 0.9
"""Probability of the intervals."""

IDENTIFIABLE = 0.8
"""Standard deviation of the posterior over that of the prior, above which the observations tell next to nothing."""

MISFIT = 0.01
"""Probability of residuals as large, below which the model is said not to fit."""

SCAR_LIKE = 0.5
"""Contractility, over the mean of the wall, at which a stiff scar is found: one that does not contract at all and is 20
times as stiff was found at 0.36 to 0.59, like a soft segment that contracts so much, since both hardly shorten."""

MATERIAL, TENSION = "mechanics.material.stiffness_kPa", "active_tension_kPa"
"""C, and the active tension at end-systole, mean of the muscle, which follow from the parameters."""


def infer(
    observed: xr.Dataset,
    prior: Given | None = None,
    mesh: tuple[int, int, int] | None = MESH,
    progress: bool = True,
) -> xr.Dataset:
    """Infer the contractility of segments, and what else motion depends on, from what a tracker saw.

    The finite elements themselves are the model; Gauss-Newton steps find the most probable parameters, and Laplace's
    approximation their intervals (docs/inference.md). A minute or two.

    Parameters
    ----------
    observed : Dataset
        As :func:`echotruth.observe` returns it; `observed.isel(observation=kept, other=kept)` leaves observations out.
    prior : mapping, optional
        Dotted key to the mean and the standard deviation of its value before anything is observed, or to None for what
        is known as the model has it; `mechanics.regional.contractility` and `mechanics.regional.stiffness` stand for
        those of all segments. Default: those of docs/inference.md.
    mesh : tuple of int, optional
        Elements of the model around, along and through the wall. None: those of the observed heart.
    progress : bool
        Whether a line on stderr says how far it is, where a person watches.

    Returns
    -------
    Dataset
        By `parameter`, in its `unit`: `mean`, the most probable value, `sd`, `lower` and `upper` of the 90 % interval,
        `prior_mean`, `prior_sd`, and `identifiable`, whether the standard deviation is at most 0.8 of the prior's.
        Parameters `contractility.N` and `stiffness.N` are means over the muscle of AHA segments, relative to the
        mean of the whole wall (the geometric one of stiffness); an interval of contractility that goes below 0.5
        reaches down to 0 unless the stiffness is known (docs/inference.md). By `observation`: `observed`, `predicted`,
        `residual` and `sd_error`. Attributes: `misfit_probability` of residuals as large, `misfit` if it is below 0.01,
        `converged`, `steps`, `case`, `tracker`, `size_px` and the `config` of the most probable heart.

    Raises
    ------
    ValueError
        If nothing was observed, there is no loop, or a prior cannot be used; if there is no such heart.
    NoMode
        If observations and model contradict each other so that no step lowers the misfit.

    Examples
    --------
    >>> import echotruth as et
    >>> seen = et.observe(et.sample(), "bspline_dic", "infarct")
    >>> fixed = {"mechanics.regional.stiffness": None, "fibres.endo_deg": None, "fibres.epi_deg": None}
    >>> found = et.infer(seen, fixed, mesh=(12, 6, 1))  # half a minute
    >>> muscle = found["mean"].sel(parameter=["contractility.8", "contractility.11"]).values
    >>> bool(muscle[0] < muscle[1])  # the infarct is in segments 7 and 8
    True
    """
    check(observed)
    with TemporaryDirectory() as folder, progress_line("infer", progress):
        config = model_config(observed, mesh, Path(folder))
        free = parameters(config, prior or {})
        model = HeartModel(config, free, observed["view"].values.tolist(), observed["aha"].values.tolist())
        found = posterior(model, observed["value"].values, observed["covariance"].values, prior_of(free))
        return _Result(free, model, found, SegmentMeans.of(config)).dataset(observed)


def check(observed: xr.Dataset) -> None:
    """Refuse observations that cannot be used.

    Raises
    ------
    TypeError, ObservationError
    """
    if not isinstance(observed, xr.Dataset):
        raise TypeError(f"observed = {observed!r:.80}: must be a Dataset: echotruth.observe makes one.")
    needed = ("value", "covariance", "quantity", "view", "aha")
    if missing := [name for name in needed if name not in observed]:
        raise ObservationError(f"observed: has no {missing[0]}: give what echotruth.observe returns")
    if missing := [name for name in ("config", "case") if name not in observed.attrs]:
        raise ObservationError(
            f"observed: has lost its attribute {missing[0]}: keep those that echotruth.observe gave it"
        )
    _check_values(observed["value"].values, observed["covariance"].values)


def _check_values(value: Floats, covariance: Floats) -> None:
    """Refuse values (n,) and their covariance (n, n) that are not finite, or of which one has no error."""
    if not len(value):
        raise ObservationError("observed: holds no observation: a tracker must have seen one segment at least")
    chosen = "isel(observation=kept, other=kept)"
    if covariance.shape != 2 * value.shape:
        raise ObservationError(
            f"observed: the covariance is {covariance.shape} of {len(value)} values: choose by {chosen}"
        )
    if not np.isfinite(value).all():
        row = int(np.argmax(~np.isfinite(value)))
        raise ObservationError(f"observed: value {row} is not finite: leave it out by {chosen}")
    if not (np.isfinite(covariance).all() and np.allclose(covariance, covariance.T)):
        raise ObservationError("observed: the covariance is not finite and symmetric")
    if not np.linalg.eigvalsh(covariance)[0] > 0:
        raise ObservationError("observed: the covariance is not positive definite: each value needs an error")


@dataclass(frozen=True)
class _Result:
    """What was found, on the scales of the parameters."""

    free: Sequence[Parameter]
    model: HeartModel
    found: Posterior
    segments: SegmentMeans

    def dataset(self, observed: xr.Dataset) -> xr.Dataset:
        """The result as :func:`infer` returns it."""
        rows = [*self._keys(), *self._segments(), *self._muscle()]
        columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
        names, unit = columns.pop("parameter"), columns.pop("unit")
        sd = np.sqrt(np.diag(observed["covariance"].values))
        value = observed["value"].values
        seen = {"observed": value, "predicted": self.found.predicted, "residual": value - self.found.predicted}
        arrays: dict[str, Any] = {name: ("parameter", values) for name, values in columns.items()}
        arrays |= {name: ("observation", values) for name, values in (seen | {"sd_error": sd}).items()}
        labels = {name: ("observation", observed[name].values) for name in ("quantity", "view", "aha")}
        about = {name: value for name, value in observed.attrs.items() if name != "config"}
        about |= {
            "misfit_probability": self.found.misfit,
            "misfit": int(self.found.misfit < MISFIT),
            "converged": int(self.found.converged),
            "steps": self.found.steps,
            "version": echotruth.__version__,
            "config": self.model.at(self.found.mean).model_dump_json(),
        }
        return xr.Dataset(arrays, {"parameter": names, "unit": ("parameter", unit), **labels}, about)

    def _keys(self) -> list[dict[str, Any]]:
        """Rows of the keys, without those of segments."""
        rows, spread = [], np.sqrt(np.diag(self.found.covariance))
        for parameter, mean, sd in zip(self.free, self.found.mean, spread, strict=True):
            if not parameter.key.startswith((CONTRACTILITY, STIFFNESS)):
                unit = parameter.key.rpartition("_")[2]
                shown = unit if unit in UNITS else "1"
                rows.append(_row(parameter.key, shown, (mean, sd), (parameter.mean, parameter.sd), parameter.limits))
        return rows

    def _segments(self) -> list[dict[str, Any]]:
        """Rows of contractility and stiffness, mean of segments relative to the whole wall."""
        rows, keys = [], {parameter.key for parameter in self.free}
        for section, relative, logarithmic in (
            (CONTRACTILITY, self.segments.relative, False),
            (STIFFNESS, self.segments.log_relative, True),
        ):
            if not any(parameter.key.startswith(section) for parameter in self.free):
                continue
            pairs = []
            for scaled, covariance in ((self.found.mean, self.found.covariance), self._prior):
                factors, selected = self._factors(section, scaled)
                values, slope = relative(factors)
                pairs.append((values, _spread(slope @ selected, covariance)))
            for number, mean, sd, *before in zip(self.segments.number, *pairs[0], *pairs[1], strict=True):
                name = f"{section.rpartition('.')[2]}.{number}"
                row = _row(name, "1", (mean, sd), (before[0], before[1]), (0.0, np.inf), logarithmic)
                scarred = section == CONTRACTILITY and f"{STIFFNESS}.{number}" in keys
                rows.append(_down_to_scar(row) if scarred else row)
        return rows

    def _muscle(self) -> list[dict[str, Any]]:
        """Rows of C and of the active tension at end-systole, those of the mean of the wall."""
        pairs = []
        for scaled, covariance in ((self.found.mean, self.found.covariance), self._prior):
            values, slopes = self.model.muscle[scaled.tobytes()]
            for place, (section, level) in enumerate(
                ((STIFFNESS, self.segments.log_geometric_mean), (CONTRACTILITY, self.segments.log_mean))
            ):
                factors, selected = self._factors(section, scaled)
                mean, slope = level(factors)
                values, slopes = values + mean * _unit(place), slopes + np.outer(_unit(place), slope @ selected)
            pairs.append((values - np.log(UNITS["kPa"]), _spread(slopes, covariance)))
        (after, after_sd), (before, before_sd) = pairs
        return [
            _row(name, "kPa", (after[i], after_sd[i]), (before[i], before_sd[i]), (0.0, np.inf), True)
            for i, name in enumerate((MATERIAL, TENSION))
        ]

    @property
    def _prior(self) -> tuple[Floats, Floats]:
        """Mean and covariance of the prior."""
        prior = prior_of(self.free)
        return prior.mean, np.diag(prior.sd**2)

    def _factors(self, section: str, scaled: Floats) -> tuple[Floats, Floats]:
        """Factors of the keys of all segments (17,), 1 where one is not inferred, and derivatives by the parameters."""
        factors, selected = np.ones(len(SEGMENTS)), np.zeros((len(SEGMENTS), len(self.free)))
        for column, parameter in enumerate(self.free):
            if parameter.key.startswith(section):
                place = int(parameter.key.rpartition(".")[2]) - 1
                factors[place] = parameter.value(scaled[column])
                selected[place, column] = factors[place] if parameter.logarithmic else 1.0
        return factors, selected


def _down_to_scar(row: dict[str, Any]) -> dict[str, Any]:
    """Row of contractility whose interval reaches down to none at all, if it holds that at which a stiff scar is found.

    Laplace's approximation is that of the soft segment, and does not see the other one.
    """
    return row | {"lower": 0.0} if row["lower"] < SCAR_LIKE else row


def _spread(slope: Floats, covariance: Floats) -> Floats:
    """Standard deviations of linear functions (q, p) of parameters of a covariance."""
    return np.sqrt(np.einsum("qp,pr,qr->q", slope, covariance, slope))


def _unit(place: int) -> Floats:
    return np.eye(2)[place]


def _row(
    name: str,
    unit: str,
    after: tuple[float, float],
    before: tuple[float, float],
    limits: tuple[float, float],
    logarithmic: bool = False,
) -> dict[str, Any]:
    """Row of a parameter, given mean and standard deviation on its scale, and the limits of its value."""
    reach = float(norm.ppf((1 + COVERED) / 2))
    (mean, sd), (first, first_sd) = after, before
    interval = np.array([mean - reach * sd, mean, mean + reach * sd, first])
    lower, middle, upper, prior_mean = np.clip(np.exp(interval) if logarithmic else interval, *limits)
    return {
        "parameter": name,
        "unit": unit,
        "mean": middle,
        "sd": sd * middle if logarithmic else sd,
        "lower": lower,
        "upper": upper,
        "prior_mean": prior_mean,
        "prior_sd": first_sd * prior_mean if logarithmic else first_sd,
        "identifiable": bool(sd <= IDENTIFIABLE * first_sd),
    }
