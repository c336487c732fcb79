"""What was inferred of the hearts of a repository: the group `inference/fit` as a table."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from echotruth.repository import schema
from echotruth.repository.choice import image_size
from echotruth.units import unit_of

if TYPE_CHECKING:
    from echotruth.repository.reader import Repository

COLUMNS = (
    *("case", "tracker", "size_px", "parameter", "unit", "mean", "sd", "lower", "upper"),
    *(
        "prior_mean",
        "prior_sd",
        "identifiable",
        "scar_probability",
        "true",
        "misfit_probability",
        "misfit",
        "converged",
    ),
)
"""Columns of the table; `lower` and `upper` are the ends of the 90 % interval."""

MISFIT = 0.01
"""Probability of residuals as large, below which the model is said not to fit."""

FILE = "inference.csv"
"""Name of the table in the folder of a repository."""


def hearts(repository: Repository) -> list[str]:
    """Cases of which the muscle was inferred."""
    if not repository.config.inference.tracker:
        return []
    return [case for case in repository.present if not repository.problem(case, None, "inference")]


def table(repository: Repository) -> pd.DataFrame:
    """Table of all that was inferred of the hearts of a repository: a row for each heart and parameter."""
    config, section = repository.config, repository.config.inference
    about = {"tracker": section.tracker, "size_px": image_size(config, section.size_px)}
    fits = {case: repository.arrays("inference/fit", case) for case in hearts(repository)}
    found = [{"case": case} | about | row for case, fit in fits.items() for row in rows(fit)]
    return pd.DataFrame(found, columns=list(COLUMNS))


def write(path: Path, table: pd.DataFrame) -> None:
    """Write a table, with six digits."""
    table.to_csv(path, index=False, float_format="%.6g")


def read(path: Path) -> pd.DataFrame:
    """Read a table that :func:`write` wrote."""
    texts = dict.fromkeys(("case", "tracker", "parameter", "unit"), str)
    return pd.read_csv(path, dtype=texts, keep_default_na=False, na_values="")


def shown(repository: Repository, table: pd.DataFrame) -> str:
    """Case that is shown where only one can be: the first complete one or, if nothing was inferred of it, the first of
    which something was; empty if there is none."""
    cases = list(table["case"].unique())
    return next((str(case) for case in (*repository.shown[:1], *cases) if case in cases), "")


def rows(fit: dict[str, Any]) -> list[dict[str, Any]]:
    """Rows of the parameters of one heart that were inferred, by the names of their columns.

    Parameters
    ----------
    fit : dict of ndarray
        Group `inference/fit` of the heart.
    """
    probability = float(fit["misfit_probability"])
    about = {
        "misfit_probability": probability,
        "misfit": probability < MISFIT,
        "converged": bool(fit["converged"]),
    }
    names = ("mean", "sd", "lower", "upper", "prior_mean", "prior_sd", "true")
    return [
        {
            "parameter": name,
            "unit": unit_of(name) or "1",
            "identifiable": bool(fit["identifiable"][place]),
            "scar_probability": _of_segment(name, fit["scar_probability"]),
            **{column: float(fit[column][place]) for column in names},
            **about,
        }
        for place, name in enumerate(schema.LABELS["parameter"])
        if np.isfinite(fit["mean"][place])
    ]


def _of_segment(name: str, values: Any) -> float:
    """Value of the segment of a contractility; NaN of another parameter."""
    section, _, number = name.rpartition(".")
    return float(values[int(number) - 1]) if section == "contractility" else np.nan
