"""All arrays of a repository, from which `docs/schema.md` is generated."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from echotruth.config import Config
from echotruth.repository import rounding
from echotruth.repository.array import Array
from echotruth.repository.array import array as _array
from echotruth.repository.measured import PHYSIOLOGY, PHYSIOLOGY_PACKS
from echotruth.repository.packing import Pack
from echotruth.repository.rounding import STRAIN
from echotruth.repository.tracked import EVALUATION, EVALUATION_PACKS, REFERENCE, REFERENCE_PACKS, TRACKING
from echotruth.section import unit_of

GEOMETRY = (
    _array("node_position", "case node xyz", "float64", "m", "position of the nodes, unloaded"),
    _array("cell_node", "case cell local_node", "int32", "1", "nodes of the quadratic tetrahedra, in VTK's order"),
    _array("endo", "case endo_facet facet_node", "int32", "1", "nodes of the endocardial triangles"),
    _array("epi", "case epi_facet facet_node", "int32", "1", "nodes of the epicardial triangles"),
    _array("base", "case base_facet facet_node", "int32", "1", "nodes of the basal triangles"),
)

FIBRES = (
    _array("wall_depth", "case node", "float64", "1", "wall depth, 0 at the endocardium and 1 at the epicardium"),
    _array("fibre", "case cell xyz", "float64", "1", "unit vector along the fibres at cell centroids, unloaded"),
    _array("sheet", "case cell xyz", "float64", "1", "unit vector along the sheets at cell centroids, unloaded"),
    _array("layer", "case cell", "uint8", "1", "transmural layer of the cell centroid, 1 at the endocardium"),
    _array("segment", "case cell", "uint8", "1", "AHA segment of the cell centroid"),
)

_REGION = "0 healthy (or none), 1 infarct, 2 border zone, 3 late activation"
PATHOLOGY = (
    _array("region", "case cell", "uint8", "1", f"region of disease: {_REGION}"),
    _array("stiffness_scale", "case cell", "float64", "1", "passive stiffness over that of healthy tissue"),
    _array("tension_scale", "case cell", "float64", "1", "active tension over that of healthy tissue"),
    _array("activation_delay", "case cell", "float64", "s", "delay of the active tension"),
)

MECHANICS = (
    _array("pressure", "case frame", "float64", "Pa", "cavity pressure, solved"),
    _array("volume", "case frame", "float64", "m3", "cavity volume, solved"),
    _array("pressure_target", "case frame", "float64", "Pa", "cavity pressure prescribed by the loop"),
    _array("volume_target", "case frame", "float64", "m3", "cavity volume prescribed by the loop"),
    _array("active_tension", "case frame", "float64", "Pa", "active tension T_Ca, solved"),
    _array("displacement", "case frame node xyz", "float64", "m", "displacement of the nodes from unloaded"),
    _array("stiffness", "case", "float64", "Pa", "stiffness C of the healthy wall"),
    _array("es_frame", "case", "int32", "1", "frame of end-systole"),
    _array(
        "phase", "case frame", "uint8", "1", "0 filling, 1 isovolumic contraction, 2 ejection, 3 isovolumic relaxation"
    ),
    _array("newton_steps", "case frame", "int32", "1", "tangents factored to reach the frame"),
    _array("residual", "case frame", "float64", "1", "relative residual of force, cavity volume and cell volume"),
)

KINEMATICS = (
    _array(
        *("strain", "case frame cell strain_component", "float32", "1"),
        "strain from ED along wall axes at cell centroids",
        STRAIN,
    ),
    _array("strain_mean", "case frame strain_component", "float64", "1", "wall mean of the strain from ED"),
    _array("strain_sd", "case frame strain_component", "float64", "1", "standard deviation of the strain from ED"),
    _array("layer_strain", "case frame layer strain_component", "float64", "1", "mean strain from ED of each layer"),
    _array("volume_ratio_min", "case frame", "float64", "1", "smallest det F of all quadrature points"),
    _array("volume_ratio_mean", "case frame", "float64", "1", "wall mean of det F"),
)

PHANTOM = (
    _array("scatterer_count", "case view", "int32", "1", "number of scatterers in the wall that enter the beam"),
    _array("origin", "case view xyz", "float64", "m", "centre of the array in the heart frame"),
    _array("axes", "case view vector xyz", "float64", "1", "lateral, axial and elevation axes in the heart frame"),
    _array("centre", "case view plane", "float64", "m", "origin of polar components in the image"),
)

_PIXEL = "case view frame axial lateral"
TRUTH = (
    _array(
        *("displacement", f"{_PIXEL} vector", "float32", "m"),
        "displacement from ED of the tissue at the pixel",
        rounding.LENGTH,
    ),
    _array(
        *("strain", f"{_PIXEL} strain_component", "float32", "1"),
        "strain from ED of the tissue at the pixel",
        rounding.STRAIN,
    ),
    _array(
        *("wall_depth", _PIXEL, "float32", "1"),
        "wall depth, 0 at the endocardium and 1 at the epicardium",
        rounding.WALL_DEPTH,
    ),
    _array(
        *("labels", "case view frame label axial lateral", "uint8", "1"),
        f"transmural layer, 1 at the endocardium; AHA segment; region of disease: {_REGION}; all 0 outside the wall",
    ),
    _array(
        *("flow", "case view frame to axial lateral vector", "float32", "m"),
        "displacement of the tissue at the pixel to where it is in the previous and in the next frame",
        rounding.LENGTH,
    ),
)

BMODE = (_array("image", _PIXEL, "uint8", "1", "B-mode grey level"),)

_FRAME = "case view frame"
LINES = (_array("lines", f"{_FRAME} line range", "complex64", "1", "lines, demodulated by exp(-4 pi i f range / c)"),)
CHANNELS = (
    _array(
        *("channels", f"{_FRAME} transmitter receiver sample", "int16", "1"),
        "RF of every receiver for every transmitter alone, in steps of channels_step",
    ),
    _array("channels_step", _FRAME, "float64", "1", "value of one step of channels"),
)
TRANSMITS = (
    _array("transmit_delay", "transmit element", "float64", "s", "delay of an element"),
    _array("transmit_weight", "transmit element", "float64", "1", "weight of an element"),
    _array("transmit_origin", "transmit plane", "float64", "m", "source of a wave; of a plane wave the direction"),
    _array("transmit_t0_distance", "transmit", "float64", "m", "distance of a wave from its origin at time 0"),
)
"""Transmitted waves from which the lines are made; stored wherever RF is kept."""
RF = (*LINES, *CHANNELS, *TRANSMITS)

COORDINATES = (
    _array("case", "case", "string", "1", "case id"),
    _array("view", "view", "string", "1", "imaging plane"),
    _array("frame", "frame", "int32", "1", "frame of the cycle, 0 at end-diastole"),
    _array("time", "case frame", "float64", "s", "time since end-diastole"),
    _array("axial", "axial", "float64", "m", "depth below the array"),
    _array("lateral", "lateral", "float64", "m", "lateral position"),
    _array("xyz", "xyz", "string", "1", "axis of the heart frame"),
    _array("vector", "vector", "string", "1", "axis of the image"),
    _array("label", "label", "string", "1", "what a label says of the tissue"),
    _array("to", "to", "string", "1", "frame that flow leads to"),
    _array("plane", "plane", "string", "1", "axis in the image plane"),
    _array("strain_component", "strain_component", "string", "1", "radial, circumferential, longitudinal"),
    _array("fibre_component", "fibre_component", "string", "1", "fibre, sheet, normal"),
    _array("wall_component", "wall_component", "string", "1", "radial, tangential (CC or LL), shear along the wall"),
    _array("reference", "reference", "string", "1", "reference strain"),
    _array("measure", "measure", "string", "1", "measure of strain"),
    _array("contour", "contour", "string", "1", "contour of the wall"),
    _array("statistic", "statistic", "string", "1", "mean, median, 95th percentile"),
    _array("agreement", "agreement", "string", "1", "mean difference, limits of agreement, correlation"),
    _array("layer", "layer", "int32", "1", "transmural layer, 1 at the endocardium"),
    _array("region", "region", "int32", "1", "transmural layer, 0 for the whole wall"),
    _array("aha", "aha", "int32", "1", "AHA segment"),
    _array("line_angle", "line", "float64", "rad", "angle of a line from the axial axis"),
    _array("line_origin", "line", "float64", "m", "lateral position of the origin of a line on the array"),
    _array("range", "range", "float64", "m", "distance along a line from its origin"),
    _array("sample", "sample", "float64", "s", "time since the element transmitted"),
    _array("element", "element", "float64", "m", "lateral position of the element"),
    _array("transmitter", "transmitter", "float64", "m", "lateral position of the transmitting element"),
    _array("receiver", "receiver", "float64", "m", "lateral position of the receiving element"),
    _array("polar", "polar", "string", "1", "radial, tangential (long axis: transverse, longitudinal)"),
    _array("component", "component", "string", "1", "polar component, or the whole vector"),
    *(
        coordinate
        for dim in ("scalar", "course", "true_course", "limit", "score")
        for coordinate in (
            _array(dim, dim, "string", "1", "name of the array that the number belongs to, and its place there"),
            _array(f"{dim}_units", dim, "string", "1", "unit of the number"),
        )
    ),
)

LABELS: dict[str, tuple[str, ...]] = {
    "xyz": ("x", "y", "z"),
    "vector": ("lateral", "axial", "elevation"),
    "label": ("layer", "segment", "region"),
    "to": ("previous", "next"),
    "plane": ("lateral", "axial"),
    "strain_component": ("RR", "CC", "LL", "RC", "RL", "CL"),
    "fibre_component": ("ff", "ss", "nn", "fs", "fn", "sn"),
    "wall_component": ("RR", "TT", "RT"),
    "reference": ("heart", "plane", "operator"),
    "measure": ("engineering", "green_lagrange"),
    "contour": ("endocardial", "middle", "epicardial"),
    "statistic": ("mean", "median", "p95"),
    "agreement": ("bias", "lower", "upper", "correlation"),
    "polar": ("radial", "tangential"),
    "component": ("radial", "tangential", "total"),
}
"""Labels of the dimensions that are the same in every repository."""

STAGES = {
    "geometry": GEOMETRY,
    "fibres": FIBRES,
    "pathology": PATHOLOGY,
    "mechanics": MECHANICS,
    "kinematics": KINEMATICS,
    "physiology": PHYSIOLOGY,
    "phantom": PHANTOM,
}
"""Groups that exist once."""

SIZED = {"truth": TRUTH, "bmode": BMODE, "evaluation": REFERENCE}
"""Groups that exist once per image size, and are named after it: `truth/512`."""

TRACKED = {"tracking": TRACKING, "evaluation": EVALUATION}
"""Groups that exist once per image size and tracker: `tracking/512/dis`."""

OPTIONAL = {"rf": RF}
"""Groups whose arrays exist only as `rf.keep` requests."""

DERIVED = (
    _array("deformation_gradient", "case frame cell row column", "float64", "1", "F at cell centroids, from unloaded"),
    _array("strain", "case frame cell strain_component", "float64", "1", "strain from ED along wall axes"),
    _array("strain_unloaded", "case frame cell strain_component", "float64", "1", "strain from unloaded, wall axes"),
    _array("fibre_strain", "case frame cell fibre_component", "float64", "1", "strain from ED along fibre axes"),
    _array("fibre_strain_unloaded", "case frame cell fibre_component", "float64", "1", "the same from unloaded"),
    _array("helix_angle", "case cell", "float64", "rad", "helix angle at cell centroids"),
    _array("transverse_angle", "case cell", "float64", "rad", "transverse angle at cell centroids"),
    _array("sheet_angle", "case cell", "float64", "rad", "sheet angle at cell centroids"),
)
"""Arrays that follow from those of a heart; :func:`echotruth.kinematics` computes them."""

KINDS = STAGES | OPTIONAL | {f"{name}/SIZE": arrays for name, arrays in SIZED.items()}
KINDS |= {f"{name}/SIZE/TRACKER": arrays for name, arrays in TRACKED.items()}
"""Arrays by the kind of their group, such as `truth/SIZE`."""

PACKS: dict[str, tuple[Pack, ...]] = {
    "physiology": PHYSIOLOGY_PACKS,
    "evaluation/SIZE": REFERENCE_PACKS,
    "evaluation/SIZE/TRACKER": EVALUATION_PACKS,
}
"""Arrays that hold several others, by the kind of their group."""


def kind(group: str) -> str:
    """Kind of a group: of `tracking/512/dis`, `tracking/SIZE/TRACKER`."""
    stage, *rest = group.split("/")
    return "/".join([stage, *("SIZE", "TRACKER")[: len(rest)]])


def arrays_of(group: str) -> tuple[Array, ...]:
    """Arrays of a group, as "bmode/512"."""
    return KINDS[kind(group)]


def packs_of(group: str) -> tuple[Pack, ...]:
    """Packs of a group, as "evaluation/512/dis"."""
    return PACKS.get(kind(group), ())


CASES = (
    _array(
        *("status", "case", "string", "1"),
        "complete, implausible (out of the bounds of physiology), failed (no solution), or retired (not of the config)",
    ),
    _array("reason", "case", "string", "1", "why a case is not complete"),
)
"""Verdicts on the cases. The group `cases` also holds `seed` and one array for every key that differs among the cases,
in the unit of the key; its attribute `constants` holds the keys that do not."""


def parameters(columns: dict[str, NDArray[Any]]) -> tuple[Array, ...]:
    """Arrays of the group `cases` for the columns of the table of cases."""
    types = {"f": "float64", "i": "int64", "b": "bool"}
    arrays = [
        Array(key, ("case",), types.get(values.dtype.kind, "string"), _UNITS.get(unit_of(key), "1"), key)
        for key, values in ((name.removeprefix("cases:"), values) for name, values in columns.items())
    ]
    return (*CASES, *arrays)


_UNITS = {
    "um": "um",
    "mm": "mm",
    "per_mm3": "mm-3",
    "uL": "uL",
    "ms": "ms",
    "per_min": "min-1",
    "mmHg": "mmHg",
    "kPa": "kPa",
    "MHz": "MHz",
    "m_per_s": "m s-1",
    "deg": "degree",
    "dB": "dB",
}


def groups(config: Config) -> dict[str, tuple[Array, ...]]:
    """Arrays of every group, without coordinates, by the path of the group; each quantum is a number."""
    sizes, trackers = config.bmode.sizes, config.tracking.trackers
    every = {"cases": CASES} | STAGES
    every |= {f"{name}/{size}": arrays for name, arrays in SIZED.items() for size in sizes}
    every |= {f"{name}/{size}/{one}": arrays for name, arrays in TRACKED.items() for size in sizes for one in trackers}
    every |= {"rf": rf_arrays(config)} if config.rf.keep else {}
    return {path: rounding.of(arrays, config) for path, arrays in every.items()}


def rf_arrays(config: Config) -> tuple[Array, ...]:
    """Arrays of the group `rf`: the RF that is kept, and its transmits."""
    lines, channels = (name in config.rf.keep for name in ("lines", "channels"))
    return (LINES if lines else ()) + (CHANNELS if channels else ()) + TRANSMITS


def written_by(stage: str, config: Config, size: int | None = None) -> list[str]:
    """Groups that a job of a stage writes.

    Parameters
    ----------
    stage : str
    config : Config
    size : int, optional
        Image size of the job, px; without it, the groups of all sizes.
    """
    sizes = config.bmode.sizes if size is None else [size]
    if stage == "mechanics":
        return [group for group, arrays in STAGES.items() if arrays[0].leading == 1]
    if stage == "tracking":
        of_trackers = [f"{name}/{px}/{one}" for name in TRACKED for px in sizes for one in config.tracking.trackers]
        return [f"evaluation/{px}" for px in sizes] + of_trackers
    if stage in SIZED:
        return [f"{stage}/{px}" for px in sizes]
    return [stage] if stage in STAGES or (stage == "rf" and config.rf.keep) else []


def named(group: str) -> tuple[Array, ...]:
    """Arrays of a group by the names that jobs and readers use: the members of a pack in place of the pack."""
    members = {pack.array.name: pack.members for pack in packs_of(group)}
    return tuple(one for array in arrays_of(group) for one in members.get(array.name, (array,)))


def coordinates(arrays: tuple[Array, ...]) -> tuple[Array, ...]:
    """Coordinates of a group: those along the dimensions of its arrays."""
    dims = {dim for array in arrays for dim in array.dims}
    names = {array.name for array in arrays}
    return tuple(array for array in COORDINATES if dims >= set(array.dims) and array.name not in names)
