"""Jobs of a repository: which each rule has, and which have ended, by the ledger."""

import os
from collections.abc import Iterable
from pathlib import Path

from echotruth.config import Config
from echotruth.repository.ledger import STAGES, stages

FINAL_RULES = ("repository", "report")
"""What is made once, after all hearts."""
TARGETS = ("all", "hearts", "store", *FINAL_RULES)
"""Rules that can be asked for by their names: they are for all hearts."""


def rules(config: Config) -> list[str]:
    """Rules that have jobs by a configuration, in the order of these."""
    return [*stages(config), *FINAL_RULES]


def places(rule: str, config: Config) -> list[tuple[str, int]]:
    """View and image size, px, of each job of a rule for one heart; an empty text and 0 where it has none."""
    names = STAGES.get(rule, ())
    views, sizes = config.views if "view" in names else [""], config.bmode.sizes if "size" in names else [0]
    return [(view, size) for view in views for size in sizes]


def jobs(rule: str, config: Config, cases: Iterable[str]) -> set[str]:
    """Jobs of a rule: CASE, CASE/VIEW or CASE/VIEW/SIZE, as its records are named."""
    if rule in FINAL_RULES:
        return {rule}
    ends = ["".join(f"/{part}" for part in place if part) for place in places(rule, config)]
    return {f"{case}{end}" for case in cases for end in ends}


def ended(folder: Path, rule: str, config: Config) -> set[str]:
    """Jobs of a rule that have a record, with the names of :func:`jobs`.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`; it need not exist.
    rule : str
    config : Config
    """
    if rule in FINAL_RULES:
        made = folder / ("report.html" if rule == "report" else "ledger/repository.json")
        return jobs(rule, config, ()) if made.is_file() else set()
    top = folder / "ledger" / rule
    files = (os.path.relpath(os.path.join(at, name), top) for at, _, names in os.walk(top) for name in names)
    return {file.removesuffix(".json") for file in files}
