"""Expand the sweep into cases and lay out the repository for them."""

import argparse
import sys
from pathlib import Path

import numpy as np
import yaml

from echotruth.cases import expand, table
from echotruth.config.loading import ConfigError, validate
from echotruth.imaging.bmode import pixel_centres
from echotruth.imaging.channels import described
from echotruth.imaging.scanner import Scanner, imaging_depth
from echotruth.mechanics.geometry import GeometryError, left_ventricle
from echotruth.mechanics.loop import read_loop
from echotruth.repository import layout, ledger, schema
from echotruth.repository.store import Store
from echotruth.tracking import grid

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("repository", type=Path, help="folder of the repository, as out/demo")
parser.add_argument("config", type=argparse.FileType("r"), help="YAML file, or - for standard input")
arguments = parser.parse_args()

try:
    config = validate(yaml.safe_load(arguments.config) or {}, arguments.config.name)
    cases = {case.id: case for case in expand(config, arguments.config.name)}
    mesh = left_ventricle(config.geometry)
except (ConfigError, GeometryError) as error:
    sys.exit(str(error))

arguments.repository.mkdir(parents=True, exist_ok=True)
rows = ledger.register(arguments.repository / "registry.txt", list(cases))
times = np.full((len(rows), config.loop.frames), np.nan)
loops = {loop: read_loop(loop) for loop in {case.config.loop for case in cases.values()}}
for id, case in cases.items():
    times[rows[id]] = loops[case.config.loop].time
frame = table(list(cases.values()))
columns = layout.columns(frame, list(rows))
scanner = config.rf.keep and Scanner(config.probe, config.rf, imaging_depth(config.rf, config.bmode))
values, lengths, settings = described(config, scanner) if scanner else ({}, {}, {})
sizes = layout.sizes(mesh) | lengths
labels = layout.labels(config, list(rows), times) | layout.positions(config, pixel_centres, grid) | columns
labels |= {f"rf:{name}": value for name, value in values.items()}
arrays = schema.groups(config) | {"cases": schema.parameters(columns)}
Store(arguments.repository / f"{config.name}.zarr").lay_out(arrays, sizes, labels, {"rf": settings})
frame.to_csv(arguments.repository / "cases.csv", index=False)
(arguments.repository / "config.yaml").write_text(yaml.safe_dump(config.model_dump(mode="json"), sort_keys=False))
