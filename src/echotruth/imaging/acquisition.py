"""Acquisition: the full matrix of every frame, with growth of the harmonic, shadow, haze, aberration, ring-down and
noise.

Applied to the full matrix, so that every synthesised transmit contains them.
"""

from functools import cached_property
from math import prod, sqrt

import numpy as np
from numpy.typing import NDArray

from echotruth.config import Config, Probe
from echotruth.imaging.beamforming.aperture import Aperture, harmonic
from echotruth.imaging.beamforming.scanner import Scanner, validate_scatterers
from echotruth.imaging.beamforming.volume import VolumeScanner
from echotruth.imaging.medium.body import Echoes
from echotruth.imaging.medium.medium import Medium
from echotruth.imaging.medium.random_process import Random
from echotruth.imaging.rf import ring_down
from echotruth.imaging.rf.aberration import delays, phasors
from echotruth.imaging.rf.full_matrix import FullMatrix
from echotruth.imaging.rf.haze import reverberation, reverberation_filter
from echotruth.imaging.rf.row_column import RowColumn
from echotruth.imaging.rf.shadow import Rib
from echotruth.units import mm

BYTE_STD = sqrt((256**2 - 1) / 12)
"""Standard deviation of a random byte."""


class Acquisition:
    """The full matrix of every frame.

    Parameters
    ----------
    config : Config
    scanner : Scanner or VolumeScanner
    medium : Medium
    random : Random
        Makes the generators of the reverberation and of the noise in each frame.

    Attributes
    ----------
    noise : float
        Standard deviation of the noise in a bin of a pair (complex), in the unit of the matrix; 0 for none.
    """

    def __init__(self, config: Config, scanner: Scanner | VolumeScanner, medium: Medium, random: Random):
        realism = config.realism
        self._scanner, self._medium, self._random = scanner, medium, random
        self._haze_range, self._filter = 0.0, None
        self._matrix: FullMatrix | RowColumn = scanner.matrix
        self._growth_range = config.rf.focus_mm * mm if config.rf.harmonic else 0.0
        self._screen = _screen(config, scanner.matrix.frequency, random) if realism.aberration.delay_ns else ()
        if realism.haze.level_dB is not None:
            echoes = reverberation(realism.haze, config.probe, config.depth_mm * mm, random("haze"))
            self._haze_range = realism.haze.max_source_range_mm * mm
            self._filter = 1 + reverberation_filter(echoes, config.probe, scanner.matrix.frequency)
        if realism.shadow.side != "none" and isinstance(scanner, Scanner):
            self._matrix = scanner.matrix.behind(Rib(realism.shadow))
        snr = realism.noise.snr_dB
        self.noise = 0.0 if snr is None else self._signal_to_unit_noise() * 10 ** (-snr / 20)
        level = realism.ring_down.level_dB
        self._ring_down = None if level is None else self._leveled_ring_down(config.probe, level)

    def __call__(self, frame: int) -> np.ndarray:
        """Spectra of the record of all pairs in a frame, (bins, elements, elements), as from :class:`FullMatrix`."""
        return self.record(self._medium(frame), frame)

    def record(self, scatterers: Echoes, frame: int | str) -> np.ndarray:
        """Record of scatterers with the noise of a frame, or of what has another name."""
        record = self.echoes(*validate_scatterers(*scatterers))
        if self._ring_down is not None:
            ring_down.add(record, self._ring_down)
        if self.noise:
            record += np.float32(self.noise) * self.unit_noise(frame)
        return record

    def echoes(self, position: np.ndarray, amplitude: np.ndarray, exponent: np.ndarray | float = 0.0) -> np.ndarray:
        """Record of scatterers, their positions (n, 3), m, amplitudes (n,) and exponents (n,), without noise."""
        amplitude = self._grown(position, amplitude)
        if self._filter is None:
            return self._aberrated(self._matrix(position, amplitude, exponent))
        near = np.linalg.norm(position, axis=1) < self._haze_range
        return self._aberrated(self._matrix(position, amplitude, exponent, (near, self._filter)))

    def _grown(self, position: np.ndarray, amplitude: np.ndarray) -> np.ndarray:
        """Amplitudes (n,) of scatterers (n, 3), m, times what there is of the harmonic, relative to the focus."""
        if not self._growth_range or not isinstance(self._scanner, Scanner):
            return amplitude
        # Of a plane wave whose attenuation is proportional to frequency: its loss is that of a wave sent as harmonic.
        _, range_ = self._scanner.scan.to_scan_coordinates(position[:, 0], position[:, 1])
        return amplitude * np.minimum(range_ / self._growth_range, 1)

    def _aberrated(self, matrix: np.ndarray) -> np.ndarray:
        """The record (bins, receivers, transmitters) after the screen, which overwrites it."""
        for factor in self._screen:
            matrix *= factor
        return matrix

    def unit_noise(self, frame: int | str) -> np.ndarray:
        """Noise of variance 1 in the records of all pairs in a frame, at the frequencies of the matrix.

        White over the pairs and over the band of the pulse, to which a receiver is tuned; none outside the band. Every
        part is a random byte, since sums of many, of which channels and lines consist, are normally distributed.
        """
        matrix = self._scanner.matrix
        shape = (len(matrix.frequency), len(matrix.centres), len(matrix.centres), 2)
        parts = np.frombuffer(self._random(f"noise {frame}").bytes(prod(shape)), np.int8)
        # Bytes are from -128 to 127, of which the mean is -1/2.
        scaled = (parts + np.float32(0.5)) * np.float32(1 / BYTE_STD / sqrt(2))
        return scaled.view(np.complex64).reshape(shape[:3])

    @cached_property
    def _muscle(self) -> tuple[np.ndarray, np.ndarray]:
        """Where muscle is in lines or volume at end-diastole, bool, and its echo there, (n,)."""
        scanner = self._scanner
        muscle = self._medium.wall.contains(0, scanner.positions())
        if not muscle.any():
            remedy = "so levels relative to it (realism.noise, realism.ring_down) have no meaning"
            raise ValueError(f"There is no muscle in the image at end-diastole, {remedy}.")
        position, amplitude, exponent = validate_scatterers(*self._medium.wall(0))
        matrix = scanner.matrix(position, self._grown(position, amplitude), exponent)
        return muscle, scanner.beamform(self._aberrated(matrix))[muscle]

    def _signal_to_unit_noise(self) -> float:
        """RMS of the echo of muscle over that of unit noise, in the lines where muscle is at end-diastole."""
        muscle, echo = self._muscle
        noise = self._scanner.beamform(self.unit_noise(0))
        return float(np.linalg.norm(echo) / np.linalg.norm(noise[muscle]))

    def _leveled_ring_down(self, probe: Probe, level_dB: float) -> NDArray[np.complex64]:
        """Ring-down, (bins, elements), whose brightest echo in the lines is at a level over the RMS of muscle."""
        matrix, (_, echo) = self._scanner.matrix, self._muscle
        spectra = ring_down.ring_down(probe, matrix.frequency)
        record = np.zeros((len(spectra), *2 * spectra.shape[1:]), np.complex64)
        ring_down.add(record, spectra)
        brightest = np.abs(self._scanner.beamform(record)).max()
        scale = 10 ** (level_dB / 20) * np.linalg.norm(echo) / np.sqrt(echo.size) / brightest
        return (spectra * scale).astype(np.complex64)


def _screen(config: Config, frequency: np.ndarray, random: Random) -> tuple[np.ndarray, np.ndarray]:
    """Factors of a record on receive, (bins, elements, 1), and on transmit, (bins, 1, elements).

    The frequencies (bins,) are in Hz. A harmonic comes from a wave of half the frequency, whose beam is squared after
    the screen.
    """
    delay = delays(config.realism.aberration, config.probe, random("aberration"))
    received = phasors(delay, frequency)
    sent = received
    if config.rf.harmonic:
        weight = Aperture(config.probe, config.rf).fundamental
        sent = harmonic(weight * phasors(delay, frequency / 2)) / harmonic(weight[None])
    return received[:, :, None].astype(np.complex64), sent[:, None, :].astype(np.complex64)
