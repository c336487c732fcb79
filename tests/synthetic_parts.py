"""A table with the columns of the parts of the suite, drawn: hearts by trackers of which the errors are known."""

from itertools import product

import numpy as np
import pandas as pd

from benchmarks.suite.columns import TANGENTIAL

EFFECTS = {
    "bspline_dic": 0.0,
    "affine_dic": 0.0,
    "dis_fine": 0.25,
    "dis": 0.45,
    "window_deformation": 0.5,
    "corrected": 0.9,
    "as_published": 2.0,
}
"""Tracker -> logarithm of its error over that of the first."""

GROUPS = ("healthy", "infarct", "late_activation", "hypertrophy", "dilation")
VIEWS = {"mid": "short_axis", "long_axis": "long_axis"}
HEARTS = {("test", "mouse"): 48, ("test", "human"): 12, ("develop", "mouse"): 12, ("develop", "human"): 4}
VARIATIONS = ("none", "none", "motion", "shadow", "low_rate")
BLUR = {"bspline_dic": 0.1, "affine_dic": 0.2, "as_published": 0.9}
"""Part of the mean over the segments in what a tracker finds; of others 0.3."""

DEVIATION = 0.22
"""Of the logarithm of the ratio of two errors over hearts."""


def parts(seed=0, hearts=HEARTS):
    """Rows of clips, as `read_parts` returns them."""
    random, rows = np.random.default_rng(seed), []
    for (split, species), count in hearts.items():
        for number in range(count):
            rows += list(_of_heart(random, split, species, number))
    return pd.DataFrame(rows)


def _of_heart(random, split, species, number):
    group = "healthy" if number % 3 == 0 else GROUPS[1 + number % 4] if number % 3 == 1 else "infarct"
    hard = np.log(12) + random.normal(0, 0.4)
    own = {name: effect + random.normal(0, DEVIATION / np.sqrt(2)) for name, effect in EFFECTS.items()}
    heart = f"{split}_{species}{number:02d}"
    share = np.zeros(17)
    if group == "infarct":
        at = number % 6
        share[6 + at], share[6 + (at + 1) % 6], share[12 + at % 4] = 0.9, random.uniform(0.1, 0.5), 0.8
    level, strain = random.normal(-18, 1.5), {}
    for plane in TANGENTIAL:
        strain[plane] = level * (1 - 0.85 * share) + random.normal(0, 1.2, 17)
    for acoustics in ("realistic", "ideal") if number % 4 == 0 else ("realistic",):
        for (view, plane), size in product(VIEWS.items(), (256, 128)):
            for tracker, effect in own.items():
                variation = VARIATIONS[number % 5] if number % 4 else "none"
                is_failed = tracker == "corrected" and random.random() < 0.02
                error = hard + effect + 0.3 * (size == 128) - 0.5 * (acoustics == "ideal") + random.normal(0, 0.1)
                row = {"part": 1 + number // 8, "split": split, "species": species, "heart": heart, "group": group}
                row |= {"disease": "healthy" if group == "healthy" else "diseased", "acoustics": acoustics}
                row |= {"variation": variation, "case": f"{heart}_{acoustics}", "view": view, "size_px": size}
                row |= {"tracker": tracker, "plane": plane, "diagnosis": "", "failure": "lost" if is_failed else np.nan}
                row |= {"cpu_s": np.exp(random.normal(0, 0.2)) * (1 + list(EFFECTS).index(tracker)), "code": "0" * 64}
                row["nrmse_all_percent"] = 100.0 if is_failed else float(np.exp(error))
                row |= {"drift_um": np.exp(error) / 4, "segment_peak_error_pp": np.exp(error) / 8}
                shown = np.arange(7, 13) if view == "mid" else np.arange(1, 17)
                row |= _segments(random, strain[plane], share, shown, BLUR.get(tracker, 0.3), np.exp(error) / 10)
                name = "gcs" if plane == "short_axis" else "gls"
                for other in ("gcs", "gls"):
                    true = level if other == name else np.nan
                    tracked = np.nan if is_failed else true + effect + random.normal(0, 1)
                    row |= {f"true_{other}_percent": true, f"tracked_{other}_percent": tracked}
                yield row | _steps(random, 0.25 * effect)


def _segments(random, strain, share, shown, blur, noise):
    tracked = (1 - blur) * strain + blur * strain[shown - 1].mean() + random.normal(0, noise, 17)
    row = {}
    for aha in shown:
        values = {
            "points": 60,
            "infarct_share": share[aha - 1],
            "infarct_extent": share[aha - 1],
            "epicardial_share": 0,
        }
        for name, of in (("true", strain), ("tracked", tracked)):
            values |= {f"{name}_peak_percent": of[aha - 1], f"radial_{name}_peak_percent": -2 * of[aha - 1]}
        row |= {f"{name}_{aha:02d}": value for name, value in values.items()}
    return row


def _steps(random, excess):
    row = {}
    for step, count in enumerate(random.multinomial(2000, np.arange(1, 11) / 55)):
        stated = (step + 0.5) / 10
        right = random.binomial(count, np.clip(stated - excess, 0, 1))
        row |= {f"count_{step}": count, f"quality_sum_{step}": count * stated, f"within_count_{step}": right}
    return row
