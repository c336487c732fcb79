"""Results of trackers that stand already, one piece for each tracker and image size: only others are tracked."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import zarr

from echotruth.evaluation.clip import Clip
from echotruth.repository.checksums import is_whole
from echotruth.repository.provenance import code_version, settings_version
from echotruth.tracking import trackers

if TYPE_CHECKING:
    from echotruth.section import Section

ARRAYS = ("displacement", "quality")


@dataclass(frozen=True)
class Piece:
    """What one tracker found in one clip.

    Attributes
    ----------
    displacement : ndarray of shape (frame, grid rows, grid columns, 2)
        Lateral, axial, m; NaN outside the wall.
    quality : ndarray of shape (frame, grid rows, grid columns)
    fingerprint : str
        Of all that it was made from; empty if that is not known.
    failure : str
        Why there is no estimate; empty if there is one.
    """

    displacement: np.ndarray
    quality: np.ndarray
    fingerprint: str
    failure: str = ""


class Pieces:
    """Pieces of one view, as the last job that tracked it left them.

    Parameters
    ----------
    entry : dict
        What the last job remembered in its checkpoint.
    index : tuple of int
        Row of the case and index of the view.
    roots : iterable of Path
        Folders below which its arrays may stand.
    """

    def __init__(self, entry: dict[str, Any], index: tuple[int, ...], roots: Iterable[Path]) -> None:
        self._index, self._roots = index, list(roots)
        self._sha256 = entry.get("record", {}).get("sha256", {})
        # A piece is read at the place of this view, which must be that at which it was written.
        self._known = entry.get("pieces", {}) if entry.get("index") == list(index) else {}

    def find(self, size: int, name: str, fingerprint: str) -> Piece | None:
        """Find the piece of a tracker at an image size, if it was made from the same and its files are whole."""
        pieces = self._known.get(str(size), {})
        known = pieces.get(name, {})
        if not fingerprint or known.get("fingerprint") != fingerprint or known["failure"]:
            return None
        if self._arrays is None:
            return None
        place = list(self._known).index(str(size)), list(pieces).index(name)
        displacement, quality = (array[place] for array in self._arrays)
        return Piece(displacement, quality, fingerprint)

    @cached_property
    def _arrays(self) -> tuple[np.ndarray, ...] | None:
        """Arrays of all image sizes and trackers; None if a file is missing or differs from what was written."""
        found = []
        for array in ARRAYS:
            group = f"tracking/{array}"
            files = {name: value for name, value in self._sha256.items() if name.startswith(f"{group}/")}
            root = next((root for root in self._roots if files and _whole(root, files)), None)
            if root is None:
                return None
            opened = cast(Any, zarr.open_array(root / group, mode="r"))
            found.append(np.asarray(opened[self._index]))
        return tuple(found)


def fingerprint(tracker: Section, clip: Clip) -> str:
    """Hash of all that a piece is made from: code and settings of the tracker, and what the tracker is given.

    Empty for a tracker from outside, whose code is not known: it is never taken for the same.
    """
    method = getattr(tracker, "method", "external")
    return "" if method == "external" else settings_version(_code(method), tracker, digest(clip))


def _code(method: str) -> str:
    """Version of the code of one method: a change of the others leaves its results as they are."""
    call = "echotruth.tracking.tracker"
    names = {file.stem for file in Path(*trackers.__path__).glob("*.py")} - {method}
    others = frozenset((call, f"{trackers.__name__}.{name}") for name in names)
    return code_version("echotruth.evaluation.clip", call, unless=others)


def digest(clip: Clip) -> str:
    """Hash of all that a tracker is given."""
    content = sha256()
    for value in (*clip.tracker_arguments, clip.inside):
        array = np.ascontiguousarray(value)
        content.update(f"{array.dtype} {array.shape} ".encode())
        content.update(array.tobytes())
    return content.hexdigest()


def known(pieces: dict[int, dict[str, Piece]]) -> dict[str, dict[str, dict[str, str]]]:
    """What the checkpoint keeps of pieces, by image size and tracker, in the order of the arrays."""
    return {
        str(size): {
            name: {"fingerprint": piece.fingerprint, "failure": piece.failure} for name, piece in trackers.items()
        }
        for size, trackers in pieces.items()
    }


def _whole(root: Path, files: dict[str, str]) -> bool:
    return all(is_whole(root / name, expected) for name, expected in files.items())
