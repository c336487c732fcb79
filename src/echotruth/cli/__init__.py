"""Command line: one module a command, each with `add`, which adds its arguments, and the function that does it."""

import os
import sys
from importlib import import_module

import echotruth
from echotruth.cli.command import Parser, add_command, did_you_mean, fail
from echotruth.extras import MissingPackage, explained
from echotruth.workflow.lock import LockError

COMMANDS = (
    *("new", "check", "cases", "run", "status", "info", "show"),
    *("draw", "track", "evaluate", "export", "release", "merge"),
)
"""Commands, and their modules and functions, in the order of `echotruth --help`."""

PASSES_ON = "run"
"""Command of which the options that it does not know are passed on."""


def main() -> None:
    """Entry point of the command `echotruth`."""
    whole = parser()
    if len(sys.argv) == 1:
        whole.print_help()
        sys.exit(2)
    arguments, options = whole.parse_known_args()
    if options and arguments.command != PASSES_ON:
        sys.exit(fail(_unknown(options[0], arguments.command, whole)))
    arguments.options = options
    try:
        with explained(arguments.command):
            ended = arguments.act(arguments)
        sys.stdout.flush()
    except KeyboardInterrupt:
        sys.exit(fail("interrupted") and 130)
    except BrokenPipeError:
        # Whoever read the output has seen enough; the interpreter would tell so at its end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except (MissingPackage, LockError, ValueError) as error:
        sys.exit(fail(str(error)))
    except OSError as error:
        sys.exit(fail(_of_file(error)))
    sys.exit(ended)


def parser() -> Parser:
    """Parser of the whole command line."""
    whole = Parser(
        prog="echotruth",
        description=(echotruth.__doc__ or "").split("\n")[0],
        epilog="Begin with: echotruth new; echotruth run mouse.yaml. More: echotruth COMMAND --help",
    )
    whole.add_argument("--version", action="version", version=echotruth.__version__)
    commands = whole.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name in COMMANDS:
        module = import_module(f"{__name__}.{name}")
        module.add(add_command(commands, getattr(module, name)))
    return whole


def _of_file(error: OSError) -> str:
    """What the system says of a file, with its name and a remedy, or what echotruth says of it itself."""
    if error.errno is None:
        return str(error)
    place = f"{error.filename!s:.200}: " if error.filename else ""
    return f"{place}{error.strerror}: see that the path is right, has space, and you may read and write there"


def _unknown(option: str, command: str, whole: Parser) -> str:
    """What to say of an option, or of an argument too many, that a command does not take."""
    if not option.startswith("-"):
        return f"{option}: is one argument too many: see echotruth {command} --help"
    name = option.partition("=")[0]
    remedy = did_you_mean(name, whole.options_of(command), f"see echotruth {command} --help")
    return f"{name}: is not an option of echotruth {command}: {remedy}"
