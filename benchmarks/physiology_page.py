"""The page of the search for a heart that moves as an animal's: benchmarks/results/physiology.md and its figures."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from physiology import LEVERS, TARGETS, levers_of, misfit, missed
from report import table

from echotruth.report import style

Row = dict[str, Any]

INTRODUCTION = """# Search for the motion of an animal's heart

Coarse hearts (6 x 8 x 2 elements), each beaten through the loop of its species with levers drawn at random
(`python benchmarks/physiology.py`). [docs/physiology.md](../../docs/physiology.md) says what was chosen and why.
The misfit is the root mean square distance from the targets, in standard deviations as published.

The hearts of the search and those chosen from them are of an earlier mechanics, in which the tension did not depend on
the velocity of the fibres; *mesh that ships* and *finer mesh* are the default heart of version 0.2.0 before its walls
differed and its apex became as thin as it is now.
"""

EFFECTS = {
    "twist_ivc": ("twist, end of IVC (deg)", 1),
    "twist_es": ("twist, ES (deg)", 1),
    "rr_ivc": ("E_RR, end of IVC", 3),
    "rc_ivc": ("E_RC layer, end of IVC", 3),
    "rl_ivc": ("E_RL layer, end of IVC", 3),
    "cc_es": ("E_CC, ES", 3),
    "ll_es": ("E_LL, ES", 3),
    "cl_es": ("E_CL, ES", 3),
    "tension_es_kPa": ("tension, ES (kPa)", 1),
    "det_f": ("smallest det F", 2),
}
"""Quantities of the table of effects, with their decimals."""

PANELS = (
    (("twist_ivc", "twist_es"), "twist (deg)"),
    (("rr_ivc", "rc_ivc", "rl_ivc"), "strain at the end of IVC"),
    (("cc_es", "ll_es", "cl_es"), "strain at ES"),
)
COLOURS = {
    "twist_ivc": "#9a6a1f",
    "twist_es": "#1a1a1a",
    "rr_ivc": style.RADIAL,
    "rc_ivc": style.CIRCUMFERENTIAL,
    "rl_ivc": style.LONGITUDINAL,
    "cc_es": style.CIRCUMFERENTIAL,
    "ll_es": style.LONGITUDINAL,
    "cl_es": "#8a5aa8",
}
FRONTS = (
    ("twist_ivc", "twist_es", "fibres.epi_deg", "twist at the end of IVC (deg)", "twist at ES (deg)"),
    ("rr_ivc", "tension_es_kPa", "mechanics.active.normal_share", "E_RR at the end of IVC", "tension at ES (kPa)"),
    ("cc_es", "ll_es", "mechanics.active.sheet_share", "E_CC at ES", "E_LL at ES"),
)
"""x, y and the lever that colours the points."""


def rows_of(folder: Path, species: str, what: str) -> list[Row]:
    """Rows of a run, solved ones; none if it was not made."""
    path = folder / f"{species}_{what}.json"
    return [row for row in json.loads(path.read_text()) if "failed" not in row] if path.exists() else []


def effects(rows: list[Row]) -> dict[str, list[float]]:
    """Change of each quantity over the range of each lever, by a linear fit over all hearts: quantity -> levers."""
    design = np.array([[row["values"][lever.keys[0]] for lever in LEVERS] for row in rows])
    low, high = np.array([(lever.low, lever.high) for lever in levers_of(rows[0]["species"])]).T
    unit = np.column_stack([np.ones(len(rows)), (design - low) / (high - low)])
    return {
        name: np.linalg.lstsq(unit, np.array([row[name] for row in rows]), rcond=None)[0][1:].tolist()
        for name in EFFECTS
    }


@style.styled
def draw_levers(rows: list[Row]) -> Figure:
    """One column a lever, varied alone around the chosen heart."""
    figure = style.figure(15, 6)
    axes = figure.subplots(len(PANELS), len(LEVERS), sharey="row")
    steps = (len(rows) - 1) // len(LEVERS)
    for column, lever in enumerate(LEVERS):
        part = rows[1 + column * steps : 1 + (column + 1) * steps]
        value = [row["values"][lever.keys[0]] for row in part]
        for panel, (names, label) in zip(axes[:, column], PANELS, strict=True):
            for name in names:
                panel.plot(value, [row[name] for row in part], "o-", color=COLOURS[name], markersize=3, label=name)
            panel.axvline(rows[0]["values"][lever.keys[0]], color="#9a9a9a", linewidth=0.8, linestyle=":")
            if column == 0:
                panel.set_ylabel(label)
                panel.legend(fontsize=7)
        axes[-1, column].set_xlabel(lever.name, fontsize=8)
    return figure


@style.styled
def draw_fronts(rows: list[Row], chosen: Row, species: str) -> Figure:
    """All hearts of the search, two quantities at a time, with what was measured and what was chosen."""
    figure = style.figure(13, 4)
    targets = TARGETS[species]
    for panel, (x, y, lever, x_label, y_label) in zip(figure.subplots(1, len(FRONTS)), FRONTS, strict=True):
        colour = [row["values"][lever] for row in rows]
        points = panel.scatter([row[x] for row in rows], [row[y] for row in rows], c=colour, s=12, cmap="viridis")
        figure.colorbar(points, ax=panel, label=lever)
        for name, span in ((x, panel.axvspan), (y, panel.axhspan)):
            if name in targets:
                span(
                    targets[name].centre - targets[name].spread, targets[name].centre + targets[name].spread, alpha=0.12
                )
        panel.plot(chosen[x], chosen[y], "*", color=style.RADIAL, markersize=14)
        panel.set(xlabel=x_label, ylabel=y_label)
    return figure


def asked_table(species: str, columns: dict[str, Row]) -> str:
    """Targets beside hearts."""
    rows = []
    for name, target in TARGETS[species].items():
        low, high = (f"{bound:g}" if np.isfinite(bound) else "" for bound in (target.low, target.high))
        measured = f"{target.centre:g} +- {target.spread:g}"
        rows.append([target.name, measured, f"{low} .. {high}", *(f"{row[name]:.3g}" for row in columns.values())])
    for name, label in (
        ("peak_delay_ms", "peak of twist after ES (ms)"),
        ("base_mm", "base towards apex at ES (mm)"),
        ("gls", "GLS"),
        ("tei", "Tei index"),
        ("det_f", "smallest det F"),
        ("tension_es_kPa", "tension at ES (kPa)"),
        ("stiffness_kPa", "C (kPa)"),
    ):
        rows.append([label, "", "", *(f"{row[name]:.3g}" for row in columns.values())])
    rows.append(["misfit (published SD)", "", "", *(f"{misfit(row):.2f}" for row in columns.values())])
    return "\n".join(table(["quantity", "measured", "asked", *columns], rows))


def effects_table(rows: list[Row]) -> str:
    """What each lever does over its range, all others anywhere in theirs."""
    found = effects(rows)
    header = ["over its range", *(label for label, _ in EFFECTS.values())]
    lines = [
        [f"{lever.name}, {lever.low:g} to {lever.high:g}"]
        + [f"{found[name][k]:+.{digits}f}" for name, (_, digits) in EFFECTS.items()]
        for k, lever in enumerate(levers_of(rows[0]["species"]))
    ]
    return "\n".join(table(header, lines))


def best_table(rows: list[Row], number: int) -> str:
    """The hearts with the smallest misfit."""
    header = ["misfit", *(lever.name for lever in LEVERS), "base", "misses"]
    lines = []
    for row in sorted(rows, key=misfit)[:number]:
        values = row["values"]
        lines.append(
            [f"{misfit(row):.2f}"]
            + [f"{values[lever.keys[0]]:.3g}" for lever in LEVERS]
            + [values["mechanics.base"], ", ".join(missed(row)) or "none"]
        )
    return "\n".join(table(header, lines))


def write(folder: Path, results: Path) -> None:
    """Write the page and its figures from the rows of the runs."""
    text = [INTRODUCTION]
    for species in TARGETS:
        search, levers = rows_of(folder, species, "search"), rows_of(folder, species, "levers")
        confirmed, fine, paper = (rows_of(folder, species, what) for what in ("confirm", "refine", "paper"))
        if not search:
            continue
        text.append(f"## {species.capitalize()}: {len(search)} hearts\n")
        within = sum(not missed(row) for row in search)
        text.append(f"{within} of {len(search)} hearts are within all that is asked.\n")
        chosen = levers[:1] or confirmed
        columns = {
            "paper's": paper,
            "chosen then, search mesh": levers,
            "mesh that ships": confirmed,
            "finer mesh": fine,
        }
        text.append(asked_table(species, {name: rows[0] for name, rows in columns.items() if rows}))
        text.append("\n### What each means does\n\nChange over the range, by a linear fit over all hearts.\n")
        text.append(effects_table(search))
        if len(levers) > 2 * len(LEVERS):
            draw_levers(levers).savefig(results / f"physiology_{species}_levers.png", dpi=100)
            text.append(f"\nVaried alone around the heart chosen then:\n\n![levers](physiology_{species}_levers.png)")
        if chosen:
            draw_fronts(search, chosen[0], species).savefig(results / f"physiology_{species}_fronts.png", dpi=100)
            text.append(
                "\n### Fronts\n\nAll hearts of the search; bands: measured mean and deviation; star: chosen then.\n\n"
                f"![fronts](physiology_{species}_fronts.png)"
            )
        text.append("\n### The ten nearest of the search\n\n" + best_table(search, 10) + "\n")
    (results / "physiology.md").write_text("\n".join(text) + "\n")
