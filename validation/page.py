"""Runs all checks and writes the page of their results."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from types import ModuleType

from echotruth.report import style
from validation import beam, elastodynamics, indifference, inflation, patch, refinement, ventricle, work
from validation.report import Report

CHECKS = (patch, inflation, beam, ventricle, elastodynamics, refinement, work, indifference)
"""In the order of the page."""

_HEAD = """# What was checked, against what

Numbers of `python -m validation` (`make validation`), which writes this page. "Allowed" is the largest difference from
what was expected, where a number is judged; one beyond it says **missed**. Beside these, `tests/` checks each stage
by itself, and [tracking.md](tracking.md) says how the paper's tracker fares.

"""

_QUICK = "This page was made with `--quick`: on coarse meshes.\n\n"


def write(folder: Path, quick: bool, log: Callable[[str], None] = print) -> bool:
    """Run all checks and write the page with its pictures.

    Parameters
    ----------
    folder : Path
        Of `validation.md` and of the folder `validation` with the pictures.
    quick : bool
        Whether to use coarse meshes.
    log : callable
        Receives the progress, line by line.

    Returns
    -------
    bool
        Whether every number is within its tolerance.
    """
    sections, met = [], True
    for check in CHECKS:
        start = perf_counter()
        report, picture = _run(check, folder, quick)
        sections.append(report.section(picture))
        missed = [row.quantity for row in report.rows if not row.met]
        met = met and not missed
        log(f"{report.title}: {len(report.rows)} numbers, {perf_counter() - start:.0f} s")
        for quantity in missed:
            log(f"  missed: {quantity}")
    page = folder / "validation.md"
    page.parent.mkdir(parents=True, exist_ok=True)
    page.write_text(_HEAD + (_QUICK if quick else "") + "\n".join(sections), encoding="utf-8")
    return met


def _run(check: ModuleType, folder: Path, quick: bool) -> tuple[Report, str | None]:
    """Report of a check and, where it has one, the path of its picture as seen from the page."""
    results = check.measure(quick)
    if not hasattr(check, "draw"):
        return check.report(results), None
    picture = f"validation/{check.__name__.rsplit('.', 1)[-1]}.png"
    style.save(check.draw(results), folder / picture, dpi=110)
    return check.report(results), picture
