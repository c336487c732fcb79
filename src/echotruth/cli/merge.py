"""`echotruth merge`: hearts and clips of other repositories taken over into one."""

import argparse
from pathlib import Path

from echotruth.cli.command import add_configuration, fail


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `echotruth merge`."""
    add_configuration(parser)
    parser.add_argument("sources", type=Path, nargs="+", help="folders of repositories, which stay as they are")


def merge(arguments: argparse.Namespace) -> int:
    """Copy what a configuration asks for from repositories that have it; echotruth run makes the rest.

    The configuration has the cases of all. A heart or a clip that was made with other settings, or by
    other code, is made anew by the run.

    examples:
      echotruth merge both.yaml out/first out/second
      echotruth run both.yaml

    exit status:
      0  it is copied
      1  the configuration is not valid
      2  a folder is no repository or is damaged, or a run works on the one that is made
    """
    from echotruth.cli.configuration import load_cases
    from echotruth.config import shipped
    from echotruth.repository.places import repository_folder
    from echotruth.workflow.lock import is_held
    from echotruth.workflow.merging import merge
    from echotruth.workflow.plan import Plan

    config, _ = load_cases(arguments.config)
    plan = Plan(config.model_dump(), arguments.config)
    sources = [repository_folder(shipped.repository(source)) for source in arguments.sources]
    if busy := [source for source in sources if is_held(source)]:
        return fail(f"{busy[0]}: a run works on it: wait for it")
    plan.begin()
    copied = merge(plan, sources)
    print(f"{plan.folder}: {copied} hearts and clips are copied: echotruth run {arguments.config} makes the rest")
    return 0
