"""Measurements of hearts, for the table of cases and as targets of regression."""

from echotruth.arrays import Floats
from echotruth.fem.volume import cell_volumes
from echotruth.repository.reader import Repository

PHYSIOLOGY = (
    *("ejection_fraction", "gls", "circumferential_strain", "longitudinal_strain", "wall_thickening"),
    *("twist_es", "twist_peak", "tei_index", "dpdt_max", "dpdt_min", "tau"),
)
"""Columns that are arrays of the group `physiology`, in its units."""
INFARCT = 1
"""Region of an infarct in `pathology/region`."""


def physiology(
    repository: Repository, row: int | slice = slice(None), names: tuple[str, ...] = PHYSIOLOGY
) -> dict[str, Floats]:
    """Measured function of one heart, or of all of a repository.

    Parameters
    ----------
    repository : Repository
    row : int or slice
        Row of the case. Default: all.
    names : tuple of str
        Scalars of the group `physiology`.

    Returns
    -------
    dict of ndarray of shape () or (case,)
        By name, in the units of docs/schema.md; NaN for hearts that were not measured.
    """
    labels, packed = repository.labels("physiology/scalar"), repository.read("physiology/scalars", row)
    return {name: packed[..., labels.index(name)] for name in names}


def scar_size(repository: Repository, row: int) -> float:
    """Fraction of the wall's volume, unloaded, that is infarcted; without the border zone.

    Parameters
    ----------
    repository : Repository
    row : int
        Row of the case, whose mechanics were solved.
    """
    infarct = repository.read("pathology/region", row) == INFARCT
    if not infarct.any():
        return 0.0
    volume = cell_volumes(repository.read("geometry/node_position", row), repository.read("geometry/cell_node", row))
    return float(volume[infarct].sum() / volume.sum())
