"""Radio-frequency data: the echoes of a phantom between all pairs of elements.

At a frequency f of the pulse of spectrum P, the echo between the elements i and j of scatterers of amplitude a_k is

    S_ij(f) = P(f) sum_k a_k (f / f0)^n_k u_ki(f) u_kj(f),
    u_ki(f) = D_i(f) E_i(f) exp(-alpha f r_i) exp(-2 pi i f r_i / c) / r_i,

with the centre frequency f0, the exponent n of the scattering, the distance r_i, directivity D, response E of the lens
and attenuation alpha of each way; see benchmarks/exact_sum.py, where it is summed as it stands. Here echoes
are spread on a grid in time by short kernels (:mod:`~echotruth.imaging.rf.kernel`) and then filtered together, those of
each exponent by a filter that contains the power of the frequency. Where elements differ too much under the lens for
that, they are summed at few frequencies (:mod:`~echotruth.imaging.rf.frequency_sum`). By reciprocity only the pairs
i <= j are computed, and where many scatterers are close together only those between a few elements, from which all
others follow (:mod:`~echotruth.imaging.rf.clusters`).

With n elements the memory is 8 n^2 bytes a frequency of the matrix, some 500 MB while it is made at most, and a few MB
for tables: 50 MB for the default array, however many scatterers there are.
"""

from __future__ import annotations

from copy import copy
from functools import lru_cache, partial, reduce

import numpy as np

from echotruth.config import Probe
from echotruth.imaging.rf import directivity, kernel, spreading
from echotruth.imaging.rf.clusters import Cluster, Clusters, add_expanded
from echotruth.imaging.rf.elevation import MAX_BLOCKS, Lens
from echotruth.imaging.rf.frequency_sum import FrequencySum
from echotruth.imaging.rf.kernel import NODES, TAPS, Band, stack_real_imaginary
from echotruth.imaging.rf.lens_kernels import lens_kernels
from echotruth.imaging.rf.probe import element_centres
from echotruth.imaging.rf.product import HEIGHT, padded
from echotruth.imaging.rf.record import PLANE, Record, half_pulse, plane_tables, pulse_grid
from echotruth.imaging.rf.shadow import Rib
from echotruth.imaging.rf.spreading import phases_of
from echotruth.threads import share
from echotruth.units import MHz, dB_per_cm_MHz, um

BLOCK = 256
"""Scatterers spread at a time."""
LENS, WIDE = 1, 3
"""Schemes of the kernels' tables (see :data:`.spreading.COEFFICIENTS`) with the lens, the latter for elements wider
than `MAX_NARROW_WIDTH`; without it, the scheme is :data:`.PLANE`."""
PLANE_ACCURACY = 2e-5
"""Relative error (L2) against the exact sum without the lens, within 32 degrees, or within 24 degrees if elements are
0.88 wavelengths wide (`mouse_30MHz`, `mouse_40MHz`); times 1 + n / 2 for echoes with the exponent n."""
LENS_SPECTRA, PAIR_SPECTRA = (0, 0, 0, 0, 1, 1), (0, 1, 2, 2, 0, 1)
"""Each term is the product of a spectrum of :func:`.lens_spectra` and one of :func:`.directivity.pair_spectra`: their
indices, by the number of the term."""
MAX_NARROW_WIDTH = 0.75
"""Width of an element, in wavelengths, up to which its directivity hardly changes with frequency."""
EXPANDED = 1 << 28
"""Bytes of the spectra of clusters from which on they are expanded, so that memory does not grow with the clusters."""
CLUSTER_TOLERANCE = (1e-6, 1e-3)
"""Relative error (L2) of the echoes that clusters interpolate, without and with the lens. Measured between exact echoes
with the lens it is 3e-4 to 6e-4, and up to 1e-2 within 1.4 mm of a mouse's array and 23 mm of a human's, where the lens
turns phases that the decomposition does not know; the few scatterers there are seldom in a cluster."""


class FullMatrix(Record):
    """Echoes between all pairs of elements of a probe.

    Parameters
    ----------
    probe : Probe
        The array.
    depth : float
        Greatest range of interest, m. Scatterers farther than this and half a pulse are left out.
    max_delay : float
        Greatest delay, early or late, that will be added to the echoes, s.
    elevation : bool
        Whether the lens is there; without it, elements are points in elevation, at a distance in three dimensions. The
        error against the exact sum is :data:`PLANE_ACCURACY` without the lens, and 1 % with it.
    harmonic : bool
        Whether echoes are those of the second harmonic of a wave that is sent at half of the frequency, which has the
        square of that wave's beam in elevation. Of each pair of elements it is the mean of both ways.

    Attributes
    ----------
    frequency, first_bin, sampling, samples
        As of :class:`.Record`.
    centres : ndarray of shape (elements,), m
        Lateral coordinates of the elements.
    sound_speed : float, m/s
    max_range : float, m
        Greatest range of a scatterer.

    Examples
    --------
    >>> import echotruth as et
    >>> import numpy as np
    >>> matrix = et.FullMatrix(et.Probe(elements=8), depth=8e-3)
    >>> spectra = matrix(np.array([[0.2e-3, 6.5e-3, 0.0]]), np.ones(1))
    >>> spectra.shape == (len(matrix.frequency), 8, 8)
    True
    >>> bool(np.allclose(spectra, spectra.swapaxes(1, 2)))  # who sends and who listens may change places
    True
    """

    _rib: Rib | None = None

    def __init__(
        self, probe: Probe, depth: float, max_delay: float = 0.0, elevation: bool = True, harmonic: bool = False
    ) -> None:
        centre, speed = probe.frequency_MHz * MHz, probe.sound_speed_m_per_s
        self._width = probe.width_um * um * centre / speed
        self._scheme = (LENS if self._width <= MAX_NARROW_WIDTH else WIDE) if elevation else PLANE
        band = pulse_grid(probe, elevation)
        self.max_range = depth + speed * half_pulse(probe) / 2
        super().__init__(probe, band, 2 * self.max_range + probe.elements * (probe.pitch_um * um), max_delay)
        self.centres = element_centres(probe)
        self.sound_speed = speed
        loss = probe.attenuation_dB_per_cm_MHz * dB_per_cm_MHz * centre
        self._scales = self.sampling / speed, loss, centre / speed
        self._directivity = directivity.directivity_table(self._width)
        self._lens = _lens(probe, self.max_range, harmonic) if elevation else None
        if self._lens:
            self._sum = FrequencySum(probe, self.sampling, self.samples, harmonic)
        self._clusters = Clusters(self.centres, speed, band, self.max_range, CLUSTER_TOLERANCE[elevation])
        self._tabulate(band, band.frequency / centre)

    def _tabulate(self, band: Band, ratio: np.ndarray) -> None:
        """Set the tables of kernels without the lens, or the lookup tables from which those with the lens are made."""
        coefficients, phases = spreading.COEFFICIENTS[self._scheme], phases_of(self._scheme)
        count = 6 if self._lens else 1 + max(term for term, number in enumerate(coefficients) if number)
        self._mean_exponent, pair_spectra = directivity.pair_spectra(self._width, ratio, count)
        if self._lens:
            responses = (stack_real_imaginary(each) for each in (self._lens.beam, self._lens.derivative_residual))
            maps = tuple(_maps(band, degree, phases) for degree in (2, 1))
            self._lookup = (
                tuple(responses),
                self._lens.power == 1,
                np.ascontiguousarray(pair_spectra[:, :3], np.float32),
                maps,
            )
            return
        self._tables = plane_tables(band, self._scheme, pair_spectra)

    def behind(self, rib: Rib) -> FullMatrix:
        """The echoes that the array receives behind a rib: the same, each way times its transmission."""
        matrix = copy(self)
        matrix._rib, matrix._clusters = rib, self._clusters.behind(rib)
        return matrix

    def in_beam(self, position: np.ndarray) -> np.ndarray:
        """Whether each scatterer at `position` (n, 3), m, is within the record and the beam: (n,), bool.

        The energy of all others together is at most :data:`~echotruth.imaging.rf.elevation.BEAM_TAIL_ENERGY`.
        """
        inside = np.linalg.norm(position, axis=1) <= self.max_range
        if self._lens:
            inside[inside] = self._lens.in_beam(position[inside])
        return inside

    def _traces(self, elements: np.ndarray, position: np.ndarray, amplitude: np.ndarray) -> np.ndarray:
        """Spread echoes of pairs of some elements, before window and pulse are accounted for: (pairs, samples)."""
        traces = np.zeros((len(elements) * (len(elements) + 1) // 2, self.samples), np.float32)
        # Neighbours in range lie in the part of the traces that is in the cache.
        order = np.argsort(np.linalg.norm(position, axis=1), kind="stable")
        position, amplitude = position[order], amplitude[order]
        size, lens = sum(spreading.COEFFICIENTS[self._scheme]) * TAPS, self._lens is not None
        angle = self._angle_index(position)
        kernels = _LensKernels(self, position, angle) if lens else _PlaneKernels(self, angle, size)
        shape = BLOCK, padded(len(elements), spreading.LANES)
        propagation = np.zeros(shape, np.int32), *np.zeros((3, *shape), np.float32)
        array = self.centres[elements], self._scales, self._directivity
        for start in range(0, len(position), BLOCK):
            part = slice(start, min(start + BLOCK, len(position)))
            lens_terms, blocks, tables = kernels(part)
            spreading.one_way(position[part], self._mean_exponent[angle[part]], lens_terms, array, propagation)
            if self._rib:
                weight = propagation[1][: part.stop - start, : len(elements)]
                weight *= self._rib.transmission(position[part], self.centres[elements])
            pairs, scheme = (len(elements), len(elements), True), (0,) * self._scheme
            added = (propagation, propagation, amplitude[part]), blocks, (tables, size), pairs, lens, scheme
            share(partial(spreading.spread, traces, *added), spreading.TRANSMIT_GROUPS)
        return traces

    def _angle_index(self, position: np.ndarray) -> np.ndarray:
        """Index of the nearest tabulated angle from the centre of the array, shape (n,)."""
        sine = np.abs(position[:, 0]) / np.linalg.norm(position, axis=1)
        return np.rint(sine * (directivity.ANGLES - 1)).astype(np.int64)

    def __call__(
        self,
        position: np.ndarray,
        amplitude: np.ndarray,
        exponent: np.ndarray | float = 0.0,
        filtered: tuple[np.ndarray, np.ndarray] | None = None,
    ) -> np.ndarray:
        """Spectra of the echoes of all pairs at `frequency`.

        Parameters
        ----------
        position : ndarray of shape (scatterers, 3), m
        amplitude : ndarray of shape (scatterers,)
            At the centre frequency of the probe.
        exponent : ndarray of shape (scatterers,), or float
            Power of the frequency that the amplitude follows; 0 for scattering that is the same at all frequencies. Few
            different values, because the echoes of each are transformed apart.
        filtered : tuple of ndarray of shape (scatterers,) and (bins,), optional
            Which scatterers (bool) have echoes that pass a filter, and its transfer function.

        Returns
        -------
        ndarray of shape (bins, elements, elements), complex64
            Symmetric in the elements. Units: amplitude / m^2 / sample.
        """
        inside = self.in_beam(position)
        position, amplitude = position[inside], amplitude[inside].astype(np.float32)
        powers = np.broadcast_to(exponent, inside.shape)[inside]
        passes, transfer = (np.zeros(len(inside), bool), np.ones(1)) if filtered is None else filtered
        passes, response = passes[inside], transfer.astype(np.complex64)[:, None]
        numbers = self._clusters.worth_expanding(self._clusters.numbers(position))
        matrix = np.zeros((len(self.frequency), *[len(self.centres)] * 2), np.complex64)
        clusters, spectra = [], []
        for number in np.unique(numbers):
            own, cluster = numbers == number, self._clusters[number]
            clusters.append(cluster)
            echoes = []
            for through in np.unique(passes[own]):
                part = own & (passes == through)
                found = self._skeleton_spectra(cluster, position[part], amplitude[part], powers[part])
                echoes.append(found * response if through else found)
            spectra.append(reduce(np.add, echoes))
            if sum(each.nbytes for each in spectra) > EXPANDED or number == numbers.max():
                add_expanded(matrix, clusters, self.frequency, np.concatenate(spectra, axis=1))
                clusters, spectra = [], []
        return matrix

    def _skeleton_spectra(
        self, cluster: Cluster, position: np.ndarray, amplitude: np.ndarray, exponent: np.ndarray
    ) -> np.ndarray:
        """Spectra of the echoes of pairs of the skeleton elements of a cluster, without its delays: (bins, pairs)."""
        few = len(cluster.skeleton)
        spectra = np.zeros((len(self.frequency), few * (few + 1) // 2), np.complex64)
        spread = self._lens.spreads(position) if self._lens else np.ones(len(position), bool)
        for power in np.unique(exponent[spread]):
            own = spread & (exponent == power)
            self.add_spectra(spectra, self._traces(cluster.skeleton, position[own], amplitude[own]), power)
        if spread.any() and cluster.delay.any():
            cluster.remove_delay(spectra, self.frequency)
        if not spread.all():
            centres, delay = self.centres[cluster.skeleton], cluster.delay[cluster.skeleton]
            position, amplitude, exponent = (each[~spread] for each in (position, amplitude, exponent))
            passes = self._rib.transmission(position, centres) if self._rib else np.ones((len(position), few))
            self._sum.add(spectra, self.first_bin, (centres, delay), (position, amplitude, exponent, passes))
        return spectra


class _PlaneKernels:
    """Tables of echoes in the plane: one for each angle from the centre of the array, whatever the scatterer."""

    def __init__(self, full: FullMatrix, angle: np.ndarray, size: int) -> None:
        self._tables = full._tables
        self._base = angle * size * phases_of(full._scheme)

    def __call__(self, part: slice) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Lens terms, kernel blocks and tables of some of the scatterers, for :mod:`.spreading`."""
        base = self._base[part]
        blocks = np.column_stack([np.arange(len(base)), base, np.full(len(base), kernel.sample_offsets(1)[0])])
        return np.empty((0, 4)), blocks, self._tables


class _LensKernels:
    """Tables of echoes under the lens, made for every scatterer.

    The positions (n, 3) are in m; `angle` (n,) is the index of the angle of each from the centre of the array.
    """

    def __init__(self, full: FullMatrix, position: np.ndarray, angle: np.ndarray) -> None:
        assert full._lens
        self._full, self._angle = full, angle
        self._index, self._lens_terms = full._lens.lens_terms(position, full.sound_speed)
        self._owner, block, self._first = _blocks(full._lens.blocks_at(self._index))
        self._entries = np.stack([self._owner, block], axis=1)
        starts = np.searchsorted(self._owner, np.arange(0, len(position) + BLOCK, BLOCK))
        terms = zip(spreading.COEFFICIENTS[full._scheme], LENS_SPECTRA, PAIR_SPECTRA, strict=True)
        self._terms = np.array([(term, count, *spectra) for term, (count, *spectra) in enumerate(terms) if count])
        rows = phases_of(full._scheme), sum(spreading.COEFFICIENTS[full._scheme])
        self._tables = spreading.cache_aligned(int(np.diff(starts).max(initial=0)), *rows, TAPS)
        self._base = np.arange(len(self._tables)) * np.prod(rows) * TAPS

    def __call__(self, part: slice) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Lens terms, kernel blocks and tables of some of the scatterers, for :mod:`.spreading`."""
        own = slice(*np.searchsorted(self._owner, [part.start, part.stop]))
        entries = self._entries[own] - [part.start, 0]
        order, tables = np.argsort(entries[:, 1], kind="stable"), self._tables[: len(entries)]
        scatterers = self._index[part], self._angle[part]
        made = partial(lens_kernels, *scatterers, self._full._lookup, self._terms, entries, order, tables)
        share(made, -(-len(entries) // HEIGHT))
        blocks = np.column_stack([entries[:, 0], self._base[: len(entries)], self._first[own]])
        return self._lens_terms[part], blocks, tables.ravel()


@lru_cache(maxsize=1)
def _lens(probe: Probe, max_range: float, harmonic: bool) -> Lens:
    """Lens of a probe, kept for the next matrix of the same: its tables take most of the time to set one up."""
    return Lens(probe, max_range, pulse_grid(probe, True), harmonic)


def _maps(band: Band, degree: int, phases: int) -> np.ndarray:
    """Maps to the polynomials of all blocks, shape (blocks, 2 NODES, phases (degree + 1) TAPS), float32."""
    maps = np.concatenate([kernel.fit_polynomials(band, blocks, degree, phases) for blocks in range(1, MAX_BLOCKS + 1)])
    return np.ascontiguousarray(np.moveaxis(maps, -1, 1).reshape(len(maps), 2 * NODES, -1), np.float32)


def _blocks(count: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Owner, map and first sample of every block of samples, each (blocks,), of the number that each owner needs."""
    owner = np.repeat(np.arange(len(count)), count)
    within = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    blocks = count[owner].astype(np.int64)
    return owner, blocks * (blocks - 1) // 2 + within, within * TAPS - (blocks * TAPS // 2 - 1)
