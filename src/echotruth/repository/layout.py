"""Layout of a repository before its first job: table and configurations of its hearts, and the empty arrays."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml
from numpy.typing import ArrayLike, NDArray

from echotruth.cases import RF_INDEPENDENT, Case, table
from echotruth.config import Config
from echotruth.config.reading import SHORT_FLOAT
from echotruth.fem.tetrahedra import Mesh
from echotruth.imaging.beamforming.scanner import Scanner, imaging_depth
from echotruth.imaging.bmode import pixel_centres
from echotruth.imaging.recorder import metadata
from echotruth.loop.cycle import frame_times
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.motion_file.wall import moving_wall
from echotruth.repository import durable, ledger, schema
from echotruth.repository.case_file import case_path
from echotruth.repository.checksums import commit_beside
from echotruth.repository.store import Store
from echotruth.tracking import grid

if TYPE_CHECKING:
    import pandas as pd


def lay_out(folder: Path, config: Config, cases: list[Case]) -> None:
    """Write the table of the cases, a configuration for each, and the empty arrays of all jobs; existing values stay.

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
    _drop_records(folder, store, config)
    times = np.full((len(rows), config.loop.frames), np.nan)
    for case in cases:
        times[rows[case.id]] = frame_times(case.config.loop)
    case_table = table(cases)
    case_columns = columns(case_table, list(rows))
    values, lengths, settings = _rf_metadata(cases[0].config, constants(case_table))
    coordinates = labels(config, list(rows), times, list(views)) | case_columns | positions(config)
    coordinates |= {f"rf:{name}": value for name, value in values.items()}
    arrays = schema.groups(config) | {"cases": schema.parameters(case_columns)}
    attributes = {"rf": settings, "cases": {"constants": constants(case_table)}}
    store.lay_out(arrays, sizes(mesh) | lengths, coordinates, attributes)
    texts = {case_path(folder, case.id): case.config.model_dump_json() for case in cases}
    texts |= {folder / "cases.csv": case_table.to_csv(index=False), folder / "config.yaml": as_yaml(config)}
    durable.update_all({path: text.encode() for path, text in texts.items()})
    commit_beside(folder, folder / "ledger/configuration.json", list(texts))


def _drop_records(folder: Path, store: Store, config: Config) -> None:
    """Drop the records of image sizes and of inference that left the configuration, whose arrays are to be removed."""
    if not config.inference.tracker:
        for record in folder.glob("ledger/inference/*.json"):
            record.unlink(missing_ok=True)
    left = {path.name for path in store.path.glob("*/[0-9]*")} - {str(size) for size in config.bmode.sizes}
    for size in left:
        for record in folder.glob(f"ledger/*/*/*/{size}.json"):
            record.unlink(missing_ok=True)


def _rf_metadata(
    first: Config, constant: dict[str, Any]
) -> tuple[dict[str, ArrayLike], dict[str, int], dict[str, Any]]:
    """Values, lengths and attributes of the group `rf`; none if no RF is kept."""
    if not first.rf.keep:
        return {}, {}, {}
    scanner = Scanner(first.probe, first.rf, imaging_depth(first.rf, first.bmode))
    values, lengths, settings = metadata(first, scanner)
    swept = {name for key, names in RF_INDEPENDENT.items() if key not in constant for name in names}
    return {**values}, lengths, {name: value for name, value in settings.items() if name not in swept}


class _Dumper(getattr(yaml, "CSafeDumper", yaml.SafeDumper)):  # type: ignore[misc]  # which of them is not known
    """Writer of YAML in which the table of hearts keeps its lines."""


def _text(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style="|" if "\n" in text else None)


_Dumper.add_representer(str, _text)
_Dumper.add_implicit_resolver(*SHORT_FLOAT)  # so that such a text is written in quotes


def as_yaml(config: Config) -> str:
    """Text of config.yaml."""
    return yaml.dump(config.model_dump(mode="json"), Dumper=_Dumper, sort_keys=False, allow_unicode=True)


def sizes(mesh: Mesh) -> dict[str, int]:
    """Lengths of the dimensions without coordinates.

    Parameters
    ----------
    mesh : Mesh
        Mesh of any case: all meshes have the same topology.
    """
    return {
        "node": len(mesh.nodes),
        "cell": len(mesh.cells),
        "local_node": mesh.cells.shape[1],
        "facet_node": mesh.endo.shape[1],
        "endo_facet": len(mesh.endo),
        "epi_facet": len(mesh.epi),
        "base_facet": len(mesh.base),
    }


def positions(config: Config) -> dict[str, ArrayLike]:
    """Positions of the pixels of every image size, and of the tracked points.

    Returns
    -------
    dict
        `group:axial` and `group:lateral`, m; the tracked points are the same at every size.
    """
    coordinates: dict[str, ArrayLike] = {}
    centres = {size: tuple(map(np.asarray, pixel_centres(config.bmode, size))) for size in config.bmode.sizes}
    largest = config.bmode.sizes[0]
    points = np.asarray(grid((largest, largest), config.tracking.grid_px)).astype(int)
    for size, (axial, lateral) in centres.items():
        for stage in ("truth", "bmode"):
            coordinates |= {f"{stage}/{size}:axial": axial, f"{stage}/{size}:lateral": lateral}
    tracked = [group for group in schema.groups(config) if group.partition("/")[0] in schema.TRACKED]
    for group in tracked:
        coordinates[f"{group}:axial"] = centres[largest][0][points[:, 0, 1]]
        coordinates[f"{group}:lateral"] = centres[largest][1][points[0, :, 0]]
    return coordinates


def labels(config: Config, rows: list[str], times: ArrayLike, views: list[str] | None = None) -> dict[str, ArrayLike]:
    """Values of the coordinates that are the same in every group, and of the labels of packs.

    Parameters
    ----------
    config : Config
    rows : list of str
        Case ids, in the order of the rows.
    times : ndarray of shape (case, frame), s
    views : list of str, optional
        Views in the order of their indices (default: those of the configuration, as in a new repository).
    """
    layers = np.arange(1, config.fibres.layers + 1)
    common: dict[str, ArrayLike] = {
        "case": rows,
        "view": list(config.views) if views is None else views,
        "frame": np.arange(config.loop.frames),
        "time": times,
        "layer": layers,
        "region": [0, *layers],
        "aha": np.arange(1, 18),
        "chain": np.arange(schema.CHAINS),
        "draw": np.arange(schema.DRAWS),
        "observation": schema.observations(config),
        "observation_units": schema.units_of_observations(config),
        "other": schema.observations(config),
        "parameter_units": [schema.unit_in_store(name) for name in schema.LABELS["parameter"]],
    }
    coordinates = schema.LABELS | common
    packs = ((group, pack.labels(coordinates)) for group in schema.groups(config) for pack in schema.packs_of(group))
    return coordinates | {f"{group}:{name}": found for group, each in packs for name, found in each.items()}


def columns(table: pd.DataFrame, rows: list[str]) -> dict[str, NDArray[Any]]:
    """Columns of the table of cases as `cases:KEY`, one value per row; NaN or "" for retired cases.

    Parameters
    ----------
    table : DataFrame
        As :func:`echotruth.cases.table` returns it.
    rows : list of str
        Case ids, in the order of the rows.

    Returns
    -------
    dict
        The seed, and every key whose value differs among the cases.
    """
    keys = [key for key in table if key == "seed" or (key != "case" and not _is_constant(table[key]))]
    arrays = {}
    for key, column in table.set_index("case")[keys].reindex(rows).items():
        text = any(isinstance(value, str) for value in column)
        values = column.fillna("") if text else column.astype(float)
        arrays[f"cases:{key}"] = np.asarray(values, dtype=str if text else float)
    return arrays


def constants(table: pd.DataFrame) -> dict[str, str | float | None]:
    """Value of every key that is the same in all cases, as the table of cases holds it.

    Parameters
    ----------
    table : DataFrame
        As :func:`echotruth.cases.table` returns it.
    """
    keys = [key for key in table if key not in ("case", "seed") and _is_constant(table[key])]
    return {str(key): table[key].iloc[:1].tolist()[0] for key in keys}


def _is_constant(column: pd.Series) -> bool:
    return column.nunique(dropna=False) < 2
