"""Arrays of a store with their units, as its metadata give them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from echotruth.repository import schema

Metadata = dict[str, dict[str, Any]]
"""Path of every group and array -> its metadata."""


@dataclass(frozen=True)
class Quantity:
    """An array, or arrays that differ in the size of the image only."""

    group: str
    """Path of its group; of sized groups with SIZE in place of the size."""
    name: str
    dims: tuple[str, ...]
    dtype: str
    units: str
    """SI, as UDUNITS writes them."""
    long_name: str
    is_coordinate: bool
    """Whether it belongs to the dimensions of others."""


def read_quantities(nodes: Metadata) -> tuple[Quantity, ...]:
    """All arrays of a store; those of all sizes of the images are one.

    Parameters
    ----------
    nodes : dict
        Consolidated metadata of the root.
    """
    auxiliary = _auxiliary(nodes)
    found: dict[tuple[str, str], Quantity] = {}
    for path, array in sorted(nodes.items()):
        if array["node_type"] != "array":
            continue
        parent, _, name = path.rpartition("/")
        group = "/".join("SIZE" if part.isdigit() else part for part in parent.split("/"))
        dims, attributes = tuple(array.get("dimension_names") or ()), array.get("attributes", {})
        about = attributes.get("units", "1"), attributes.get("long_name", "")
        quantity = Quantity(group, name, dims, _type(array["data_type"]), *about, dims == (name,) or name in auxiliary)
        for each in (quantity, *_members(quantity, nodes[parent].get("attributes", {}).get("labels", {}))):
            found.setdefault((each.group, each.name), each)
    return tuple(found.values())


def _members(pack: Quantity, labels: dict[str, list[str]]) -> Iterator[Quantity]:
    """Arrays of which an array holds the numbers along its last dimension, with labels as `nrmse[0,total]`."""
    dimension = pack.dims[-1] if pack.dims else ""
    named, units = labels.get(dimension, []), labels.get(f"{dimension}_units", [])
    if pack.is_coordinate or not named or len(named) != len(units):
        return
    packs = schema.PACKS.get(pack.group, ())
    meaning = {array.name: f"{array.long_name} (in {pack.name})" for each in packs for array in each.members}
    for name, unit in {label.partition("[")[0]: unit for label, unit in zip(named, units, strict=True)}.items():
        yield Quantity(pack.group, name, pack.dims, pack.dtype, unit, meaning.get(name, ""), False)


def _auxiliary(nodes: Metadata) -> set[str]:
    """Names of the coordinates along the dimensions of others, which arrays list in the attribute `coordinates`."""
    return {name for node in nodes.values() for name in node.get("attributes", {}).get("coordinates", "").split()}


def _type(data_type: object) -> str:
    return str(data_type.get("name", "")) if isinstance(data_type, dict) else str(data_type)
