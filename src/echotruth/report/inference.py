"""What was inferred of the muscle of a heart: bullseyes, and the strain of the most probable one beside the tracked."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import TwoSlopeNorm
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from echotruth.report import bullseye, style
from echotruth.repository.schema import LABELS

Arrays = dict[str, NDArray[Any]]

_SCALES = {
    "contractility": TwoSlopeNorm(1, 0, 2),
    "sd": TwoSlopeNorm(0, -0.7, 0.7),
    "probability": TwoSlopeNorm(0, -1.2, 1.2),
}
"""White is the mean of the wall, no error, and no scar."""


@dataclass(frozen=True)
class Seen:
    """What a tracker saw of a heart, beside what is true and what the most probable heart shows.

    Attributes
    ----------
    label : sequence of str
        As :func:`.schema.observations` gives them.
    observed : ndarray of shape (n,)
        Strain, or rotation, rad; NaN where the tracker saw nothing.
    covariance : ndarray of shape (n, n)
        Of its errors.
    true, predicted : ndarray of shape (n,)
    """

    label: list[str]
    observed: NDArray[np.float64]
    covariance: NDArray[np.float64]
    true: NDArray[np.float64]
    predicted: NDArray[np.float64]


@style.styled
def draw(fit: Arrays, seen: Seen) -> Figure:
    """Draw what was inferred of a heart.

    Parameters
    ----------
    fit : dict of ndarray
        Group `inference/fit` of the heart.
    seen : Seen
    """
    figure = style.figure(9.6, 9.6)
    upper, lower = figure.subfigures(2, 1, squeeze=False, height_ratios=[6.2, 3.4])[:, 0]
    *discs, rest = upper.subplots(2, 3).ravel()
    rest.axis("off")
    names = [f"contractility.{number}" for number in range(1, 18)]
    at = [LABELS["parameter"].index(name) for name in names]
    known = fit["identifiable"][at] == 1
    shown = {
        "Inferred (mean)": (np.where(known, fit["mean"][at], np.nan), "contractility"),
        "True": (fit["true"][at], "contractility"),
        "Probability of a scar": (fit["scar_probability"], "probability"),
        "Standard deviation": (fit["sd"][at], "sd"),
        "Standard deviation before": (fit["prior_sd"][at], "sd"),
    }
    for axes, (title, (values, scale)) in zip(discs, shown.items(), strict=True):
        bullseye.disc(axes, values, _SCALES[scale], decimals=2)
        axes.set_title(title, fontweight="normal", fontsize=9)
    upper.suptitle("Contractility of the segments over the mean of the wall", fontweight="bold", fontsize=10)
    reason = "not identifiable, as little\nknown as before; or\nshown by no view"
    hatched = Patch(linewidth=0.6, label=reason, **bullseye.UNSEEN)
    rest.legend(handles=[hatched], loc="center", fontsize=8.5, labelcolor=style.MUTED)
    _strains(lower.subplots(), seen)
    return figure


def _strains(axes: Axes, seen: Seen) -> None:
    """Strain of the segments as it was seen, with its error, as it is, and as the most probable heart shows it."""
    strains = [not label.endswith("rotation") for label in seen.label]
    rows = np.flatnonzero(np.isfinite(seen.observed) & strains)
    at, sd = np.arange(len(rows)), np.sqrt(np.diag(seen.covariance)[rows])
    axes.errorbar(
        at,
        100 * seen.observed[rows],
        100 * sd,
        fmt="o",
        color=style.SERIES[0],
        markersize=4,
        linewidth=1,
        label="tracked, with its standard deviation",
    )
    axes.plot(at, 100 * seen.predicted[rows], "D", color=style.SERIES[1], markersize=4, label="most probable heart")
    axes.plot(at, 100 * seen.true[rows], "_", color=style.TRUTH, markersize=11, markeredgewidth=1.6, label="true")
    axes.axhline(0, color=style.MUTED, linewidth=0.6)
    axes.set_xticks(at, [seen.label[row].rpartition(" ")[2] for row in rows])
    views = [seen.label[row].rpartition(" ")[0] for row in rows]
    for view in dict.fromkeys(views):
        first, last = views.index(view), len(views) - 1 - views[::-1].index(view)
        axes.text((first + last) / 2, 1.02, style.title(view), ha="center", transform=axes.get_xaxis_transform())
        if first:
            axes.axvline(first - 0.5, color=style.GRID)
    axes.set_xlabel("AHA segment")
    axes.set_ylabel("Strain along the wall at ES (%)")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.08), ncols=3, fontsize=8.5)
