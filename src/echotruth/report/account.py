"""What a page says of a repository: how much was made, what failed, and what the stages took."""

from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import pandas as pd

from echotruth.config.imaging import ALL_VIEWS
from echotruth.evaluation.no_estimate import FAILED
from echotruth.repository import estimates, inferred, status
from echotruth.repository.choice import image_size
from echotruth.repository.places import STAGES
from echotruth.repository.reader import Repository

LISTED = 20
"""Largest number of failures of a kind that are listed."""


def imaged(repository: Repository) -> int:
    """Number of hearts of which there are images."""
    wanted = status.imaged(repository.config.physiology.exclude_implausible)
    return int(repository.cases["status"].isin(wanted).sum())


def size_on_disk(store: Path) -> int:
    """Bytes of the files of a store."""
    return sum(path.stat().st_size for path in store.rglob("*") if path.is_file())


def failures(repository: Repository) -> dict[str, Any]:
    """Hearts that are not complete, and what trackers did not find, with the reasons."""
    rows = repository.cases[~repository.cases["status"].isin(["complete"])]
    lost = list(islice(_lost(repository), LISTED + 1))
    return {
        "cases": rows[["status", "reason"]].head(LISTED).reset_index().to_dict("records"),
        "more_cases": max(len(rows) - LISTED, 0),
        "trackers": lost[:LISTED],
        "more_trackers": len(lost) > LISTED,
        "no_estimate": list(islice(_not_estimated(repository), LISTED)),
    }


def inference(repository: Repository, table: pd.DataFrame) -> dict[str, Any]:
    """What was inferred of the muscle of hearts, as the table has it, and of which it was not, with the reasons."""
    config, case = repository.config, inferred.shown(repository, table)
    found = [_inferred(case, rows) for case, rows in islice(table.groupby("case", sort=False), LISTED)]
    failed = [(case, repository.problem(case, None, "inference")) for case in repository.shown]
    of_wall = ~table["parameter"].str.startswith(("contractility.", "stiffness."))
    return {
        "size_px": image_size(config, config.inference.size_px),
        "case": case,
        "hearts": found,
        "more_hearts": table["case"].nunique() - len(found),
        "failed": [{"case": case, "reason": reason} for case, reason in failed if reason][:LISTED],
        "parameters": table[(table["case"] == case) & of_wall].to_dict("records"),
    }


def _inferred(case: str, rows: pd.DataFrame) -> dict[str, Any]:
    """What was inferred of one heart, in a row."""
    muscle = rows[rows["parameter"].str.startswith("contractility.")]
    seen = muscle[muscle["identifiable"]]
    weakest = seen.sort_values("mean").head(1).to_dict("records")
    return {
        "case": case,
        "misfit": bool(rows["misfit"].any()),
        "converged": bool(rows["converged"].all()),
        "identifiable": len(seen),
        "weakest": weakest[0] | {"segment": weakest[0]["parameter"].rpartition(".")[2]} if weakest else None,
        "error": float(((seen["mean"] - seen["true"]) ** 2).mean() ** 0.5) if len(seen) else None,
        "covered": int(((seen["lower"] <= seen["true"]) & (seen["true"] <= seen["upper"])).sum()),
    }


def _not_estimated(repository: Repository) -> Iterator[dict[str, str]]:
    """What trackers have no estimate of in the first heart that is shown, with the reason; failures are apart."""
    has_curves = repository.shown and not repository.config.has_volumes
    table = repository.summary(cases=repository.shown[:1]) if has_curves else None
    if table is None or not len(table):
        return
    lost = table[(table["no_estimate"] != "") & (table["view"] != ALL_VIEWS)]
    lost = lost[~lost["no_estimate"].str.startswith(FAILED)]
    for (view, why), rows in lost.groupby(["view", "no_estimate"], sort=False):
        quantities, trackers = (", ".join(rows[name].unique()) for name in ("quantity", "tracker"))
        yield {"view": str(view), "quantities": quantities, "trackers": trackers, "reason": str(why)}


def _lost(repository: Repository) -> Iterator[dict[str, str]]:
    """Trackers without a result on a clip."""
    for case in repository.shown:
        for view in repository.views:
            for (tracker, size), reason in estimates.failures(repository, case, view).items():
                yield {"tracker": tracker, "clip": f"{case}, {view}, {size} px", "reason": reason}


def stages(folder: Path) -> list[dict[str, Any]]:
    """What every stage took: its name, number of jobs and CPU time, s."""
    found = []
    for name in STAGES:
        if files := list((folder / "benchmarks" / name).rglob("*.tsv")):
            found.append({"name": name, "jobs": len(files), "cpu": float(took(files)["cpu_time"].sum())})
    return found


def took(files: Iterable[Path]) -> pd.DataFrame:
    """What jobs took, a row each, by the files that Snakemake's `benchmark` wrote.

    The CPU time in them lacks the end of a job, because Snakemake looks every half second and later every half minute.
    So the time itself counts where it is more: that of jobs of one thread.

    Parameters
    ----------
    files : iterable of Path

    Returns
    -------
    DataFrame
        Columns `s`, seconds of the clock, `cpu_time`, s, and `max_rss`, MB.
    """
    tables = [pd.read_csv(file, sep="\t", na_values="-")[["s", "cpu_time", "max_rss"]] for file in files]
    found = pd.concat(tables).apply(pd.to_numeric, errors="coerce")
    return found.assign(cpu_time=found[["s", "cpu_time"]].max(axis=1))
