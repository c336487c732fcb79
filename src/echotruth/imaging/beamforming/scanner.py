"""The scanner: from scatterers to the lines of a frame."""

import numpy as np

from echotruth.config import Probe, Rf
from echotruth.imaging.beamforming.aperture import Aperture
from echotruth.imaging.beamforming.gate import echo_time_range
from echotruth.imaging.beamforming.receive import ReceiveFocus
from echotruth.imaging.beamforming.resampling import line_resampling, range_resampling
from echotruth.imaging.beamforming.scan import Scan, sample_positions, scan_lines
from echotruth.imaging.beamforming.synthesis import TransmitSynthesis, channel_sampling
from echotruth.imaging.beamforming.transmit import TRANSMIT_SEQUENCES, Zone
from echotruth.imaging.rf.full_matrix import FullMatrix
from echotruth.units import MHz

__all__ = ["Scanner", "validate_scatterers"]


class Scanner:
    """A probe that scans a frame; delays and phases are computed once for all frames.

    The scatterers are at rest during a frame. There is no multiple scattering.

    Memory for all frames: 48 bytes per sample of the lines, up to twice that with focal zones, and half a byte per
    frequency, element and transmit: 60 MB for the default array. A frame takes another 30 MB beside its matrix.

    Parameters
    ----------
    probe, rf
        The array, and its lines and transmits.
    depth
        Greatest range, m.

    Attributes
    ----------
    scan : Scan
        The lines.
    range : ndarray (ranges,)
        Distance of the samples from the origin of their line, m; the two-way path of a step takes one RF sample.
    frequency : float
        Frequency at which the lines are demodulated, Hz.
    matrix : FullMatrix
        The echoes between all pairs.

    Examples
    --------
    >>> import echotruth as et
    >>> import numpy as np
    >>> scanner = et.Scanner(et.Probe(elements=32), et.Rf(lines=17, focal_zones=1), depth=8e-3)
    >>> lines = scanner.lines(np.array([[0.0, 6.5e-3, 0.0]]), np.ones(1))  # lateral, axial, elevation, m
    >>> brightest = np.abs(lines[8]).argmax()  # the middle line looks straight ahead
    >>> bool(abs(scanner.range[brightest] - 6.5e-3) < 20e-6)
    True
    """

    def __init__(self, probe: Probe, rf: Rf, depth: float):
        speed = probe.sound_speed_m_per_s
        if not np.isfinite(depth) or depth < 20 * speed / (probe.frequency_MHz * MHz):
            raise ValueError(f"The depth is {depth:g} m; it must be at least twenty wavelengths.")
        self.scan, self.range, imaged = scan_lines(probe, rf), sample_ranges(probe, depth), rf
        transmits = TRANSMIT_SEQUENCES[rf.transmit](probe, rf, self.scan)
        self._over_range = range_resampling(probe, self.range)
        self._over_lines = line_resampling(probe, rf, self.scan, transmits, self.range[-1])
        rf = rf.model_copy(update={"lines": len(self._over_lines.samples)})
        sampled, range_ = scan_lines(probe, rf), self._over_range.samples
        zones = TRANSMIT_SEQUENCES[rf.transmit](probe, rf, sampled).zones(range_)
        latest = max(np.abs(zone.transmits.delay).max() for zone in zones)
        self.matrix = full_matrix(probe, imaged, depth, latest)
        self._sampling = channel_sampling(self.matrix)
        self._zones = [_ZoneBeamformer(probe, rf, self.matrix, sampled, range_, zone) for zone in zones]
        self.frequency = self._zones[0].synthesis.frequency
        self._carrier = np.exp(-4j * np.pi * self.frequency / speed * range_).astype(np.complex64)

    @property
    def angle(self) -> np.ndarray:
        """Angles of the lines from the axial axis, shape (lines,), rad; the smallest lateral coordinate first."""
        return self.scan.angle

    def positions(self) -> np.ndarray:
        """Positions of the samples of all lines, (lines, ranges, 3), m."""
        lateral, axial = sample_positions(self.scan, self.range)
        return np.stack([lateral, axial, np.zeros_like(lateral)], axis=-1)

    def lines(self, position: np.ndarray, amplitude: np.ndarray, exponent: np.ndarray | float = 0.0) -> np.ndarray:
        """Lines of one frame.

        Parameters
        ----------
        position
            Scatterers in the frame of the probe (lateral, axial, elevation), shape (scatterers, 3), m.
        amplitude
            Their reflectivity at the centre frequency, shape (scatterers,), 1.
        exponent
            Power of the frequency that it follows, shape (scatterers,) or one for all; 0 for none.

        Returns
        -------
        Shape (lines, ranges), complex64, demodulated by exp(-2 pi i frequency 2 range / c): a scatterer that moves
        away by d turns the phase by -4 pi frequency d / c.
        """
        return self.beamform(self.matrix(*validate_scatterers(position, amplitude, exponent)))

    def beamform(self, matrix: np.ndarray) -> np.ndarray:
        """Lines (lines, ranges) of one frame, as :meth:`lines`, of its full matrix (bins, elements, elements)."""
        lines = np.zeros((len(self._over_lines.samples), len(self._carrier)), np.complex64)
        gates = [beamformer.synthesis.gate for beamformer in self._zones]
        echoes = self._sampling.to_time(matrix) if any(gates) else matrix
        # That of a long array takes hundreds of MB, which are free for the gates unless a caller keeps it.
        matrix = np.empty(0) if all(gates) else matrix
        for gate, beamformer in zip(gates, self._zones, strict=True):
            lines[:, beamformer.zone.samples] += beamformer(gate.spectra(echoes) if gate else matrix)
        lines *= self._carrier
        return self._over_range(self._over_lines(lines).T.copy()).T.copy()


def sample_ranges(probe: Probe, depth: float) -> np.ndarray:
    """Distances of the samples from the origin of their line up to a depth, m: (ranges,), m."""
    step = probe.sound_speed_m_per_s / (2 * (probe.sampling_MHz * MHz))
    return step * np.arange(1, int(depth / step) + 2)


def full_matrix(probe: Probe, rf: Rf, depth: float, latest: float = 0.0) -> FullMatrix:
    """The echoes from which lines of a depth, m, are made with delays of up to `latest`, s."""
    farthest = np.hypot(*sample_positions(scan_lines(probe, rf), sample_ranges(probe, depth))).max()
    return FullMatrix(probe, farthest, latest, rf.elevation_beam, rf.harmonic)


class _ZoneBeamformer:
    """Beamforming of the samples of the lines of a scan, at ranges (ranges,), m, that are in a focal zone."""

    def __init__(self, probe: Probe, rf: Rf, matrix: FullMatrix, scan: Scan, range_: np.ndarray, zone: Zone):
        self.zone, self._range = zone, range_[zone.samples]
        self._points = sample_positions(scan, self._range)
        time_range = echo_time_range(probe, zone, self._range, self._points) if len(zone.transmits.foci) else None
        self.synthesis = TransmitSynthesis(matrix, probe.frequency_MHz * MHz, zone.transmits, time_range)
        self._start_path = probe.sound_speed_m_per_s * self.synthesis.start
        self._receive = ReceiveFocus(
            Aperture(probe, rf),
            scan.line_origin,
            self._range,
            self._points,
            frequency=self.synthesis.carrier,
            sampling=self.synthesis.sampling,
            sound_speed=probe.sound_speed_m_per_s,
        )

    def __call__(self, matrix: np.ndarray) -> np.ndarray:
        """Lines (lines, ranges of the zone), complex64, before demodulation.

        The full matrix (bins, elements, elements) is that of the whole record, or of the gate of the zone.
        """
        transmits = self.zone.transmits
        lines = np.zeros(self._points[0].shape, np.complex64)
        for block, channels in self.synthesis(matrix):
            if len(transmits.foci):
                path = np.tile(self._range - self._start_path, (len(channels), 1))
                self._receive(lines, block.start, channels, np.arange(len(channels)), path)
                continue
            for number in range(block.start, block.stop):
                path = transmits.path_length(number, *self._points)
                self._receive(lines, 0, channels, np.full(len(lines), number - block.start), path)
        lines *= self.zone.blending
        return lines


def validate_scatterers(
    position: np.ndarray, amplitude: np.ndarray, exponent: np.ndarray | float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions, amplitudes and exponents as float64 arrays; raises a ValueError if they are invalid."""
    position = np.ascontiguousarray(position, np.float64)
    amplitude = np.ascontiguousarray(amplitude, np.float64)
    exponent = np.asarray(exponent, np.float64)
    if position.ndim != 2 or position.shape[1] != 3 or amplitude.shape != position.shape[:1]:
        raise ValueError(
            f"Scatterers need positions (n, 3) and amplitudes (n,); got {position.shape} and {amplitude.shape}."
        )
    if exponent.shape not in ((), amplitude.shape):
        raise ValueError(f"Scatterers need one exponent, or exponents {amplitude.shape}; got {exponent.shape}.")
    if not len(position):
        raise ValueError("There are no scatterers to image.")
    if not all(np.isfinite(values).all() for values in (position, amplitude, exponent)):
        raise ValueError("Positions, amplitudes and exponents of scatterers must be finite numbers.")
    if position[:, 1].min() <= 0:
        raise ValueError("Scatterers must lie in front of the array: their axial coordinate must be positive.")
    return position, amplitude, np.broadcast_to(exponent, amplitude.shape)
