"""What a clip holds beside the stored truth, computed when it is read: labels by name, and the slice of tissue."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from echotruth.config import Config
from echotruth.imaging.beamforming.scan import scan_lines
from echotruth.imaging.flow import out_of_slice, slice_thickness
from echotruth.imaging.labels import unpack

if TYPE_CHECKING:
    import xarray as xr

MEANING = {
    "mask": ("labels", "whether the pixel centre is in the wall"),
    "layer": ("labels", "transmural layer, 1 at the endocardium, 0 outside"),
    "segment": ("labels", "AHA segment, 0 outside"),
    "region": ("labels", "region of disease: 0 healthy (or none), 1 infarct, 2 border zone, 3 late activation"),
    "thickness": ("flow", "thickness of the slice of tissue that the image shows"),
    "leaves": ("flow", "whether the tissue at the pixel is beside the slice in the next frame"),
    "enters": ("flow", "whether the tissue at the pixel was beside the slice in the previous frame"),
}
"""Variable to the stored array that it is computed from, and its meaning."""


def stored_names(variables: Iterable[str] | None, known: set[str]) -> set[str]:
    """Names of the stored arrays that variables of a clip are made from; ValueError if there is no such variable.

    Parameters
    ----------
    variables : iterable of str, optional
        Stored or computed. Default: all.
    known : set of str
        Stored arrays.
    """
    if variables is None:
        return known
    given = [variables] if isinstance(variables, str) else variables
    asked = {MEANING[name][0] if name in MEANING else name for name in given}
    if not asked or not asked <= known:
        unknown = ", ".join(map(repr, sorted(asked - known))) or "none"
        raise ValueError(f"variables: {unknown}: use any of {', '.join(sorted({*known, *MEANING} - {'label'}))}.")
    return asked


def derived(clip: xr.Dataset, config: Config) -> xr.Dataset:
    """The clip with all that can be computed from its arrays, in place of the packed labels.

    Parameters
    ----------
    clip : Dataset
        With the coordinates axial and lateral, m, and, where these were read, labels (frame, label, axial, lateral) and
        flow (frame, to, axial, lateral, vector), m.
    config : Config
    """
    image: tuple[str, ...] = ("axial", "lateral")
    found: dict[str, tuple[tuple[str, ...], NDArray[Any]]] = {}
    if "labels" in clip:
        found |= {name: (("frame", *image), values) for name, values in unpack(clip["labels"].values).items()}
    if "flow" in clip:
        scan = scan_lines(config.probe, config.rf)
        _, range_ = scan.to_scan_coordinates(clip["lateral"].values, clip["axial"].values[:, None])
        thickness = slice_thickness(config, range_)
        elevation = clip["flow"].sel(vector="elevation")
        for name, to in (("leaves", "next"), ("enters", "previous")):
            found[name] = (("frame", *image), out_of_slice(elevation.sel(to=to).values, thickness))
        found["thickness"] = (image, thickness)
    units = {"thickness": "m"}
    about = {name: {"units": units.get(name, "1"), "long_name": MEANING[name][1]} for name in found}
    clip = clip.drop_dims("label") if "label" in clip.dims else clip
    return clip.assign({name: (*values, about[name]) for name, values in found.items()})
