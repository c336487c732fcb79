"""Arrays of a heart as xarray data sets, with the dimensions and units of the repository."""

import xarray as xr

from echotruth.cases import Case
from echotruth.heart import Heart
from echotruth.notebook.arguments import check_heart
from echotruth.repository.datasets import as_stored, dataset


def heart_dataset(heart: Heart, group: str) -> xr.Dataset:
    """Arrays of one group of a heart.

    Parameters
    ----------
    heart : Heart
        As :func:`echotruth.beat` returns it.
    group : {"geometry", "fibres", "pathology", "mechanics", "kinematics", "physiology"}

    Raises
    ------
    ValueError
        If the heart has no such group.

    Examples
    --------
    >>> import echotruth as et
    >>> geometry = et.heart_dataset(et.Repository("out/demo").heart(), "geometry")
    >>> geometry["node_position"].dims, geometry["node_position"].units
    (('node', 'xyz'), 'm')
    """
    check_heart(heart)
    if heart.config is None or group not in heart.arrays:
        raise ValueError(f"group = {group!r}: the heart has {', '.join(heart.arrays) or 'no groups'}.")
    case = Case("heart", {}, heart.config)
    return dataset(case, as_stored(case, {group: heart.arrays[group]}), {})
