"""A sequence of volumes: all frames of a heart before a row-column array."""

import logging
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from echotruth.config import Config
from echotruth.heart import Heart
from echotruth.imaging.acquisition import Acquisition
from echotruth.imaging.beamforming.volume import VolumeScanner
from echotruth.imaging.bmode import grey_images, time_gain_compensation
from echotruth.imaging.medium.body import Scene
from echotruth.imaging.medium.medium import Medium, seed_medium
from echotruth.imaging.medium.random_process import Random
from echotruth.imaging.view import Plane
from echotruth.loop.cycle import frame_times

logger = logging.getLogger("echotruth")


class VolumeSequence:
    """A heart before a row-column array, imaged frame by frame; parameters are those of :class:`.Sequence`."""

    def __init__(self, config: Config, heart: Heart, plane: Plane, random: Random) -> None:
        self._scene = Scene(config, heart, plane, random, frame_times(config.loop))
        self.scanner = VolumeScanner(config)

    def volumes(self) -> Iterator[NDArray[np.complex64]]:
        """The volume (axial, elevation, lateral) of every frame, complex64, demodulated."""
        scene, frames = self._scene, len(self._scene.heart.displacement)
        medium = Medium(scene, seed_medium(scene, self.scanner.matrix.in_beam))
        acquire = Acquisition(scene.config, self.scanner, medium, scene.random)
        for frame in range(frames):
            yield self.scanner.beamform(acquire(frame))
            logger.info("frame %d of %d", frame + 1, frames)

    def images(self, is_closed: bool) -> NDArray[np.uint8]:
        """B-mode (frame, axial, elevation, lateral) of all volumes, of a cycle that is closed or open."""
        config = self._scene.config
        gain = time_gain_compensation(config.probe, config.bmode, self.scanner.axial)[:, None, None]
        images = np.stack([np.abs(volume) * gain for volume in self.volumes()])
        return grey_images(images, np.ones(images.shape[1:], bool), config.bmode, is_closed)
