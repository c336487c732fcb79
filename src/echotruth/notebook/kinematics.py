"""Deformation and strain of a heart, which the repository does not hold since its mesh and its motion give them."""

import numpy as np
import xarray as xr

from echotruth.heart import Heart
from echotruth.loop.cycle import frame_times
from echotruth.mechanics.derived import centroid_kinematics, fibre_angles
from echotruth.notebook.arguments import check_heart
from echotruth.repository import schema


def kinematics(heart: Heart) -> xr.Dataset:
    """Compute deformation, strain and fibre angles at the centroids of the cells of a heart.

    Parameters
    ----------
    heart : Heart
        As :func:`echotruth.beat` or :meth:`echotruth.Repository.heart` returns it.

    Returns
    -------
    Dataset
        deformation_gradient (frame, cell, row, column) from the unloaded state; strain and strain_unloaded (frame,
        cell, strain_component) along the wall axes, from end-diastole and from the unloaded state; fibre_strain and
        fibre_strain_unloaded (frame, cell, fibre_component) along the fibre axes; and helix_angle, transverse_angle and
        sheet_angle (cell), rad (docs/conventions.md).

    Raises
    ------
    ValueError
        If the heart was not made by echotruth.beat or read by echotruth.Repository.

    Examples
    --------
    >>> import echotruth as et
    >>> strain = et.kinematics(et.Repository("out/demo").heart())["strain"]
    >>> strain.dims
    ('frame', 'cell', 'strain_component')
    >>> float(abs(strain.isel(frame=0)).max()) < 1e-6  # strain is from end-diastole, frame 0
    True
    """
    check_heart(heart)
    if heart.config is None or not {"geometry", "fibres"} <= set(heart.arrays):
        raise ValueError("The heart has no fibres: make it by echotruth.beat, or read one of a Repository.")
    values = centroid_kinematics(heart) | fibre_angles(heart)
    variables = {
        array.name: (array.dims, values[array.name], {"units": array.units, "long_name": array.long_name})
        for array in schema.DERIVED
    }
    labels = {name: list(schema.LABELS[name]) for name in ("strain_component", "fibre_component")}
    times = ("frame", frame_times(heart.config.loop), {"units": "s"})
    return xr.Dataset(variables, {**labels, "frame": np.arange(len(heart.displacement)), "time": times})
