"""What all sequences of items have in common: which clips they are made from, and how these are chosen."""

from abc import abstractmethod
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from echotruth.heart import Heart
from echotruth.imaging.view import Plane, before_probe
from echotruth.repository.choice import Names, image_size, require_known
from echotruth.repository.reader import Repository
from echotruth.units import mm

Item = dict[str, Any]
"""Name -> array, number or text."""

Place = tuple[str, str]
"""Case and view of a clip."""


class Items(Sequence[Item]):
    """A sequence of items, each read when it is asked for: a dict of NumPy arrays, numbers and texts.

    Items depend on nothing but their index: they are the same in every order and in any number of processes. Images are
    channels first, and vectors in the order lateral, axial, elevation. Every item has `case` and `view`.

    Parameters
    ----------
    repository : str or Path
        `out/NAME`, `out/NAME/NAME.zarr`, or the address `s3://BUCKET/FOLDER`.
    cases : DataFrame or iterable of str, optional
        A table as :func:`echotruth.learning.cases` or :func:`echotruth.learning.split` returns it, or case ids.
        Default: all that are complete.
    views : iterable of str, optional
        Default: all of the configuration.
    size : int, optional
        Pixels along a side. Default: the largest.

    Raises
    ------
    FileNotFoundError
        If the folder holds no repository.
    ValueError
        If there is no such case, view or size, or one of the clips was not made.

    Examples
    --------
    >>> from echotruth.learning import Clips
    >>> clips = Clips("out/demo", size=128)
    >>> [item["view"] for item in clips]
    ['base', 'mid', 'apex', 'long_axis']
    """

    stages: tuple[str, ...] = ("bmode", "truth")
    """Stages of which the groups of a clip are read."""
    has_volumes = False
    """Whether items are of volumes, and not of slices."""
    _kept: tuple[str, Heart] | None = None

    def __init__(self, repository: str | Path, cases: Any = None, views: Names = None, size: int | None = None) -> None:
        self.repository = Repository(repository)
        config = self.repository.config
        if config.has_volumes != self.has_volumes:
            needs, has = ("volumes", "slices") if self.has_volumes else ("slices", "volumes: take VolumePairs")
            raise ValueError(f"{type(self).__name__}: needs {needs}, and {config.name} has {has}.")
        self.size = image_size(config, size)
        self.group = config.image_names[config.image_sizes.index(self.size)]
        """Last part of the names of groups of that size."""
        self.frames = config.loop.frames
        voxel, pixel = np.array(config.volume.voxel_mm)[[2, 0, 1]], config.bmode.field_of_view_mm / self.size
        self.spacing: Any = (voxel if self.has_volumes else pixel) * mm
        """Distance of pixel centres, m; of volumes (3,): lateral, axial and elevation side of a voxel."""
        given = cases.index if hasattr(cases, "columns") else cases
        ids = _complete(self.repository) if given is None else _listed(given)
        names = list(config.views) if views is None else _listed(views)
        self.places = self._places(ids, [require_known("view", name, list(config.views)) for name in names])

    def _places(self, cases: list[str], views: list[str]) -> list[Place]:
        places = [(case, view) for case in cases for view in views]
        for case, view in places:
            for stage in self.stages:
                if self.repository.attributes(f"{stage}/{self.group}", case, view).get("status") != "complete":
                    raise ValueError(
                        f"{self.repository.location}: {case} has no {stage}/{self.group} in the view {view}: "
                        "finish the run, or choose cases of status complete."
                    )
        return places

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_kept": None}

    @property
    def per_clip(self) -> int:
        """Number of items from each clip."""
        return 1

    def __len__(self) -> int:
        return len(self.places) * self.per_clip

    @overload
    def __getitem__(self, index: int) -> Item: ...
    @overload
    def __getitem__(self, index: slice) -> list[Item]: ...
    def __getitem__(self, index: int | slice) -> Item | list[Item]:
        """One item, read from the store."""
        if isinstance(index, slice):
            return [self[number] for number in range(*index.indices(len(self)))]
        number = int(index) + (len(self) if index < 0 else 0)
        if not 0 <= number < len(self):
            raise IndexError(f"item {index} of {len(self)}")
        clip, within = divmod(number, self.per_clip)
        case, view = place = self.places[clip]
        return {"case": case, "view": view} | self.item(place, within)

    def __iter__(self) -> Iterator[Item]:
        return (self[number] for number in range(len(self)))

    @abstractmethod
    def item(self, place: Place, within: int) -> Item:
        """Item number `within` of a clip."""

    def image(self, place: Place, frames: int | slice = slice(None)) -> NDArray[np.float32]:
        """Grey levels of one frame (axial, lateral) or several (frame, axial, lateral), from 0 to 1."""
        grey = self.repository.read(f"bmode/{self.group}/image", *place, frames)
        return np.divide(grey, 255, dtype=np.float32)

    def truth(self, place: Place, name: str, *index: Any) -> NDArray[Any]:
        """Part of an array of the truth of a clip."""
        return self.repository.read(f"truth/{self.group}/{name}", *place, *index)

    def before_probe(self, place: Place) -> tuple[Heart, Plane]:
        """The heart as it moves before the probe, and the plane of a view; the last heart is kept, for its views."""
        case, view = place
        if self._kept is None or self._kept[0] != case:
            self._kept = case, self.repository.heart(case)
        return before_probe(self._kept[1], self.repository.case(case).config, view)

    def time(self, place: Place) -> NDArray[np.float32]:
        """Time of each frame since end-diastole, (frame,), s."""
        return self.repository.read(f"bmode/{self.group}/time", *place).astype(np.float32)


def _listed(names: Any) -> list[str]:
    return [names] if isinstance(names, str) else list(names)


def _complete(repository: Repository) -> list[str]:
    found = [str(case) for case in repository.cases.query("status == 'complete'").index]
    if not found:
        raise ValueError(f"{repository.location}: no case is complete: finish the run, or name the cases.")
    return found
