"""What the Snakefile asks of a configuration: its hearts, cases, views and sizes, and what of them stands already.

It reads what stands, and writes nothing before a run begins.
"""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable, Iterable, Iterator
from functools import cached_property
from pathlib import Path
from typing import Any
from uuid import uuid4

import yaml

from echotruth import files
from echotruth.cases import Case, all_cases, expand
from echotruth.config import Config
from echotruth.config.diagnosis import bounds_of
from echotruth.config.loading import ConfigError, validate
from echotruth.config.reading import SHORT_FLOAT
from echotruth.repository import metadata, publication
from echotruth.repository.checksums import CHECKSUMS, METADATA, checksum
from echotruth.repository.places import NOT_NEEDED, JobPlace, groups_of, is_of_a_job, jobs_of, place
from echotruth.repository.status import excluded
from echotruth.repository.version import Versions, report_version
from echotruth.workflow import cost, lock
from echotruth.workflow.job import case_file, case_text

ADDED = "trackers.yaml"
"""File in the folder of a repository with the settings of trackers that were added to it, by name."""

RUN = "ECHOTRUTH_PLAN"
"""Environment variable with the name of a run, which the processes of its jobs have too."""

HEAD = 1000
"""Bytes at the beginning of the report that hold its version."""

Wildcards = Any
"""Wildcards of a job: its `heart` or `case`, and its `view` and `tracker` if there are."""

Input = Callable[[Wildcards], list[str]]
"""Input function of a rule."""


class Plan:
    """Plan of the jobs of a configuration.

    Parameters
    ----------
    values : dict
        The configuration, as Snakemake has it.
    source : str, optional
        Where it comes from, for errors.
    folder : Path, optional
        Folder of the repository. Default: `out/NAME`.

    Attributes
    ----------
    config : Config
    folder : Path
    cases : dict
        Id -> case.

    Raises
    ------
    ConfigError
        If the configuration is not valid.
    """

    def __init__(self, values: dict[str, Any], source: str = "configuration", folder: Path | None = None) -> None:
        config = validate(dict(values), source)
        self.folder = folder or Path("out") / config.name
        self.config: Config = with_added_trackers(config, self.folder)
        # The files of a repository that stands were checked when it was made.
        self.cases: dict[str, Case] = (
            all_cases(self.config) if folder else {case.id: case for case in expand(self.config, source)}
        )
        self._versions: dict[str, Versions] = {}
        self._attributes: dict[str, dict[str, Any]] = {}

    @property
    def store(self) -> Path:
        """The Zarr hierarchy, `out/NAME/NAME.zarr`."""
        return self.folder / f"{self.config.name}.zarr"

    @cached_property
    def hearts(self) -> dict[str, str]:
        """Heart -> a case that has it."""
        return {case.heart: id for id, case in reversed(self.cases.items())}

    def case_of(self, wildcards: Wildcards) -> str:
        """A case of a heart, whose configuration says how it beats."""
        return self.hearts[wildcards.heart]

    def resources(self, rule: str) -> dict[str, Any]:
        """Time (min) and memory (MB) that a job asks for; one that failed asks for more."""
        asked = cost.resources(rule, self.config)
        return {name: lambda wildcards, attempt, value=value: attempt * value for name, value in asked.items()}

    def needed(self, stage: str, *patterns: str) -> Input:
        """Input function of the rule of a stage: what its job reads, or nothing if what it makes stands already.

        So no date of a file, and no other job, makes a job run again whose groups stand as they are to be.

        Parameters
        ----------
        stage : str
        *patterns : str
            Paths of the metadata of groups, with the wildcards of the rule and `{heart}`.
        """

        def files(wildcards: Wildcards) -> list[str]:
            named = dict(wildcards.items())
            case = named.setdefault("case", self.hearts.get(named.get("heart", ""), ""))
            named["heart"] = self.cases[case].heart
            job = JobPlace(stage, case, named.get("view"), named.get("tracker"))
            return [] if self.is_made(job) else self.asked_for(pattern.format(**named) for pattern in patterns)

        return files

    def asked_for(self, paths: Iterable[str]) -> list[str]:
        """Files that ask Snakemake for groups, given the paths of their metadata.

        Snakemake makes what is missing. What stands, but was made with other settings or by other code, is asked for by
        a file that its job touches besides, and which is of this run alone.
        """
        jobs = {path: self._job_of[path] for path in paths}
        return [
            self._touched(job) if Path(path).exists() and not self.is_made(job) else path for path, job in jobs.items()
        ]

    @cached_property
    def unpublished(self) -> list[str]:
        """File that the rule repository touches if what stands is not what is published; else none."""
        return [] if self.is_published else [f"{self.touched}/repository"]

    @cached_property
    def unreported(self) -> list[str]:
        """File that the rule report touches if the page is not of what is published; else none."""
        return [] if self._is_reported("report.html") else [f"{self.touched}/report"]

    def _is_reported(self, page: str) -> bool:
        path = self.folder / page
        if not (self.is_published and path.is_file()):
            return False
        with path.open("rb") as file:
            return f'content="{report_version(self.folder)}"'.encode() in file.read(HEAD)

    @cached_property
    def _job_of(self) -> dict[str, JobPlace]:
        """Path of the metadata of every group -> the job that makes it."""
        return {f"{self.store}/{group}/{METADATA}": job for job in self._jobs() for group in self._groups(job)}

    def is_made(self, job: JobPlace) -> bool:
        """Whether what a job makes stands, with the settings and by the code of today."""
        version = self._version(job)
        return all(self._of_group(group).get("version") == version for group in self._groups(job))

    @cached_property
    def is_published(self) -> bool:
        """Whether the checksums are of all that stands, and all stands that is asked for."""
        listed = publication.published_checksums(self.folder)
        stand = set(publication.TEXTS)
        for job in self._jobs():
            groups = {f"{self.store.name}/{group}/{METADATA}" for group in self._groups(job)}
            if self.is_made(job):
                stand |= groups
            elif job.stage not in NOT_NEEDED or any((self.folder / group).exists() for group in groups):
                return False
        if {name for name in listed if name in publication.TEXTS or is_of_a_job(name)} != stand:
            return False
        if not all(path.is_file() and path.read_bytes() == text for path, text in self._texts().items()):
            return False
        return all(checksum(self.folder / name) == listed[name] for name in stand)

    def _jobs(self) -> Iterator[JobPlace]:
        """All jobs, that of each heart once."""
        for id, case in self.cases.items():
            first, *others = jobs_of(id, case.config)
            yield from ([first] if self.hearts[case.heart] == id else [])
            yield from others

    def _groups(self, job: JobPlace) -> list[str]:
        """Paths of the groups of a job below the store."""
        case = self.cases[job.case]
        groups = groups_of(job.stage, case.config.image_names, job.tracker)
        return [place(group, case.heart, job.case, job.view) for group in groups]

    def _version(self, job: JobPlace) -> str:
        case = self.cases[job.case]
        if job.stage == "mechanics":
            return Versions(case.config).of("mechanics")
        if job.case not in self._versions:
            heart = self._of_group(place("heart", case.heart, case.id))
            self._versions[job.case] = Versions(case.config, excluded(heart, bounds_of(case.config)))
        return self._versions[job.case].of(job.stage, job.view, job.tracker)

    def _of_group(self, path: str) -> dict[str, Any]:
        """Attributes of a group, read once."""
        if path not in self._attributes:
            self._attributes[path] = metadata.attributes(self.store / path)
        return self._attributes[path]

    @property
    def touched(self) -> str:
        """Folder of the files that jobs of this run touch, so that they can be asked for."""
        return f"{self.folder}/touched/{os.environ.setdefault(RUN, uuid4().hex)}"

    def _touched(self, job: JobPlace) -> str:
        case = self.cases[job.case].heart if job.stage == "mechanics" else job.case
        return "/".join(filter(None, [self.touched, job.stage, case, job.view, job.tracker]))

    def begin(self) -> None:
        """Hold the folder, and write the configuration, that of each case, their table, and what holds the groups.

        Raises
        ------
        LockError
            If another run works on the folder.
        """
        lock.hold(self.folder)
        self.end()  # of a run that was killed
        if not self.is_published:
            (self.folder / CHECKSUMS).unlink(missing_ok=True)
            publication.write_holders(self.store, self.config, list(self.cases.values()))
        self._date_back()
        for case in self.cases.values():
            files.update(case_file(self.folder, case.id), case_text(case).encode())
        for path, text in self._texts().items():
            files.update(path, text)

    def _date_back(self) -> None:
        """Give groups of a date in the future that of today: Snakemake takes no output that is older than its input."""
        for path in map(Path, self._job_of):
            if path.exists() and path.stat().st_mtime > time.time():
                os.utime(path)

    def end(self) -> None:
        """Remove what only a run needs."""
        for name in ("drafts", "touched"):
            shutil.rmtree(self.folder / name, ignore_errors=True)
        for folder in (self.folder, self.folder / "cases"):
            files.remove_drafts(folder)

    def _texts(self) -> dict[Path, bytes]:
        """Configuration and table of the cases, as they are to be."""
        cases = publication.as_csv(publication.table_of(self.store, list(self.cases.values())))
        return {self.folder / "config.yaml": as_yaml(self.config).encode(), self.folder / "cases.csv": cases}


def added_trackers(folder: Path) -> dict[str, Any]:
    """Settings of trackers that were added to a repository, by name.

    Raises
    ------
    ConfigError
        If the file is not YAML of that form.
    """
    path = folder / ADDED
    try:
        found = yaml.safe_load(path.read_bytes()) if path.is_file() else {}
    except (yaml.YAMLError, UnicodeDecodeError):
        found = None
    if not isinstance(found, dict):
        raise ConfigError(f"{path}: is not a table of trackers by name: mend it, or delete it")
    return found


def with_added_trackers(config: Config, folder: Path) -> Config:
    """A configuration with the trackers that were added to its repository, after its own."""
    added = added_trackers(folder)
    if not added:
        return config
    tracking, own = config.tracking.model_dump(), config.tracking.model_dump()["trackers"]
    together = tracking | {"trackers": own | {name: added[name] for name in added if name not in own}}
    return validate(config.model_dump() | {"tracking": together}, str(folder / ADDED))


class _Dumper(getattr(yaml, "CSafeDumper", yaml.SafeDumper)):  # type: ignore[misc]  # which of them is not known
    """Writer of YAML in which the table of hearts keeps its lines."""


def _text(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style="|" if "\n" in text else None)


_Dumper.add_representer(str, _text)
_Dumper.add_implicit_resolver(*SHORT_FLOAT)  # so that such a text is written in quotes


def as_yaml(config: Config) -> str:
    """Text of config.yaml."""
    return yaml.dump(config.model_dump(mode="json"), Dumper=_Dumper, sort_keys=False, allow_unicode=True)
