"""All checks, run one after the other, and the page they make."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from types import ModuleType

from echotruth.report import style
from validation import beam, indifference, inflation, patch, refinement, ventricle, work
from validation.report import Report

CHECKS = (patch, inflation, beam, ventricle, refinement, work, indifference)
"""In the order of the page."""

_HEAD = """# What was checked, against what

Numbers of `echotruth validate` (`make validation`), which writes this page. "Allowed" is the largest difference from
what was expected, where a number is judged; one beyond it says **missed**. Beside these, `tests/` checks each stage
by itself, and [tracking.md](tracking.md) tells how the paper's tracker fares.

"""

_QUICK = "This page was made with `--quick`: on coarse meshes.\n\n"


def write(folder: Path, quick: bool, tell: Callable[[str], None] = print) -> bool:
    """Run all checks and write the page with its pictures.

    Parameters
    ----------
    folder : Path
        `validation.md` and the folder `validation` are put there.
    quick : bool
        Whether to take coarse meshes.
    tell : callable
        What happens is said to it.

    Returns
    -------
    bool
        Whether every number is within its tolerance.
    """
    parts, met = [], True
    for check in CHECKS:
        start = perf_counter()
        said, picture = _run(check, folder, quick)
        parts.append(said.page(picture))
        missed = [row.quantity for row in said.rows if not row.met]
        met = met and not missed
        tell(f"{said.title}: {len(said.rows)} numbers, {perf_counter() - start:.0f} s")
        for quantity in missed:
            tell(f"  missed: {quantity}")
    page = folder / "validation.md"
    page.parent.mkdir(parents=True, exist_ok=True)
    page.write_text(_HEAD + (_QUICK if quick else "") + "\n".join(parts), encoding="utf-8")
    return met


def _run(check: ModuleType, folder: Path, quick: bool) -> tuple[Report, str | None]:
    """Report of a check and, where it has one, the path of its picture as seen from the page."""
    numbers = check.measure(quick)
    if not hasattr(check, "draw"):
        return check.report(numbers), None
    picture = f"validation/{check.__name__.rsplit('.', 1)[-1]}.png"
    style.save(check.draw(numbers), folder / picture, dpi=110)
    return check.report(numbers), picture
