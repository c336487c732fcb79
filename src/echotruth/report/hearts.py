"""The hearts of a repository at a glance: what became of them, their measures and a small picture of each."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from echotruth.report import style
from echotruth.report.clips import QUALITY, address
from echotruth.repository.reader import Repository

MEASURES = {
    "Ejection fraction (%)": ("ejection_fraction", 100.0),
    "GLS (%)": ("gls", 100.0),
    "E_CC (%)": ("circumferential_strain", 100.0),
    "Twist at ES (°)": ("twist_es", style.FACTORS["°"]),
}
"""Label -> array of the group `physiology`, and the factor to the unit of the label."""

SHOWN = 24
"""Largest number of hearts of which there is a row with a picture."""

THUMBNAIL = 96
"""Side of a small picture, px."""


def measures(repository: Repository, cases: Sequence[str]) -> dict[str, NDArray[np.float64]]:
    """Measures of hearts by the labels of `MEASURES`, each (case,).

    Parameters
    ----------
    repository : Repository
    cases : sequence of str
        Hearts that have been imaged.
    """
    found = [repository.arrays("physiology", case) for case in cases]
    return {label: factor * np.array([each[name] for each in found]) for label, (name, factor) in MEASURES.items()}


def subjects(repository: Repository, view: str) -> list[dict[str, Any]]:
    """The hearts that the page shows, evenly chosen if there are many.

    Parameters
    ----------
    repository : Repository
    view : str
        View of the small pictures, which are made of its smallest images.

    Returns
    -------
    list of dict
        At most `SHOWN`, each with `case`, `status`, `diagnosis`, `volume` (end-diastolic, m^3), `measures` (as
        `MEASURES`) and `picture` (as :func:`picture` returns it); numbers are NaN where the heart has none.
    """
    imaged = repository.shown
    places = np.unique(np.linspace(0, len(imaged) - 1, min(len(imaged), SHOWN)).round().astype(int))
    chosen = [imaged[place] for place in places]
    found = measures(repository, chosen)
    return [
        {
            "case": case,
            "status": str(repository.cases.at[case, "status"]),
            "diagnosis": str(repository.cases.at[case, "diagnosis"]),
            "volume": float(repository.read("mechanics/volume", case, None, 0)),
            "measures": [float(values[k]) for values in found.values()],
            "picture": picture(_image(repository, case, view)),
        }
        for k, case in enumerate(chosen)
    ]


def _image(repository: Repository, case: str, view: str) -> NDArray[np.uint8]:
    """The smallest image at end-diastole, of volumes the slice through the middle, its pixels square."""
    config = repository.config
    image = repository.read(f"bmode/{config.image_names[-1]}/image", case, view, 0)
    if not config.has_volumes:
        return image
    axial, _, lateral = config.volume.field_mm
    middle = Image.fromarray(image[:, image.shape[1] // 2])
    return np.asarray(middle.resize((max(1, round(len(image) * lateral / axial)), len(image))))


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
    return address(small, "jpeg", quality=QUALITY, optimize=True)
