"""`echotruth new`: a commented configuration to begin with."""

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
    parser.add_argument("--all", action="store_true", help="write all keys, with their defaults commented out")
    parser.add_argument("--list", action="store_true", help="list the presets")


def new(arguments: argparse.Namespace) -> int:
    """Write a commented configuration to begin with.

    It has the keys that most people want to see first, with their meaning, unit, limits and default;
    what is commented out has its default. A file that is there already is never replaced.

    examples:
      echotruth new
      echotruth new human -o patient.yaml
      echotruth new sweep --all
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
        sys.stdout.write(_texts(arguments.preset, Path(f"{arguments.preset}.yaml"), arguments.all)[0])
        return 0
    return _write(arguments.preset, Path(output), arguments.all)


def _write(preset: str, path: Path, everything: bool) -> int:
    """Write a configuration and the table that it reads, if there is one; return the exit status."""
    text, tables = _texts(preset, path, everything)
    files = tables | {path: text}
    for file, table in tables.items():
        if file.is_file() and file.read_bytes() == table.encode():
            del files[file]  # the same table is there already
    for file in files:
        if file.exists() or file.is_symlink():
            return fail(f"{file}: is there already: give a file in another folder with --output, or remove it")
    try:
        for file, content in files.items():
            with file.open("x", encoding="utf-8") as opened:
                opened.write(content)
    except OSError as error:
        return fail(f"{error.filename or path}: cannot be written ({error.strerror}): give a file in a folder of yours")
    for file in files:
        print(file)
    print(f"Edit it, then: echotruth check {quote(str(path))}; echotruth run {quote(str(path))}")
    return 0


def _texts(preset: str, path: Path, everything: bool) -> tuple[str, dict[Path, str]]:
    """Text of a configuration under the name of its file, and of the tables that it reads, by the files to write."""
    from echotruth.config import shipped
    from echotruth.config.commented import commented

    text = shipped.path_of(preset).read_text(encoding="utf-8")
    if re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,59}", path.stem):
        text = re.sub(r"(?m)^name: .*$", f"name: {path.stem}", text)
    tables = {}
    for name in re.findall(r"(?m)^ *file: config/(\S+\.csv)", text):
        source = shipped.folder() / name
        tables[path.parent / name] = source.read_text(encoding="utf-8")
        # The table is read where it is, and named where it will be.
        text = text.replace(f"config/{name}", str(source))
    written = commented(text, everything)
    for file in tables:
        written = written.replace(str(shipped.folder() / file.name), file.as_posix())
    return written, tables
