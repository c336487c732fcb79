"""The hearts of a repository at a glance: what became of them, their measures and a small picture of each."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from PIL import Image

from echotruth.report.cine import jpeg_address
from echotruth.repository.unpacking import unpack

MEASURES = {
    "Ejection fraction (%)": ("ejection_fraction", 100.0),
    "GLS (%)": ("gls", 100.0),
    "Circumferential strain (%)": ("circumferential_strain", 100.0),
    "Twist at ES (deg)": ("twist_es", float(np.degrees(1))),
}
"""Label -> array of the group `physiology`, and the factor to the unit of the label."""

UNIT_OF_VOLUME = 1e-9
"""uL, in m^3."""

SHOWN = 24
"""Largest number of hearts of which there is a row with a picture."""

THUMBNAIL = 96
"""Side of a small picture, px."""

STATUSES = ("complete", "implausible", "failed", "retired", "unfinished")
"""What may become of a heart, in the order of the page."""


def diagnoses(tree: xr.DataTree) -> NDArray[np.str_]:
    """Diagnosis of every heart, (case,).

    Parameters
    ----------
    tree : DataTree
        The repository.
    """
    cases = tree["cases"].to_dataset()
    if "diagnosis" in cases:
        return _plain(cases["diagnosis"].values)
    return np.full(cases.sizes["case"], str(cases.attrs["constants"].get("diagnosis", "")))


def statuses(tree: xr.DataTree) -> NDArray[np.str_]:
    """What became of every heart, (case,): its status, or "unfinished" if it has none yet.

    Parameters
    ----------
    tree : DataTree
        The repository.
    """
    found = _plain(tree["cases"].to_dataset()["status"].values)
    return np.where(found == "", "unfinished", found)


def _plain(texts: NDArray[Any]) -> NDArray[np.str_]:
    """Texts of variable length as NumPy's own."""
    return np.array([str(text) for text in texts], dtype=str)


def measures(tree: xr.DataTree, rows: NDArray[np.int_]) -> dict[str, NDArray[np.float64]]:
    """Measures of hearts by the labels of `MEASURES`, each (row,).

    Parameters
    ----------
    tree : DataTree
        The repository.
    rows : ndarray of int
        Rows of the hearts.
    """
    names = [name for name, _ in MEASURES.values()]
    found = unpack(tree["physiology"].to_dataset().isel(case=rows), *names)
    return {label: factor * np.asarray(found[name].values, float) for label, (name, factor) in MEASURES.items()}


def subjects(tree: xr.DataTree, rows: NDArray[np.int_], view: str, size: int) -> list[dict[str, Any]]:
    """The hearts that the page shows, evenly chosen if there are many.

    Parameters
    ----------
    tree : DataTree
        The repository.
    rows : ndarray of int
        Rows of the hearts that have been imaged.
    view : str
        View of the small pictures.
    size : int
        Size of the images from which these are made, px.

    Returns
    -------
    list of dict
        At most `SHOWN`, each with `case`, `status`, `diagnosis`, `volume` (end-diastolic, uL), `measures` (as
        `MEASURES`) and `picture` (as :func:`picture` returns it); numbers are NaN where the heart has none.
    """
    chosen = rows[np.unique(np.linspace(0, len(rows) - 1, min(len(rows), SHOWN)).round().astype(int))]
    found = measures(tree, chosen)
    volume = tree["mechanics"].to_dataset().volume.isel(case=chosen, frame=0).values / UNIT_OF_VOLUME
    images = tree[f"bmode/{size}"].to_dataset().image.sel(view=view).isel(frame=0)
    cases, status, diagnosis = tree["cases"].to_dataset()["case"].values, statuses(tree), diagnoses(tree)
    return [
        {
            "case": str(cases[row]),
            "status": str(status[row]),
            "diagnosis": str(diagnosis[row]),
            "volume": float(volume[k]),
            "measures": [float(values[k]) for values in found.values()],
            "picture": picture(images.isel(case=row).values),
        }
        for k, row in enumerate(chosen)
    ]


def picture(image: NDArray[np.uint8]) -> str:
    """Small picture of the bright part of an image, as an address that holds its data.

    Parameters
    ----------
    image : ndarray of shape (axial, lateral), uint8

    Returns
    -------
    str
    """
    bright = np.argwhere(image > 40)
    low, high = (bright.min(0), bright.max(0)) if len(bright) else (np.zeros(2, int), np.array(image.shape) - 1)
    half = max(int(0.55 * (high - low).max()), 8)
    row, column = (low + high) // 2
    # Pillow pads with black what lies beyond the image.
    box = int(column) - half, int(row) - half, int(column) + half, int(row) + half
    small = Image.fromarray(image).crop(box).resize((THUMBNAIL, THUMBNAIL), Image.Resampling.LANCZOS)
    return jpeg_address(small)
