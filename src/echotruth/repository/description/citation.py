"""CITATION.cff of a repository (Citation File Format 1.2.0, doi 10.5281/zenodo.5171937)."""

from __future__ import annotations

import re
from datetime import date

import yaml

from echotruth.repository.description import statements
from echotruth.repository.description.attribution import Attribution, Author
from echotruth.repository.description.facts import Facts

MARK = "# Made by echotruth describe.\n"
"""First line, by which the file is known as one that may be replaced."""

PAPER = {
    "type": "conference-paper",
    "title": "Synthetic ultrasound images to benchmark echocardiography-based biomechanics",
    "authors": [
        {"family-names": "Mukherjee", "given-names": "Tanmay"},
        {"family-names": "Neelakantan", "given-names": "Sunder"},
        {"family-names": "Myers", "given-names": "Kyle"},
        {"family-names": "Tong", "given-names": "Carl"},
        {"family-names": "Avazmohammadi", "given-names": "Reza"},
    ],
}
"""The paper whose method is used, as in CITATION.cff of echotruth."""

KEYWORDS = ["echocardiography", "ultrasound", "speckle tracking", "strain", "synthetic data", "cardiac mechanics"]


def title(facts: Facts) -> str:
    """Title of the repository."""
    return f"{facts.name}: synthetic echocardiograms with their true motion"


def published(facts: Facts, attribution: Attribution) -> date:
    """Day of publication: as given, or that of the last job."""
    return attribution.published or facts.run.ended.date()


def authors(facts: Facts, attribution: Attribution) -> tuple[Author, ...]:
    """The authors; without any, an unnamed group."""
    return attribution.authors or (Author(f"The authors of the repository {facts.name}"),)


def citation(facts: Facts, attribution: Attribution) -> bytes:
    """CITATION.cff of a repository."""
    licence = attribution.licence
    terms = {"license": licence.name} if licence.is_spdx else {"license-url": licence.url}
    document = {
        "cff-version": "1.2.0",
        "message": "If you use these data, please cite them, the software that made them and the paper it builds on.",
        "type": "dataset",
        "title": title(facts),
        "abstract": statements.summary(facts),
        "authors": [_author(author) for author in authors(facts, attribution)],
        "version": attribution.release,
        "date-released": published(facts, attribution),
        "keywords": KEYWORDS,
        **(terms if licence.url else {}),
        **({"url": attribution.url} if attribution.url else {}),
        "references": [_software(facts), PAPER],
    }
    text = yaml.safe_dump(document, sort_keys=False, allow_unicode=True, width=100)
    return (MARK + text).encode()


def bibtex(facts: Facts, attribution: Attribution) -> str:
    """Citation of a repository for LaTeX."""
    day = published(facts, attribution)
    people = " and ".join(
        f"{_latex(one.family)}, {_latex(one.given)}" if one.is_person else f"{{{_latex(one.name)}}}"
        for one in authors(facts, attribution)
    )
    entries = {
        "title": f"{{{_latex(title(facts))}}}",
        "author": people,
        "year": str(day.year),
        "version": attribution.release,
        **({"url": attribution.url} if attribution.url else {}),
    }
    inner = ",\n".join(f"  {key} = {{{value}}}" for key, value in entries.items())
    return f"@misc{{{facts.name},\n{inner}\n}}"


def _latex(text: str) -> str:
    """Text without characters that mean something else to LaTeX."""
    return re.sub(r"([&%$#_])", r"\\\1", text)


def _author(author: Author) -> dict[str, str]:
    names = {"family-names": author.family, "given-names": author.given} if author.is_person else {"name": author.name}
    orcid = {"orcid": f"https://orcid.org/{author.orcid}"} if author.orcid else {}
    affiliation = {"affiliation": author.affiliation} if author.affiliation and author.is_person else {}
    return names | orcid | affiliation | ({"website": author.url} if author.url and not author.is_person else {})


def _software(facts: Facts) -> dict[str, object]:
    version = facts.run.packages.get("echotruth")
    known: dict[str, object] = {"type": "software", "title": "echotruth"}
    known |= {"version": version} if version else {}
    return known | {"license": "BSD-3-Clause", "authors": [{"name": "The echotruth developers"}]}
