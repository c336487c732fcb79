"""What the workflow hands a job: its configuration in a file that never changes, its case, and the version of its code.

So a job that runs or waits in a queue does not read a configuration that has changed since it was planned, and neither
expands the sweep nor reads the code of its stage. A stage that is run by hand finds all three itself.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from shlex import quote
from typing import Any

from echotruth.cases import Case
from echotruth.config import Cases, Config
from echotruth.config.loading import ConfigError, override, validate
from echotruth.repository import durable
from echotruth.repository.provenance import settings_version


def single(config: Config) -> Config:
    """The configuration without its sweep: what all its cases have in common."""
    return config.model_copy(update={"cases": Cases()})


def configuration_path(folder: Path, config: Config) -> Path:
    """File with the configuration that jobs are handed, named by its content: configs/HASH.json.

    Parameters
    ----------
    folder : Path
        Folder of the repository, `out/NAME`.
    config : Config
        Configuration, with or without its sweep.
    """
    return _path(folder, single(config))


def write_configuration(folder: Path, config: Config) -> Path:
    """Write the configuration that jobs are handed, unless it stands there already, and return its path."""
    return _write(folder, single(config))


def write_sweep(folder: Path, config: Config) -> Path:
    """Write a configuration with its sweep, as the processes read it that Snakemake starts on other machines."""
    return _write(folder, config)


def _path(folder: Path, config: Config) -> Path:
    return folder / "configs" / f"{settings_version(config)}.json"


def _write(folder: Path, config: Config) -> Path:
    path = _path(folder, config)
    if not path.exists():
        # The order of trackers is that of the arrays: keys stay as they are.
        durable.write(path, config.model_dump_json().encode())
    return path


def common_options(path: Path, code: dict[str, str]) -> str:
    """Options of a job's command line that are the same for all cases, quoted for the shell.

    Parameters
    ----------
    path : Path
        File with the configuration.
    code : dict
        Stage -> version of its code.
    """
    return f"--config {quote(str(path))} --code {quote(json.dumps(code))}"


def case_options(case: Case) -> str:
    """Option of a job's command line that differs between cases, quoted for the shell."""
    return f"--parameters {quote(json.dumps(case.parameters))}"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options to the parser of a job."""
    group = parser.add_argument_group("given by the workflow; without them a job reads config.yaml of the repository")
    group.add_argument("--config", type=Path, help="file with the configuration of a case, without its parameters")
    group.add_argument("--parameters", type=_mapping, default={}, help="swept keys and values of the case, as JSON")
    group.add_argument("--code", type=_mapping, default={}, help="version of the code of each stage, as JSON")


def handed_case(id: str, path: Path, parameters: dict[str, Any]) -> Case:
    """The case that a job is handed.

    Raises
    ------
    ConfigError
        If the file is missing or holds no configuration, or a parameter is not valid.
    """
    if not path.is_file():
        raise ConfigError(f"{path}: file not found: run the workflow, or leave out --config to use config.yaml")
    config = validate(json.loads(path.read_text(encoding="utf-8")), str(path))
    return Case(id, parameters, override(config, parameters, str(path)))


def _mapping(text: str) -> dict[str, Any]:
    values = json.loads(text)
    if not isinstance(values, dict):
        raise argparse.ArgumentTypeError(f"{text} is not a mapping: write it as JSON, such as '{{\"seed\": 2}}'")
    return values
