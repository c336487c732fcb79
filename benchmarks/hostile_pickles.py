"""Pickles that say whether somebody has read them."""

import os
import pickle
from pathlib import Path


class _Touching:
    """What makes a file when it is unpickled."""

    def __init__(self, marker: Path) -> None:
        self._marker = marker

    def __reduce__(self) -> tuple[object, tuple[object, ...]]:
        return os.mknod, (str(self._marker),)


def pickled(marker: Path) -> bytes:
    """A pickle that, when it is read, makes a file."""
    return pickle.dumps(_Touching(marker))
