"""What the Snakefile asks of a configuration: its hearts, cases, views and sizes, and what of them stands already."""

from __future__ import annotations

import atexit
import shutil
from collections.abc import Iterator
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Any

import yaml

from echotruth import files
from echotruth.cases import Case, expand
from echotruth.config import Config
from echotruth.config.diagnosis import bounds_of
from echotruth.config.loading import validate
from echotruth.config.reading import SHORT_FLOAT
from echotruth.repository import metadata
from echotruth.repository.places import METADATA, OF_HEART, STAGES, groups_of, made, place
from echotruth.repository.publication import CHECKSUMS, as_csv, table_of
from echotruth.repository.status import excluded
from echotruth.repository.version import version_of
from echotruth.workflow import cost, lock
from echotruth.workflow.job import case_file, case_text

OUTDATED_CHECKSUMS = f".{CHECKSUMS}.outdated"
"""Name of the checksums of a repository that is to be published anew."""

Wildcards = Any
"""Wildcards of a job: its `heart` or `case`, and its `view` and `size` if there are."""


class Plan:
    """Plan of the jobs of a configuration.

    Parameters
    ----------
    values : dict
        The configuration, as Snakemake has it.
    source : str, optional
        Where it comes from, for errors.

    Attributes
    ----------
    config : Config
    folder : Path
        Folder of the repository, `out/NAME`.
    cases : dict
        Id -> case.

    Raises
    ------
    ConfigError
        If the configuration is not valid.
    """

    def __init__(self, values: dict[str, Any], source: str = "configuration") -> None:
        self.config: Config = validate(dict(values), source)
        self.folder = Path("out") / self.config.name
        self.cases: dict[str, Case] = {case.id: case for case in expand(self.config, source)}
        self._aside: dict[Path, Path] = {}

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

    def heart(self, wildcards: Wildcards) -> str:
        """Metadata of the heart of a case: an input of the jobs of its views."""
        return f"{self.store}/hearts/{self.cases[wildcards.case].heart}/{METADATA}"

    def resources(self, rule: str) -> dict[str, Any]:
        """Time (min) and memory (MB) that a job asks for; one that failed asks for more."""
        asked = cost.resources(rule, self.config)
        return {name: lambda wildcards, attempt, value=value: attempt * value for name, value in asked.items()}

    def settle(self) -> None:
        """Set aside what was made with other settings or by other code, so that Snakemake makes it again.

        So is what the configuration has no more, which is then no part of the repository.
        What a group was made with is in the group: a copy of the folder is judged as the original is, whatever the
        dates of its files. Whoever holds the lock does it, and removes what a killed run left. At the end of a process
        that did not begin a run, as one that only lists jobs, all is as before.

        Raises
        ------
        LockError
            If another run works on the folder.
        """
        if not self.folder.is_dir() or not lock.hold(self.folder):
            return
        shutil.rmtree(self.folder / "drafts", ignore_errors=True)
        atexit.register(self._take_back)
        wanted = set()
        for path, version in self._versions():
            self._settle(path, version)
            wanted.add(path)
        for path in {*made(self.store)} - wanted:
            self._settle(path, "")
        if not all(path.is_file() and path.read_bytes() == text for path, text in self._texts().items()):
            self._set_checksums_aside()  # so that the rule repository writes them

    def _versions(self) -> Iterator[tuple[str, str]]:
        """Path and version of every group, those of hearts first."""
        for heart, id in self.hearts.items():
            yield f"hearts/{heart}", version_of("mechanics", self.cases[id].config)
        stages = [stage for stage in STAGES if stage not in OF_HEART]
        for case in self.cases.values():
            why = excluded(metadata.attributes(self.store / "hearts" / case.heart), bounds_of(case.config))
            for stage, view in product(stages, self.config.views):
                version = version_of(stage, case.config, view, why)
                for group in groups_of(stage, self.config.bmode.sizes):
                    yield place(group, case.heart, case.id, view), version
            if self.config.inference.tracker:
                yield place("inference", case.heart, case.id), version_of("inference", case.config, None, why)

    def _settle(self, path: str, version: str) -> None:
        folder = self.store / path
        was_there = (folder / METADATA).is_file()
        if not metadata.settle(folder, version) and was_there:
            self._aside[folder / METADATA] = folder / metadata.OUTDATED

    def _set_checksums_aside(self) -> None:
        path, aside = self.folder / CHECKSUMS, self.folder / OUTDATED_CHECKSUMS
        if path.is_file():
            path.replace(aside)
            self._aside[path] = aside

    def _take_back(self) -> None:
        """Take back what was set aside for a run that did not begin: one that only lists its jobs."""
        for path, aside in self._aside.items():
            if aside.exists() and not path.exists():
                aside.replace(path)

    def begin(self) -> None:
        """Write the configuration, that of each case, and the table of the cases."""
        lock.hold(self.folder)
        self._aside.clear()
        (self.folder / OUTDATED_CHECKSUMS).unlink(missing_ok=True)
        for case in self.cases.values():
            files.update(case_file(self.folder, case.id), case_text(case).encode())
        for path, text in self._texts().items():
            files.update(path, text)

    def _texts(self) -> dict[Path, bytes]:
        """Configuration and table of the cases, as they are to be."""
        cases = as_csv(table_of(self.store, list(self.cases.values())))
        return {self.folder / "config.yaml": as_yaml(self.config).encode(), self.folder / "cases.csv": cases}


class _Dumper(getattr(yaml, "CSafeDumper", yaml.SafeDumper)):  # type: ignore[misc]  # which of them is not known
    """Writer of YAML in which the table of hearts keeps its lines."""


def _text(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style="|" if "\n" in text else None)


_Dumper.add_representer(str, _text)
_Dumper.add_implicit_resolver(*SHORT_FLOAT)  # so that such a text is written in quotes


def as_yaml(config: Config) -> str:
    """Text of config.yaml."""
    return yaml.dump(config.model_dump(mode="json"), Dumper=_Dumper, sort_keys=False, allow_unicode=True)
