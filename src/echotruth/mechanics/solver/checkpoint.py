"""Frames of an unfinished beat, kept so that a stopped run goes on where it was."""

from __future__ import annotations

import os
import pickle
from dataclasses import dataclass
from pathlib import Path

from echotruth.mechanics.solver.equilibrium import Load, Past, State, Unknown


@dataclass(frozen=True)
class Factored:
    """Where the factors in use were made: with these the next frame takes the same steps as if nothing had stopped."""

    state: State
    load: Load
    unknown: Unknown
    past: Past


@dataclass(frozen=True)
class Frame:
    """A solved frame.

    Attributes
    ----------
    state : State
    load : Load
        Met by it.
    steps : int
        Factorizations up to it.
    residual : float
        Relative imbalance of force, volume and growth that is left.
    factored : Factored, optional
    """

    state: State
    load: Load
    steps: int
    residual: float
    factored: Factored | None


class Progress:
    """A folder with one file a frame.

    Parameters
    ----------
    folder : Path
        Of one heart, one configuration and one version of the code: whoever names it sees to that.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def frames(self) -> list[Frame]:
        """Frames solved so far, in order."""
        return [pickle.loads(path.read_bytes()) for path in sorted(self.folder.glob("*.frame"))]

    def add(self, frame: Frame) -> None:
        """Keep one frame more."""
        self.folder.mkdir(parents=True, exist_ok=True)
        path = self.folder / f"{len(list(self.folder.glob('*.frame'))):05d}.frame"
        part = path.with_suffix(".part")
        part.write_bytes(pickle.dumps(frame))
        os.replace(part, path)
