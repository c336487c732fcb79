"""Error of trackers at end-systole: bias of segment strain and rotation, and covariance between segments.

Of heart h, the error of segment s is b + c_h + e_hs: a bias, an error that all segments of the view share, and one of
each. Trackers smooth, so that they err most where neighbours differ most: the variance of e_hs is v + k d_h^2, with the
standard deviation d_h of the tracked strains of the view. v and k fit the variances within hearts (least squares, not
negative), the mean of all gives b, and the variance of the means of hearts less its part of e that of c. The errors of
a heart that is not among these then have the covariance

    (v + k d^2) I + (f var(c) (1 + 1/H) + mean(v + k d_h^2) / N) 1 1^T,    f = (t_95(H - 1) / z_95)^2,

with H hearts of N segments together; f widens it as Student's t distribution is wider than the normal one, since few
hearts tell var(c) badly.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.optimize import nnls
from scipy.stats import norm, t

from echotruth.arrays import Floats
from echotruth.config import Config
from echotruth.repository.choice import image_size

SHIPPED = Path(__file__).with_name("tracker_errors.csv")
"""Errors of the trackers of the benchmark, of its develop hearts; `benchmarks/tracker_errors.py` makes it."""

KEYS = ["tracker", "size_px", "acoustics", "quantity"]
COLUMNS = [*KEYS, "heart", "segments", "spread", "mean", "sd"]
"""`spread` is the standard deviation of what was tracked in the segments of a heart, `mean` and `sd` are those of its
errors: strain, or rotation in rad."""


class NoErrors(ValueError):
    """Raised if the error of a tracker is not known."""


@dataclass(frozen=True)
class TrackerError:
    """Error of one quantity.

    Attributes
    ----------
    bias, common_sd : float
        Mean of tracked less true, and standard deviation of what all segments of a view share; strain, or rad.
    segment_variance : float
        Of what each segment has by itself, v, where all are tracked alike.
    smoothing : float
        k, by which it grows with the variance of what is tracked.
    hearts : int
        Number of hearts of which they are known.
    """

    bias: float
    common_sd: float
    segment_variance: float
    smoothing: float
    hearts: int

    def covariance(self, tracked: Floats) -> Floats:
        """Covariance (n, n) of the errors of the segments of one view, given what was tracked, (n,)."""
        own = self.segment_variance + self.smoothing * np.var(tracked, ddof=1 if len(tracked) > 1 else 0)
        return self.common_sd**2 + own * np.eye(len(tracked))


def acoustics(config: Config) -> str:
    """`ideal`, or `realistic` where surroundings, noise, haze or a shadow are in the images."""
    realism = config.realism
    added = (realism.surroundings.level_dB, realism.noise.snr_dB, realism.haze.level_dB)
    return "ideal" if all(value is None for value in added) and realism.shadow.side == "none" else "realistic"


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
        table = pd.read_csv(path, dtype={name: str for name in ("tracker", "acoustics", "quantity", "heart")})
    except (ValueError, UnicodeDecodeError) as error:
        raise NoErrors(f"{path}: is no table: {error}") from None
    if missing := [name for name in COLUMNS if name not in table]:
        raise NoErrors(f"{path}: has no column {missing[0]}: it needs {', '.join(COLUMNS)}")
    for name in ("size_px", "segments", "spread", "mean", "sd"):
        values = pd.to_numeric(table[name], errors="coerce").to_numpy(float)
        if not np.isfinite(values).all() or (name != "mean" and (values < 0).any()):
            row = int(np.argmax(~np.isfinite(values) | ((name != "mean") & (values < 0)))) + 1
            raise NoErrors(f"{path}, row {row}: {name} is {table[name].iloc[row - 1]}: give a number of an error")
    return table


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
    if len(rows) < 2:
        asked = f"{tracker} at {size} px with {kind} acoustics"
        known = sorted({f"{row.size_px} px {row.acoustics}" for row in of_tracker.itertuples()})
        there = (
            f"it is known at {', '.join(known)}" if known else f"known are {', '.join(sorted(set(table['tracker'])))}"
        )
        remedy = "make a table of it by benchmarks/tracker_errors.py"
        raise NoErrors(f"tracker: the error of {asked} in {quantity} is known of {len(rows)} hearts: {there}; {remedy}")
    return _analysed(*(rows[name].to_numpy(float) for name in ("segments", "spread", "mean", "sd")))


def _analysed(segments: Floats, spread: Floats, mean: Floats, sd: Floats) -> TrackerError:
    """Error from number, spread, and mean and standard deviation of the errors of the segments of each heart."""
    hearts, weight = len(mean), np.sqrt(np.maximum(segments - 1, 0))
    matrix = np.column_stack([np.ones(hearts), spread**2])
    (variance, smoothing), _ = nnls(matrix * weight[:, None], sd**2 * weight)
    own = variance + smoothing * spread**2
    between = max(np.var(mean, ddof=1) - np.mean(own / segments), 0.0)
    widened = (t.ppf(0.95, hearts - 1) / norm.ppf(0.95)) ** 2
    common = np.sqrt(widened * between * (1 + 1 / hearts) + np.mean(own) / np.sum(segments))
    return TrackerError(float(np.mean(mean)), float(common), float(variance), float(smoothing), hearts)


def table_of(rows: Iterable[tuple[str, int, str, str, str, Floats, Floats]]) -> pd.DataFrame:
    """Table of errors.

    Parameters
    ----------
    rows : iterable
        Tracker, size in pixels, acoustics, quantity, heart, and what was tracked and is true in its segments, (n,).
    """
    found = []
    for *about, tracked, true in rows:
        error, freedom = tracked - true, int(len(true) > 1)
        found.append((*about, len(true), np.std(tracked, ddof=freedom), np.mean(error), np.std(error, ddof=freedom)))
    return pd.DataFrame(found, columns=COLUMNS).sort_values([*KEYS, "heart"], ignore_index=True)


def version(configs: Iterable[Config]) -> str:
    """Hash of the table from which the hearts of a repository are inferred.

    Raises
    ------
    NoErrors
        If the table cannot be read, or does not know the tracker on images like those of one of the hearts.
    """
    kept = {(_asked(config), acoustics(config), _quantities(config)) for config in configs}
    digest = sha256()
    for (path, tracker, size), kind, quantities in sorted(kept, key=str):
        table = read(Path(path) if path else None)
        for quantity in quantities:
            error_of(table, tracker, size, kind, quantity, "")
        digest.update(table.to_csv().encode())
    return digest.hexdigest()[:16]


def _asked(config: Config) -> tuple[str | None, str, int]:
    """File of the table, tracker and image size that a configuration names."""
    section = config.inference
    return section.errors, str(section.tracker), image_size(config, section.size_px)


def _quantities(config: Config) -> tuple[str, ...]:
    """What the views of a configuration show."""
    planes = {view.plane for view in config.views.values()}
    of = {"short_axis": ("circumferential", "rotation"), "long_axis": ("longitudinal",)}
    return tuple(quantity for plane in sorted(planes) for quantity in of[plane])
