"""Page of the suite, docs/benchmark.md: its tables, from the parts alone.

python -m benchmarks.suite page --split develop
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from numpy.typing import NDArray

from echotruth import files
from echotruth.evaluation.agreement import limits_of_agreement
from echotruth.evaluation.leaderboard import RANKED_BY
from echotruth.evaluation.paired_ratios import LEAST_HEARTS

from . import charts, columns, power, quality
from .comparison import against, by_heart, deviation, ranking, scores
from .detection import detection, recovery
from .parts import CLIP, FOLDER

REFERENCE = "bspline_dic"
"""Tracker with which others are compared in people, who are few."""

EFFECTS = (0.05, 0.1, 0.15, 0.18, 0.25, 0.35, 0.5)
"""Shares by which a score is smaller, of which the page has the power."""

OTHERS = {
    "segment_peak_error_pp": ("segmental peak strain (pp)", 1),
    "drift_um": ("drift (µm)", 1),
    "cpu_s": ("CPU (s a clip)", 2),
}
"""Metric -> its heading, of which there is the median over the clips, and its decimals."""

OUTSIDE = FOLDER.parent / "outside.csv"
"""Table of benchmarks/outside.py."""

IMAGES = {
    "mouse": "Mice, realistic",
    "human": "People, realistic",
    "PyMUST": "Rings in water, images of PyMUST",
    "disk": "A real disk",
}
"""Kinds of its images, and their headings."""

LEAST_ERROR = 0.01
"""Error over which others are taken at least, 1/256 of the side: images of a wall at rest may be all the same."""

NONE = "–"


class Page:
    """Tables and figures of one page.

    Parameters
    ----------
    parts : DataFrame
        As :func:`.parts.read_parts` returns it.
    split : {"develop", "test"}
        Half of the hearts that is reported.
    """

    def __init__(self, parts: pd.DataFrame, split: str) -> None:
        self.split, self.code = split, ", ".join(sorted(parts["code"].dropna().str[:12].unique()))
        self.clips = parts[parts["split"] == split].assign(failure=lambda rows: rows["failure"].fillna(""))
        self.sizes: list[int] = sorted(map(int, self.clips["size_px"].unique()), reverse=True)
        self.mice, self.people = (self.of(species=name, acoustics="realistic") for name in ("mouse", "human"))
        self.boards = {size: ranking(scores(self.at(size))) for size in self.sizes}
        self.order = [str(name) for name in next(iter(self.boards.values())).index] if len(self.mice) else []
        self.hearts = {"mice": self.mice["heart"].nunique(), "people": self.people["heart"].nunique()}
        self.deviations = {
            "mice": deviation(scores(self.at_largest(self.mice))),
            "people": deviation(scores(self.at_largest(self.people))),
        }
        self.power = self._power()

    def of(self, **values: object) -> pd.DataFrame:
        """Clips with the given values of columns."""
        return self.clips[np.logical_and.reduce([self.clips[name] == value for name, value in values.items()])]

    def at_largest(self, clips: pd.DataFrame) -> pd.DataFrame:
        """Those of some clips at the largest image size."""
        return clips[clips["size_px"] == max(self.sizes, default=0)]

    def _power(self, effect: float = 0.0) -> dict[str, power.Power]:
        """What the hearts can show, by who is compared, where diseases have an effect of this size."""
        kinds = (("mice", "each with each", False), ("mice", "with one", True), ("people", "with one", True))
        return {
            f"{self.hearts[name]} {name}, {words}": power.simulate(
                self.groups(name), self.deviations[name], is_one, effect
            )
            for name, words, is_one in kinds
            if self.hearts[name] >= LEAST_HEARTS and np.isfinite(self.deviations[name])
        }

    def groups(self, name: str) -> NDArray[np.str_]:
        """Disease of each of the mice or people."""
        clips = self.mice if name == "mice" else self.people
        return clips.drop_duplicates("heart")["group"].to_numpy(str)

    def contents(self) -> str:
        """Number of hearts by group and species."""
        hearts = self.clips.drop_duplicates(["species", "heart"])
        counts = pd.crosstab(hearts["group"], hearts["species"]).sort_index(key=lambda names: names != "healthy")
        rows = [[str(group).replace("_", " "), *map(str, row)] for group, row in counts.T.items()]
        return markdown(["group", *map(str, counts.columns)], rows)

    def board(self) -> str:
        """Mice: ranges of ranks and errors at all image sizes, ratios to the first, and other metrics."""
        first, *rest = self.sizes
        of = self.at_largest(self.mice).groupby("tracker")
        others = {metric: about for metric, about in OTHERS.items() if metric in self.mice}
        medians, failed = of[list(others)].median(), of["failure"].agg(lambda text: (text != "").sum())
        slowest = of["cpu_s"].quantile(0.99) if "cpu_s" in others else pd.Series(np.nan, medians.index)
        rows = []
        for name, row in self.boards[first].iterrows():
            cells = [ranks(row), number(row["score"]), interval(row, 2)]
            for size in rest:
                other = self.boards[size].reindex([name]).iloc[0]
                cells += [ranks(other), number(other["score"])]
            cells += [number(medians.at[name, metric], digits) for metric, (_, digits) in others.items()]
            rows.append([f"`{name}`", *cells, number(slowest[name], 2), f"{failed[name]} of {of.size()[name]}"])
        headings = ["rank", f"NRMSE at {first} px (%)", "to the first"]
        headings += [text for size in rest for text in (f"rank at {size} px", f"NRMSE at {size} px (%)")]
        headings += [text for text, _ in others.values()]
        return markdown(["tracker", *headings, "99th percentile (s)", "clips failed"], rows)

    def conditions(self) -> str:
        """Geometric mean errors of mice by what is changed, at the largest size."""
        mice = self.at_largest(self.of(species="mouse"))
        real, ideal = (mice[mice["acoustics"] == name] for name in ("realistic", "ideal"))
        found = {"all, realistic": real, "ideal": ideal}
        found["realistic, hearts of ideal"] = real[real["heart"].isin(ideal["heart"])]
        for column in ("variation", "disease", "plane"):
            found |= {f"{value}".replace("_", " "): real[real[column] == value] for value in real[column].unique()}
        found = {name.replace("none", "nothing else"): of for name, of in found.items() if len(of)}
        means = {
            f"{name} ({of['heart'].nunique()})": np.exp(scores(of).mean(skipna=False)) for name, of in found.items()
        }
        return self._table("tracker", means, lambda values, name: number(values.get(name, np.nan)))

    def against(self) -> str:
        """People: ratios to the reference at all image sizes."""
        found = {}
        for size in self.sizes:
            of = scores(self.people[self.people["size_px"] == size])
            if REFERENCE in of and of[REFERENCE].notna().all():
                own = pd.DataFrame({"score": [np.exp(of[REFERENCE].mean())]}, index=[REFERENCE])
                found[size] = pd.concat([own, against(of, REFERENCE)])

        def verdict(table: pd.DataFrame, name: str) -> str:
            if name not in table.index:
                return NONE
            row = table.loc[name]
            words = "worse" if row["low"] > 1 else "better" if row["high"] < 1 else "undecided"
            return f"{number(row['score'])}; " + (f"{interval(row, 2)}, {words}" if name != REFERENCE else "reference")

        return self._table("NRMSE (%); ratio", {f"{size} px": table for size, table in found.items()}, verdict)

    def agreement(self) -> str:
        """Bias and limits of agreement of GLS and GCS, percentage points."""
        found: dict[str, dict[str, str]] = {}
        for species, clips in (("mice", self.mice), ("people", self.people)):
            for strain in ("gls", "gcs"):
                of = self.at_largest(clips)
                true, tracked = (by_heart(of, f"{what}_{strain}_percent") for what in ("true", "tracked"))
                texts = {str(name): _limits(tracked[name].reindex(true.index), true[name]) for name in tracked}
                found |= {f"{strain.upper()}, {species}": texts} if texts else {}
        return self._table("tracker", found, lambda cells, name: cells.get(name, NONE))

    def detections(self) -> str:
        """Areas under the curve of subtle infarcts in mice."""
        found = {f"{size} px": detection(segments) for size, segments in self._segments.items()}
        names = [*self.order, "true strain"]
        table = self._table("tracker", found, _area, names)
        counts = next(iter(found.values())).iloc[-1]
        told = f"{counts['positive']:.0f} segments with a subtle infarct and {counts['healthy']:.0f} healthy ones"
        return f"{table}\n\nOf {told}."

    def recoveries(self) -> str:
        """What is left of differences between segments in hearts with an infarct."""
        found: dict[str, pd.Series] = {}
        for size, segments in self._segments.items():
            table, radial = recovery(segments), recovery(columns.segments(self.at(size), is_radial=True))
            found |= {f"{what} at {size} px": table[what] for what in ("contrast", "spread")}
            found |= {f"radial contrast at {size} px": radial["contrast"]}
        return self._table("tracker", found, lambda values, name: number(values.get(name, np.nan), 2))

    def qualities(self, species: str) -> str:
        """Stated and observed share of right points by acoustics, plane and image size, and the calibration error."""
        clips = self.of(species=species).sort_values("size_px", ascending=False, kind="stable")
        steps = _stated(clips).merge(clips[["case", "view", "plane"]].drop_duplicates())
        keys = ["acoustics", "plane", "size_px"]
        found = {
            f"{acoustics}, {plane.replace('_', ' ')}, {size} px": {
                str(name): quality.stated_and_right(rows) for name, rows in of.groupby("tracker")
            }
            for (acoustics, plane, size), of in steps.groupby(keys, sort=False)
        }
        return self._table("tracker", found, lambda cells, name: " / ".join(map(number, cells.get(name, ()))) or NONE)

    def powers(self) -> str:
        """Power by effect and who is compared."""
        rows = [
            [f"{100 * less:.0f} %", *(f"{100 * found.of(less):.0f}" for found in self.power.values())]
            for less in EFFECTS
        ]
        least = (f"{100 * found.least:.0f} %" for found in self.power.values())
        shared = self._power(power.DISEASE_EFFECT).values()
        false, beside = ([f"{100 * found.false_order:.1f}" for found in of] for of in (self.power.values(), shared))
        names = "**equal ones ordered**", f"**the same, diseases differ by {100 * power.DISEASE_EFFECT:.0f} %**"
        return markdown(
            ["error smaller by", *self.power],
            [*rows, ["**shown in 80 %**", *least], [names[0], *false], [names[1], *beside]],
        )

    def outside(self) -> str:
        """Errors and thickening on motions that no heart makes, two tables for each kind of images."""
        texts = []
        for images, rows in pd.read_csv(OUTSIDE).groupby("images", sort=False):
            by_motion = rows.groupby("motion", sort=False)
            of = {str(motion): found.groupby("tracker").mean(numeric_only=True) for motion, found in by_motion}
            names = [name for name in self.order if all(name in found.index for found in of.values())]
            others = [name for name in names if name != REFERENCE]
            errors = [[motion, *_errors(found, others)] for motion, found in of.items()]
            bias = [[motion, *_thickening(found, names)] for motion, found in of.items()]
            heads = [f"true (px), `{REFERENCE}` (px)", *(f"`{name}`" for name in others)]
            texts += [f"### {IMAGES[str(images)]}", markdown(["motion", *heads], errors)]
            texts += [markdown(["motion", "true E_RR (%)", *(f"`{name}`" for name in names)], bias)]
        return "\n\n".join(texts)

    def draw(self, folder: Path) -> None:
        """Draw the figures."""
        folder.mkdir(parents=True, exist_ok=True)
        charts.draw_ratios(folder / "ratios.png", self.boards)
        if self.power:
            charts.draw_power(folder / "power.png", self.power)
        curves = quality.curve(_stated(self.mice))
        known = [name for name in self.order if name in set(curves["tracker"])]
        charts.draw_reliability(folder / "reliability.png", curves, known)

    @cached_property
    def _segments(self) -> dict[int, pd.DataFrame]:
        """Segments of mice, by image size."""
        return {size: columns.segments(self.at(size)) for size in self.sizes}

    def at(self, size: int) -> pd.DataFrame:
        """Clips of realistic mice at an image size."""
        return self.mice[self.mice["size_px"] == size]

    def _table(
        self, corner: str, found: dict[str, Any], text: Callable[[Any, str], str], names: Iterable[str] = ()
    ) -> str:
        """A row per tracker, and a column for each entry, of which `text` makes the cell of a tracker."""
        shown = ["`" + name + "`" if name in self.order else name for name in names or self.order]
        rows = [[name, *(text(values, name.strip("`")) for values in found.values())] for name in shown]
        return markdown([corner, *found], rows)


def with_cost(parts: pd.DataFrame, folder: Path = FOLDER) -> pd.DataFrame:
    """Parts with a column `cpu_s`, the CPU time of a tracker in a clip, from the files beside them."""
    tables = [pd.read_csv(file) for file in sorted(folder.glob("cost-*.csv"))]
    if "cpu_s" in parts or not tables:
        return parts
    return parts.merge(pd.concat(tables), on=[*CLIP, "tracker"], how="left")


def write(parts: pd.DataFrame, file: Path, split: str = "test") -> Path:
    """Write the page, and its figures to a folder beside it.

    Parameters
    ----------
    parts : DataFrame
        As :func:`.parts.read_parts` returns it, with the costs of :func:`with_cost` or without.
    file : Path
        Markdown; the folder has its name without suffix.
    split : {"develop", "test"}

    Returns
    -------
    Path
        The file. The same parts give the same bytes.
    """
    page, folder = Page(with_cost(parts), split), file.with_suffix("")
    if page.order:
        page.draw(folder)
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent), undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    template = environment.get_template("page.md.jinja")
    text = template.render(page=page, folder=folder.name, reference=REFERENCE, ranked_by=RANKED_BY, least=LEAST_HEARTS)
    files.write(file, f"{text}\n".encode())
    return file


def _stated(clips: pd.DataFrame) -> pd.DataFrame:
    """Steps of quality that have points, as :func:`.columns.reliability` returns them."""
    steps = columns.reliability(clips)
    return steps[steps["count"] > 0]


def markdown(headings: list[str], rows: list[list[str]]) -> str:
    """A table of which the first column is text."""
    lines = [headings, ["---", *["---:"] * (len(headings) - 1)], *rows]
    return "\n".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |" for line in lines)


def number(value: float, decimals: int = 1) -> str:
    """A number as text; a dash where it is not known."""
    # Adding 0 makes 0 of -0.
    return f"{round(float(value), decimals) + 0.0:.{decimals}f}".replace("-", "−") if np.isfinite(value) else NONE


def interval(row: pd.Series, decimals: int) -> str:
    """A ratio with its interval, if it has one."""
    low, high = (number(row[end], decimals) for end in ("low", "high"))
    return number(row["ratio"], decimals) + (f" ({low}–{high})" if row["low"] < row["high"] < np.inf else "")


def ranks(row: pd.Series) -> str:
    """Range of ranks."""
    first, last = row["rank_first"], row["rank_last"]
    return NONE if not np.isfinite(first) else f"{first:.0f}" if first == last else f"{first:.0f}–{last:.0f}"


def _errors(found: pd.DataFrame, others: list[str]) -> list[str]:
    """Cells of the errors of a motion."""
    error = found["error_px"]
    first = f"{number(found['motion_px'].iloc[0])}, {number(error[REFERENCE], 2)}"
    return [first, *(number(error[name] / max(error[REFERENCE], LEAST_ERROR), 2) for name in others)]


def _thickening(found: pd.DataFrame, names: list[str]) -> list[str]:
    """Cells of the thickening of a motion."""
    true = found["true_radial_strain_percent"]
    bias, sure = found["radial_strain_percent"] - true, found[["stated_percent", "right_percent"]]
    cells = [f"{number(bias[name])} ({' / '.join(number(each, 0) for each in sure.loc[name])})" for name in names]
    return [number(true.iloc[0]), *cells]


def _limits(tracked: pd.Series, true: pd.Series) -> str:
    """Bias with its limits of agreement over hearts, and of how many hearts if these are not all."""
    bias, lower, upper, _ = limits_of_agreement(tracked.to_numpy()[:, None], true.to_numpy()[:, None])[:, 0]
    limits = f" [{number(lower)}, {number(upper)}]" if np.isfinite(lower) else ""
    known = int(np.isfinite(tracked).sum())
    return number(bias, 2) + limits + (f", {known} of {len(true)}" if known < len(true) else "")


def _area(table: pd.DataFrame, name: str) -> str:
    """Area under the curve with its interval."""
    if name not in table.index or not np.isfinite(table.at[name, "auc"]):
        return NONE
    return "{} ({}–{})".format(*(number(table.at[name, column], 2) for column in ("auc", "low", "high")))
