"""Options of `echotruth run` that go to Snakemake."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import echotruth

WORKFLOW = Path(echotruth.__file__).parent / "workflow"
"""Folder of the Snakefile, which travels with the package."""

PROFILES = sorted(path.name for path in (WORKFLOW / "profiles").iterdir())
"""Profiles of the package, which `--profile` takes by their name."""

PROFILE_OPTIONS = ("--profile", "--workflow-profile")

QUERY_OPTIONS = {
    *("--dry-run", "--dryrun", "--dag", "--rulegraph", "--filegraph", "--d3dag", "--summary", "--detailed-summary"),
    *("--lint", "--list", "--list-rules", "--list-target-rules", "--help", "-h", "-l", "-S", "-D"),
}
"""Options with which Snakemake only prints; combined short options with an n, such as -np, are others."""


def with_profiles(options: list[str]) -> list[str]:
    """Options for Snakemake in which the name of a profile of the package is replaced by its folder.

    Such a profile takes the place of the package's default one, so that a profile of the user can be given beside it.
    """
    joined = tuple(f"{flag}=" for flag in PROFILE_OPTIONS)
    options = [part for option in options for part in (option.split("=", 1) if option.startswith(joined) else [option])]
    for place, (flag, name) in enumerate(pairwise(tuple(options))):
        if flag in PROFILE_OPTIONS and name in PROFILES and not Path(name).is_dir():
            options[place : place + 2] = ["--workflow-profile", str(WORKFLOW / "profiles" / name)]
    return options


def is_query(option: str) -> bool:
    """Whether an option makes Snakemake only print."""
    return option in QUERY_OPTIONS or re.fullmatch(r"-[a-z]*n[a-z]*", option) is not None
