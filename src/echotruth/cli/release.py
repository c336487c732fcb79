"""`echotruth release`: the files of a repository that one would upload."""

from __future__ import annotations

import argparse
import re
from argparse import ArgumentTypeError
from pathlib import Path
from typing import TYPE_CHECKING

from echotruth.cli.command import count

if TYPE_CHECKING:
    from echotruth.sharing.release.attribution import Author

ORCID = re.compile(r"(?:https?://orcid\.org/)?(\d{4}-\d{4}-\d{4}-\d{3}[\dXx])")
ADDRESS = re.compile(r"https?://[^\s<>\"{}|\\^`]+")


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `echotruth release`."""
    nothing: tuple[str, str] = ("", "")
    parser.add_argument("repository", type=Path, help="folder of the repository, such as out/demo")
    parser.add_argument("--to", type=Path, help="folder for the files (default: REPOSITORY-release)")
    parser.add_argument(
        "--part-mb", type=count, default=2000, metavar="N", help="largest size of a part, MB (default: %(default)s)"
    )
    text = "identifier of SPDX, such as CC-BY-4.0, or an address (default: none)"
    parser.add_argument("--license", type=_licence, default=nothing, help=text)
    text = "'Family, Given; ORCID; affiliation', or the name of a group; can be repeated"
    parser.add_argument("--author", type=_author, action="append", default=[], help=text)
    parser.add_argument("--url", type=_address, help="address at which the repository is published")
    parser.add_argument("--release", default="1.0.0", help="version of the data (default: %(default)s)")


def release(arguments: argparse.Namespace) -> int:
    """Write the files that one would upload to give a repository away.

    These are archives of whole hearts and clips, of a stated size, a registry of their checksums for pooch, a data
    card that Hugging Face reads, and a citation. echotruth.fetch reads them from wherever they are.

    examples:
      echotruth release out/demo --license CC-BY-4.0 --author 'Doe, Jane; 0000-0002-1825-0097'
      echotruth release out/demo --to demo-1.0.0 --part-mb 500

    exit status:
      0  all files are written
      2  it cannot be released
    """
    from echotruth.repository.reader import Repository
    from echotruth.sharing.release import release as write
    from echotruth.sharing.release.attribution import Attribution

    repository = Repository(arguments.repository)
    name = f"{repository.config.name}-release"
    folder = arguments.to or (Path("out") if repository.is_sample else repository.folder.parent) / name
    spdx, terms = arguments.license
    given = Attribution(tuple(arguments.author), spdx, terms, arguments.url or "", arguments.release)
    for path in write(repository, folder, given, arguments.part_mb * 10**6):
        print(path)
    return 0


def _address(text: str) -> str:
    if not ADDRESS.fullmatch(text):
        raise ArgumentTypeError(f"{text} is no address: give one that begins with https://")
    return text


def _author(text: str) -> Author:
    from echotruth.sharing.release.attribution import Author

    name, *others = [" ".join(part.split()) for part in text.split(";")]
    family, comma, given = (part.strip() for part in name.partition(","))
    orcids = [found[1].upper() for part in others if (found := ORCID.fullmatch(part))]
    affiliations = [part for part in others if part and not ORCID.fullmatch(part)]
    is_odd = max(len(orcids), len(affiliations)) > (1 if given else 0)
    if not family or (comma and not given) or is_odd:
        raise ArgumentTypeError(f"{text!r} is no author: give 'Family, Given; ORCID; affiliation', or a group's name")
    return Author(family, given, "".join(orcids), "".join(affiliations))


def _licence(text: str) -> tuple[str, str]:
    """Identifier of SPDX, if it is one, and address of the terms."""
    if ADDRESS.fullmatch(text):
        return "", text
    from packaging.licenses import InvalidLicenseExpression, canonicalize_license_expression

    try:
        name = str(canonicalize_license_expression(text))
    except InvalidLicenseExpression:
        name = ""
    if not name or " " in name or name.startswith("LicenseRef"):
        remedy = "give one identifier of spdx.org/licenses, as CC-BY-4.0, or the address of its text"
        raise ArgumentTypeError(f"{text} is no known licence: {remedy}")
    return name, f"https://spdx.org/licenses/{name}"
