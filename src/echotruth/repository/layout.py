"""Lengths of the dimensions and values of the coordinates of a repository."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from echotruth.config import Config
from echotruth.fem.tetrahedra import Mesh
from echotruth.repository import schema

if TYPE_CHECKING:
    import pandas as pd


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


def positions(
    config: Config, pixel_centres: Callable[..., tuple[ArrayLike, ArrayLike]], grid: Callable[..., ArrayLike]
) -> dict[str, ArrayLike]:
    """Positions of the pixels of every image size, and of the tracked points.

    Parameters
    ----------
    config : Config
    pixel_centres : callable
        From (bmode, size) to the axial and lateral pixel centres, m.
    grid : callable
        From (shape, step) to points (axial, lateral, 2): lateral, axial, px.

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
    for stage in ("tracking", "evaluation"):
        coordinates[f"{stage}:axial"] = centres[largest][0][points[:, 0, 1]]
        coordinates[f"{stage}:lateral"] = centres[largest][1][points[0, :, 0]]
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
        "size": list(config.bmode.sizes),
        "tracker": list(config.tracking.trackers),
        "layer": layers,
        "region": [0, *layers],
        "aha": np.arange(1, 18),
    }
    return schema.LABELS | common | pack_labels(schema.LABELS | common)


def pack_labels(coordinates: Mapping[str, ArrayLike]) -> dict[str, ArrayLike]:
    """Labels and units of the numbers of every pack, by `group:dimension`.

    Parameters
    ----------
    coordinates : dict
        Values of the coordinates of their members.
    """
    return {
        f"{group}:{name}": labels
        for group, packs in schema.PACKS.items()
        for pack in packs
        for name, labels in pack.labels(coordinates).items()
    }


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
