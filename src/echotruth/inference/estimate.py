"""Parameters of a heart from what a tracker saw of it, with their intervals."""

from __future__ import annotations

import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

import echotruth
from echotruth.arrays import Floats
from echotruth.config import Config
from echotruth.config.building import configure
from echotruth.inference.draws import MATERIAL, TENSION, of_posterior, of_prior
from echotruth.inference.heart_model import elements, model_config
from echotruth.inference.imaged_wall import ROTATION
from echotruth.inference.modes import Modes, modes
from echotruth.inference.observation import ObservationError
from echotruth.inference.parameters import Given
from echotruth.inference.segment_means import SEGMENTS, SegmentMeans
from echotruth.notebook.simulation import progress_line
from echotruth.repository.inferred import MISFIT
from echotruth.units import unit_of

MESH = (12, 8, 2)
"""Elements around, along and through the wall of the model."""

COARSE_SD = 0.02
"""Standard deviation of what a mesh that is coarser than `MESH` does to strain (docs/inference.md)."""

COVERED = 0.9
"""Probability of the intervals."""

IDENTIFIABLE = 0.8
"""Standard deviation of the posterior over that of the prior, above which a parameter is not identifiable."""

POSITIVE = ("stiffness.", MATERIAL, TENSION)
"""Beginnings of the names of what is positive, and has a prior on a logarithmic scale."""


def infer(
    observed: xr.Dataset,
    prior: Given | None = None,
    mesh: tuple[int, int, int] | None = MESH,
    progress: bool = True,
) -> xr.Dataset:
    """Infer the contractility of segments, and what else motion depends on, from what a tracker saw.

    The finite elements themselves are the model; Gauss-Newton steps find the most probable parameters of a wall without
    a scar and of such as have one, and Laplace's approximation their intervals and weights (docs/inference.md). One to
    four minutes.

    Parameters
    ----------
    observed : Dataset
        As :func:`echotruth.observe` returns it; `observed.isel(observation=kept, other=kept)` leaves observations out.
    prior : mapping, optional
        Dotted key to the mean and the standard deviation of its value before anything is observed, or to None for what
        is known as the model has it; `mechanics.regional.contractility` and `mechanics.regional.stiffness` stand for
        those of all segments; of a stiffness the pair is the median, and the standard deviation of its logarithm times
        that. Default: those of docs/inference.md.
    mesh : tuple of int, optional
        Elements of the model around, along and through the wall. None: those of the observed heart. Fewer than by
        default, here or in the observed heart, add an error of 2 percentage points of strain to that of the tracker.
    progress : bool
        Whether a line on stderr says how far it is, where a person watches.

    Returns
    -------
    Dataset
        By `parameter`, in its `unit`: `mean`, `sd`, `lower` and `upper` of the shortest 90 % interval, `prior_mean`,
        `prior_sd`, and `identifiable`, whether the standard deviation (of stiffness and tension: of its logarithm) is
        at most 0.8 of the prior's. Parameters `contractility.N` and `stiffness.N` are means over the muscle of AHA
        segments, relative to the mean of the whole wall (the geometric one of stiffness). They are of the draws
        `posterior` and `prior` (draw, parameter); `scar` (draw, aha) says in which of the first a segment is a scar,
        `scar_probability` (aha) in how many, NaN of a segment that no view shows and where no scar is tried, and
        `replicated` (draw, observation) what would be seen, with errors. By `observation`: `observed`, `predicted` of
        the most probable heart, `residual` and `sd_error`, and `covariance` (observation, other) of the errors, that of
        the mesh included. Attributes: `misfit_probability` of observations as far from what model and prior say,
        `misfit` if it is below 0.01, `converged` if every search ended at its mode, but for those of
        negligible weight, `steps`, `case`, `tracker`, `size_px` and the `config` of the most probable heart.

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
    >>> found = et.infer(seen, fixed, mesh=(6, 4, 1))  # ten seconds
    >>> muscle = found["mean"].sel(parameter=["contractility.8", "contractility.11"]).values
    >>> bool(muscle[0] < muscle[1])  # the infarct is in segments 7 and 8
    True
    """
    check(observed)
    with TemporaryDirectory() as folder, progress_line("infer", progress):
        config = model_config(observed, mesh, Path(folder))
        observed, segments = with_error_of_mesh(observed, config), SegmentMeans.of(config)
        return _dataset(observed, modes(config, prior or {}, observed, segments), segments)


def with_error_of_mesh(observed: xr.Dataset, model: Config) -> xr.Dataset:
    """Observations whose covariance has the error of a mesh, of the model or the heart, coarser than the usual one.

    There is none in a direction in which both have as many elements.
    """
    own, of_model = (np.array(elements(config)) for config in (configure(json.loads(observed.attrs["config"])), model))
    if np.all((own == of_model) | (np.minimum(own, of_model) >= MESH)):
        return observed
    more = np.diag(np.where(observed["quantity"] == ROTATION, 0.0, COARSE_SD**2))
    return observed.assign(covariance=observed["covariance"] + more)


def check(observed: xr.Dataset) -> None:
    """Refuse observations that cannot be used.

    Raises
    ------
    TypeError, ObservationError
    """
    if not isinstance(observed, xr.Dataset):
        raise TypeError(f"observed = {observed!r:.80}: must be a Dataset: echotruth.observe makes one.")
    needed = {"value", "covariance", "quantity", "view", "aha", "pressure", "volume"}
    if not needed <= set(observed.variables) or "config" not in observed.attrs:
        raise ObservationError("observed: lacks a variable or an attribute: keep all that echotruth.observe gave it")
    value, covariance = observed["value"].values, observed["covariance"].values
    if not len(value):
        raise ObservationError("observed: holds no observation: a tracker must have seen one segment at least")
    usable = covariance.shape == 2 * value.shape and np.isfinite(value).all() and np.isfinite(covariance).all()
    if not (usable and np.allclose(covariance, covariance.T) and np.linalg.eigvalsh(covariance)[0] > 0):
        remedy = "leave observations out by isel(observation=kept, other=kept)"
        raise ObservationError(f"observed: needs finite values with a positive definite covariance: {remedy}")


def _dataset(observed: xr.Dataset, every: Modes, segments: SegmentMeans) -> xr.Dataset:
    """What was found, as :func:`infer` returns it."""
    found, value = every.found, observed["value"].values
    best = max(found, key=lambda mode: mode.log_weight)
    tried, shown = found[0].may_have_scar, np.isin(SEGMENTS, found[0].model.aha)
    predicted = best.found.prediction.observed
    draws, replicated = of_posterior(found, segments, observed["covariance"].values)
    before = of_prior(found[0], segments)
    names = list(draws.values)
    posterior, prior = (np.stack([one.values[name] for name in names], axis=1) for one in (draws, before))
    seen = {"observed": value, "predicted": predicted, "residual": value - predicted}
    seen["sd_error"] = np.sqrt(np.diag(observed["covariance"].values))
    arrays: dict[str, Any] = {name: ("parameter", values) for name, values in _summary(names, posterior, prior).items()}
    arrays |= {name: ("observation", values) for name, values in seen.items()}
    arrays |= {
        "posterior": (("draw", "parameter"), posterior),
        "prior": (("draw", "parameter"), prior),
        "replicated": (("draw", "observation"), replicated),
        "covariance": (("observation", "other"), observed["covariance"].values),
        "scar": (("draw", "aha"), draws.scar),
        "scar_probability": ("aha", np.where(tried & shown, draws.scar.mean(axis=0), np.nan)),
    }
    labels: dict[str, Any] = {name: ("observation", observed[name].values) for name in ("quantity", "view")}
    units = [unit_of(one) or "1" for one in names]
    labels |= {"segment": ("observation", observed["aha"].values), "unit": ("parameter", units)}
    about = {name: value for name, value in observed.attrs.items() if name != "config"}
    about |= {
        "misfit_probability": best.found.misfit,
        "misfit": int(best.found.misfit < MISFIT),
        "converged": int(every.converged),
        "steps": sum(mode.found.steps for mode in found),
        "version": echotruth.__version__,
        "config": best.model.at(best.found.mean).model_dump_json(),
    }
    return xr.Dataset(arrays, {"parameter": names, "aha": list(SEGMENTS), **labels}, about)


def shortest_interval(draws: Floats) -> tuple[Floats, Floats]:
    """Ends (parameter,) of the shortest interval that holds 90 % of the draws (draw, parameter).

    Of what cannot be negative and is most probably nearly nothing, as the contractility of a scar, it begins there.
    """
    ordered, inside = np.sort(draws, axis=0), int(np.ceil(COVERED * len(draws)))
    width = ordered[inside - 1 :] - ordered[: len(draws) - inside + 1]
    first, column = np.argmin(width, axis=0), np.arange(draws.shape[1])
    return ordered[first, column], ordered[first + inside - 1, column]


def _summary(names: list[str], posterior: Floats, prior: Floats) -> dict[str, NDArray[Any]]:
    """Summaries (parameter,) of draws (draw, parameter)."""
    lower, upper = shortest_interval(posterior)
    logarithmic = np.array([name.startswith(POSITIVE) for name in names])
    # Of a positive factor its logarithm is normal, whose spread tells what was learned.
    spread, before = (
        np.where(logarithmic, np.std(np.log(np.where(logarithmic, draws, 1.0)), axis=0), np.std(draws, axis=0))
        for draws in (posterior, prior)
    )
    return {
        "mean": posterior.mean(axis=0),
        "sd": posterior.std(axis=0),
        "lower": lower,
        "upper": upper,
        "prior_mean": prior.mean(axis=0),
        "prior_sd": prior.std(axis=0),
        "identifiable": spread <= IDENTIFIABLE * before,
    }
