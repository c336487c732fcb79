"""Options of `echotruth run` that go to Snakemake."""

import argparse
import os
from importlib.util import find_spec
from pathlib import Path

import yaml

from echotruth.cli.command import count, did_you_mean
from echotruth.config import shipped
from echotruth.extras import installation

TARGETS = ("all", "repository", "report")
"""Rules that can be asked for by their names: they are for all hearts."""

FOLDER = shipped.ROOT / "workflow/profiles"
PROFILES = sorted(path.name for path in FOLDER.iterdir())
"""Profiles of the package, which `--profile` takes by their name."""

CONFIG_OPTIONS = ("--config", "-C", "--configfile", "--configfiles")
"""Options that would change the configuration after it was read."""

RULE_OPTIONS = ("--forcerun", "-R", "--until", "-U", "--omit-from", "-O", "--prioritize", "-P", "--allowed-rules")
"""Options that take names of rules."""

OWN_EXECUTORS = ("local", "dryrun", "touch")
"""Executors of Snakemake itself; others are packages."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options that most runs need; the others are passed to Snakemake as they are."""
    text = "processor cores, a number or all (default: what the profile says)"
    parser.add_argument("-c", "--cores", type=_number, metavar="N", help=text)
    text = "jobs at the same time, where the profile is that of a cluster (default: what the profile says)"
    parser.add_argument("-j", "--jobs", type=_number, metavar="N", help=text)
    text = f"where jobs run: {', '.join(PROFILES)}, or a folder with a config.yaml of Snakemake; can be repeated"
    parser.add_argument("--profile", type=_profile, action="append", default=[], metavar="NAME", help=text)
    parser.add_argument("-n", "--dry-run", action="store_true", help="only list the jobs")


def given(arguments: argparse.Namespace) -> tuple[list[str], list[str]]:
    """Options for Snakemake, and the rules and files that are to be made."""
    numbers = {f"--{name}": getattr(arguments, name) for name in ("cores", "jobs")}
    options = [part for flag, number in numbers.items() if number for part in (flag, number)]
    options += [part for profile in arguments.profile for part in profile]
    others, targets = split_targets(arguments.options)
    return [*options, *(["--dry-run"] if arguments.dry_run else []), *others], targets


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


def problem(arguments: argparse.Namespace) -> str:
    """Why the options cannot be given to Snakemake, in a sentence; "" if they can."""
    for option in arguments.options:
        if option.partition("=")[0] in CONFIG_OPTIONS:
            return f"{option}: change the file of the configuration"
    executor = _content(arguments.profile).get("executor")
    if arguments.estimate or not isinstance(executor, str) or executor in OWN_EXECUTORS:
        return ""
    package = f"snakemake-executor-plugin-{executor}"
    if find_spec(package.replace("-", "_")) is not None:
        return ""
    remedy = installation("slurm") if executor == "slurm" else f"pip install {package}"
    return f"executor {executor}: needs the package {package}: {remedy}"


def jobs_at_once(arguments: argparse.Namespace) -> int:
    """Jobs at the same time: as the options say, else the profile, else the cores of this machine."""
    number = arguments.cores or arguments.jobs or str(_content(arguments.profile).get("jobs"))
    return int(number) if number.isdigit() else len(os.sched_getaffinity(0))


def _number(text: str) -> str:
    """Whole number above 0, since Snakemake waits for ever with 0 cores, or what stands for any."""
    return text if text in ("all", "unlimited") else str(count(text))


def _profile(name: str) -> tuple[str, str]:
    """Option of Snakemake for a profile; one of the package takes the place of its default, beside one of the user."""
    if name in PROFILES and not Path(name).is_dir():
        return "--workflow-profile", str(FOLDER / name)
    if not _is_profile(name):
        meant = f" ({close})" if (close := did_you_mean(name, PROFILES)) else ""
        remedy = f"give {' or '.join(PROFILES)}, or a folder that holds a config.yaml"
        raise argparse.ArgumentTypeError(f"{name} is not a profile{meant}: {remedy}")
    return "--profile", name


def _is_profile(name: str) -> bool:
    """Whether a name is that of a profile: Snakemake would read the configuration of a heart as one."""
    if Path(name).is_file():
        return Path(name).name.startswith(("config", "profile"))
    places = os.environ.get("XDG_CONFIG_HOME", "~/.config"), os.environ.get("XDG_CONFIG_DIRS", "/etc/xdg").split(":")[0]
    folders = [Path(), *(Path(place, "snakemake").expanduser() for place in places)]
    return name == "none" or any((folder / name).exists() for folder in folders)


def _content(profiles: list[tuple[str, str]]) -> dict[str, object]:
    """Content of the first profile that is a folder; empty without one."""
    for _, folder in profiles:
        if (file := Path(folder) / "config.yaml").is_file():
            try:
                content = yaml.safe_load(file.read_text(encoding="utf-8"))
            except (yaml.YAMLError, ValueError) as error:
                remedy = "correct it, or give another --profile"
                raise ValueError(f"{file}: is no YAML ({' '.join(str(error).split())}): {remedy}") from None
            return content if isinstance(content, dict) else {}
    return {}
