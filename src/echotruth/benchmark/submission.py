"""What a submission leaves in a repository: its card, and its scores on variants of the clips."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from echotruth.benchmark.card import attach, read
from echotruth.benchmark.rerun import prepare_rerun
from echotruth.benchmark.results import Row
from echotruth.config.loading import load
from echotruth.evaluation.summary import folder_of
from echotruth.evaluation.tracker_options import EvaluationError


def attach_card(repositories: list[Path], path: Path) -> str:
    """Keep a card beside the scores of its tracker in every repository that has them.

    Parameters
    ----------
    repositories : list of Path
        Folders.
    path : Path
        YAML file.

    Returns
    -------
    str
        The files that were written.

    Raises
    ------
    ConfigError, EvaluationError
        If it is no card, or none of them has scores of its tracker.
    """
    card = read(path)
    folders = [folder_of(repository) for repository in repositories]
    scored = [folder for folder in folders if (folder / "external" / f"{card.tracker}.csv").is_file()]
    if not scored:
        if own := [folder for folder in folders if card.tracker in load(folder / "config.yaml").tracking.trackers]:
            remedy = f"is in the configuration of {own[0]}: only a tracker from outside has a card"
            raise EvaluationError(f"{path}: tracker = {card.tracker}: {remedy}")
        known = sorted({file.stem for folder in folders for file in (folder / "external").glob("[A-Za-z]*.csv")})
        remedy = f"use one of {', '.join(known)}" if known else "run echotruth evaluate --keep first"
        raise EvaluationError(f"{path}: tracker = {card.tracker}: was not evaluated: {remedy}")
    return ", ".join(str(attach(folder, card)) for folder in scored)


def rerun(
    repositories: list[Path], tracker: str, variant: str, split: str, sizes: list[int], jobs: int = 1
) -> Iterator[str]:
    """Run a tracker again on variants of the clips of repositories, and keep the scores.

    Parameters
    ----------
    repositories : list of Path
        Folders; those that have not kept what it found are left out.
    tracker, variant, split : str
        As :func:`echotruth.benchmark.rerun.prepare_rerun` takes them.
    sizes : list of int
        Image sizes, px; all if empty.
    jobs : int
        Number of processes.

    Yields
    ------
    str
        A line for every clip.

    Raises
    ------
    EvaluationError
        If it was not evaluated on any of them, or an image size is that of none.
    """
    runs, reasons = [], []
    for folder in map(folder_of, repositories):
        known = load(folder / "config.yaml").bmode.sizes
        if missing := [size for size in sizes if size not in known]:
            choices = ", ".join(map(str, known))
            raise EvaluationError(f"--size {missing[0]}: is not an image size of {folder}: use {choices}")
        try:
            run = prepare_rerun(folder, tracker, variant, split)
        except EvaluationError as error:
            reasons.append(str(error))
            continue
        if chosen := [size for size in run.sizes if size in (sizes or known)]:
            runs.append((run, chosen))
        else:
            choices = ", ".join(map(str, run.sizes))
            reasons.append(f"--size {sizes[0]}: {tracker} was not evaluated at it on {folder}: use {choices}")
    if not runs:
        raise EvaluationError("\n".join(reasons))
    for run, chosen in runs:
        rows = []
        for row in run.rows(chosen, jobs):
            rows.append(row)
            yield _line(row, variant)
        run.write(rows)


def _line(row: Row, variant: str) -> str:
    outcome = row["failure"] or f"NRMSE {row['error_percent']:.1f} % (before {row['before_percent']:.1f})"
    return f"{row['case']} {row['view']} {row['size_px']} px, {variant}: {outcome}"
