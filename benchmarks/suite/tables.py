"""Tables of the page of the benchmark, in Markdown."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence

import numpy as np
import pandas as pd

from echotruth.cases import Case, diagnosis
from echotruth.cases.labels import heart_of
from echotruth.evaluation.leaderboard import RANKED_BY
from echotruth.evaluation.resampling import CLIP

from .comparison import LEAST_HEARTS
from .conditions import PLAIN
from .records import Suite
from .splits import DEVELOP, TEST, split_of
from .standings import main_errors, shown_size

NONE = "–"
"""What stands where there is no value."""

SPACE = "\N{NO-BREAK SPACE}"
"""Between numbers that stay on one line."""

SLASH = f"{SPACE}/{SPACE}"

COLUMNS = {
    "delta_avg_percent": ("points within 1–16 px (%)", 1),
    "average_jaccard_percent": ("average Jaccard (%)", 1),
    "median_trajectory_error_px256": ("median trajectory error (px)", 2),
    "flow_epe_px256": ("end-point error of flow (px)", 3),
    "flow_angular_error_deg": ("angular error (deg)", 1),
    "segment_peak_error_pp": ("segmental peak strain (pp)", 1),
    "segment_time_to_peak_error_ms": ("its time (ms)", 1),
    "segment_strain_rate_error_per_s": ("its rate (1/s)", 2),
    "drift_um": ("drift (µm)", 1),
}
"""Metric -> heading and decimals, at the largest image size."""


def markdown(headings: Sequence[str], rows: Iterable[Sequence[str]], text: int = 1) -> str:
    """A table in Markdown.

    Parameters
    ----------
    headings : sequence of str
    rows : iterable of sequence of str
    text : int
        Number of columns that stand to the left of their cells; the others are numbers and stand to the right.
    """
    lines = [headings, [*["---"] * text, *["---:"] * (len(headings) - text)], *rows]
    return "\n".join("| " + " | ".join(str(cell).replace("|", "\\|") for cell in line) + " |" for line in lines)


def number(value: float, decimals: int = 1) -> str:
    """A number as text; a dash where it is not known."""
    # Adding 0 makes 0 of -0.
    return f"{round(float(value), decimals) + 0.0:.{decimals}f}".replace("-", "−") if np.isfinite(value) else NONE


def interval(value: float, low: float, high: float, decimals: int = 1) -> str:
    """A number with its interval, if it has one."""
    if not (np.isfinite(value) and np.isfinite(low)):
        return number(value, decimals)
    between = "–" if low >= 0 else f"{SPACE}to{SPACE}"  # a dash before a minus sign would be read as one
    return f"{number(value, decimals)}{SPACE}({number(low, decimals)}{between}{number(high, decimals)})"


def rank(row: pd.Series) -> str:
    """Range of the ranks that the intervals allow."""
    first, last = row["rank_first"], row["rank_last"]
    if not np.isfinite(first):
        return NONE
    return f"{first:.0f}" if first == last else f"{first:.0f}–{last:.0f}"


def progress(suites: list[Suite]) -> str:
    """How far each repository is."""
    rows = []
    for suite in suites:
        cases = suite.repository.every
        names = set(map(heart_of, cases.values()))
        versions = dict.fromkeys(str(case.labels.get("suite") or NONE) for case in cases.values())
        (done, wanted), sizes = suite.clips, len(suite.config.bmode.sizes)
        state = "whole" if done == wanted else f"{wanted - done} clips are missing"
        rows.append([f"`{suite.name}`", ", ".join(versions), str(len(names)), f"{done} of {wanted}", str(sizes), state])
    return markdown(["repository", "suite", "hearts", "clips", "image sizes", "state"], rows, text=2)


def hearts(suite: Suite, clips: pd.DataFrame) -> str:
    """Hearts of a repository: half, group, what was changed, variations, and what they do.

    Parameters
    ----------
    suite : Suite
    clips : DataFrame
        Columns repository, case, true_gls_percent and true_gcs_percent.
    """
    cases = list(suite.repository.every.values())
    columns = ["true_gls_percent", "true_gcs_percent"]
    # That of a case which is not finished yet is that of another one with the same motion and planes.
    strains = clips[clips["repository"] == suite.name].groupby("case")[columns].first()
    rows = []
    for heart in dict.fromkeys(map(heart_of, cases)):
        own = [case for case in cases if heart_of(case) == heart]
        first = own[0]
        found = [str(of.labels.get("variation") or "") for of in own]
        varied = ", ".join(name.replace("_", " ") for name in dict.fromkeys(found) if name not in PLAIN)
        plain = [of.id for of in own if str(of.labels.get("variation") or "") in PLAIN] or [first.id]
        known = strains.reindex(plain).bfill().iloc[0]
        fraction = next(filter(np.isfinite, (ejection_fraction(suite, case) for case in plain)), np.nan)
        measured = [number(100 * fraction, 0), *(number(value) for value in known)]
        rows.append([heart, split_of(first), _group(first), _changes(first), varied, *measured])
    headings = ["heart", "half", "group", "disease", "variation", "EF (%)", "GLS (%)", "GCS (%)"]
    return markdown(headings, rows, text=5)


def ejection_fraction(suite: Suite, case: str) -> float:
    """Ejection fraction of a heart; NaN if it was not solved."""
    if suite.repository.problem(case, None, "mechanics"):
        return np.nan
    return float(suite.repository.read("physiology/ejection_fraction", case))


def _group(case: Case) -> str:
    """Group of a case: its label, or its diagnosis."""
    return str(case.labels.get("group") or diagnosis(case.config)).replace("_", " ")


def _changes(case: Case) -> str:
    """Keys of the disease of a heart, and their values."""
    found = []
    for key, value in case.parameters.items():
        section, _, name = key.rpartition(".")
        if value is not None and (section.startswith("pathology") or name in ("hypertrophy", "dilation")):
            found.append(f"{name} {value}")
    return ", ".join(found).replace("'", "")


def halves(suite: Suite) -> str:
    """Number of hearts of each group in each half."""
    rows = [
        [group, *(str(len(parts[name])) for name in (DEVELOP, TEST))] for group, parts in hearts_by_group(suite).items()
    ]
    return markdown(["group", "develop", "test"], rows)


def hearts_by_group(suite: Suite) -> dict[str, dict[str, set[str]]]:
    """Names of the hearts by group and half."""
    groups: dict[str, dict[str, set[str]]] = {}
    for case in suite.repository.every.values():
        groups.setdefault(_group(case), {DEVELOP: set(), TEST: set()})[split_of(case)].add(heart_of(case))
    return groups


def condition(standings: pd.DataFrame, name: str, largest: int) -> str:
    """Leaderboard of one main condition: ranges of ranks at one size, errors at all, and differences to the first."""
    errors = main_errors(standings)
    of = errors[errors["condition"] == name]
    sizes = sorted(of["size_px"].unique(), reverse=True)
    of_size = {size: of[of["size_px"] == size].set_index("tracker") for size in sizes}
    rows: list[list[str]] = []
    shown = shown_size(of, largest)
    for tracker, row in of_size[shown].iterrows():
        behind = _difference(row)
        cells = [cell for size in sizes for cell in _cells(of_size[size], [tracker], _error)]
        rows.append([f"`{tracker}`", rank(row), *cells, behind if rows else NONE])
    headings = [*(f"NRMSE at {size} px (%)" for size in sizes), f"less the first, {shown} px"]
    return markdown(["tracker", "rank", *headings], rows)


def others(standings: pd.DataFrame, name: str, order: list[str], largest: int) -> str:
    """Other metrics of one main condition, at the image size by which it is ranked."""
    of = standings[standings["is_main"] & (standings["condition"] == name)]
    size = shown_size(of, largest)
    of = of[of["size_px"] == size]
    shown = [metric for metric in COLUMNS if metric in set(of["metric"])]
    values = of.set_index(["tracker", "metric"])["value"]
    rows = [
        [f"`{tracker}`", *(number(values.get((tracker, metric), np.nan), COLUMNS[metric][1]) for metric in shown)]
        for tracker in order
    ]
    first = "tracker" if size == largest else f"tracker, at {size}{SPACE}px"
    return markdown([first, *(COLUMNS[metric][0] for metric in shown)], rows)


def _difference(row: pd.Series) -> str:
    """Difference of a tracker to the first with its interval."""
    return interval(*(row[f"difference{end}"] for end in ("", "_low", "_high")))


def _error(row: pd.Series) -> str:
    """Median error of a tracker with its interval."""
    return interval(row["value"], row["low"], row["high"])


def by_group(standings: pd.DataFrame, order: list[str]) -> str:
    """Median errors at all image sizes in the groups."""
    of = standings[~standings["is_main"] & (standings["metric"] == RANKED_BY)]
    names, sizes = list(dict.fromkeys(of["condition"])), sorted(of["size_px"].unique(), reverse=True)
    values = of.set_index(["tracker", "condition", "size_px"])["value"]
    rows = [[f"`{tracker}`", *(_at_sizes(values, (tracker, name), sizes) for name in names)] for tracker in order]
    counts = of.groupby("condition")["hearts"].max()
    return markdown(["tracker", *(f"{name} ({counts[name]})" for name in names)], rows)


def by_variation(varied: pd.DataFrame, order: list[str]) -> str:
    """Median errors at all image sizes under a variation, and of the same hearts without it."""
    names, sizes = list(dict.fromkeys(varied["variation"])), sorted(varied["size_px"].unique(), reverse=True)
    values = varied.set_index(["tracker", "variation", "size_px"])
    rows = []
    for tracker in order:
        keys = [(tracker, name) for name in names]
        found, plain = ([_at_sizes(values[what], key, sizes) for key in keys] for what in ("varied", "plain"))
        rows.append([f"`{tracker}`", *(f"{one} ({other})" for one, other in zip(found, plain, strict=True))])
    counts = varied.groupby("variation")["hearts"].max()
    return markdown(["tracker", *(f"{name}, {counts[name]} hearts" for name in names)], rows)


def ahead(standings: pd.DataFrame) -> str:
    """Who is first in each main condition, and who is not surely behind."""
    rows = []
    for (name, size), table in main_errors(standings).groupby(["condition", "size_px"], sort=False):
        known = table[table["value"].notna()]
        if known.empty:
            continue
        first, rest = known.iloc[0], known.iloc[1:]
        near = rest[~((rest["difference_low"] > 0) & (rest["hearts"] >= LEAST_HEARTS))]["tracker"]
        second = rest.iloc[0] if len(rest) else None
        lead = NONE if second is None else _difference(second)
        told = ", ".join(f"`{tracker}`" for tracker in near) or "nobody"
        following = NONE if second is None else f"`{second['tracker']}`"
        rows.append(
            [f"{name}, {size}{SPACE}px", f"`{first['tracker']}`", number(first["value"]), following, lead, told]
        )
    headings = ["condition", "first", "NRMSE (%)", "second", "second less first", "not surely behind"]
    return markdown(headings, rows, text=2)


def _at_sizes(values: pd.Series, key: tuple[str, str], sizes: list[int]) -> str:
    """Values of a tracker under a condition at all image sizes."""
    return SLASH.join(number(values.get((*key, size), np.nan)) for size in sizes)


def agreement(table: pd.DataFrame, order: list[str]) -> str:
    """Bias and limits of agreement of GLS and GCS."""
    columns = _imaged(table)
    found = table.set_index(["tracker", "strain", "acoustics", "size_px"])
    rows = [
        [f"`{tracker}`", strain.upper(), *_cells(found, [(tracker, strain, *column) for column in columns], _limits)]
        for tracker in order
        for strain in dict.fromkeys(table["strain"])
    ]
    return markdown(["tracker", "strain", *map(_imaging, columns)], rows)


def detection(table: pd.DataFrame, order: list[str]) -> str:
    """Areas under the curve of the detection of infarcted segments."""
    columns = _imaged(table)
    found = table.set_index(["tracker", "acoustics", "size_px"])
    rows = [[f"`{one}`", *_cells(found, [(one, *column) for column in columns], _auc)] for one in order]
    perfect = []
    for column in columns:
        of = found.xs(column, level=(1, 2)).iloc[0]
        perfect.append(f"{number(of['true_auc'], 2)}; {number(of['true_subendocardial_auc'], 2)}")
    rows.append(["true strain", *perfect])
    return markdown(["tracker", *map(_imaging, columns)], rows)


def _cells(table: pd.DataFrame, keys: Iterable[Hashable], text: Callable[[pd.Series], str]) -> list[str]:
    """Text of the rows of some keys; a dash where there is none."""
    return [text(table.loc[key]) if key in table.index else NONE for key in keys]


def _limits(row: pd.Series) -> str:
    """Bias with its limits of agreement, and of how many hearts if these are not all."""
    known = np.isfinite(row["lower"])
    limits = f"{SPACE}[{number(row['lower'])},{SPACE}{number(row['upper'])}]" if known else ""
    hearts, of = int(row["hearts"]), int(row["of_hearts"])
    return number(row["bias"], 2) + limits + (f", {hearts} of {of} hearts" if hearts < of else "")


def _auc(row: pd.Series) -> str:
    """Area under the curve with its interval, and that of subendocardial infarcts."""
    inner = f"; {number(row['subendocardial_auc'], 2)}" if np.isfinite(row["subendocardial_auc"]) else ""
    return interval(row["auc"], row["auc_low"], row["auc_high"], 2) + inner


def _imaged(table: pd.DataFrame) -> list[tuple[str, int]]:
    """Acoustics and image sizes of a table, the largest size first."""
    found = set(table[["acoustics", "size_px"]].itertuples(index=False, name=None))
    return sorted(found, key=lambda one: (one[0], -one[1]))


def _imaging(column: tuple[str, int]) -> str:
    """Heading for acoustics and an image size."""
    acoustics, size = column
    return ", ".join(filter(None, [acoustics, f"{size}{SPACE}px"]))


def difficulty(clips: pd.DataFrame, floors: pd.DataFrame, leader: str) -> str:
    """Floors and correlations by main condition and size, and the error of the first tracker over the floor."""
    names = ("floor_plane_percent", "floor_crb_percent", "floor_percent", "correlation_median", "correlation_least")
    plain = clips[(clips["tracker"] == leader) & clips["variation"].isin(PLAIN)]
    both = plain.merge(floors, on=list(CLIP))
    both = both.assign(ratio=both[RANKED_BY] / both["floor_percent"])
    rows = []
    for (name, size), of in both.groupby(["condition", "size_px"], sort=False):
        values = [number(of[column].median(), 1 if column.startswith("floor") else 2) for column in names]
        rows.append(
            [f"{name}, {size}{SPACE}px", *values, number(of[RANKED_BY].median()), number(of["ratio"].median(), 1)]
        )
    headings = ["perfect tracker of the plane", "Cramér–Rao bound", "floor", "correlation, median", "least"]
    return markdown(["condition", *headings, f"`{leader}`", "over the floor"], rows)
