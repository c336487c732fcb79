"""Lengths of the dimensions and values of the coordinates of a repository."""

from __future__ import annotations

from collections.abc import Callable
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
        "row": 3,
        "column": 3,
    }


def positions(
    config: Config, pixel_centres: Callable[..., tuple[ArrayLike, ArrayLike]], grid: Callable[..., ArrayLike]
) -> dict[str, ArrayLike]:
    """Positions of the pixels and the tracked points of every image size.

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
        `group:axial` and `group:lateral`, m.
    """
    coordinates: dict[str, ArrayLike] = {}
    centres = {size: tuple(map(np.asarray, pixel_centres(config.bmode, size))) for size in config.bmode.sizes}
    largest = config.bmode.sizes[0]
    points = np.asarray(grid((largest, largest), config.tracking.grid_px)).astype(int)
    for size, (axial, lateral) in centres.items():
        for stage in ("truth", "bmode"):
            coordinates |= {f"{stage}/{size}:axial": axial, f"{stage}/{size}:lateral": lateral}
        for stage in ("tracking", "evaluation"):
            coordinates[f"{stage}/{size}:axial"] = centres[largest][0][points[:, 0, 1]]
            coordinates[f"{stage}/{size}:lateral"] = centres[largest][1][points[0, :, 0]]
    return coordinates


def labels(config: Config, rows: list[str], times: ArrayLike) -> dict[str, ArrayLike]:
    """Values of the coordinates that are the same in every group.

    Parameters
    ----------
    config : Config
    rows : list of str
        Case ids, in the order of the rows.
    times : ndarray of shape (case, frame), s
    """
    layers = np.arange(1, config.fibres.layers + 1)
    common: dict[str, ArrayLike] = {
        "case": rows,
        "view": list(config.views),
        "frame": np.arange(config.loop.frames),
        "time": times,
        "tracker": list(config.tracking.trackers),
        "layer": layers,
        "region": [0, *layers],
        "aha": np.arange(1, 18),
    }
    return schema.LABELS | common


def columns(table: pd.DataFrame, rows: list[str]) -> dict[str, NDArray[Any]]:
    """Columns of the table of cases as `cases:KEY`, one value per row; NaN or "" for retired cases."""
    arrays = {}
    for key, column in table.set_index("case").reindex(rows).items():
        text = column.map(lambda value: isinstance(value, str)).any()
        values = column.fillna("") if text else column.astype(float)
        arrays[f"cases:{key}"] = np.asarray(values, dtype=str if text else float)
    return arrays
