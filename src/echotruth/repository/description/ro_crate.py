"""ro-crate-metadata.json of a repository: Workflow Run RO-Crate 0.5 (doi 10.1371/journal.pone.0309210) on RO-Crate 1.1.

The main workflow is the Snakefile, the configuration is its input, and the repository its output. The Snakefile and its
rules are written to the folder `workflow`, so that the crate holds all it names.
"""

import json
from typing import Any

from rocrate.model.contextentity import ContextEntity
from rocrate.rocrate import ROCrate

from echotruth.config.shipped import ROOT
from echotruth.repository.description.attribution import Author, slug
from echotruth.repository.description.citation import filled
from echotruth.repository.description.facts import Facts
from echotruth.repository.description.files import StoredFile

NAME = "ro-crate-metadata.json"

MAIN = "workflow/Snakefile"

PROFILES = {
    "https://w3id.org/ro/wfrun/process/0.5": ("Process Run Crate", "0.5"),
    "https://w3id.org/ro/wfrun/workflow/0.5": ("Workflow Run Crate", "0.5"),
    "https://w3id.org/workflowhub/workflow-ro-crate/1.0": ("Workflow RO-Crate", "1.0"),
}
"""Profiles to which a crate conforms -> name and version."""

WORKFLOW_PROFILE = "https://bioschemas.org/profiles/ComputationalWorkflow/1.0-RELEASE"

OTHERS = {
    WORKFLOW_PROFILE: ("ComputationalWorkflow", "1.0-RELEASE"),
    "https://bioschemas.org/profiles/FormalParameter/1.0-RELEASE": ("FormalParameter", "1.0-RELEASE"),
}
"""Profiles to which the workflow, its input and its output conform -> name and version."""


def workflow_files() -> dict[str, bytes]:
    """The Snakefile and its rules, by their path in the crate."""
    files = [ROOT / "Snakefile", *sorted((ROOT / "rules").glob("*.smk"))]
    return {f"workflow/{path.relative_to(ROOT).as_posix()}": path.read_bytes() for path in files}


def ro_crate(facts: Facts, said: dict[str, Any], made: list[StoredFile]) -> bytes:
    """ro-crate-metadata.json of a repository.

    Parameters
    ----------
    facts : Facts
    said : dict
        Statements on the repository.
    made : list of StoredFile
        Files that are written with it.
    """
    crate = ROCrate(version="1.1")
    for id, (name, version) in (PROFILES | OTHERS).items():
        _add(crate, id, "CreativeWork", name=name, version=version)
    crate.metadata.extra_terms["sha256"] = "https://w3id.org/ro/terms/workflow-run#sha256"
    for file in (*facts.tables, *made):
        if file.path != MAIN:
            crate.add_file(dest_path=file.path, properties=_about(file))
    crate.get("README.md")["about"] = crate.root_dataset
    text = "A record of every finished job: checksums, seed, version of the code, time taken."
    crate.add_dataset(dest_path="ledger/", properties={"name": "ledger", "description": text})
    text = "All arrays of the repository, as a Zarr hierarchy (format 3)."
    crate.add_dataset(dest_path=f"{facts.store}/", properties={"name": facts.store, "description": text})
    makers = [_maker(crate, author) for author in facts.attribution.authors]
    _add_workflow(crate, facts, said, next(file for file in made if file.path == MAIN))
    _add_run(crate, facts, said, makers[0])
    _describe_root(crate, facts, said, makers)
    return (json.dumps(crate.metadata.generate(), indent=1, ensure_ascii=False) + "\n").encode()


def _about(file: StoredFile) -> dict[str, Any]:
    return {
        "name": file.name,
        "encodingFormat": file.media_type,
        "contentSize": str(file.size),
        "sha256": file.sha256,
    }


def _add(crate: ROCrate, id: str, kind: str, **properties: Any) -> ContextEntity:
    """Add what is no part of the crate; of two with one address the latter stays."""
    return crate.add(ContextEntity(crate, id, properties={"@type": kind} | filled(**properties)))


def _describe_root(crate: ROCrate, facts: Facts, said: dict[str, Any], makers: list[ContextEntity]) -> None:
    attribution, first = facts.attribution, makers[0]
    licence = attribution.licence
    terms = licence.url and _add(crate, licence.url, "CreativeWork", name=licence.name, identifier=licence.name)
    properties = filled(
        name=said["title"],
        description=said["summary"],
        datePublished=facts.published.isoformat(),
        version=attribution.release,
        license=terms or licence.name,
        author=makers,
        publisher=first.get("affiliation") if first.type == "Person" else first,
        keywords=", ".join(said["keywords"]),
        conformsTo=[crate.get(id) for id in PROFILES],
        mentions=crate.get("#run"),
        url=attribution.url,
    )
    for name, value in properties.items():
        crate.root_dataset[name] = value


def _add_workflow(crate: ROCrate, facts: Facts, said: dict[str, Any], file: StoredFile) -> None:
    """The Snakefile, what it takes and gives, and the packages that it needs; echotruth is the workflow itself."""
    packages = {name: version for name, version in facts.run.packages.items() if name != "echotruth"}
    properties = _about(file) | {
        "name": "echotruth run",
        "description": "From the geometry to scored trackers, for every heart and view; a job is a stage of echotruth.",
        "conformsTo": crate.get(WORKFLOW_PROFILE),
        "version": facts.run.packages.get("echotruth", "not recorded"),
        "license": "BSD-3-Clause",
        "url": "https://snakemake.github.io",
        "softwareRequirements": [_package(crate, name, version, said["homes"]) for name, version in packages.items()],
    }
    workflow = crate.add_workflow(dest_path=MAIN, properties=properties, main=True, lang="snakemake")
    for role, name, kind, example in (
        ("input", "configuration", "File", crate.get("config.yaml")),
        ("output", "repository", "Dataset", crate.get(f"{facts.store}/")),
    ):
        workflow[role] = crate.add_formal_parameter(name, kind, f"#{role}-{name}", properties={"workExample": example})
        example["exampleOfWork"] = workflow[role]


def _package(crate: ROCrate, name: str, version: str, homes: dict[str, str]) -> ContextEntity:
    home = homes.get(name)
    id = f"{home}#{version}" if home else f"#package-{name}"
    return _add(crate, id, "SoftwareApplication", name=name, softwareVersion=version, url=home)


def _add_run(crate: ROCrate, facts: Facts, said: dict[str, Any], agent: ContextEntity) -> None:
    run = facts.run
    is_finished = facts.is_published and not facts.missing_jobs
    text = (
        f"{run.jobs} jobs, {run.hours:.2f} hours of one core. {said['state']} "
        "Times are those of the records of the first and last job; there may have been pauses."
    )
    properties = filled(
        name=f"Runs of echotruth that made {facts.name}",
        description=text,
        agent=agent,
        startTime=run.started.isoformat(),
        endTime=run.ended.isoformat(),
        actionStatus="http://schema.org/CompletedActionStatus" if is_finished else "",
    )
    workflow, taken, made = (crate.get(name) for name in (MAIN, "config.yaml", f"{facts.store}/"))
    crate.add_action(workflow, "#run", object=taken, result=made, properties=properties)


def _maker(crate: ROCrate, author: Author) -> ContextEntity:
    """An author, with the affiliation if there is one."""
    if not author.is_person:
        return _add(crate, author.id, "Organization", name=author.name, url=author.url)
    home = author.affiliation and _add(
        crate, author.url or f"#{slug(author.affiliation)}", "Organization", name=author.affiliation, url=author.url
    )
    return _add(crate, author.id, "Person", name=author.name, affiliation=home)
