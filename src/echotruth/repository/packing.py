"""Packing: the small numbers of one job are one array, and so one file.

Along its last dimension, a pack has a label for every number, the name of the array it belongs to and its place there,
as `nrmse[0,total]`; a coordinate gives the unit of each. Jobs and readers deal with the arrays by their names.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from echotruth.repository.array import Array

Values = Mapping[str, ArrayLike]
"""Arrays of one job by name."""


@dataclass(frozen=True)
class Pack:
    """Small arrays that are stored as one."""

    array: Array
    """As it is stored; its last dimension is that of the labels."""
    members: tuple[Array, ...]
    """Each has the other dimensions of the pack and any of its own."""

    @property
    def dimension(self) -> str:
        """Dimension of the labels."""
        return self.array.dims[-1]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the members."""
        return tuple(member.name for member in self.members)

    @property
    def shared(self) -> tuple[str, ...]:
        """Dimensions within one job that all members have."""
        return self.array.dims[self.array.leading : -1]

    def own(self, member: Array) -> tuple[str, ...]:
        """Dimensions that only this member has."""
        return tuple(dim for dim in member.dims if dim not in self.array.dims)

    def labels(self, coordinates: Mapping[str, ArrayLike]) -> dict[str, list[str]]:
        """Coordinates of the pack: its labels and the unit of each.

        Parameters
        ----------
        coordinates : dict
            Values of the coordinates of the members.
        """
        places = {
            member: [
                ",".join(map(str, place))
                for place in product(*(np.asarray(coordinates[dim]).tolist() for dim in self.own(member)))
            ]
            for member in self.members
        }
        labels = [f"{one.name}[{place}]" if place else one.name for one in self.members for place in places[one]]
        units = [one.units for one in self.members for _ in places[one]]
        return {self.dimension: labels, f"{self.dimension}_units": units}


def pack(packs: Iterable[Pack], values: Values) -> dict[str, ArrayLike]:
    """Values as they are stored.

    Parameters
    ----------
    packs : iterable of Pack
        Those of the group.
    values : dict
        Arrays of one case (and view) by name.

    Returns
    -------
    dict
        The packs whose members are among the values, and all other values.

    Raises
    ------
    ValueError
        If only a part of the members of a pack is given.
    """
    stored = dict(values)
    for one in packs:
        missing = [name for name in one.names if name not in stored]
        if len(missing) == len(one.members):
            continue
        if missing:
            raise ValueError(f"{one.array.name} needs all its members at once: {missing[0]} is missing")
        parts = [_flat(one, member, np.asarray(stored.pop(member.name))) for member in one.members]
        stored[one.array.name] = np.concatenate(parts, axis=-1)
    return stored


def unpack(packs: Iterable[Pack], stored: Values, labels: Mapping[str, Sequence[str]]) -> dict[str, NDArray[Any]]:
    """Values by their names.

    Parameters
    ----------
    packs : iterable of Pack
        Those of the group.
    stored : dict
        Arrays of one case (and view) as they are stored.
    labels : dict
        Labels along the dimension of each pack.

    Returns
    -------
    dict of ndarray
        The members of the packs that are among the stored arrays, and all other arrays.
    """
    values = {name: np.asarray(value) for name, value in stored.items()}
    for one in packs:
        if one.array.name not in values:
            continue
        packed = values.pop(one.array.name)
        members = {member.name: member for member in one.members}
        for name, places, coordinates in sections(labels[one.dimension]):
            shape = (*packed.shape[:-1], *map(len, coordinates))
            values[name] = _in_order(one, members[name], packed[..., places].reshape(shape))
    return values


def sections(labels: Sequence[str]) -> Iterator[tuple[str, list[int], list[list[str]]]]:
    """Arrays of which a pack, or a selection of it, holds all numbers or some.

    Parameters
    ----------
    labels : sequence of str

    Yields
    ------
    name : str
    places : list of int
        Where its numbers are, in the order of the coordinates, the last one fastest.
    coordinates : list of list of str
        Values of the coordinates along its own dimensions.
    """
    found: dict[str, list[int]] = {}
    for number, label in enumerate(labels):
        found.setdefault(label.partition("[")[0], []).append(number)
    for name, places in found.items():
        indices = [labels[place].partition("[")[2].removesuffix("]") for place in places]
        keys = [tuple(index.split(",")) if index else () for index in indices]
        coordinates = [list(dict.fromkeys(column)) for column in zip(*keys, strict=True)]
        place_of = dict(zip(keys, places, strict=True))
        yield name, [place_of[key] for key in product(*coordinates) if key in place_of], coordinates


def _flat(one: Pack, member: Array, value: NDArray[Any]) -> NDArray[Any]:
    """Numbers of a member, those of its own dimensions along the last one."""
    dims = member.dims[member.leading :]
    ordered = value.transpose([dims.index(dim) for dim in (*one.shared, *one.own(member))])
    return ordered.reshape((*ordered.shape[: len(one.shared)], -1))


def _in_order(one: Pack, member: Array, value: NDArray[Any]) -> NDArray[Any]:
    """A member with its dimensions in their order."""
    dims = (*one.shared, *one.own(member))
    return value.transpose([dims.index(dim) for dim in member.dims[member.leading :]])
