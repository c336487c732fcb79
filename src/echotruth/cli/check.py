"""`echotruth check`: a configuration, or all files and values of a repository."""

import argparse
from pathlib import Path

from echotruth.cli.command import add_configuration


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `echotruth check`."""
    text = "YAML file, a name of `echotruth new --list`, or folder of a repository, such as out/demo"
    add_configuration(parser, text, metavar="path")
    parser.add_argument(
        "--heal",
        action="store_true",
        help="delete damaged files and their records, so that the next run makes just these",
    )
    parser.add_argument(
        "--quick", action="store_true", help="compare the checksums of the files only, and leave out their values"
    )


def check(arguments: argparse.Namespace) -> int:
    """Check a configuration, or all files and values of a repository.

    A repository is checked to the end, with one line for each fault.

    examples:
      echotruth check config/demo.yaml
      echotruth check out/demo
      echotruth check out/demo --heal

    exit status:
      0  nothing is wrong (jobs not run yet are no damage)
      1  the configuration is not valid, a run would refuse it, or something is damaged
      2  it cannot be checked
    """
    if arguments.heal or Path(arguments.config).is_dir():
        from echotruth.workflow.integrity import check_repository

        return check_repository(Path(arguments.config), arguments.heal, arguments.quick)
    from echotruth.cli.configuration import LISTED, load_cases

    config, cases = load_cases(arguments.config, f"a YAML file, {LISTED}, or the folder of a repository")
    print(f"{arguments.config}: valid; cases: {len(cases)}, views per case: {len(config.views)}")
    from echotruth.cli.estimation import estimated, print_concerns
    from echotruth.workflow.estimate import short

    found, concerns = estimated(config, cases, [])
    print(f"A run takes {short(found)}.")
    print_concerns(concerns)
    return int(any(concern.is_absurd for concern in concerns))
