"""Options of `echotruth describe` and `release`: what no file of a repository says, as its authors and its licence."""

from __future__ import annotations

import argparse
import re
from argparse import ArgumentTypeError
from datetime import date
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from echotruth.sharing.description.attribution import Attribution, Author

ORCID = re.compile(r"(?:https?://orcid\.org/)?(\d{4}-\d{4}-\d{4}-\d{3}[\dXx])")
ADDRESS = re.compile(r"https?://[^\s<>\"{}|\\^`]+")


def add_attribution(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    nothing: tuple[str, str] = ("", "")
    text = "identifier of SPDX, such as CC-BY-4.0, or an address (default: none)"
    parser.add_argument("--license", type=_licence, default=nothing, help=text)
    text = "'Family, Given; ORCID; affiliation', or the name of a group; can be repeated"
    parser.add_argument("--author", type=_author, action="append", default=[], help=text)
    parser.add_argument("--url", type=_address, help="address at which the repository is published")
    parser.add_argument("--release", type=_release, default="1.0.0", help="version of the data (default: 1.0.0)")
    text = "day of publication, as 2026-01-31 (default: that of the last change)"
    parser.add_argument("--date", type=_day, help=text)


def attribution(arguments: argparse.Namespace) -> Attribution:
    """What the options say."""
    from echotruth.sharing.description.attribution import Attribution

    spdx, terms = arguments.license
    authors, url = tuple(arguments.author), arguments.url or ""
    return Attribution(authors, spdx, terms, url, arguments.release, arguments.date)


def _address(text: str) -> str:
    if not ADDRESS.fullmatch(text):
        raise ArgumentTypeError(f"{text} is no address: give one that begins with https://")
    return text


def _release(text: str) -> str:
    if not re.fullmatch(r"(0|[1-9]\d*)(\.(0|[1-9]\d*)){2}", text):
        raise ArgumentTypeError(f"{text} is no version: give three numbers, as 1.0.0 (semver.org)")
    return text


def _day(text: str) -> date:
    try:
        return date.fromisoformat(text)
    except ValueError:
        raise ArgumentTypeError(f"{text} is no date: give year, month and day, as 2026-01-31") from None


def _author(text: str) -> Author:
    from echotruth.sharing.description.attribution import Author

    name, *others = [" ".join(part.split()) for part in text.split(";")]
    family, comma, given = (part.strip() for part in name.partition(","))
    orcids = [found[1].upper() for part in others if (found := ORCID.fullmatch(part))]
    affiliations = [part for part in others if part and not ORCID.fullmatch(part)]
    is_odd = max(len(orcids), len(affiliations)) > (1 if given else 0)
    if not family or (comma and not given) or is_odd:
        raise ArgumentTypeError(f"{text!r} is no author: give 'Family, Given; ORCID; affiliation', or a group's name")
    if not all(map(_has_check_digit, orcids)):
        raise ArgumentTypeError(f"{text!r}: the last digit of the ORCID iD does not fit: correct it")
    return Author(family, given, "".join(orcids), "".join(affiliations))


def _has_check_digit(orcid: str) -> bool:
    """Whether the last digit is the checksum of the others, by ISO 7064 MOD 11-2 as ORCID uses it."""
    digits = orcid.replace("-", "")
    total = sum(int(digit) << (15 - place) for place, digit in enumerate(digits[:-1]))
    return "0123456789X"[(12 - total % 11) % 11] == digits[-1]


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
