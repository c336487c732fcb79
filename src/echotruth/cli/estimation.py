"""What a run will take, before it starts: its estimate, and what speaks against it."""

import argparse
import os
import sys
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import yaml

from echotruth.cases import Case
from echotruth.cli.snakemake import FOLDER, PROFILE_OPTIONS, with_profiles
from echotruth.config import Config
from echotruth.workflow.concerns import Concern, concerns
from echotruth.workflow.estimate import Estimate, estimate


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
    profile = profile_content(options) or {}
    found = estimate(config, cases, _cores(options, profile), folder)
    return found, concerns(config, found, folder, profile.get("executor", "local") == "local")


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


def _cores(options: list[str], profile: dict[str, object]) -> int:
    """Jobs at the same time: as the options say, else the profile, else the cores of this machine."""
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    parser.add_argument("--cores", "-c", "--jobs", "-j", dest="cores", nargs="?")
    given = parser.parse_known_args(options)[0].cores or str(profile.get("jobs"))
    available = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return int(given) if given.isdigit() else available


def profile_content(options: list[str]) -> dict[str, object] | None:
    """Content of the profile that the options name; None without one, or if it cannot be read."""
    for flag, name in pairwise([*with_profiles(options), ""]):
        if flag in PROFILE_OPTIONS:
            for folder in (Path(name), FOLDER / name):
                if (folder / "config.yaml").is_file():
                    content = yaml.safe_load((folder / "config.yaml").read_text(encoding="utf-8"))
                    return content if isinstance(content, dict) else None
    return None
