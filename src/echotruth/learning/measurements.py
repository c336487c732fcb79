"""Measurements of hearts, for the table of cases and as targets of regression."""

from echotruth.arrays import Floats
from echotruth.fem.volume import cell_volumes
from echotruth.repository.group import NotWritten
from echotruth.repository.reader import Repository

PHYSIOLOGY = (
    *("ejection_fraction", "gls", "circumferential_strain", "longitudinal_strain", "wall_thickening"),
    *("twist_es", "twist_peak", "tei_index", "dpdt_max", "dpdt_min", "tau"),
)
"""Columns that are arrays of the group `physiology`, in its units."""
INFARCT = 1
"""Region of an infarct in `pathology/region`."""


def measurements(repository: Repository, case: str) -> dict[str, Floats | float]:
    """Measured function of a heart and its `scar_size`; nothing of one that was not solved."""
    try:
        found = repository.arrays("physiology", case, None, *PHYSIOLOGY)
        return found | {"scar_size": scar_size(repository, case)}
    except NotWritten:
        return {}


def scar_size(repository: Repository, case: str) -> float:
    """Fraction of the wall's volume, unloaded, that is infarcted; without the border zone.

    Parameters
    ----------
    repository : Repository
    case : str
        Of which the mechanics were solved.
    """
    infarct = repository.arrays("pathology", case, None, "region")["region"] == INFARCT
    if not infarct.any():
        return 0.0
    mesh = repository.arrays("geometry", case, None, "node_position", "cell_node")
    volume = cell_volumes(mesh["node_position"], mesh["cell_node"])
    return float(volume[infarct].sum() / volume.sum())
