"""`echotruth new`: a copy of a shipped configuration to begin with."""

import argparse
import re
import sys
from pathlib import Path
from shlex import quote

from echotruth.cli.command import did_you_mean, fail

STANDARD_OUTPUT = "-"
"""What `--output` is called to print the configuration."""


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `echotruth new`."""
    text = "mouse, rat, human or another of --list (default: mouse)"
    parser.add_argument("preset", nargs="?", default="mouse", help=text)
    parser.add_argument("-o", "--output", metavar="FILE", help="file to write (default: PRESET.yaml; - prints it)")
    parser.add_argument("--list", action="store_true", help="list the presets")


def new(arguments: argparse.Namespace) -> int:
    """Write a commented configuration to begin with.

    mouse, rat and human have the keys that most people change, with their meaning and unit; config/README.md
    lists all keys. A file that is there already is never replaced.

    examples:
      echotruth new
      echotruth new human -o patient.yaml
      echotruth new --list

    exit status:
      0  the file is written
      2  it cannot be written
    """
    from echotruth.config import shipped

    names = shipped.names()
    if arguments.list:
        width = max(map(len, names))
        print("\n".join(f"{name:{width}}  {shipped.summary(name)}" for name in names))
        return 0
    if arguments.preset not in names:
        remedy = did_you_mean(arguments.preset, names, f"use one of {', '.join(names)}", cutoff=0.5)
        return fail(f"{arguments.preset} is not a preset: {remedy}")
    output = arguments.output or f"{arguments.preset}.yaml"
    if output == STANDARD_OUTPUT:
        sys.stdout.write(_files(arguments.preset, Path(f"{arguments.preset}.yaml")).popitem()[1])
        return 0
    return _write(_files(arguments.preset, Path(output)))


def _write(files: dict[Path, str]) -> int:
    """Write a configuration, the last of some files, and the tables that it reads; return the exit status."""
    path = [*files][-1]
    # The same table may be there already.
    new = {file: text for file, text in files.items() if file == path or not _holds(file, text)}
    for file in new:
        if file.exists() or file.is_symlink():
            return fail(f"{file}: is there already: give a file in another folder with --output, or remove it")
    try:
        for file, text in new.items():
            with file.open("x", encoding="utf-8") as opened:
                opened.write(text)
    except OSError as error:
        return fail(f"{error.filename or path}: cannot be written ({error.strerror}): give a file in a folder of yours")
    for file in new:
        print(file)
    print(f"Edit it, then: echotruth check {quote(str(path))}; echotruth run {quote(str(path))}")
    return 0


def _holds(file: Path, text: str) -> bool:
    return file.is_file() and file.read_bytes() == text.encode()


def _files(preset: str, path: Path) -> dict[Path, str]:
    """Texts of the tables that a configuration reads, and last its own, under the name of its file."""
    from echotruth.config import shipped

    text = shipped.path_of(preset).read_text(encoding="utf-8")
    if re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,59}", path.stem):
        text = re.sub(r"(?m)^name: \S+", f"name: {path.stem}", text)
    tables = {}
    for name in re.findall(r"(?m)^ *file: (\S+\.csv)", text):
        tables[path.parent / name] = (shipped.folder() / name).read_text(encoding="utf-8")
    return tables | {path: text}
