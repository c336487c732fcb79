"""Parser of one command: what it does, its examples and what its exit statuses mean."""

import argparse
import inspect
import re
import sys
from collections.abc import Callable, Sequence
from difflib import get_close_matches
from typing import NoReturn

Commands = argparse._SubParsersAction  # type: ignore[type-arg]
"""What the parsers of commands are added to; argparse has no public name for it."""

Act = Callable[[argparse.Namespace], int]
"""Function that does a command and returns its exit status."""


class Parser(argparse.ArgumentParser):
    """Parser that prints an error in one line, with what was probably meant."""

    def error(self, message: str) -> NoReturn:
        """Tell an error and end the process with status 2."""
        if match := re.search(r"argument (\S+): invalid choice: '(.*?)' \(choose from (.*)\)", message):
            argument, given, listed = match.groups()
            known, otherwise = re.findall(r"[\w.-]+", listed), f"use one of {listed.replace(chr(39), '')}"
            message = f"{argument} = {given}: {did_you_mean(given, known, otherwise)}"
        self.exit(2, f"{self.prog}: {message} (see {self.prog} --help)\n")

    def options_of(self, command: str) -> list[str]:
        """Options that a command takes."""
        (commands,) = (action for action in self._actions if isinstance(action, argparse._SubParsersAction))
        parser: argparse.ArgumentParser = commands.choices[command]
        return [text for action in parser._actions for text in action.option_strings if text.startswith("--")]


def did_you_mean(given: str, known: Sequence[str], otherwise: str = "", cutoff: float = 0.6) -> str:
    """Ask for the word that is most like a wrong one, or say something else if none is."""
    close = get_close_matches(given, known, n=1, cutoff=cutoff)
    return f"did you mean {close[0]}?" if close else otherwise


def add_command(commands: Commands, act: Act) -> argparse.ArgumentParser:
    """Add the parser of a command, which has the name of the function that does it, and its docstring as help.

    The first line says what it does. Sections that begin with a line with a colon, as the examples and the meaning of
    the exit statuses, are printed below the options.

    Parameters
    ----------
    commands : argparse._SubParsersAction
        What the parser is added to.
    act : callable
        Function of the parsed arguments that does the command and returns its exit status.

    Returns
    -------
    argparse.ArgumentParser
        Parser to which the arguments are added.
    """
    text = inspect.getdoc(act) or ""
    description, *sections = re.split(r"\n\n(?=[^\n]+:\n)", text, maxsplit=1)
    summary = text.partition("\n")[0].rstrip(".")
    parser: argparse.ArgumentParser = commands.add_parser(
        act.__name__,
        help=summary[:1].lower() + summary[1:],
        description=description,
        epilog="".join(sections),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(act=act)
    return parser


def add_configuration(parser: argparse.ArgumentParser) -> None:
    """Add the argument that is the file of a configuration, or the name of a shipped one."""
    text = "YAML file, or a name of `echotruth new --list`, such as demo"
    parser.add_argument("config", type=_configuration, help=text)


def _configuration(path: str) -> str:
    from echotruth.config import shipped

    return shipped.found(path)


def add_repeated(parser: argparse.ArgumentParser, *options: tuple[str, type, str]) -> None:
    """Add options that can be repeated, each with its type and its help."""
    for name, kind, text in options:
        parser.add_argument(f"--{name}", type=kind, action="append", default=[], help=text)


def add_page(parser: argparse.ArgumentParser) -> None:
    """Add the options of a command that serves a page."""
    parser.add_argument("--port", type=_port, default=0, help="port of the page (default: any that is free)")
    parser.add_argument("--no-browser", action="store_true", help="print the address, and open no browser")


def show_page(arguments: argparse.Namespace, what: object, address: str) -> None:
    """Print the address of a page, and open it in the browser unless the options say otherwise."""
    import webbrowser

    print(f"{what}: {address} (Ctrl-C ends it)", flush=True)
    if not arguments.no_browser:
        webbrowser.open(address)


def _port(text: str) -> int:
    if not text.isdigit() or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"{text}: give a number from 1 to 65535, or none for any that is free")
    return int(text)


def count(text: str) -> int:
    """Whole number above 0, as an option gives it."""
    if not text.isdigit() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text} is not a whole number above 0")
    return int(text)


def model(text: str) -> str:
    """Path of a model in ONNX, as an option gives it."""
    if not text.endswith(".onnx"):
        raise argparse.ArgumentTypeError(f"{text} must end with .onnx")
    return text


def fail(message: str) -> int:
    """Print why a command cannot be done, a line for each reason; return its exit status."""
    print(named(message), file=sys.stderr)
    return 2


def named(message: str) -> str:
    """What went wrong, each line with the name of the program."""
    return "\n".join(f"echotruth: {line}" for line in message.splitlines())
