"""A sequence of volumes: all frames of a heart before a row-column array."""

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from echotruth.imaging.beamforming.volume import VolumeScanner
from echotruth.imaging.medium.body import Arrays
from echotruth.imaging.recorder import quantise
from echotruth.imaging.rf.row_column import RowColumn
from echotruth.imaging.sequence import Sequence
from echotruth.imaging.truth import wall_mask
from echotruth.imaging.view import NoWall


class VolumeSequence(Sequence):
    """A heart before a row-column array, imaged frame by frame; parameters are those of :class:`.Sequence`."""

    @cached_property
    def scanner(self) -> VolumeScanner:  # type: ignore[override]  # beamforms as the other does
        """What beamforms the volumes."""
        return VolumeScanner(self._scene.config)

    @property
    def _matrix(self) -> RowColumn:
        return self.scanner.matrix

    @cached_property
    def wall(self) -> NDArray[np.bool_]:
        """Voxels in the wall at end-diastole, (axial, elevation, lateral)."""
        scanner, scene = self.scanner, self._scene
        return wall_mask(scene.heart, scene.plane, scanner.axial, scanner.lateral, scanner.elevation)

    def scatterers(self) -> Arrays:
        """As of :meth:`.Sequence.scatterers`; :exc:`.NoWall` is raised if no voxel is in the wall."""
        if not self.wall.any():
            config = self._scene.config
            where = f"volume.field_mm = {list(config.volume.field_mm)} about rf.focus_mm = {config.rf.focus_mm:g}"
            raise NoWall(f"There is no wall in the volume: {where} and the offset of the view must suit the heart.")
        return super().scatterers()

    def volumes(self, scatterers: Arrays) -> dict[str, NDArray[Any]]:
        """Image all frames.

        Parameters
        ----------
        scatterers : dict of ndarray
            As :meth:`scatterers` returns them.

        Returns
        -------
        dict of ndarray
            Demodulated, in 16 bits, since all are in memory together: volumes (frame, axial, elevation, lateral, part),
            int16, in-phase and quadrature; and volumes_step (frame,), the value of one step.
        """
        frames, shape = len(self._scene.heart.displacement), self._scene.config.volume.size
        volumes, step = np.empty((frames, *shape, 2), np.int16), np.empty(frames)
        for frame, volume in enumerate(self.frames(scatterers)):
            volumes[frame], step[frame] = quantise(volume.view(np.float32).reshape(*shape, 2))
        return {"volumes": volumes, "volumes_step": step}
