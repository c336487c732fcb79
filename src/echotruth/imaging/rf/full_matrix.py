"""Radio-frequency data: the echoes of a phantom between all pairs of elements.

The echo of a scatterer between two elements is its amplitude times their directivities, the spreading 1/r and the loss
on each way and the beam in elevation, delayed by the two ways and shaped by the pulse. Echoes are put on a grid in time
by short kernels (:mod:`~echotruth.imaging.rf.kernel`) and then filtered together. By reciprocity only the pairs i <= j
are computed, and of those only the ones between a few elements, from which all others follow for scatterers that are
close together (:mod:`~echotruth.imaging.rf.clusters`).

With n elements the memory is 8 n^2 bytes a frequency of the matrix, about as much again while it is made, and a few MB
for tables: 50 MB for the default array, however many scatterers there are.
"""

from __future__ import annotations

import numba
import numpy as np
from scipy import fft

from echotruth.config import Probe
from echotruth.imaging.rf import directivity
from echotruth.imaging.rf import spreading as deposit
from echotruth.imaging.rf.attenuation import separated
from echotruth.imaging.rf.clusters import Clusters, Spread
from echotruth.imaging.rf.elevation import MOST_BLOCKS, Lens, bounds
from echotruth.imaging.rf.kernel import NODES, TAPS, Band, Grid, fits, offsets, stacked, window_spectrum
from echotruth.imaging.rf.lens_kernels import mould, together
from echotruth.imaging.rf.probe import element_centres, pulse_band, pulse_spectrum, spectral_width
from echotruth.imaging.rf.product import padded

BLOCK = 256
"""Scatterers deposited at a time."""
FINE, FAST, LENS, WIDE, NEAR = 3, 2, 1, 4, deposit.APART
"""Schemes of the kernels' tables (see :data:`.spreading.ROWS`) for an error of 2e-5 and of 1e-3 in the
plane, and under a lens, there also for elements wider than `NARROW` and for scatterers that parts of the array look up
apart."""
SPECTRA, SHAPES = (0, 0, 0, 0, 1, 1, 2), (0, 1, 2, 2, 0, 1, 0)
"""By the number of a term: the spectrum under the lens (echo, change or skew) and the shape that make it."""
NARROW = 0.75
"""Width of an element, in wavelengths, up to which its directivity hardly changes with frequency."""
DENSEST, SHARPNESS = {FINE: 0.32, FAST: 0.41}, {FINE: 20.0, FAST: 15.0}
"""Greatest frequency of the pulse over that of the grid, and sharpness of the window."""
FINEST = 1e-4
"""Accuracy below which the tables are `FINE`."""
TOLERANCE = {FINE: 1e-6, FAST: 2e-4, LENS: 1e-3, WIDE: 1e-3}
"""Of the clusters, by the scheme: too little to be seen in the error."""


def _length(least: int) -> int:
    """Samples of a record of at least so many, quickly transformed.

    No multiple of 256: echoes stand at like places of all traces, and those of such a length share a few cache lines.
    """
    samples = fft.next_fast_len(least, real=True)
    return samples if samples % 256 else _length(samples + 1)


class FullMatrix:
    """Echoes between all pairs of elements of a probe.

    Parameters
    ----------
    probe : Probe
        The array.
    depth : float
        Greatest range of interest, m. Scatterers farther than this and half a pulse are left out.
    latest : float
        Greatest delay, early or late, that will be added to the echoes, s.
    accuracy : float
        Relative error (L2) that is allowed against the exact sum without the lens: 2e-5 or 1e-3.
    elevation : bool
        Whether the lens is there; without it, echoes are those of strips without end, and positions still in space.
        Under the lens the error is 1.5 % beyond one aperture, most of it in what is far beside the plane; before an
        array as tall as a human's, where echoes are longer than a kernel, some per cent up to two apertures.

    Attributes
    ----------
    frequency : ndarray of shape (bins,), Hz
        Frequencies of the pulse band on the grid of the record.
    first : int
        Bin of the first of them.
    sampling : float, Hz
        Sampling frequency of the record.
    samples : int
        Length of the record; it starts at time 0 and ends with the latest echo plus room for delays and pulse.
    centres : ndarray of shape (elements,), m
        Of the elements.
    sound_speed : float, m/s
    """

    def __init__(
        self, probe: Probe, depth: float, latest: float = 0.0, accuracy: float = 2e-5, elevation: bool = True
    ) -> None:
        p = probe.si()
        low, high = pulse_band(probe)
        self._width = p.width * p.frequency / p.sound_speed
        in_plane = FINE if accuracy < FINEST and not elevation else FAST
        self._scheme = (LENS if self._width <= NARROW else WIDE) if elevation else in_plane
        grid = Grid(max(p.sampling, high / DENSEST[in_plane]), SHARPNESS[in_plane])
        self.sampling = grid.sampling
        half_pulse = 4.5 / (2 * np.pi * spectral_width(probe))
        self.reach = depth + p.sound_speed * half_pulse / 2
        last = 2 * self.reach / p.sound_speed + p.elements * p.pitch / p.sound_speed + half_pulse
        room = 2 * deposit.LEAD + MOST_BLOCKS * TAPS
        self.samples = _length(int((last + 2 * latest) * self.sampling) + room)
        if self.samples >= 1 << (31 - deposit.FRACTION_BITS):
            raise ValueError(f"A record of {self.samples} samples is too long: image less deep or sample slower.")
        self.centres = element_centres(probe)
        self.sound_speed = p.sound_speed
        loss = p.attenuation * p.frequency
        self._scales = self.sampling / p.sound_speed, loss, p.frequency / p.sound_speed
        self._directivity = directivity.tabulated(self._width)
        self._filter(probe, grid, low, high)
        band = _band(probe, grid, low, high)
        self._lens = Lens(probe, self.reach, band) if elevation else None
        self._clusters = Clusters(self.centres, p.sound_speed, band, self.reach, TOLERANCE[self._scheme])
        self._tabulate(band, band.frequency / p.frequency)

    def _filter(self, probe: Probe, grid: Grid, low: float, high: float) -> None:
        """What turns the deposited traces into echoes: courses in time and responses in the band."""
        p = probe.si()
        cycles = np.arange(self.samples // 2 + 1) / self.samples
        inside = np.flatnonzero((cycles * self.sampling >= low) & (cycles * self.sampling <= high))
        self.first = int(inside[0])
        self.frequency = cycles[inside] * self.sampling
        rate = _loss(p, self.frequency)
        time = (np.arange(self.samples) - deposit.LEAD) / self.sampling
        courses, filters = separated(rate, time)
        window = window_spectrum(grid.cycles(self.frequency, rate), grid.sharpness)
        response = pulse_spectrum(probe, self.frequency) / window
        lead = np.exp(2j * np.pi * cycles[inside] * deposit.LEAD)  # rows begin LEAD samples before time 0
        self._courses = courses.astype(np.float32)
        self._responses = (filters * response * lead).astype(np.complex64)

    def _tabulate(self, band: Band, ratio: np.ndarray) -> None:
        """Tables of kernels in the plane, or what makes those under the lens."""
        rows, phases = deposit.ROWS[self._scheme], _phases(self._scheme)
        count = 6 if self._lens else 1 + max(term for term, degree in enumerate(rows) if degree)
        self._tilts, shapes = directivity.shapes(self._width, ratio, count)
        if self._lens:
            beams = stacked(self._lens.beam), stacked(self._lens.change)
            maps = tuple(_maps(band, degree, phases) for degree in (2, 1))
            self._moulds = beams, np.ascontiguousarray(shapes[:, :3], np.float32), maps
            return
        spectra = stacked(shapes + 0j)
        terms = [(term, fits(band, 1, degree - 1, phases)[0]) for term, degree in enumerate(rows) if degree]
        found = [np.einsum("pdtf,kf->kpdt", fit, spectra[:, term]) for term, fit in terms]
        whole = np.concatenate(found, axis=2).ravel()
        self._tables = deposit.aligned(len(whole))
        self._tables[:] = whole

    def in_beam(self, position: np.ndarray) -> np.ndarray:
        """Which of the scatterers at `position` (n, 3), m, are within the record and the beam: (n,), bool.

        All others together add no more than :data:`~echotruth.imaging.rf.elevation.LEFT_OUT` says.
        """
        inside = np.linalg.norm(position, axis=1) <= self.reach
        if self._lens:
            inside[inside] = self._lens.in_beam(position[inside])
        return inside

    def _traces(self, elements: np.ndarray, position: np.ndarray, amplitude: np.ndarray) -> np.ndarray:
        """Deposited echoes of pairs of some elements, before window and pulse are accounted for: (pairs, samples)."""
        traces = np.zeros((len(elements) * (len(elements) + 1) // 2, self.samples), np.float32)
        reach = np.linalg.norm(position, axis=1)
        # Neighbours in range share the part of the traces that is at hand.
        order = np.argsort(reach, kind="stable")
        parts = self._lens.parts(reach[order]) if self._lens else np.ones(len(order), int)
        for number in np.unique(parts):
            alike = order[parts == number]
            self._add(traces, elements, position[alike], amplitude[alike], int(number))
        return traces

    def _add(self, traces: np.ndarray, elements: np.ndarray, position: np.ndarray, amplitude: np.ndarray, parts: int):
        """Add the echoes of scatterers that so many parts of the array look up apart, a block at a time."""
        scheme = NEAR if parts > 1 else self._scheme
        size, lens = sum(deposit.ROWS[scheme]) * TAPS, self._lens is not None
        first, kinds = bounds(len(self.centres), parts), self._kind(position)
        part_of, limits = np.searchsorted(first, elements, "right") - 1, np.searchsorted(elements, first)
        source = _LensKernels(self, position, kinds, parts) if lens else _PlaneKernels(self, kinds, size)
        width = padded(len(elements), deposit.LANES)
        time, (weight, colour, bend) = np.zeros((BLOCK, width), np.int32), np.zeros((3, BLOCK, width), np.float32)
        array = self.centres[elements], part_of, self._scales, self._directivity
        for start in range(0, len(position), BLOCK):
            part = slice(start, min(start + BLOCK, len(position)))
            lean, entries, tables = source(part)
            terms = time, weight, colour, bend
            deposit.one_way(position[part], *array, self._tilts[kinds[part]], lean, *terms)
            deposit.add_echoes(traces, *terms, amplitude[part], entries, tables, size, limits, lens, (0,) * scheme)

    @property
    def accurate_from(self) -> float:
        """Range from which on the error is that of the lens, m; 0 without one."""
        return self._lens.accurate_from if self._lens else 0.0

    def _kind(self, position: np.ndarray) -> np.ndarray:
        """Which of the angles from the centre of the array is nearest, shape (n,)."""
        sine = np.abs(position[:, 0]) / np.linalg.norm(position, axis=1)
        return np.rint(sine * (directivity.KINDS - 1)).astype(np.int64)

    def __call__(self, position: np.ndarray, amplitude: np.ndarray) -> np.ndarray:
        """Spectra of the echoes of all pairs at `frequency`.

        Parameters
        ----------
        position : ndarray of shape (scatterers, 3), m
        amplitude : ndarray of shape (scatterers,)

        Returns
        -------
        ndarray of shape (bins, elements, elements), complex64
            Symmetric in the elements. Units: amplitude / m^2 / sample.
        """
        inside = self.in_beam(position)
        position, amplitude = position[inside], amplitude[inside].astype(np.float32)
        numbers = self._clusters.numbers(position)
        clusters, spectra = [], []
        for number in np.unique(numbers):
            own, cluster = numbers == number, self._clusters[number]
            clusters.append(cluster)
            spectra.append(self._filtered(self._traces(cluster.elements, position[own], amplitude[own])))
        if not clusters:
            return np.zeros((len(self.frequency), *[len(self.centres)] * 2), np.complex64)
        return Spread(clusters, self.frequency)(np.concatenate(spectra, axis=1))

    def _filtered(self, traces: np.ndarray) -> np.ndarray:
        """Spectra (bins, pairs) of traces (pairs, samples)."""
        band, threads = slice(self.first, self.first + len(self.frequency)), numba.get_num_threads()
        found = np.zeros((len(self.frequency), len(traces)), np.complex64)
        for start in range(0, len(traces), 64):
            some = traces[start : start + 64]
            for course, response in zip(self._courses, self._responses, strict=True):
                spectra = fft.rfft(some * course, axis=1, workers=threads)[:, band] * response
                found[:, start : start + 64] += spectra.T
        return found


class _PlaneKernels:
    """Tables of echoes in the plane: one for each angle from the centre of the array, whatever the scatterer."""

    def __init__(self, full: FullMatrix, kinds: np.ndarray, size: int) -> None:
        self._tables = full._tables
        self._base = kinds * size * _phases(full._scheme)

    def __call__(self, part: slice) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What :func:`deposit.one_way` and :func:`deposit.add_echoes` take for some of the scatterers."""
        base = self._base[part]
        entries = np.zeros((len(base), 5), int)
        entries[:, 0], entries[:, 1], entries[:, 2] = np.arange(len(base)), base, offsets(1)[0]
        return np.empty((0, 1, 4)), entries, self._tables


class _LensKernels:
    """Tables of echoes under the lens, made for every scatterer.

    Parameters
    ----------
    full : FullMatrix
    position : ndarray of shape (n, 3), m
    kinds : ndarray of shape (n,)
        Angle from the centre of the array of each.
    parts : int
        Parts of the array that look them up apart.
    """

    def __init__(self, full: FullMatrix, position: np.ndarray, kinds: np.ndarray, parts: int) -> None:
        self._full, self._kinds = full, kinds
        self._places, self._lean = full._lens.lean(position, full.sound_speed, parts)
        sender, listener = np.triu_indices(parts)
        blocks = full._lens.blocks_at(self._places)
        owner, block, self._first = _entries(np.maximum(blocks[:, sender], blocks[:, listener]).ravel())
        self._owner, pair = np.divmod(owner, len(sender))
        self._made = np.stack([self._owner, block, sender[pair], listener[pair]], axis=1)
        starts = np.searchsorted(self._owner, np.arange(0, len(position) + BLOCK, BLOCK))
        scheme = NEAR if parts > 1 else full._scheme
        rows = zip(deposit.ROWS[scheme], SPECTRA, SHAPES, strict=True)
        self._terms = np.array([(term, count, *which) for term, (count, *which) in enumerate(rows) if count])
        rows = _phases(scheme), sum(deposit.ROWS[scheme])
        self._tables = deposit.aligned(int(np.diff(starts).max(initial=0)), *rows, TAPS)
        self._base = np.arange(len(self._tables)) * np.prod(rows) * TAPS

    def __call__(self, part: slice) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What :func:`deposit.one_way` and :func:`deposit.add_echoes` take for some of the scatterers."""
        full, which = self._full, slice(*np.searchsorted(self._owner, [part.start, part.stop]))
        made = self._made[which] - [part.start, 0, 0, 0]
        tables = self._tables[: len(made)]
        groups = together(made[:, 1])
        scatterers = self._places[part], self._kinds[part]
        mould(*scatterers, full._moulds, self._terms, made, groups, tables)
        entries = np.column_stack([made[:, 0], self._base[: len(made)], self._first[which], made[:, 2:]])
        return self._lean[part], entries, tables.ravel()


def _phases(scheme: int) -> int:
    return 1 << deposit.PHASE_BITS[scheme]


def _loss(p, frequency: np.ndarray) -> np.ndarray:
    """Rate at which an echo at these frequencies fades faster than at the centre frequency, 1/s."""
    return p.attenuation * (frequency - p.frequency) * p.sound_speed


def _band(probe: Probe, grid: Grid, low: float, high: float) -> Band:
    node, share = np.polynomial.legendre.leggauss(NODES)
    frequency = (low + high) / 2 + node * (high - low) / 2
    energy = share * pulse_spectrum(probe, frequency) ** 2
    return Band(frequency, energy / energy.sum(), grid, _loss(probe.si(), frequency))


def _maps(band: Band, degree: int, phases: int) -> np.ndarray:
    """Maps to the polynomials of all blocks, shape (blocks, 2 NODES, phases (degree + 1) TAPS), float32."""
    maps = np.concatenate([fits(band, blocks, degree, phases) for blocks in range(1, MOST_BLOCKS + 1)])
    return np.ascontiguousarray(np.moveaxis(maps, -1, 1).reshape(len(maps), 2 * NODES, -1), np.float32)


def _entries(blocks: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Scatterer, map and first sample of every block of samples, each (entries,)."""
    owner = np.repeat(np.arange(len(blocks)), blocks)
    within = np.arange(len(owner)) - np.repeat(np.cumsum(blocks) - blocks, blocks)
    count = blocks[owner].astype(np.int64)
    return owner, count * (count - 1) // 2 + within, within * TAPS - (count * TAPS // 2 - 1)
