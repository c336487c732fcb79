"""What a run will take, before it starts: its estimate, and what speaks against it."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import yaml

from echotruth.cases import Case
from echotruth.cli.snakemake import PROFILE_OPTIONS, WORKFLOW, with_profiles
from echotruth.config import Config
from echotruth.workflow.concerns import Concern, concerns
from echotruth.workflow.estimate import Estimate, estimate
from echotruth.workflow.machine_speed import Speed, measured_speed

CORES = ("--cores", "-c", "--jobs", "-j")


def estimated(config: Config, cases: Sequence[Case], options: list[str]) -> tuple[Estimate, list[Concern]]:
    """Estimate of a run, and what speaks against it.

    Parameters
    ----------
    config : Config
    cases : sequence of Case
        Its hearts.
    options : list of str
        Options for Snakemake.
    """
    folder = Path("out") / config.name
    profile = profile_content(options)
    is_local = profile is None or profile.get("executor", "local") == "local"
    # What other machines take is not known from the repositories that were made on this one.
    speed = measured_speed(folder.parent) if is_local else Speed({})
    found = estimate(config, cases, _cores(options, profile), speed, folder)
    return found, concerns(config, found, folder, is_local)


def print_concerns(found: Sequence[Concern], is_accepted: bool = False) -> None:
    """Print what speaks against a run, a line each.

    Parameters
    ----------
    found : sequence of Concern
    is_accepted : bool
        Whether the run goes on all the same; then nobody need be told again why it was refused.
    """
    for concern in found:
        if not concern.is_absurd:
            print(f"echotruth: warning: {concern.text}", file=sys.stderr)
        elif not is_accepted:
            print(f"echotruth: {concern.text} (`echotruth run --yes` runs it all the same)", file=sys.stderr)


def _cores(options: list[str], profile: dict[str, object] | None) -> int:
    """Jobs at the same time: as the options say, else the profile, else the cores of this machine."""
    joined = [part for option in options for part in option.split("=", 1)]
    for flag, value in pairwise([*joined, ""]):
        if flag in CORES and value.isdigit():
            return max(1, int(value))
        if flag[:2] in CORES and flag[2:].isdigit():
            return max(1, int(flag[2:]))
    jobs = (profile or {}).get("jobs")
    return jobs if isinstance(jobs, int) and jobs > 0 else _available_cores()


def profile_content(options: list[str]) -> dict[str, object] | None:
    """Content of the profile that the options name; None without one, or if it cannot be read."""
    for flag, name in pairwise([*with_profiles(options), ""]):
        if flag in PROFILE_OPTIONS:
            for folder in (Path(name), WORKFLOW / "profiles" / name):
                if (folder / "config.yaml").is_file():
                    content = yaml.safe_load((folder / "config.yaml").read_text(encoding="utf-8"))
                    return content if isinstance(content, dict) else None
    return None


def _available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
