"""A sequence: all frames of one view, from the scatterers to the lines."""

import logging
from collections.abc import Iterator
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.config import Config
from echotruth.heart import Heart
from echotruth.imaging.acquisition import Acquisition
from echotruth.imaging.beamforming.scanner import Scanner, full_matrix
from echotruth.imaging.medium.body import Arrays, Scene
from echotruth.imaging.medium.medium import Medium, seed_medium
from echotruth.imaging.medium.random_process import Random
from echotruth.imaging.recorder import RfRecorder
from echotruth.imaging.rf.full_matrix import FullMatrix
from echotruth.imaging.rf.row_column import RowColumn
from echotruth.imaging.view import Plane
from echotruth.loop.cycle import frame_times
from echotruth.units import mm

logger = logging.getLogger("echotruth")


class Sequence:
    """A heart before a probe, imaged frame by frame.

    Parameters
    ----------
    config : Config
        The sections phantom, probe, rf, realism, bmode and loop are used.
    heart : Heart
    plane : Plane
        Where the probe stands, as :func:`echotruth.imaging.view.imaging_plane` places it.
    random : Random
        Makes a generator of random numbers for each purpose.
    time : ndarray of shape (frame,), s, optional
        Times of the frames. Default: those of the loop.
    """

    def __init__(self, config: Config, heart: Heart, plane: Plane, random: Random, time: Floats | None = None) -> None:
        self._scene = Scene(config, heart, plane, random, frame_times(config.loop) if time is None else time)
        self._array = config.probe, config.rf, config.depth_mm * mm

    @cached_property
    def scanner(self) -> Scanner:
        """What beamforms the frames; none is needed to draw scatterers."""
        return Scanner(*self._array)

    def scatterers(self) -> Arrays:
        """Draw the scatterers of the view; see :func:`echotruth.imaging.medium.medium.seed_medium`."""
        return seed_medium(self._scene, self._matrix.in_beam)

    @property
    def _matrix(self) -> FullMatrix | RowColumn:
        """The array, which hears scatterers or not."""
        return full_matrix(*self._array)

    def acquisition(self, scatterers: Arrays) -> Acquisition:
        """Return what makes the full matrix of any frame."""
        return Acquisition(self._scene.config, self.scanner, self.medium(scatterers), self._scene.random)

    def medium(self, scatterers: Arrays) -> Medium:
        """Return the scatterers of any frame."""
        return Medium(self._scene, scatterers)

    def lines(self, scatterers: Arrays, recorder: RfRecorder | None = None) -> NDArray[np.complex64]:
        """Image all frames.

        Parameters
        ----------
        scatterers : dict of ndarray
            As :meth:`scatterers` returns them.
        recorder : RfRecorder, optional
            It is given the full matrix of every frame.

        Returns
        -------
        ndarray of shape (frame, lines, ranges), complex64
            Demodulated lines, as of :meth:`echotruth.imaging.beamforming.scanner.Scanner.lines`.
        """
        return np.stack(list(self.frames(scatterers, recorder)))

    def frames(self, scatterers: Arrays, recorder: RfRecorder | None = None) -> Iterator[NDArray[np.complex64]]:
        """One frame after another, as the scanner beamforms it; the parameters are those of :meth:`lines`."""
        acquire, frames = self.acquisition(scatterers), len(self._scene.heart.displacement)
        for frame in range(frames):
            # The matrix has no name here, so that its memory is free for beamforming.
            yield self.scanner.beamform(_recorded(acquire(frame), frame, recorder))
            logger.info("frame %d of %d", frame + 1, frames)


def _recorded(matrix: NDArray[np.complex64], frame: int, recorder: RfRecorder | None) -> NDArray[np.complex64]:
    """The full matrix of a frame, once a recorder has it too."""
    if recorder:
        recorder.add(frame, matrix)
    return matrix
