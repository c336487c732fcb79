"""Who made a repository, and under which terms it is given away: what no file of it says."""

import re
from dataclasses import dataclass
from datetime import date

NO_LICENCE = "No licence has been chosen: all rights are reserved"
"""Terms of a repository whose makers have not chosen any: nobody else can choose for them."""


class DescriptionError(ValueError):
    """Raised if a repository cannot be described, or with what is given."""


@dataclass(frozen=True)
class Author:
    """An author: a person, or a group under one name."""

    family: str
    """Family name of a person, or the name of a group."""
    given: str = ""
    """Given name of a person; empty for a group."""
    orcid: str = ""
    """Sixteen digits in four groups; empty if not given."""
    affiliation: str = ""
    """Of a person."""
    url: str = ""
    """Of the group, or of the affiliation of a person."""

    @property
    def name(self) -> str:
        """Name as it is read."""
        return f"{self.given} {self.family}".strip()

    @property
    def is_person(self) -> bool:
        """Whether it is a person."""
        return bool(self.given)

    @property
    def id(self) -> str:
        """Address of the author, or an anchor."""
        if self.orcid:
            return f"https://orcid.org/{self.orcid}"
        return self.url if self.url and not self.is_person else f"#{slug(self.name)}"


@dataclass(frozen=True)
class Licence:
    """Terms of use."""

    name: str = NO_LICENCE
    """Identifier of SPDX, an address, or the sentence that there is none."""
    url: str = ""
    """Empty if there is none."""
    is_spdx: bool = False
    """Whether `name` is an identifier of SPDX."""


@dataclass(frozen=True)
class Attribution:
    """What is to be said of a repository beyond its content."""

    authors: tuple[Author, ...] = ()
    """Empty if none is given."""
    licence: Licence = Licence()
    url: str = ""
    """Where the repository is published; empty if nowhere yet."""
    release: str = "1.0.0"
    """Version of the data, as 1.0.0."""
    published: date | None = None
    """None for the date on which the repository was finished."""


def attribution(authors: list[str], licence: str | None, url: str | None, release: str, day: str | None) -> Attribution:
    """Check what is given on a command line.

    Parameters
    ----------
    authors : list of str
        Each as `Family, Given; ORCID; affiliation; address of the affiliation`, of which only the name is needed, or as
        `Group; address`; the name of a group has no comma.
    licence : str or None
        Identifier of SPDX, or an address.
    url : str or None
    release : str
    day : str or None
        Date of publication, as 2026-01-31.

    Raises
    ------
    DescriptionError
        If something is not what it should be.
    """
    if url is not None and not _is_address(url):
        raise DescriptionError(f"--url {url}: is no address: give one that begins with https://")
    if not re.fullmatch(r"(0|[1-9]\d*)(\.(0|[1-9]\d*)){2}", release):
        raise DescriptionError(f"--release {release}: is no version: give three numbers, as 1.0.0 (semver.org)")
    people = tuple(map(_author, authors))
    return Attribution(people, _licence(licence), url or "", release, _day(day))


def _author(text: str) -> Author:
    name, *others = [" ".join(part.split()) for part in text.split(";")]
    family, comma, given = (part.strip() for part in name.partition(","))
    if not family or (comma and not given):
        raise DescriptionError(f"--author {text!r}: has no name: give 'Family, Given', or the name of a group")
    known: dict[str, str] = {}
    for other in filter(None, others):
        key = "orcid" if _is_orcid(other) else "url" if _is_address(other) else "affiliation"
        if key in known:
            remedy = "give each author in an option of its own, and the address of an affiliation as https://..."
            raise DescriptionError(f"--author {text!r}: gives two of {key}: {remedy}")
        known[key] = other.rpartition("/")[2].upper() if key == "orcid" else other
    if (orcid := known.get("orcid")) and not _has_check_digit(orcid):
        raise DescriptionError(f"--author {text!r}: {orcid} is no ORCID iD, its last digit does not fit: correct it")
    if not given and known.keys() & {"orcid", "affiliation"}:
        raise DescriptionError(f"--author {text!r}: a group has neither ORCID iD nor affiliation: give 'Family, Given'")
    return Author(family, given, **known)


def _is_orcid(text: str) -> bool:
    return re.fullmatch(r"(https?://orcid\.org/)?\d{4}-\d{4}-\d{4}-\d{3}[\dXx]", text) is not None


def _has_check_digit(orcid: str) -> bool:
    """Whether the last digit is the checksum of the others, by ISO 7064 MOD 11-2 as ORCID uses it."""
    digits = orcid.replace("-", "")
    total = 0
    for digit in digits[:-1]:
        total = (total + int(digit)) * 2
    return "0123456789X"[(12 - total % 11) % 11] == digits[-1]


def _licence(text: str | None) -> Licence:
    if text is None:
        return Licence()
    if _is_address(text):
        return Licence(text, text)
    from packaging.licenses import InvalidLicenseExpression, canonicalize_license_expression

    try:
        name = str(canonicalize_license_expression(text))
    except InvalidLicenseExpression:
        name = ""
    if not name or " " in name or name.startswith("LicenseRef"):
        remedy = "give one identifier of spdx.org/licenses, as CC-BY-4.0, or the address of its text"
        raise DescriptionError(f"--license {text}: is no known licence: {remedy}")
    return Licence(name, f"https://spdx.org/licenses/{name}", is_spdx=True)


def _day(text: str | None) -> date | None:
    try:
        return None if text is None else date.fromisoformat(text)
    except ValueError:
        raise DescriptionError(f"--date {text}: is no date: give year, month and day, as 2026-01-31") from None


def _is_address(text: str) -> bool:
    return re.fullmatch(r"https?://[^\s<>\"{}|\\^`]+", text) is not None


def slug(name: str) -> str:
    """Name as a part of an address."""
    return re.sub(r"\W+", "-", name.lower()).strip("-")
