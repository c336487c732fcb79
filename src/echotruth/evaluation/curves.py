"""Curves of strain and rotation of one clip, tracked beside true, as they are read from a repository."""

import numpy as np
import xarray as xr

from echotruth.aha import SEGMENT_NAMES
from echotruth.config import Config
from echotruth.evaluation.agreement import REFERENCES
from echotruth.evaluation.courses import peak, rate, systolic_rate
from echotruth.loop.cycle import frame_times
from echotruth.repository import estimates, schema
from echotruth.repository.choice import image_size, require_known
from echotruth.repository.reader import Repository

NAMES = ("region_strain", "segment_strain", "line_strain", "rotation")
"""What is tracked over the cycle; the arrays are `tracked_NAME` and `true_NAME`."""

REFERENCE = "plane"
"""Reference of true strain unless another is asked for: that of the motion in the plane, so that a tracker is not
blamed for the thickening of a wall that is oblique to the plane, which no image of it shows."""


def strain_curves(
    repository: Repository,
    case: str,
    view: str,
    tracker: str,
    size: int | None = None,
    reference: str = REFERENCE,
) -> xr.Dataset:
    """Read the strain and the rotation of one clip over the cycle, tracked and true.

    The parameters, the result and the errors are those of :meth:`.Repository.curves`.
    """
    config, size = repository.case(case).config, image_size(repository.config, size)
    require_known("reference", reference, REFERENCES)
    values = estimates.tracked(repository, case, view, tracker, size, *(f"tracked_{name}" for name in NAMES))
    values |= estimates.true(repository, case, view, *(f"true_{name}" for name in NAMES))
    for name in ("true_region_strain", "true_segment_strain"):
        values[name] = values[name][REFERENCES.index(reference)]
    es, time = int(repository.read("mechanics/es_frame", case)), frame_times(config.loop)
    return _dataset(values, time, config).assign_attrs(
        case=case,
        view=view,
        plane=config.views[view].plane,
        tracker=tracker,
        size_px=size,
        reference=reference,
        es_frame=es,
        end_systole=float(time[es]),
        beat_frames=config.loop.beat_starts[1],
    )


def strain_peaks(strain: xr.Dataset) -> xr.Dataset:
    """Read end-systolic strain, peak strain, time to peak and the largest rate of systole off curves.

    Parameters
    ----------
    strain : Dataset
        As :meth:`.Repository.curves` or :meth:`.Repository.twist` returns it.

    Returns
    -------
    Dataset
        For every curve NAME, without the dimension frame: `NAME_es`, its value at end-systole; `NAME_peak`, its value
        of largest magnitude over the first beat; `NAME_time_to_peak`, s since end-diastole; and `NAME_systolic_rate`,
        the largest rate from end-diastole to end-systole in the direction of the end-systolic value (of shortening the
        most negative one).

    Raises
    ------
    ValueError
        If the data set has lost its attributes.

    Examples
    --------
    >>> import echotruth as et
    >>> peaks = et.strain_peaks(et.Repository("out/demo").curves(view="mid"))
    >>> peaks["tracked_segment_strain_es"].sel(measure="engineering", wall_component="TT").dims
    ('aha',)
    """
    if "es_frame" not in strain.attrs:
        raise ValueError("The data set has lost its attribute es_frame: keep those that echotruth gave it.")
    es, time = strain.attrs["es_frame"], strain["time"].values
    found = {}
    for name, curve in strain.data_vars.items():
        dims, units = [dim for dim in curve.dims if dim != "frame"], {"units": curve.attrs["units"]}
        values = curve.transpose("frame", ...).values
        if str(name).endswith("_rate"):
            of = str(name).removesuffix("_rate")
            at_es = strain[of].isel(frame=es).transpose(*dims).values
            found[f"{of}_systolic_rate"] = (dims, systolic_rate(values[: es + 1], at_es), units)
            continue
        value, when = peak(values[: strain.attrs.get("beat_frames")], time)
        found |= {
            f"{name}_es": (dims, values[es], units),
            f"{name}_peak": (dims, value, units),
            f"{name}_time_to_peak": (dims, when, {"units": "s"}),
        }
    coordinates = {name: array for name, array in strain.coords.items() if "frame" not in array.dims}
    return xr.Dataset(found, coordinates, strain.attrs)


def twist_views(config: Config) -> tuple[str, str] | None:
    """Names of the most basal and the most apical short-axis view; None if there are not two."""
    position = {name: view.position for name, view in config.views.items() if view.plane == "short_axis"}
    views = sorted(position, key=lambda name: position[name])
    return (views[0], views[-1]) if views and position[views[0]] < position[views[-1]] else None


def twist_curves(repository: Repository, case: str, tracker: str, size: int | None = None) -> xr.Dataset:
    """Read the twist over the cycle; parameters, result and errors are those of :meth:`.Repository.twist`."""
    views = twist_views(repository.config)
    if views is None:
        raise ValueError("Twist needs two short-axis views at different positions, and the repository has not.")
    base, apex = (strain_curves(repository, case, view, tracker, size) for view in views)
    return twist_of(base, apex, repository.read("physiology/twist", case))


def twist_of(base: xr.Dataset, apex: xr.Dataset, heart_twist: np.ndarray | None = None) -> xr.Dataset:
    """Twist from the curves of two short-axis views.

    Parameters
    ----------
    base, apex : Dataset
        As :func:`strain_curves` returns them.
    heart_twist : ndarray of shape (frame,), rad, optional
        That of the group physiology.
    """
    time = base["time"].values
    about = "rotation of the apical less that of the basal view, counter-clockwise seen from the apex"
    found = {}
    for what in ("tracked", "true"):
        name, curve = f"{what}_twist", apex[f"{what}_rotation"].values - base[f"{what}_rotation"].values
        found[name] = ("frame", curve, {"units": "rad", "long_name": f"{what} {about}"})
        found[f"{name}_rate"] = ("frame", rate(curve, time), {"units": "rad s-1", "long_name": f"rate of {name}"})
    if heart_twist is not None:
        found["heart_twist"] = ("frame", heart_twist, {"units": "rad", "long_name": "twist of the group physiology"})
    attributes = {key: value for key, value in base.attrs.items() if key not in ("view", "reference", "plane")}
    attributes |= {"basal_view": base.attrs["view"], "apical_view": apex.attrs["view"]}
    return xr.Dataset(found, base[["frame", "time"]].coords, attributes)


def _dataset(values: dict[str, np.ndarray], time: np.ndarray, config: Config) -> xr.Dataset:
    """Arrays of one clip and their rates, with dimensions, coordinates and units."""
    arrays = schema.arrays_of("points") | schema.arrays_of("tracking/TRACKER")
    found: dict[str, tuple[list[str], np.ndarray, dict[str, str]]] = {}
    for name, value in values.items():
        array = arrays[name]
        dims = [dim for dim in array.dims if dim not in ("size", "reference")]
        order = ["frame", *(dim for dim in dims if dim != "frame")]
        curve = np.asarray(value, float).transpose([dims.index(dim) for dim in order])
        found[name] = (order, curve, {"units": array.units, "long_name": array.long_name})
        rates = {"units": "s-1" if array.units == "1" else f"{array.units} s-1", "long_name": f"rate of {name}"}
        found[f"{name}_rate"] = (order, rate(curve, time), rates)
    data = xr.Dataset(found).transpose("measure", "frame", ...)
    labels = {
        "measure": list(schema.LABELS["measure"]),
        "wall_component": list(schema.LABELS["wall_component"]),
        "contour": list(schema.LABELS["contour"]),
        "region": np.arange(1 + config.fibres.layers),
        "aha": np.arange(1, 18),
        "frame": np.arange(len(time)),
    }
    names = {"aha_name": ("aha", list(SEGMENT_NAMES)), "time": ("frame", time, {"units": "s"})}
    return data.assign_coords(labels | names)
