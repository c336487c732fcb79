"""Page of the benchmark: Markdown with figures, and a table of all values, in a folder beside it."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from echotruth.benchmark import card, charts, checks, examples, tables
from echotruth.benchmark.card import Card
from echotruth.benchmark.conditions import MAIN_SPECIES, PLAIN
from echotruth.benchmark.records import Records
from echotruth.benchmark.standings import agreement, detections, order, standings, varied
from echotruth.evaluation import kept, reliability
from echotruth.evaluation.leaderboard import RANKED_BY
from echotruth.evaluation.resampling import CLIP
from echotruth.evaluation.tracker_options import parse_tracker
from echotruth.repository import durable
from echotruth.section import Section

if TYPE_CHECKING:
    import pandas as pd

HERE = Path(__file__).parent

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
        self.cards = _cards(records)
        self._verdicts: dict[str, checks.Verdict] = {}
        self.withheld = self._withheld()
        ranked = self.records.clips[~self.records.clips["tracker"].isin(self.withheld)]
        self.is_empty = ranked.empty
        self.standings = ranked if self.is_empty else standings(ranked)
        self.order = [] if self.is_empty else order(self.standings)

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

    @property
    def sizes(self) -> list[int]:
        """Image sizes, the largest first."""
        return sorted((int(size) for size in self.records.clips["size_px"].unique()), reverse=True)

    def leaderboard(self) -> str:
        """The short leaderboard as text: median error by main condition at the largest size, with ranges of ranks."""
        if self.is_empty:
            return f"No clip of the half {self.split} is evaluated yet."
        of = self.standings[
            self.standings["is_main"]
            & (self.standings["metric"] == RANKED_BY)
            & (self.standings["size_px"] == self.sizes[0])
        ]
        names = list(dict.fromkeys(of["condition"]))
        rows = []
        for tracker in self.order:
            cells = [tracker]
            for name in names:
                row = of[(of["condition"] == name) & (of["tracker"] == tracker)]
                known = len(row) and np.isfinite(row["value"].iloc[0])
                cells.append(f"{row['value'].iloc[0]:.1f} [{tables.rank(row.iloc[0])}]" if known else "-")
            rows.append(cells)
        title = f"NRMSE at end-systole, % at {self.sizes[0]} px, median over the {self.split} hearts [rank]"
        return f"{title}\n\n{_aligned([['tracker', *names], *rows])}"

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
        values = self._introduction(command) | {"kept": _written(path), "is_empty": self.is_empty}
        if not self.is_empty:
            folder.mkdir(parents=True, exist_ok=True)
            values |= self._results(self._draw(folder))
            self.standings.to_csv(folder / "leaderboard.csv", index=False, float_format="%.6g")
        text = _template().render(values)
        durable.write(path, text.replace("BENCHMARK_FILES", folder.name).encode())
        return path

    def _draw(self, folder: Path) -> list[tuple[str, str, str]]:
        """Draw the figures; tracker, file and description of those of examples."""
        clips, first = self.records.clips, self.order[:DRAWN]
        charts.draw_conditions(folder / "conditions.png", self.standings, self._floors(), self.order)
        charts.draw_floors(folder / "floors.png", clips, self.records.difficulty, first)
        charts.draw_reliability(folder / "reliability.png", reliability.curve(self.records.reliability), first)
        folders = {suite.name: suite.folder for suite in self.records.suites}
        stored = {name for suite in self.records.suites for name in kept.trackers(suite.folder, suite.config)}
        found = []
        for tracker in self.everyone:
            of = clips[(clips["tracker"] == tracker) & (clips["size_px"] == self.sizes[0])]
            if tracker not in stored or of.empty:
                continue
            rows = examples.chosen(of)
            try:
                drawn = [examples.example(folders[row["repository"]], row, what) for what, row in rows.items()]
            except kept.NotEvaluated:  # what is kept is older than the scores
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

    def _introduction(self, command: str) -> dict[str, Any]:
        """What the page says before its results, and after them."""
        suites, clips = self.records.suites, self.whole.clips
        unfinished = [suite for suite in suites if len(suite.complete) < suite.expected]
        return {
            "command": command,
            "names": ", ".join(f"`{suite.name}`" for suite in suites),
            "split": self.split,
            "unfinished": " ".join("`{}` has {} of {} clips.".format(one.name, *one.clips) for one in unfinished),
            "progress": tables.progress(suites),
            "suites": [
                {
                    "name": suite.name,
                    "halves": tables.halves(suite),
                    "hearts": tables.hearts(suite, clips[clips["repository"] == suite.name]),
                }
                for suite in suites
            ],
            "card": yaml.safe_dump(EXAMPLE.model_dump(exclude_none=True), sort_keys=False).rstrip(),
        }

    def _results(self, pictures: list[tuple[str, str, str]]) -> dict[str, Any]:
        """Tables of the results."""
        clips, segments = self.records.clips, self.records.segments
        mice = [table[table["species"] == MAIN_SPECIES] for table in (clips, segments)]
        main, parts = mice if len(mice[0]) else (clips, segments)
        variations, found = varied(clips), detections(parts)
        conditions = dict.fromkeys(self.standings[self.standings["is_main"]]["condition"])
        return {
            "largest": self.sizes[0],
            "sizes": " / ".join(map(str, self.sizes)),
            "conditions": [
                (name, tables.condition(self.standings, name), tables.others(self.standings, name, self.order))
                for name in conditions
            ],
            "ahead": tables.ahead(self.standings),
            "groups": tables.by_group(self.standings, self.order) if (~self.standings["is_main"]).any() else "",
            "variations": tables.by_variation(variations, self.everyone) if len(variations) else "",
            "withheld": list(self.withheld.items()),
            "trackers": self._trackers(),
            "agreement": tables.agreement(agreement(main), self.everyone),
            "detection": tables.detection(found, self.everyone) if len(found) else "",
            "reliability": self._reliability(),
            "difficulty": tables.difficulty(clips, self.records.difficulty, self.order[0]),
            "examples": pictures,
            "failures": self._failures(),
            "worse": checks.WORSE,
            "impossible": checks.IMPOSSIBLE,
            "checks": self._checks(),
        }

    def _trackers(self) -> str:
        """Who made each tracker, and what it had seen; of those of a configuration, their settings."""
        rows = []
        for tracker in self.everyone:
            if tracker in self.cards:
                of = self.cards[tracker]
                name = f"{of.name}, {', '.join(of.authors)}" + (f" (doi {of.doi})" if of.doi else "")
                seen = ", ".join(of.splits_seen) or "neither"
                rows.append([f"`{tracker}`", name, of.code, of.trained_on, of.tuned_on, seen])
            else:
                own = [suite.config.tracking.trackers.get(tracker) for suite in self.records.suites]
                settings = next((one for one in own if one is not None), None)
                rows.append([f"`{tracker}`", "no card" if settings is None else _settings(settings), *[""] * 4])
        headings = ["tracker", "what it is", "code", "trained on", "tuned on", "halves seen"]
        shown = len(headings) if self.cards else 2
        return tables.markdown(headings[:shown], [row[:shown] for row in rows], text=shown)

    def _reliability(self) -> str:
        """Stated and observed share of right points, and the calibration error, by size."""
        rows = []
        for tracker in self.everyone:
            cells = []
            for size in self.sizes:
                of = self.records.reliability
                of = of[(of["tracker"] == tracker) & (of["size_px"] == size)]
                count = of["count"].sum() if len(of) else 0
                if not count:
                    cells.append(tables.NONE)
                    continue
                stated, right = (100 * of[name].sum() / count for name in ("quality_sum", "within_count"))
                error = reliability.calibration_error(of)
                cells.append(tables.SLASH.join(map(tables.number, (stated, right, error))))
            rows.append([f"`{tracker}`", *cells])
        return tables.markdown(["stated / right / calibration error (%)", *(f"{size} px" for size in self.sizes)], rows)

    def _failures(self) -> str:
        """Drift, failures and coverage, and the error in open clips over that in closed ones."""
        clips, rows = self.records.clips, []
        for tracker in self.everyone:
            of = clips[clips["tracker"] == tracker]
            largest = of[of["size_px"] == self.sizes[0]]
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

    def _checks(self) -> str:
        """Verdicts on all trackers."""
        rows = []
        for found in map(self.verdict, self.everyone):
            counted = f"{found.impossible} of {found.clips}"
            rows.append(
                [f"`{found.tracker}`", _shown(found.mirrored), counted, tables.number(found.gap, 2), found.words]
            )
        return tables.markdown(["tracker", "mirrored", "impossible", "test / develop", "verdict"], rows)


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


def _shown(ratio: checks.Ratio | None) -> str:
    return tables.NONE if ratio is None else tables.interval(ratio.value, ratio.low, ratio.high, 2)


def _with_part(ratio: checks.Ratio | None) -> str:
    """A ratio, and of which clips it is if that is not all."""
    return ", ".join(filter(None, [_shown(ratio), ratio.part if ratio else ""]))


def _cards(records: Records) -> dict[str, Card]:
    """Cards of the trackers of all repositories."""
    found: dict[str, Card] = {}
    for suite in records.suites:
        for tracker in dict.fromkeys(records.clips["tracker"]):
            of = card.card_of(suite.folder, str(tracker))
            if of is not None:
                found.setdefault(str(tracker), of)
    return found


def _aligned(rows: Iterable[list[str]]) -> str:
    """Columns of text, the first to the left."""
    rows = list(rows)
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    lines = [
        [row[0].ljust(widths[0]), *(cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True))]
        for row in rows
    ]
    return "\n".join("  ".join(line).rstrip() for line in lines)


def _template() -> Any:
    environment = Environment(
        loader=FileSystemLoader(HERE),
        autoescape=False,
        undefined=StrictUndefined,
        keep_trailing_newline=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("page.md.jinja")
