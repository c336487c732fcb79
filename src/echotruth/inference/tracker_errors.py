"""Error of trackers at end-systole: bias, lost contrast, and covariance between segments.

A view of heart h has the true values x_s of N segments, and the tracked ones t_s, of means m(x) and m(t). Trackers
smooth, so that neighbours differ less than they should; of the mean, and of the deviations from it,

    m(t) = m(x) + b + c_h,    t_s - m(t) = g (x_s - m(x)) + e_s,

with a bias b, an error c_h of each heart, a gain g, and errors e_s of variance v + k d^2, which grow with the standard
deviation d of the true values. v and k fit the variances of the views (least squares, not negative), g is the weighted
mean of the views together with what is known before, 1 +- 0.3. What is seen of a heart that is not among these is

    y_s = m(t) - b + (t_s - m(t)) / g

with the covariance

    f var(c) (1 + 1/H) 1 1^T + ((v + k d^2) (I - 1 1^T / N) + var(g) (y - m(y)) (y - m(y))^T) / g^2,

f = (t_95(H - 1) / z_95)^2, with H hearts; f widens it as Student's t distribution is wider than the normal one, since
few hearts give a poor var(c). The tracked values are regressed on the true ones and not these on them, which would hold
how much segments differ in these hearts: that is for the prior to say.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.optimize import nnls
from scipy.stats import norm, t

from echotruth.arrays import Floats
from echotruth.config import Config
from echotruth.repository.choice import image_size

SHIPPED = Path(__file__).with_name("tracker_errors.csv")
"""Errors of trackers in the images of hearts to develop on; `benchmarks/tracker_errors.py` makes it."""

KEYS = ["tracker", "size_px", "acoustics", "quantity"]
PLACE = ["heart", "case", "view"]
NUMBERS = ["segments", "mean", "true_sd", "tracked_sd", "correlation"]
"""Of the segments of a view: how many, the mean of their errors (strain, or rotation in rad), the standard deviations
of what is true and of what was tracked, and the correlation of both."""
COLUMNS = [*KEYS, *PLACE, *NUMBERS]
LIMITS = {"mean": (-np.inf, np.inf), "correlation": (-1.0, 1.0), "segments": (1.0, np.inf)}
"""Of numbers; those of the others are 0 and infinity."""

GAIN_SD = 0.3
"""Standard deviation of the gain, about 1, before anything is known of a tracker."""
LEAST_GAIN = 0.1
"""Taken where less is found: such a tracker hardly shows how segments differ, and its errors say so."""
LEAST_VARIANCE = 1e-12
"""Of the error of a segment, so that a tracker without one has a gain."""
ROUNDS = 3
"""In which gain and variances, each of which needs the other, are found."""


class NoErrors(ValueError):
    """Raised if the error of a tracker is not known."""


@dataclass(frozen=True)
class TrackerError:
    """Error of one quantity.

    Attributes
    ----------
    bias, common_sd : float
        Mean of tracked less true, and standard deviation of the error of the mean of a view; strain, or rad.
    gain, gain_sd : float
        Tracked over true deviation of a segment from the mean of its view, and its standard deviation.
    segment_variance : float
        Of what each segment has by itself, v, where all are alike.
    unevenness : float
        k, by which it grows with the variance of the segments.
    segments : int
        Number of segments of a view that shows all it can.
    """

    bias: float
    common_sd: float
    gain: float
    gain_sd: float
    segment_variance: float
    unevenness: float
    segments: int

    def corrected(self, tracked: Floats) -> Floats:
        """What is most probably true of the segments of one view, of what was tracked, (n,)."""
        mean = np.mean(tracked)
        return mean - self.bias + (tracked - mean) / self.gain

    def covariance(self, tracked: Floats) -> Floats:
        """Covariance (n, n) of the errors of :meth:`corrected`."""
        number = len(tracked)
        deviation = (tracked - np.mean(tracked)) / self.gain
        own = self.segment_variance + self.unevenness * np.sum(deviation**2) / max(number - 1, 1)
        apart = np.eye(number) - 1 / max(self.segments, number)
        of_gain = self.gain_sd**2 * np.outer(deviation, deviation)
        return np.asarray(self.common_sd**2 + (own * apart + of_gain) / self.gain**2)


def acoustics(config: Config) -> str:
    """`ideal` if muscle, blood and borders alone are imaged and their echoes do not change; else `realistic`."""
    realism = config.realism
    levels = (realism.decorrelation.time_ms, realism.surroundings.level_dB, realism.noise.snr_dB, realism.haze.level_dB)
    changes = realism.backscatter.model_dump(include={"anisotropy_dB", "fibre_strain_dB", "variation_dB"})
    added = [*(level is not None for level in levels), realism.shadow.side != "none", realism.neighbours.any]
    return "realistic" if any(added) or any(changes.values()) else "ideal"


def read(path: Path | None = None) -> pd.DataFrame:
    """Read a table of errors; that of the package by default.

    Raises
    ------
    NoErrors
        If the file is no such table.
    """
    path = path or SHIPPED
    if not path.is_file():
        raise NoErrors(f"{path}: there is no such table of errors: benchmarks/tracker_errors.py makes one")
    try:
        table = pd.read_csv(path, dtype=dict.fromkeys(({*KEYS, *PLACE} - {"size_px"}), str))
    except (ValueError, UnicodeDecodeError) as error:
        raise NoErrors(f"{path}: is no table: {error}") from None
    if missing := [name for name in COLUMNS if name not in table]:
        raise NoErrors(f"{path}: has no column {missing[0]}: it needs {', '.join(COLUMNS)}")
    for name in ("size_px", *NUMBERS):
        _check_numbers(path, table[name])
    return table


def _check_numbers(path: Path, column: pd.Series) -> None:
    """Refuse a column of a table in which a number is none, or beyond its limits."""
    values = pd.to_numeric(column, errors="coerce").to_numpy(float)
    low, high = LIMITS.get(str(column.name), (0.0, np.inf))
    wrong = ~(np.isfinite(values) & (values >= low) & (values <= high))
    if wrong.any():
        row = int(np.argmax(wrong))
        raise NoErrors(f"{path}, row {row + 1}: {column.name} is {column.iloc[row]}: give a number of an error")


def error_of(table: pd.DataFrame, tracker: str, size: int, kind: str, quantity: str, heart: str) -> TrackerError:
    """Error of a tracker for a heart, of the other hearts of a table.

    Parameters
    ----------
    table : DataFrame
        As :func:`read` returns it.
    tracker : str
    size : int
        Pixels along a side.
    kind : {"ideal", "realistic"}
        Acoustics.
    quantity : {"circumferential", "longitudinal", "rotation"}
    heart : str
        Its rows do not count.

    Raises
    ------
    NoErrors
        If fewer than two other hearts are in the table.
    """
    of_tracker = table[table["tracker"] == tracker]
    chosen = (of_tracker["size_px"] == size) & (of_tracker["acoustics"] == kind) & (of_tracker["quantity"] == quantity)
    rows = of_tracker[chosen & (of_tracker["heart"] != heart)]
    if (number := rows["heart"].nunique()) < 2:
        asked = f"{tracker} at {size} px with {kind} acoustics"
        known = sorted({f"{row.size_px} px {row.acoustics}" for row in of_tracker.itertuples()})
        there = (
            f"it is known at {', '.join(known)}" if known else f"known are {', '.join(sorted(set(table['tracker'])))}"
        )
        remedy = "make a table of it by benchmarks/tracker_errors.py"
        raise NoErrors(f"tracker: the error of {asked} in {quantity} is known of {number} hearts: {there}; {remedy}")
    return _analysed(rows["heart"].to_numpy(), *(rows[name].to_numpy(float) for name in NUMBERS))


def _analysed(
    heart: NDArray[Any], segments: Floats, mean: Floats, true_sd: Floats, tracked_sd: Floats, correlation: Floats
) -> TrackerError:
    """Error from the numbers of views (n,), each of a heart."""
    freedom = np.maximum(segments - 1, 0)
    gain, gain_sd, variance, unevenness = _of_segments(freedom, true_sd, tracked_sd, correlation)
    of_hearts = np.array([np.mean(mean[heart == one]) for one in sorted(set(heart))])
    number = len(of_hearts)
    widened = (t.ppf(0.95, number - 1) / norm.ppf(0.95)) ** 2
    common = np.sqrt(widened * np.var(of_hearts, ddof=1) * (1 + 1 / number))
    bias = float(np.mean(of_hearts))
    return TrackerError(bias, float(common), gain, gain_sd, variance, unevenness, int(segments.max()))


def _of_segments(
    freedom: Floats, true_sd: Floats, tracked_sd: Floats, correlation: Floats
) -> tuple[float, float, float, float]:
    """Gain, its standard deviation, v and k, from the deviations in views of N - 1 degrees of freedom, (n,)."""
    square, product = true_sd**2, correlation * true_sd * tracked_sd
    matrix, root = np.column_stack([np.ones(len(square)), square]), np.sqrt(freedom)
    gain, gain_sd, found = 1.0, GAIN_SD, np.zeros(2)
    for _ in range(ROUNDS):
        residual = np.maximum(tracked_sd**2 - 2 * gain * product + gain**2 * square, 0.0)
        found, _ = nnls(matrix * root[:, None], residual * root)
        weight = freedom / np.maximum(matrix @ found, LEAST_VARIANCE)
        information = weight @ square + GAIN_SD**-2
        gain, gain_sd = (weight @ product + GAIN_SD**-2) / information, information**-0.5
        gain = max(gain, LEAST_GAIN)
    return float(gain), float(gain_sd), float(found[0]), float(found[1])


def table_of(rows: Iterable[tuple[str, int, str, str, str, str, str, Floats, Floats]]) -> pd.DataFrame:
    """Table of errors.

    Parameters
    ----------
    rows : iterable
        Tracker, size in pixels, acoustics, quantity, heart, case, view, and what was tracked and is true in its
        segments, (n,).
    """
    found = [(*about, *_numbers(tracked, true)) for *about, tracked, true in rows]
    return pd.DataFrame(found, columns=COLUMNS).sort_values([*KEYS, *PLACE], ignore_index=True)


def _numbers(tracked: Floats, true: Floats) -> tuple[int, float, float, float, float]:
    """Those of :data:`NUMBERS`, of the segments of a view."""
    freedom = max(len(true) - 1, 1)
    deviations = [values - np.mean(values) for values in (true, tracked)]
    true_sd, tracked_sd = (float(np.sqrt(np.sum(one**2) / freedom)) for one in deviations)
    both = true_sd * tracked_sd * freedom
    correlation = float(deviations[0] @ deviations[1]) / both if both > 0 else 0.0
    return len(true), float(np.mean(tracked - true)), true_sd, tracked_sd, float(np.clip(correlation, -1, 1))


def check(configs: Iterable[Config]) -> None:
    """Check that the error is known of the tracker by which the hearts of a repository are inferred.

    Raises
    ------
    NoErrors
        If the table cannot be read, or does not know the tracker on images like those of one of the hearts.
    """
    asked = {(_asked(config), acoustics(config), _quantities(config)) for config in configs}
    for (path, tracker, size), kind, quantities in sorted(asked, key=str):
        table = read(Path(path) if path else None)
        for quantity in quantities:
            error_of(table, tracker, size, kind, quantity, "")


def _asked(config: Config) -> tuple[str | None, str, int]:
    """File of the table, tracker and image size that a configuration names."""
    section = config.inference
    return section.errors, str(section.tracker), image_size(config, section.size_px)


def _quantities(config: Config) -> tuple[str, ...]:
    """What the views of a configuration show."""
    planes = {view.plane for view in config.views.values()}
    of = {"short_axis": ("circumferential", "rotation"), "long_axis": ("longitudinal",)}
    return tuple(quantity for plane in sorted(planes) for quantity in of[plane])
