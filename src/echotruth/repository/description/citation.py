"""CITATION.cff of a repository (Citation File Format 1.2.0, doi 10.5281/zenodo.5171937)."""

import re
from typing import Any

import yaml

from echotruth.config import shipped
from echotruth.repository.description.attribution import Author
from echotruth.repository.description.facts import Facts

MARK = "# Made by echotruth describe.\n"
"""First line, by which the file is known as one that may be replaced."""

_OWN = yaml.safe_load((shipped.ROOT / "CITATION.cff").read_text(encoding="utf-8"))

PAPER = _OWN["preferred-citation"]
"""The paper whose method is used."""

SOFTWARE = {key: _OWN[key] for key in ("type", "title", "license", "authors")}


def citation(facts: Facts, said: dict[str, Any]) -> bytes:
    """CITATION.cff of a repository.

    Parameters
    ----------
    facts : Facts
    said : dict
        Statements on the repository.
    """
    attribution, licence = facts.attribution, facts.attribution.licence
    document = {
        "cff-version": "1.2.0",
        "message": "If you use these data, please cite them, the software that made them and the paper it builds on.",
        "type": "dataset",
        "title": said["title"],
        "abstract": said["summary"],
        "authors": [_author(author) for author in attribution.authors],
        "version": attribution.release,
        "date-released": facts.published,
        "keywords": said["keywords"],
        "license" if licence.is_spdx else "license-url": licence.name if licence.url else "",
        "url": attribution.url,
        "references": [SOFTWARE | filled(version=facts.run.packages.get("echotruth")), PAPER],
    }
    return (MARK + yaml.safe_dump(filled(**document), sort_keys=False, allow_unicode=True, width=100)).encode()


def filled(**entries: object) -> dict[str, object]:
    """The entries that are not empty."""
    return {key: value for key, value in entries.items() if value}


def bibtex(facts: Facts, title: str) -> str:
    """Citation of a repository for LaTeX, under a title."""
    attribution = facts.attribution
    people = (
        f"{_latex(one.family)}, {_latex(one.given)}" if one.is_person else f"{{{_latex(one.name)}}}"
        for one in attribution.authors
    )
    entries = filled(
        title=f"{{{_latex(title)}}}",
        author=" and ".join(people),
        year=facts.published.year,
        version=attribution.release,
        url=attribution.url,
    )
    inner = ",\n".join(f"  {key} = {{{value}}}" for key, value in entries.items())
    return f"@misc{{{facts.name},\n{inner}\n}}"


def _latex(text: str) -> str:
    """Text without characters that mean something else to LaTeX."""
    return re.sub(r"([&%$#_])", r"\\\1", text)


def _author(author: Author) -> dict[str, object]:
    if not author.is_person:
        return filled(name=author.name, website=author.url)
    orcid = f"https://orcid.org/{author.orcid}" if author.orcid else ""
    person = {"family-names": author.family, "given-names": author.given}
    return filled(**person, orcid=orcid, affiliation=author.affiliation)
