"""Options of `echotruth run` that go to Snakemake."""

import argparse
import os
import re
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path

import yaml

from echotruth.cli.command import did_you_mean
from echotruth.config import shipped
from echotruth.extras import installation

TARGETS = ("all", "repository", "report")
"""Rules that can be asked for by their names: they are for all hearts."""

FOLDER = shipped.ROOT / "workflow/profiles"
PROFILES = sorted(path.name for path in FOLDER.iterdir())
"""Profiles of the package, which `--profile` takes by their name."""

PROFILE_OPTIONS = ("--profile", "--workflow-profile")

NUMBER_OPTIONS = {"--cores": "all", "-c": "all", "--jobs": "unlimited", "-j": "unlimited"}
"""Options that take a number of jobs at the same time -> the word that they take as well."""

CONFIG_OPTIONS = ("--config", "-C", "--configfile", "--configfiles")
"""Options that would change the configuration after it was read."""

RULE_OPTIONS = ("--forcerun", "-R", "--until", "-U", "--omit-from", "-O", "--prioritize", "-P", "--allowed-rules")
"""Options that take names of rules."""

OWN_EXECUTORS = ("local", "dryrun", "touch")
"""Executors of Snakemake itself; others are packages."""

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
            options[place : place + 2] = ["--workflow-profile", str(FOLDER / name)]
    return options


def split_targets(options: list[str]) -> tuple[list[str], list[str]]:
    """Options without the rules and files that are to be made, and these.

    Parameters
    ----------
    options : list of str
        Options for Snakemake, as the user gave them.
    """
    others: list[str] = []
    targets: list[str] = []
    flag = ""
    for option in options:
        flag = option if option.startswith("-") else flag
        is_target = flag == "--" or (flag not in RULE_OPTIONS and (option in TARGETS or option.startswith("out/")))
        (targets if is_target else others).append(option)
    return others, [target for target in targets if target != "--"]


def is_query(option: str) -> bool:
    """Whether an option makes Snakemake only print."""
    return option in QUERY_OPTIONS or re.fullmatch(r"-[a-z]*n[a-z]*", option) is not None


def option_errors(options: list[str]) -> list[str]:
    """What is wrong with the options that say what is run, where and on how many cores, in a sentence each.

    Snakemake waits for ever with 0 cores.

    Parameters
    ----------
    options : list of str
        Options for Snakemake, as the user gave them.
    """
    found = [f"{flag}: change the file of the configuration" for flag in CONFIG_OPTIONS if flag in options]
    parts = [part for option in options for part in (option.split("=", 1) if option.startswith("--") else [option])]
    for flag, value in pairwise(parts):
        if value.startswith("-") and not value[1:].isdigit():
            continue
        if flag in NUMBER_OPTIONS and value != NUMBER_OPTIONS[flag] and not (value.isdigit() and int(value) > 0):
            remedy = f"give a whole number above 0, or {NUMBER_OPTIONS[flag]}"
        elif flag in PROFILE_OPTIONS and not _is_profile(value):
            meant = f" ({close})" if (close := did_you_mean(value, PROFILES)) else ""
            remedy = f"is not a profile{meant}: give {' or '.join(PROFILES)}, or a folder that holds a config.yaml"
        else:
            continue
        if value.endswith((".yaml", ".yml")):
            remedy += "; the file of the configuration comes before the options"
        found.append(f"{flag} {value}: {remedy}")
    return found


def _is_profile(name: str) -> bool:
    """Whether a name is that of a profile: Snakemake would read the configuration of a heart as one."""
    if Path(name).is_file():
        return Path(name).name.startswith(("config", "profile"))
    places = os.environ.get("XDG_CONFIG_HOME", "~/.config"), os.environ.get("XDG_CONFIG_DIRS", "/etc/xdg").split(":")[0]
    folders = [Path(), FOLDER, *(Path(place, "snakemake").expanduser() for place in places)]
    return name == "none" or any((folder / name).exists() for folder in folders)


def executor_error(options: list[str]) -> str | None:
    """Say which package to install if that of the executor of a profile is missing; None if it is there."""
    executor = _profile(options).get("executor")
    if not isinstance(executor, str) or executor in OWN_EXECUTORS:
        return None
    package = f"snakemake-executor-plugin-{executor}"
    if find_spec(package.replace("-", "_")) is not None:
        return None
    remedy = installation("slurm") if executor == "slurm" else f"pip install {package}"
    return f"executor {executor}: needs the package {package}: {remedy}"


def cores(options: list[str]) -> int:
    """Jobs at the same time: as the options say, else the profile, else the cores of this machine."""
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    parser.add_argument("--cores", "-c", "--jobs", "-j", dest="cores", nargs="?")
    given = parser.parse_known_args(options)[0].cores or str(_profile(options).get("jobs"))
    return int(given) if given.isdigit() else len(os.sched_getaffinity(0))


def _profile(options: list[str]) -> dict[str, object]:
    """Content of the profile that the options name; empty without one, or if it cannot be read."""
    for flag, name in pairwise([*with_profiles(options), ""]):
        if flag in PROFILE_OPTIONS:
            for folder in (Path(name), FOLDER / name):
                if (folder / "config.yaml").is_file():
                    content = yaml.safe_load((folder / "config.yaml").read_text(encoding="utf-8"))
                    return content if isinstance(content, dict) else {}
    return {}
