"""Solved frames of an unfinished beat, stored so that a stopped run can resume."""

from __future__ import annotations

import pickle
from dataclasses import dataclass
from pathlib import Path

from echotruth.mechanics.solver.equilibrium import Load, PreviousState, State, Unknown


@dataclass(frozen=True)
class Linearization:
    """State at which the current factorization was computed; restored so that a resumed run is identical."""

    state: State
    load: Load
    unknown: Unknown
    previous: PreviousState


@dataclass(frozen=True)
class SolvedFrame:
    """A solved frame.

    Attributes
    ----------
    state : State
    load : Load
        Balanced by the state.
    factorizations : int
        Number up to this frame.
    max_error : float
        Largest relative residual of force, cavity volume and cell volumes.
    linearization : Linearization, optional
    """

    state: State
    load: Load
    factorizations: int
    max_error: float
    linearization: Linearization | None


class Checkpoints:
    """A folder with one file for each solved frame.

    Parameters
    ----------
    folder : Path
        It must belong to one heart, one configuration and one version of the code; the caller ensures this.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def load(self) -> list[SolvedFrame]:
        """Frames solved so far, in order."""
        return [pickle.loads(path.read_bytes()) for path in sorted(self.folder.glob("*.frame"))]

    def add(self, frame: SolvedFrame) -> None:
        """Store the next frame."""
        self.folder.mkdir(parents=True, exist_ok=True)
        path = self.folder / f"{len(list(self.folder.glob('*.frame'))):05d}.frame"
        part = path.with_suffix(".part")
        part.write_bytes(pickle.dumps(frame))
        part.replace(path)
