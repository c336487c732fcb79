"""The echoes of a row-column array: columns, tall strips side by side, and rows, the same turned by 90 degrees.

A long strip focuses nothing along itself: what it hears of a scatterer comes from the point of the strip that is
nearest, so that the way is that in the plane across it. The integral of a spherical wave over the strip is, by
stationary phase,

    v(f) = w(y) D(f) sqrt(lambda / (i rho)) exp(-alpha f rho) exp(-2 pi i f rho / c),   lambda = c / f,

with the distance rho and the angle of the directivity D in that plane, and the sensitivity w of the strip where it is
nearest, which falls to 0 towards both ends. Between column i and row j, at (x_i, .) and (., y_j), a scatterer at
(x, z, y) has the delay rho(x - x_i, z) / c + rho(y - y_j, z) / c: it separates (Rasmussen, Christiansen, Thomsen,
Jensen 2015, doi:10.1109/TUFFC.2014.006531). So the echoes of all columns and rows are spread as those between the
elements of :mod:`~echotruth.imaging.rf.full_matrix`, from one set of elements to another.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.config import Probe
from echotruth.imaging.rf import directivity, kernel, spreading
from echotruth.imaging.rf.probe import element_centres
from echotruth.imaging.rf.product import padded
from echotruth.imaging.rf.record import PLANE, Record, half_pulse, plane_tables, pulse_grid
from echotruth.threads import share
from echotruth.units import MHz, dB_per_cm_MHz, um

BLOCK = 256
"""Scatterers spread at a time."""
HALF_APERTURE = 0.7
"""Sine of the angle, to either side, up to which the directivity is fitted; its error, relative to a strip seen
straight ahead, is at most 3e-4 up to there for strips of 0.93 wavelengths."""
TAPER = 1 / 8
"""Part of its length over which the sensitivity of a strip falls off at either end. Without such a taper the echo of
the ends lies behind every scatterer as a ghost at -23 dB, so that real arrays have one (Rasmussen et al.)."""


class RowColumn(Record):
    """Echoes between all columns and rows of a row-column array.

    Parameters
    ----------
    probe : Probe
        The array: so many columns and as many rows.
    depth : float
        Greatest range of interest, m. Scatterers farther than this and half a pulse are left out.

    Attributes
    ----------
    frequency, first_bin, sampling, samples
        As of :class:`.Record`.
    centres : ndarray of shape (elements,), m
        Lateral coordinates of the columns, and coordinates in elevation of the rows.
    max_range : float, m
        Greatest range of a scatterer.

    Examples
    --------
    >>> import echotruth as et
    >>> import numpy as np
    >>> array = et.RowColumn(et.Probe(preset="mouse_row_column_15MHz", elements=8), depth=8e-3)
    >>> spectra = array(np.array([[0.1e-3, 6.5e-3, 0.0]]), np.ones(1))
    >>> spectra.shape == (len(array.frequency), 8, 8)
    True
    """

    def __init__(self, probe: Probe, depth: float) -> None:
        centre, speed = probe.frequency_MHz * MHz, probe.sound_speed_m_per_s
        width, band = probe.width_um * um * centre / speed, pulse_grid(probe, False)
        self.max_range = depth + speed * half_pulse(probe) / 2
        self._length = probe.elements * (probe.pitch_um * um)
        super().__init__(probe, band, 2 * self.max_range + self._length)
        self.centres, self._wavelength = element_centres(probe), speed / centre
        loss = probe.attenuation_dB_per_cm_MHz * dB_per_cm_MHz * centre
        self._scales = self.sampling / speed, loss, 1 / self._wavelength
        self._directivity = directivity.directivity_table(width)
        terms = 1 + max(term for term, number in enumerate(spreading.COEFFICIENTS[PLANE]) if number)
        ratio = band.frequency / centre
        self._mean_exponent, spectra = directivity.pair_spectra(width, ratio, terms, 1, HALF_APERTURE)
        self._tables = plane_tables(band, PLANE, spectra)
        # Both ways together are lambda / (i rho).
        self._responses = (self._responses / (1j * self.ratio)).astype(np.complex64)

    def in_beam(self, position: Floats) -> NDArray[np.bool_]:
        """Whether each scatterer at `position` (n, 3), m, is within the record and before the array: (n,), bool."""
        before = (np.abs(position[:, [0, 2]]) < self._length / 2).all(axis=1)
        return before & (np.linalg.norm(position, axis=1) <= self.max_range)

    def sensitivity(self, along: Floats) -> Floats:
        """Sensitivity w of a strip at coordinates along it from its middle, m; both of any shape."""
        from_end = (self._length / 2 - np.abs(along)) / (TAPER * self._length)
        return np.sin(np.pi / 2 * np.clip(from_end, 0, 1)) ** 2

    def __call__(
        self,
        position: Floats,
        amplitude: Floats,
        exponent: Floats | float = 0.0,
        filtered: tuple[NDArray[np.bool_], NDArray[np.complex128]] | None = None,
    ) -> NDArray[np.complex64]:
        """Spectra of the echoes at `frequency`, (bins, columns, rows), complex64, amplitude / sample.

        Parameters are those of :meth:`.FullMatrix.__call__`. By reciprocity it is no matter which of both sends.
        """
        inside = self.in_beam(position)
        powers, passes = np.broadcast_to(exponent, inside.shape), np.zeros(len(inside), bool)
        passes, transfer = (passes, np.ones(1)) if filtered is None else filtered
        spectra = np.zeros((len(self.frequency), len(self.centres) ** 2), np.complex64)
        for through in np.unique(passes[inside]):
            found = np.zeros_like(spectra)
            for power in np.unique(powers[inside & (passes == through)]):
                own = inside & (passes == through) & (powers == power)
                self.add_spectra(found, self._traces(position[own], amplitude[own]), power)
            spectra += found * transfer.astype(np.complex64)[:, None] if through else found
        return spectra.reshape(len(spectra), len(self.centres), -1)

    def _traces(self, position: Floats, amplitude: Floats) -> NDArray[np.float32]:
        """Spread echoes of all pairs, before window and pulse are accounted for: (columns rows, samples)."""
        elements = len(self.centres)
        traces = np.zeros((elements**2, self.samples), np.float32)
        # Neighbours in range lie in the part of the traces that is in the cache.
        order = np.argsort(np.linalg.norm(position, axis=1), kind="stable")
        position, amplitude = position[order], amplitude[order]
        strength = (amplitude * self.sensitivity(position[:, [0, 2]]).prod(axis=1)).astype(np.float32)
        shape, size = (BLOCK, padded(elements, spreading.LANES)), len(self._tables) // spreading.phases_of(PLANE)
        sent, received = ((np.zeros(shape, np.int32), *np.zeros((3, *shape), np.float32)) for _ in range(2))
        blocks = np.array([[k, 0, kernel.sample_offsets(1)[0]] for k in range(BLOCK)])
        for start in range(0, len(position), BLOCK):
            part = slice(start, start + BLOCK)
            for way, across in ((sent, 0), (received, 2)):
                self._one_way(position[part][:, [across, 1]], way)
            added = (sent, received, strength[part]), blocks[: len(strength[part])], (self._tables, size)
            spread = partial(spreading.spread, traces, *added, (elements, elements, False), False, (0,) * PLANE)
            share(spread, spreading.TRANSMIT_GROUPS)
        return traces

    def _one_way(self, across: Floats, propagation: tuple[NDArray[np.int32], ...]) -> None:
        """Write the propagation between strips and scatterers (n, 2), m: across the strip and axial."""
        in_plane = np.column_stack([across, np.zeros(len(across))])
        mean = np.full(len(across), self._mean_exponent[0])
        array = self.centres, self._scales, self._directivity
        spreading.one_way(in_plane, mean, np.empty((0, 4)), array, propagation)
        # A cylindrical wave in place of a spherical one.
        distance = np.hypot(across[:, :1] - self.centres, across[:, 1:])
        propagation[1][: len(across), : len(self.centres)] *= np.sqrt(distance * self._wavelength)
