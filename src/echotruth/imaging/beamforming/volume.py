"""Volumes of a row-column array: all pairs of columns and rows, focused in both directions at every voxel.

The delay of a pair at a voxel is the sum of that of its column and that of its row, so that at a depth the image is a
sum over frequencies f of A(f)^T S(f) B(f), with the echoes S of all pairs (columns, rows) and the weighted phasors A
and B of the columns at every lateral coordinate and of the rows at every elevation: matrix products in place of a sum
over pairs.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.config import Config
from echotruth.imaging.beamforming.aperture import Aperture
from echotruth.imaging.beamforming.gate import Gate
from echotruth.imaging.beamforming.scan import voxel_centres
from echotruth.imaging.beamforming.synthesis import channel_sampling
from echotruth.imaging.rf.record import half_pulse
from echotruth.imaging.rf.row_column import RowColumn
from echotruth.units import MHz

SLICES = 12
"""Depths that share a gate of the record."""


class VolumeScanner:
    """A row-column array that images a volume; the scatterers are at rest meanwhile.

    Parameters
    ----------
    config : Config
        The sections probe, rf and volume are used.

    Attributes
    ----------
    axial, elevation, lateral : ndarray of shape (n,), m
        Coordinates of the voxels.
    frequency : float, Hz
        Frequency at which the volumes are demodulated.
    matrix : RowColumn
        The echoes between columns and rows.
    """

    def __init__(self, config: Config) -> None:
        self._config, probe = config, config.probe
        self.axial, self.elevation, self.lateral = voxel_centres(config)
        self.frequency = probe.frequency_MHz * MHz
        self.matrix = RowColumn(probe, float(np.sqrt(sum(np.abs(each).max() ** 2 for each in self._coordinates))))
        self._sampling, self._aperture = channel_sampling(self.matrix), Aperture(probe, config.rf)

    @property
    def _coordinates(self) -> tuple[Floats, Floats, Floats]:
        return self.axial, self.elevation, self.lateral

    def positions(self) -> Floats:
        """Positions of the voxels in the frame of the probe, (axial, elevation, lateral, 3), m."""
        axial, elevation, lateral = np.meshgrid(*self._coordinates, indexing="ij")
        return np.stack([lateral, axial, elevation], axis=-1)

    def beamform(self, matrix: NDArray[np.complex64]) -> NDArray[np.complex64]:
        """Volume of echoes of all pairs (bins, columns, rows): (axial, elevation, lateral), complex64, demodulated."""
        echoes = self._sampling.to_time(matrix)
        volume = np.empty([len(each) for each in self._coordinates], np.complex64)
        for start, gate in self._gates:
            spectra = gate.spectra(echoes)
            for number in range(start, min(start + SLICES, len(self.axial))):
                volume[number] = self._focused(spectra, gate, self.axial[number])
        speed = self._config.probe.sound_speed_m_per_s
        volume *= np.exp(-4j * np.pi * self.frequency / speed * self.axial).astype(np.complex64)[:, None, None]
        return volume

    def _focused(self, spectra: NDArray[np.complex64], gate: Gate, depth: float) -> NDArray[np.complex64]:
        """Image at a depth, m, (elevation, lateral), of the spectra of a gate (bins, columns, rows)."""
        columns, rows = (self._phasors(gate, along, depth) for along in (self.lateral, self.elevation))
        half = np.ascontiguousarray((columns @ spectra).transpose(0, 2, 1)).reshape(-1, len(self.lateral))
        return rows.transpose(1, 0, 2).reshape(len(self.elevation), -1) @ half

    def _phasors(self, gate: Gate, along: Floats, depth: float) -> NDArray[np.complex64]:
        """Weights and delays of all strips for points at coordinates across them, m: (bins, points, strips)."""
        delay = self._ways(along, depth) / self._config.probe.sound_speed_m_per_s - gate.first / self._sampling.rate / 2
        weight = self._aperture.weights(along, depth)
        # As bright at all depths: more strips see what is deeper, and each hears less of it.
        weight /= np.linalg.norm(weight, axis=1, keepdims=True)
        low, step = gate.frequency[0], gate.frequency[1] - gate.frequency[0]
        turns = np.exp(2j * np.pi * step * delay).astype(np.complex64)
        phasors = np.empty((len(gate.frequency), *delay.shape), np.complex64)
        phasors[0] = weight * np.exp(2j * np.pi * low * delay)
        for number in range(1, len(phasors)):
            np.multiply(phasors[number - 1], turns, out=phasors[number])
        return phasors

    def _ways(self, along: Floats, depth: float) -> Floats:
        """Distances of all strips from points, m, (points, strips)."""
        return np.hypot(along[:, None] - self.matrix.centres, depth)

    @cached_property
    def _gates(self) -> list[tuple[int, Gate]]:
        """First slice and gate of the slices that share one."""
        band, found, speed = self.matrix.frequency[[0, -1]], [], self._config.probe.sound_speed_m_per_s
        margin = half_pulse(self._config.probe)
        for start in range(0, len(self.axial), SLICES):
            depths = self.axial[start : start + SLICES]
            farthest = sum(self._farthest(along, depths[-1]) for along in (self.lateral, self.elevation))
            times = 2 * depths[0] / speed - margin, farthest / speed + margin
            found.append((start, Gate(self._sampling, band, times)))
        return found

    def _farthest(self, along: Floats, depth: float) -> float:
        """Distance of the farthest strip that serves a point at a depth, m."""
        return float(self._ways(along, depth)[self._aperture.weights(along, depth) > 0].max())
