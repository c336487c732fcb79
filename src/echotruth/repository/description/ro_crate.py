"""ro-crate-metadata.json of a repository: Workflow Run RO-Crate 0.5 (doi 10.1371/journal.pone.0309210) on RO-Crate 1.1.

The main workflow is the Snakefile, the configuration is its input, and the repository its output. The Snakefile and its
rules are written to the folder `workflow`, so that the crate holds all it names.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from datetime import date
from pathlib import Path

from echotruth.repository.description import statements
from echotruth.repository.description.attribution import Attribution, Author, slug
from echotruth.repository.description.citation import KEYWORDS, authors, published, title
from echotruth.repository.description.croissant import Node, media_type, one_or_many
from echotruth.repository.description.facts import Facts
from echotruth.repository.description.files import StoredFile
from echotruth.repository.provenance import PACKAGE

NAME = "ro-crate-metadata.json"

WORKFLOW = PACKAGE / "workflow"
"""Folder of the Snakefile."""

MAIN = "workflow/Snakefile"

PROFILES = {
    "https://w3id.org/ro/wfrun/process/0.5": ("Process Run Crate", "0.5"),
    "https://w3id.org/ro/wfrun/workflow/0.5": ("Workflow Run Crate", "0.5"),
    "https://w3id.org/workflowhub/workflow-ro-crate/1.0": ("Workflow RO-Crate", "1.0"),
}

HOMES = {
    "mkl": "https://www.intel.com/content/www/us/en/developer/tools/oneapi/onemkl.html",
    "numba": "https://numba.pydata.org",
    "numpy": "https://numpy.org",
    "opencv": "https://opencv.org",
    "meshio": "https://github.com/nschloe/meshio",
    "pypardiso": "https://github.com/haasad/PyPardiso",
    "scikit-image": "https://scikit-image.org",
    "scipy": "https://scipy.org",
    "snakemake": "https://snakemake.github.io",
    "vtk": "https://vtk.org",
    "xarray": "https://xarray.dev",
    "zarr": "https://zarr.dev",
}
"""Addresses of the packages whose versions are recorded."""


def workflow_files() -> dict[str, bytes]:
    """The Snakefile and its rules, by their path in the crate."""
    files: list[Path] = [WORKFLOW / "Snakefile", *sorted((WORKFLOW / "rules").glob("*.smk"))]
    return {f"workflow/{path.relative_to(WORKFLOW).as_posix()}": path.read_bytes() for path in files}


def ro_crate(facts: Facts, attribution: Attribution, made: list[StoredFile]) -> bytes:
    """ro-crate-metadata.json of a repository.

    Parameters
    ----------
    facts : Facts
    attribution : Attribution
    made : list of StoredFile
        Files that are written with it.
    """
    files = [_file(file) for file in (*facts.tables, *made) if file.path != MAIN]
    makers = [_maker(author) for author in authors(facts, attribution)]
    data = [*files, _store(facts), _ledger(), _main(facts, made)]
    graph = [
        _descriptor(),
        _root(facts, attribution, [*data], makers),
        *data,
        _action(facts, makers),
        *_parameters(facts),
        *makers,
        *_affiliations(authors(facts, attribution)),
        *_software(facts),
        *_works(PROFILES),
        *_terms(attribution),
    ]
    context = ["https://w3id.org/ro/crate/1.1/context", {"sha256": "https://w3id.org/ro/terms/workflow-run#sha256"}]
    return (json.dumps({"@context": context, "@graph": graph}, indent=1, ensure_ascii=False) + "\n").encode()


def _descriptor() -> Node:
    return {
        "@id": NAME,
        "@type": "CreativeWork",
        "about": {"@id": "./"},
        "conformsTo": _references(
            ["https://w3id.org/ro/crate/1.1", "https://w3id.org/workflowhub/workflow-ro-crate/1.0"]
        ),
    }


def _root(facts: Facts, attribution: Attribution, parts: list[Node], makers: list[Node]) -> Node:
    licence = attribution.licence
    day: date = published(facts, attribution)
    return {
        "@id": "./",
        "@type": "Dataset",
        "name": title(facts),
        "description": statements.summary(facts),
        "datePublished": day.isoformat(),
        "version": attribution.release,
        "license": {"@id": licence.url} if licence.url else licence.name,
        "author": one_or_many(_reference(maker) for maker in makers),
        **_publisher(makers[0]),
        "keywords": ", ".join(KEYWORDS),
        "conformsTo": _references(PROFILES),
        "hasPart": [_reference(part) for part in parts],
        "mainEntity": {"@id": MAIN},
        "mentions": {"@id": "#run"},
        **({"url": attribution.url} if attribution.url else {}),
    }


def _publisher(maker: Node) -> Node:
    """The first author if that is a group, or the affiliation of that person."""
    publisher = maker.get("affiliation") if maker["@type"] == "Person" else _reference(maker)
    return {"publisher": publisher} if publisher else {}


def _file(file: StoredFile) -> Node:
    readme = {"about": {"@id": "./"}} if file.path == "README.md" else {}
    example = {"exampleOfWork": {"@id": "#input-configuration"}} if file.path == "config.yaml" else {}
    return {
        "@id": file.path,
        "@type": "File",
        "name": file.path.rpartition("/")[2],
        "encodingFormat": media_type(file.path),
        "contentSize": str(file.size),
        "sha256": file.sha256,
        **readme,
        **example,
    }


def _store(facts: Facts) -> Node:
    return {
        "@id": f"{facts.store}/",
        "@type": "Dataset",
        "name": facts.store,
        "description": "All arrays of the repository, as a Zarr hierarchy (format 3).",
        "exampleOfWork": {"@id": "#output-repository"},
    }


def _ledger() -> Node:
    text = "A record of every finished job: checksums, seed, version of the code, time taken."
    return {"@id": "ledger/", "@type": "Dataset", "name": "ledger", "description": text}


def _main(facts: Facts, made: list[StoredFile]) -> Node:
    file = next(file for file in made if file.path == MAIN)
    return {
        **_file(file),
        "@type": ["File", "SoftwareSourceCode", "ComputationalWorkflow"],
        "name": "echotruth run",
        "description": "From the geometry to scored trackers, for every heart and view; a job is a stage of echotruth.",
        "encodingFormat": "text/plain",
        "programmingLanguage": {"@id": "https://w3id.org/workflowhub/workflow-ro-crate#snakemake"},
        "conformsTo": {"@id": "https://bioschemas.org/profiles/ComputationalWorkflow/1.0-RELEASE"},
        "version": facts.run.packages.get("echotruth", "not recorded"),
        "license": "BSD-3-Clause",
        "url": HOMES["snakemake"],
        "input": {"@id": "#input-configuration"},
        "output": {"@id": "#output-repository"},
        "softwareRequirements": one_or_many(map(_reference, _packages(facts))),
    }


def _action(facts: Facts, makers: list[Node]) -> Node:
    run = facts.run
    return {
        "@id": "#run",
        "@type": "CreateAction",
        "name": f"Runs of echotruth that made {facts.name}",
        "description": f"{run.jobs} jobs, {run.cpu_seconds / 3600:.2f} hours of one core. {statements.state(facts)} "
        "Times are those of the records of the first and last job; there may have been pauses.",
        "instrument": {"@id": MAIN},
        "agent": _reference(makers[0]),
        "startTime": run.started.isoformat(),
        "endTime": run.ended.isoformat(),
        "object": {"@id": "config.yaml"},
        "result": {"@id": f"{facts.store}/"},
        **({"actionStatus": "http://schema.org/CompletedActionStatus"} if facts.is_finished else {}),
    }


def _parameters(facts: Facts) -> list[Node]:
    """What the workflow takes and gives."""
    conforms = {"@id": "https://bioschemas.org/profiles/FormalParameter/1.0-RELEASE"}
    taken: Node = {"name": "configuration", "additionalType": "File", "workExample": {"@id": "config.yaml"}}
    given: Node = {"name": "repository", "additionalType": "Dataset", "workExample": {"@id": f"{facts.store}/"}}
    kind: Node = {"@type": "FormalParameter", "conformsTo": conforms}
    profiles = {
        "https://bioschemas.org/profiles/ComputationalWorkflow/1.0-RELEASE": ("ComputationalWorkflow", "1.0-RELEASE"),
        "https://bioschemas.org/profiles/FormalParameter/1.0-RELEASE": ("FormalParameter", "1.0-RELEASE"),
    }
    parameters = [{"@id": "#input-configuration"} | kind | taken, {"@id": "#output-repository"} | kind | given]
    return [*parameters, *_works(profiles)]


def _maker(author: Author) -> Node:
    node: Node = {"@id": author.id, "@type": "Person" if author.is_person else "Organization", "name": author.name}
    if author.affiliation:
        return node | {"affiliation": {"@id": _affiliation(author)}}
    return node | ({"url": author.url} if author.url and not author.is_person else {})


def _affiliation(author: Author) -> str:
    return author.url or f"#{slug(author.affiliation)}"


def _affiliations(people: Iterable[Author]) -> list[Node]:
    named = {_affiliation(one): one for one in people if one.affiliation}
    nodes: dict[str, Node] = {id: {"@id": id, "@type": "Organization"} for id in named}
    return [nodes[id] | {"name": one.affiliation} | ({"url": one.url} if one.url else {}) for id, one in named.items()]


def _software(facts: Facts) -> list[Node]:
    language: Node = {
        "@id": "https://w3id.org/workflowhub/workflow-ro-crate#snakemake",
        "@type": "ComputerLanguage",
        "name": "Snakemake",
        "identifier": {"@id": "https://doi.org/10.12688/f1000research.29032.2"},
        "url": {"@id": HOMES["snakemake"]},
    }
    return [language, *_packages(facts)]


def _packages(facts: Facts) -> list[Node]:
    """The packages that the workflow needs; echotruth is the workflow itself."""
    return [_package(name, number) for name, number in facts.run.packages.items() if name != "echotruth"]


def _package(name: str, number: str) -> Node:
    about: Node = {"@type": "SoftwareApplication", "name": name, "softwareVersion": number}
    if name not in HOMES:
        return about | {"@id": f"#package-{name}"}
    return about | {"@id": f"{HOMES[name]}#{number}", "url": HOMES[name]}


def _works(profiles: dict[str, tuple[str, str]]) -> list[Node]:
    """Profiles, given their names and versions by address."""
    return [
        {"@id": address, "@type": "CreativeWork", "name": name, "version": number}
        for address, (name, number) in profiles.items()
    ]


def _terms(attribution: Attribution) -> list[Node]:
    licence = attribution.licence
    if not licence.url:
        return []
    return [{"@id": licence.url, "@type": "CreativeWork", "name": licence.name, "identifier": licence.name}]


def _reference(node: Node) -> Node:
    return {"@id": node["@id"]}


def _references(ids: Iterable[str]) -> Node | list[Node]:
    return one_or_many({"@id": id} for id in ids)
