"""Page of the benchmark: Markdown with figures, and a table of all values, in a folder beside it."""

from __future__ import annotations

import re
from pathlib import Path
from tempfile import TemporaryFile

import pandas as pd
import yaml
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from echotruth import files
from echotruth.evaluation.resampling import CLIP
from echotruth.evaluation.tracker_options import EvaluationError, parse_tracker
from echotruth.repository.estimates import NotEvaluated
from echotruth.section import Section

from . import card, charts, checks, examples, reliability, tables
from .card import Card
from .conditions import PLAIN, main_conditions
from .records import Records, Suite
from .splits import split_of
from .standings import agreement, detections, main_errors, order, shown_size, standings, varied

DRAWN = 6
"""Largest number of trackers in a figure whose colours tell them apart."""

EXAMPLE = Card(
    tracker="mine",
    name="Our network",
    authors=["A. Author", "B. Author"],
    code="https://example.org/network, version 1.0",
    trained_on="Kubric",
    tuned_on="hearts of the split develop",
    splits_seen=["develop"],
    date="2026-11-23",
)
"""Card that the page shows."""


class Page:
    """The tables and figures of one page.

    Parameters
    ----------
    records : Records
        Of all hearts.
    split : str
        Half that is reported.
    """

    def __init__(self, records: Records, split: str) -> None:
        self.whole, self.split = records, split
        self.records = records.of_split(split)
        self.main = self.records.of_main_species()
        self.sizes, self.largest = self.main.sizes, self.main.largest
        self.cards = _cards(records)
        self._verdicts: dict[str, checks.Verdict] = {}
        self.withheld = self._withheld()
        ranked = self.records.clips[~self.records.clips["tracker"].isin(self.withheld)]
        self.is_empty = ranked.empty or not main_conditions(ranked)
        self.standings = ranked if self.is_empty else standings(ranked)
        self.order = [] if self.is_empty else order(self.standings, self.largest)

    def _withheld(self) -> dict[str, str]:
        """Trackers from outside that are shown but not ranked, and why."""
        own = {name for suite in self.records.suites for name in suite.config.tracking.trackers}
        found = {}
        for tracker in (name for name in dict.fromkeys(self.records.clips["tracker"]) if name not in own):
            reasons = list(self.verdict(tracker).flags)
            if tracker in self.cards and self.cards[tracker].has_seen_test:
                reasons.insert(0, "its card says that it has seen the half test")
            if reasons:
                found[tracker] = "; ".join(reasons)
        return found

    @property
    def everyone(self) -> list[str]:
        """All trackers, those without a rank last."""
        return [*self.order, *self.withheld]

    def leaderboard(self) -> str:
        """The short leaderboard as text: median error by main condition at the largest size, with ranges of ranks."""
        withheld = [f"{tracker} is not ranked: {reason}." for tracker, reason in self.withheld.items()]
        if self.is_empty:
            return "\n".join([self.nothing, *withheld])
        columns = {}
        for name, part in main_errors(self.standings).groupby("condition", sort=False):
            size = shown_size(part, self.largest)
            rows = part[(part["size_px"] == size) & part["value"].notna()].set_index("tracker")
            heading = f"{name}" if size == self.largest else f"{name} ({size} px)"
            columns[heading] = rows.apply(lambda row: f"{row['value']:.1f} [{tables.rank(row)}]", axis=1)
        widths = [len(heading) + 1 for heading in columns]
        cells = pd.DataFrame(columns, index=self.order).rename_axis(columns="tracker")
        table = cells.to_string(na_rep="-", col_space=widths)
        title = f"NRMSE at end-systole, % at {self.largest} px, median over the {self.split} hearts [rank]"
        return "\n".join([title, "", table, *([""] if withheld else []), *withheld])

    @property
    def nothing(self) -> str:
        """Why there is no result; empty if there is one."""
        if not self.is_empty:
            return ""
        if not any(parts.get(self.split) for parts in _groups(self.records.suites)):
            return f"No clip of the half {self.split} is evaluated: the repositories have no heart of it."
        if set(self.records.clips["tracker"]) - set(self.withheld):
            return f"No clip of the half {self.split} is evaluated yet but those of a variation, which rank nobody."
        return "No tracker is ranked." if self.withheld else f"No clip of the half {self.split} is evaluated yet."

    def write(self, path: Path, command: str) -> Path:
        """Write the page, and beside it a folder with its figures and `leaderboard.csv`.

        What a person wrote into an earlier page between the comments about and /about, and history and /history, is
        kept.

        Parameters
        ----------
        path : Path
            Markdown file; the folder has its name without suffix.
        command : str
            Command line that made it.

        Returns
        -------
        Path
            The file. The same repositories give the same bytes.
        """
        folder = path.with_suffix("")
        values = {"page": self, "tables": tables, "checks": checks, "command": command, "kept": _written(path)}
        values |= {
            "drawn": DRAWN,
            "card": yaml.safe_dump(EXAMPLE.model_dump(exclude_none=True), sort_keys=False).rstrip(),
        }
        if not self.is_empty:
            folder.mkdir(parents=True, exist_ok=True)
            values |= {"agreement": agreement, "detections": detections, "varied": varied}
            values["pictures"] = self._draw(folder)
            self.standings.to_csv(folder / "leaderboard.csv", index=False, float_format="%.6g")
        environment = Environment(
            loader=FileSystemLoader(Path(__file__).parent),
            undefined=StrictUndefined,
            keep_trailing_newline=True,
            trim_blocks=True,
            lstrip_blocks=True,
        )
        text = environment.get_template("page.md.jinja").render(values)
        files.write(path, text.replace("BENCHMARK_FILES", folder.name).encode())
        return path

    def _draw(self, folder: Path) -> list[tuple[str, str, str]]:
        """Draw the figures; tracker, file and description of those of examples."""
        clips, first = self.main.clips, self.order[:DRAWN]
        charts.draw_conditions(folder / "conditions.png", self.standings, self._floors(), self.order)
        charts.draw_floors(folder / "floors.png", clips, self.records.difficulty, first)
        charts.draw_reliability(folder / "reliability.png", reliability.curve(self.main.reliability), first)
        repositories = {suite.name: suite.repository for suite in self.records.suites}
        stored = {name for suite in self.records.suites for name in suite.repository.trackers}
        found = []
        for tracker in self.everyone:
            of = clips[(clips["tracker"] == tracker) & (clips["size_px"] == self.largest)]
            if tracker not in stored or of.empty:
                continue
            rows = examples.chosen(of)
            try:
                drawn = [examples.example(repositories[row["repository"]], row, what) for what, row in rows.items()]
            except NotEvaluated:  # what is kept is older than the scores
                continue
            examples.draw(folder / f"example_{tracker}.png", drawn)
            words = "; ".join(one.title.replace("\n", ", ") for one in drawn)
            found.append((tracker, f"example_{tracker}.png", f"Tracked points at end-systole. {words}"))
        return found

    def _floors(self) -> pd.DataFrame:
        """Median floor by condition and size."""
        plain = self.records.clips[self.records.clips["variation"].isin(PLAIN)]
        clips = plain.drop_duplicates(list(CLIP))
        both = clips.merge(self.records.difficulty, on=list(CLIP))
        return both.groupby(["condition", "size_px"], sort=False)["floor_percent"].median().reset_index()

    @property
    def unfinished(self) -> str:
        """Which repositories are not whole; empty if all are."""
        suites = [suite for suite in self.records.suites if len(suite.complete) < suite.expected]
        return " ".join("`{}` has {} of {} clips.".format(suite.name, *suite.clips) for suite in suites)

    @property
    def is_balanced(self) -> bool:
        """Whether each half has hearts of each group."""
        return all(all(parts.values()) for parts in _groups(self.records.suites))

    @property
    def halves(self) -> list[str]:
        """Halves of which there are hearts."""
        return sorted({split_of(case) for suite in self.records.suites for case in suite.repository.every.values()})

    @property
    def conditions(self) -> list[str]:
        """Main conditions."""
        return list(dict.fromkeys(self.standings[self.standings["is_main"]]["condition"]))

    def trackers(self) -> str:
        """Who made each tracker, and what it had seen; of those of a configuration, their settings."""
        rows = []
        for tracker in self.everyone:
            if tracker in self.cards:
                of = self.cards[tracker]
                name = f"{of.name}, {', '.join(of.authors)}" + (f" (doi {of.doi})" if of.doi else "")
                seen = ", ".join(of.splits_seen) or "neither"
                rows.append([f"`{tracker}`", name, of.code, of.trained_on, of.tuned_on, seen])
            else:
                rows.append([f"`{tracker}`", self._own_settings(tracker), *[""] * 4])
        headings = ["tracker", "what it is", "code", "trained on", "tuned on", "halves seen"]
        shown = len(headings) if self.cards else 2
        return tables.markdown(headings[:shown], [row[:shown] for row in rows], text=shown)

    def _own_settings(self, tracker: str) -> str:
        """Settings of a tracker in the configurations, and of which each is if they differ."""
        found: dict[str, list[str]] = {}
        for suite in self.records.suites:
            if tracker in suite.config.tracking.trackers:
                words = _settings(suite.config.tracking.trackers[tracker])
                found.setdefault(words, []).append(f"`{suite.name}`")
        if len(found) > 1:
            return ". ".join(f"In {' and '.join(names)}: {words}" for words, names in found.items())
        return next(iter(found), "no card")

    def reliability(self) -> str:
        """Stated and observed share of right points, and the calibration error, by size."""
        known = self.main.reliability.groupby(["tracker", "size_px"])
        cells = {clips: _stated_and_right(of) for clips, of in known}
        rows = [
            [f"`{tracker}`", *(cells.get((tracker, size), tables.NONE) for size in self.sizes)]
            for tracker in self.everyone
        ]
        return tables.markdown(["stated / right / calibration error (%)", *(f"{size} px" for size in self.sizes)], rows)

    def failures(self) -> str:
        """Drift, failures and coverage, and the error in open clips over that in closed ones."""
        clips, rows = self.main.clips, []
        for tracker in self.everyone:
            of = clips[clips["tracker"] == tracker]
            largest = of[of["size_px"] == self.largest]
            failed = int((of["failure"] != "").sum())
            cells = [f"{failed} of {len(of)}", tables.number(largest["coverage_percent"].median())]
            again = checks.variants_of(self.records.suites, tracker, "open")
            ratios = (checks.paired_ratio(of[of["size_px"] == size], again.rows) for size in self.sizes)
            open_ = ["older" if ratio is None and again.older else _with_part(ratio) for ratio in ratios]
            rows.append([f"`{tracker}`", tables.number(largest["drift_um"].median()), *cells, *open_])
        headings = ["tracker", "drift (µm)", "clips failed", "tissue tracked (%)"]
        return tables.markdown([*headings, *(f"open, {size} px" for size in self.sizes)], rows)

    def verdict(self, tracker: str) -> checks.Verdict:
        """What was found of a tracker, by its name or `package.module:function`."""
        name = parse_tracker(tracker, None, [])[0] if ":" in tracker else tracker
        if name not in self._verdicts:
            self._verdicts[name] = checks.verdict(name, self.whole, self.split)
        return self._verdicts[name]

    def verdicts(self) -> str:
        """Verdicts on all trackers."""
        rows = []
        for found in map(self.verdict, self.everyone):
            counted = f"{found.impossible} of {found.clips}"
            rows.append(
                [f"`{found.tracker}`", _shown(found.mirrored), counted, tables.number(found.gap, 2), found.words]
            )
        return tables.markdown(["tracker", "mirrored", "impossible", "test / develop", "verdict"], rows)


def check_writable(path: Path) -> None:
    """Check that a page can be written; EvaluationError if not."""
    if path.suffix != ".md":
        raise EvaluationError(f"--page {path}: must be a Markdown file: give a name that ends in .md")
    if path.is_dir():
        raise EvaluationError(f"--page {path}: is a folder: give the name of a file")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        remedy = f"it must be a folder that you may write to ({error.strerror})"
        raise EvaluationError(f"--page {path}: cannot be written in {path.parent}: {remedy}") from error


def _groups(suites: list[Suite]) -> list[dict[str, set[str]]]:
    """Hearts by half, of every group of every repository."""
    return [parts for suite in suites for parts in tables.hearts_by_group(suite).values()]


def _settings(settings: Section) -> str:
    """Method of a tracker of echotruth, and the settings that are not its defaults."""
    given = settings.model_dump(mode="json", exclude_defaults=True) | {"method": settings.method}  # type: ignore[attr-defined]
    method = given.pop("method")
    return "; ".join([f"`{method}` of echotruth", *(f"{key} {value}" for key, value in given.items())])


def _written(path: Path) -> dict[str, str]:
    """What a person wrote into an earlier page, by the name of its place."""
    text = path.read_text(encoding="utf-8") if path.is_file() else ""
    found = {"about": "", "history": "- Nothing is noted yet."}
    for name in found:
        if match := re.search(rf"<!-- {name} -->\n(.*?)\n?<!-- /{name} -->", text, re.DOTALL):
            found[name] = match[1]
    return found


def _stated_and_right(of: pd.DataFrame) -> str:
    """Stated and observed share of right points, and the calibration error, %, of rows of the reliability."""
    if not (count := of["count"].sum()):
        return tables.NONE
    stated, right = (100 * of[name].sum() / count for name in ("quality_sum", "within_count"))
    return tables.SLASH.join(map(tables.number, (stated, right, reliability.calibration_error(of))))


def _shown(ratio: checks.Ratio | None) -> str:
    return tables.NONE if ratio is None else tables.interval(ratio.value, ratio.low, ratio.high, 2)


def _with_part(ratio: checks.Ratio | None) -> str:
    """A ratio, and of which clips it is if that is not all."""
    return ", ".join(filter(None, [_shown(ratio), ratio.part if ratio else ""]))


def _cards(records: Records) -> dict[str, Card]:
    """Cards of the trackers of all repositories."""
    trackers = records.clips["tracker"].unique()
    # That of the first repository counts.
    folders = [suite.repository.folder for suite in reversed(records.suites)]
    found = ((name, card.card_of(folder, name)) for folder in folders for name in trackers)
    return {name: of for name, of in found if of is not None}
