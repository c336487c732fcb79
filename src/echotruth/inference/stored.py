"""What is inferred of a heart, as the store has it: groups of ArviZ's InferenceData, and a summary."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from echotruth.arrays import Floats
from echotruth.cases import Case
from echotruth.inference.estimate import infer
from echotruth.inference.imaged_wall import ROTATION
from echotruth.inference.observation import observe, seen_of
from echotruth.inference.truth import truth
from echotruth.repository import schema
from echotruth.repository.reader import Repository

Groups = dict[str, dict[str, Any]]

SUMMARY = ("mean", "sd", "lower", "upper", "prior_mean", "prior_sd")


def stored(repository: Repository, case: Case) -> Groups:
    """Infer a heart as its configuration says, and give the arrays of the groups `inference` (docs/schema.md).

    Raises
    ------
    ValueError, NoMode
        As :func:`.observation.observe` and :func:`.estimate.infer`.
    """
    section = case.config.inference
    observed = observe(repository, section.tracker, case.id, section.size_px, section.errors)
    found = infer(observed, section.prior, progress=False)
    seen = seen_of(repository, case, found.attrs["tracker"], found.attrs["size_px"])
    true = {
        _label(one.view, number): value for one in seen for number, value in zip(one.segments, one.true, strict=True)
    }
    return groups(found, true, truth(repository, case.id), case)


def groups(found: xr.Dataset, true_seen: dict[str, float], true: dict[str, float], case: Case) -> Groups:
    """Arrays of the groups `inference`, by group and name.

    Parameters
    ----------
    found : Dataset
        As :func:`.estimate.infer` returns it.
    true_seen : dict
        True values of what may be observed, by their labels (:func:`.schema.observations`).
    true : dict
        True values of the parameters, by their names.
    case : Case
    """
    labels, parameters = schema.observations(case.config), list(schema.LABELS["parameter"])
    seen = zip(found["view"].values, found["segment"].values, strict=True)
    at = [labels.index(_label(view, int(number))) for view, number in seen]
    of = [parameters.index(name) for name in found["parameter"].values]

    def placed(values: Any, places: list[int], size: int) -> Floats:
        """Values along the last dimension at their places, NaN elsewhere."""
        whole = np.full((*np.shape(values)[:-1], size), np.nan)
        whole[..., places] = values
        return whole

    covariance = np.full((len(labels), len(labels)), np.nan)
    covariance[np.ix_(at, at)] = found["covariance"].values
    estimates = {name: placed(found[name].values, of, len(parameters)) for name in (*SUMMARY, "identifiable")}
    estimates |= {
        "true": np.array([true.get(name, np.nan) for name in parameters]),
        "scar_probability": found["scar_probability"].values,
        "predicted": placed(found["predicted"].values, at, len(labels)),
        **{name: np.array(float(found.attrs[name])) for name in ("misfit_probability", "converged")},
    }
    return {
        "inference/posterior": {
            "value": placed(found["posterior"].values, of, len(parameters))[None],
            "scar": found["scar"].values[None].astype(np.uint8),
        },
        "inference/prior": {"value": placed(found["prior"].values, of, len(parameters))[None]},
        "inference/observed_data": {"value": placed(found["observed"].values, at, len(labels))},
        "inference/posterior_predictive": {"value": placed(found["replicated"].values, at, len(labels))[None]},
        "inference/constant_data": {
            "covariance": covariance,
            "true_value": np.array([true_seen.get(label, np.nan) for label in labels]),
        },
        "inference/fit": estimates,
    }


def _label(view: str, number: int) -> str:
    """Label of an observation: the view, and the segment, or rotation for 0."""
    return f"{view} {number or ROTATION}"
