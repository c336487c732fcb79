"""Expand the sweep into cases and create the arrays of the repository."""

import argparse
import sys
from pathlib import Path

import numpy as np
import yaml

from echotruth.cases import RF_INDEPENDENT, Case, expand, table
from echotruth.config import Config
from echotruth.config.loading import ConfigError, validate
from echotruth.imaging.beamforming.scanner import Scanner, imaging_depth
from echotruth.imaging.bmode import pixel_centres
from echotruth.imaging.recorder import metadata
from echotruth.loop.cycle import frame_times
from echotruth.mechanics.geometry import GeometryError, left_ventricle
from echotruth.mechanics.motion_file.wall import moving_wall
from echotruth.mechanics.prescribed import MotionError
from echotruth.repository import durable, layout, ledger, schema
from echotruth.repository.store import Store
from echotruth.tracking import grid
from echotruth.workflow import superseded


def lay_out(folder: Path, config: Config, cases: list[Case]) -> None:
    """Write the table of the cases and the empty arrays of all jobs; existing values stay.

    Parameters
    ----------
    folder : Path
        Folder of the repository.
    config : Config
    cases : list of Case
        Cases of the configuration.
    """
    mesh = moving_wall(config).mesh if config.motion.kind == "file" else left_ventricle(config.geometry)
    folder.mkdir(parents=True, exist_ok=True)
    store = Store(folder / f"{config.name}.zarr")
    rows = ledger.register(folder / "registry.txt", [case.id for case in cases], store.labels("case"))
    views = ledger.register(folder / "views.txt", list(config.views), store.labels("view"))
    times = np.full((len(rows), config.loop.frames), np.nan)
    for case in cases:
        times[rows[case.id]] = frame_times(case.config.loop)
    case_table = table(cases)
    columns = layout.columns(case_table, list(rows))
    first = cases[0].config
    scanner = first.rf.keep and Scanner(first.probe, first.rf, imaging_depth(first.rf, first.bmode))
    values, lengths, settings = metadata(first, scanner) if scanner else ({}, {}, {})
    constants = layout.constants(case_table)
    swept = {name for key, names in RF_INDEPENDENT.items() if key not in constants for name in names}
    settings = {name: value for name, value in settings.items() if name not in swept}
    sizes = layout.sizes(mesh) | lengths
    labels = layout.labels(config, list(rows), times, list(views)) | columns
    labels |= layout.positions(config, pixel_centres, grid)
    labels |= {f"rf:{name}": value for name, value in values.items()}
    arrays = schema.groups(config) | {"cases": schema.parameters(columns)}
    superseded.set_aside(folder, config)
    store.lay_out(arrays, sizes, labels, {"rf": settings, "cases": {"constants": constants}})
    settings_file = yaml.dump(config.model_dump(mode="json"), Dumper=_Dumper, sort_keys=False, allow_unicode=True)
    texts = {"cases.csv": case_table.to_csv(index=False), "config.yaml": settings_file}
    durable.update_all({folder / name: text.encode() for name, text in texts.items()})


class _Dumper(getattr(yaml, "CSafeDumper", yaml.SafeDumper)):  # type: ignore[misc]  # which of them is not known
    """Writer of YAML in which the table of hearts keeps its lines."""


def _text(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style="|" if "\n" in text else None)


_Dumper.add_representer(str, _text)
_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""LibYAML is ten times as fast as PyYAML's own parser; a table of hearts may hold a million characters."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("repository", type=Path, help="folder of the repository, such as out/demo")
    parser.add_argument("config", type=argparse.FileType("r"), help="YAML file, or - for standard input")
    arguments = parser.parse_args()
    try:
        config = validate(yaml.load(arguments.config, Loader=_LOADER) or {}, arguments.config.name)
        lay_out(arguments.repository, config, expand(config, arguments.config.name))
    except (ConfigError, GeometryError, MotionError) as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
