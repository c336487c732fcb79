"""Who made a repository, and under which terms it is given away: what no file of it says."""

from typing import NamedTuple


class Author(NamedTuple):
    """A person, or a group, which has a name alone; what is not known is ""."""

    family: str
    given: str = ""
    orcid: str = ""
    affiliation: str = ""

    @property
    def name(self) -> str:
        """Name as it is read."""
        return f"{self.given} {self.family}".strip()


class Attribution(NamedTuple):
    """What is to be said of a repository beyond its content."""

    authors: tuple[Author, ...] = ()
    spdx: str = ""
    terms: str = ""
    url: str = ""
    release: str = "1.0.0"

    @property
    def licence(self) -> str:
        """Identifier of SPDX, address, or the sentence that there is no licence: nobody else can choose one."""
        return self.spdx or self.terms or "No licence has been chosen: all rights are reserved"
