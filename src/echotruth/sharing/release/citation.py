"""CITATION.cff of a repository (Citation File Format 1.2.0, doi 10.5281/zenodo.5171937)."""

from typing import Any

import yaml

from echotruth.config import shipped
from echotruth.sharing.release.attribution import Author
from echotruth.sharing.release.facts import Facts


def citation(facts: Facts, said: dict[str, Any]) -> bytes:
    """CITATION.cff of a repository, given the statements on it."""
    given, own = facts.attribution, shipped.citation()
    software = {key: own[key] for key in ("type", "title", "license", "authors")}
    document = {
        "cff-version": "1.2.0",
        "message": "If you use these data, please cite them, the software that made them and the paper it builds on.",
        "type": "dataset",
        "title": facts.title,
        "abstract": said["summary"],
        "authors": [_author(author) for author in given.authors],
        "version": given.release,
        "date-released": facts.published,
        "keywords": said["keywords"],
        "license" if given.spdx else "license-url": given.spdx or given.terms,
        "url": given.url,
        "references": [software | filled(version=facts.packages.get("echotruth")), own["preferred-citation"]],
    }
    return yaml.safe_dump(filled(**document), sort_keys=False, allow_unicode=True, width=100).encode()


def filled(**entries: object) -> dict[str, Any]:
    """The entries that are not empty."""
    return {key: value for key, value in entries.items() if value}


def _author(author: Author) -> dict[str, Any]:
    names = {"family-names": author.family, "given-names": author.given} if author.given else {"name": author.family}
    orcid = f"https://orcid.org/{author.orcid}" if author.orcid else ""
    return filled(**names, orcid=orcid, affiliation=author.affiliation)
