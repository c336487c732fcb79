"""What the rules ask of a configuration: its hearts, and what the job of a rule depends on and needs."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from copy import copy
from pathlib import Path
from typing import Any

from echotruth.cases import Case, expand
from echotruth.config import Cases, Config
from echotruth.config.loading import ConfigError, load, validate
from echotruth.repository import ledger, settings
from echotruth.repository.choice import image_size
from echotruth.repository.ledger import record_path, record_paths
from echotruth.repository.provenance import code_version, settings_version
from echotruth.repository.verdict import excluded
from echotruth.workflow import lease, resources
from echotruth.workflow.blocks import Block
from echotruth.workflow.processes import script
from echotruth.workflow.sharing import first_with_same

Wildcards = Any
"""Wildcards of a job: its `case`, and its `view` and `size` if there are."""


def errors_version(config: Config, cases: Iterable[Case]) -> str:
    """Hash of the errors of the tracker from which the muscle of cases is inferred, "" if none is named.

    Raises
    ------
    NoErrors, PriorError
        If they are not known, or the priors cannot be used.
    """
    if not config.inference.tracker:
        return ""
    from echotruth.inference.parameters import check_prior
    from echotruth.inference.tracker_errors import version

    check_prior(config.inference.prior)
    return version(case.config for case in cases)


class Plan:
    """Plan of the jobs of a configuration.

    Parameters
    ----------
    values : dict
        The configuration, as Snakemake has it. Its key `block`, such as "3/40", takes one part of the hearts; "0/40"
        takes none, and so leaves the repository and its report.
    source : str, optional
        Where it comes from, for errors.

    Attributes
    ----------
    config : Config
    folder : Path
        Folder of the repository, `out/NAME`.
    cases : dict
        Hearts of this plan, by id.

    Raises
    ------
    ConfigError
        If the configuration is not valid.
    """

    def __init__(self, values: dict[str, Any], source: str = "configuration") -> None:
        given = dict(values)
        block = given.pop("block", None)
        self._is_block = block is not None
        self.config: Config = validate(given, source)
        self.folder = Path("out") / self.config.name
        self._every = {case.id: case for case in expand(self.config, source)}
        self._errors = self._errors_version(source)
        self._motions = settings.motions({id: case.config for id, case in self._every.items()})
        self._same = first_with_same(self._motions, ledger.rows(self.folder / "registry.txt"))
        self._choose(Block.parse(block, source))

    def _choose(self, block: Block) -> None:
        self._block = block
        self.cases: dict[str, Case] = {id: self._every[id] for id in block.of(self._motions)}

    def block(self, number: int, count: int) -> Plan:
        """The plan of a block of the hearts, which numbers from 1 to `count`."""
        plan = copy(self)
        plan._choose(Block(number, count))
        return plan

    @property
    def mark(self) -> Path:
        """File that says that the hearts of this plan were made, with these settings and this code."""
        code = [self.code(stage) for stage in ledger.stages(self.config)]
        hearts = [[id, case.parameters, self._motions[id]] for id, case in self.cases.items()]
        common = self.config.model_copy(update={"cases": Cases()})
        return self.folder / "blocks" / f"{settings_version(common, code, hearts)}.made"

    def stands(self) -> bool:
        """Whether the hearts of this plan were made, and all their records are there."""
        return self.mark.is_file() and all(path.is_file() for path in self._record_paths())

    def begin(self) -> None:
        """Hold the lease of the folder until this process ends, and lay the repository out.

        For the blocks of a sweep that is done once.
        """
        lease.hold(self.folder)
        if not (self._is_block and self._is_laid_out()):
            from echotruth.repository.layout import lay_out

            lay_out(self.folder, self.config, list(self._every.values()))

    def _is_laid_out(self) -> bool:
        """Whether the repository is laid out for this configuration."""
        try:
            return load(self.folder / "config.yaml") == self.config
        except ConfigError:
            return False

    def code(self, stage: str) -> str:
        """Version of the code of a stage; if it changes, the stage is run again."""
        return code_version(script(stage))

    def settings(self, stage: str) -> Callable[[Wildcards], str]:
        """Hash of the settings of a stage, besides those of the stages before it; as a function of wildcards."""
        if stage == "mechanics":
            return lambda wildcards: self._motions[wildcards.case]
        if stage == "inference":
            return lambda wildcards: settings_version(*settings.inference(self.config), self._errors)
        if stage == "repository":
            return lambda wildcards: settings_version(self.config, list(self._every))
        return lambda wildcards: self._settings(stage, wildcards.case, wildcards.view)

    def _settings(self, stage: str, case: str, view: str) -> str:
        return settings_version(*settings.OF_VIEW[stage](self._every[case].config, view))

    def _errors_version(self, source: str) -> str:
        try:
            return errors_version(self.config, self._every.values())
        except ValueError as error:
            raise ConfigError(f"{source}: inference: {error}") from None

    def same_motion(self, wildcards: Wildcards) -> list[str]:
        """Record of the heart from which a heart takes over its motion, if there is one."""
        first = self._same.get(wildcards.case)
        return [] if first is None else [str(record_path(self.folder, "mechanics", first))]

    def excluded(self, wildcards: Wildcards) -> str:
        """Why a heart is not imaged; empty if it is. Other bounds run again only what they decide otherwise."""
        return excluded(self.folder, wildcards.case, self._every[wildcards.case].config)

    def tracked(self, wildcards: Wildcards) -> list[str]:
        """Records of what was tracked in the views of a heart, in the images from which is inferred."""
        size = image_size(self.config, self.config.inference.size_px)
        return [str(record_path(self.folder, "tracking", wildcards.case, view, size)) for view in self.config.views]

    def bmode_source(self, wildcards: Wildcards) -> list[str]:
        """What a clip is made from: lines, kept or not, or the largest clip."""
        case, view, largest = wildcards.case, wildcards.view, self.config.bmode.sizes[0]
        if int(wildcards.size) != largest:
            return [str(record_path(self.folder, "bmode", case, view, largest))]
        rf = record_path(self.folder, "rf", case, view)
        lines = self.folder / "scratch" / case / view / "lines.npz"
        return [str(rf)] if "lines" in self.config.rf.keep else [str(rf), str(lines)]

    def records(self, wildcards: Wildcards) -> list[str]:
        """Records of all jobs, so that a lost one is made again; for what follows the blocks, their marks."""
        number, count = self._block
        if number:
            return [str(path) for path in self._record_paths()]
        blocks = [self.block(number, count) for number in range(1, count + 1)]
        return [str(block.mark) for block in blocks if block.cases]

    def _record_paths(self) -> list[Path]:
        return [path for case in self.cases for path in record_paths(self.folder, case, self.config)]

    def external_scores(self, wildcards: Wildcards) -> list[str]:
        """Scores of trackers from outside."""
        return [str(path) for path in sorted(self.folder.glob("external/*.csv"))]

    def runtime(self, rule: str) -> Callable[..., int]:
        """Time that a job asks for, min; one that failed asks for more."""
        return lambda wildcards, attempt: attempt * self._resource(resources.minutes, rule, wildcards)

    def mem_mb(self, rule: str) -> Callable[..., int]:
        """Memory that a job asks for, MB; one that failed asks for more."""
        return lambda wildcards, attempt: attempt * self._resource(resources.megabytes, rule, wildcards)

    def _resource(self, of: Callable[..., int], rule: str, wildcards: Wildcards) -> int:
        place = dict(wildcards.items())
        config = self._every[place["case"]].config if "case" in place else self.config
        return of(rule, config, place.get("view", ""), int(place.get("size", 0)))
