"""Records the RF: lines, and channel data from which any transmit can be made.

A channel is the RF of one element after one element has sent alone. All of them hold what any focused, plane or
diverging transmit would have recorded: the sum of its elements' channels, delayed and weighted. They take less room
than 64 focused transmits.
"""

from math import ceil, log2
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from echotruth.config import Config
from echotruth.imaging.beamforming.aperture import sent_apodization
from echotruth.imaging.beamforming.scanner import Scanner
from echotruth.imaging.beamforming.transmit import TRANSMIT_SEQUENCES
from echotruth.imaging.rf.full_matrix import PLANE_ACCURACY, FullMatrix
from echotruth.units import MHz, dB_per_cm_MHz, mm, um

LENS_ACCURACY = 0.01
"""Relative error (L2) of the RF under a lens; see docs/conventions.md."""

MIN_SAMPLES_PER_PERIOD = 2.1
"""Minimum samples per period of the highest frequency; finer records are decimated."""

Arrays = dict[str, NDArray[Any]]


class RfRecorder:
    """Records the frames of one view.

    Parameters
    ----------
    config : Config
    scanner : Scanner
    frames : int

    Attributes
    ----------
    arrays : dict of ndarray
        Channels, if `rf.keep` has them, and how the RF was made: coordinates and transmitted waves.
    settings : dict
        All else that is needed to focus it again, in SI units.
    """

    def __init__(self, config: Config, scanner: Scanner, frames: int) -> None:
        self._matrix = scanner.matrix
        self.arrays, self.settings = metadata(config, scanner)
        if "channels" in config.rf.keep:
            elements = len(scanner.matrix.centres)
            shape = (frames, elements, elements, decimated_samples(scanner.matrix))
            # Integers, because all frames stay in memory until the job writes them together.
            self.arrays |= {"channels": np.zeros(shape, np.int16), "channels_step": np.zeros(frames)}

    def add(self, frame: int, matrix: NDArray[np.complex64]) -> None:
        """Record the channels of a frame, from its full matrix (bins, receivers, transmitters)."""
        if "channels" in self.arrays:
            numbers, step = quantise(channels(self._matrix, matrix))
            self.arrays["channels"][frame], self.arrays["channels_step"][frame] = numbers, step


def sixteen_bit(lines: NDArray[np.complex64]) -> NDArray[np.complex64]:
    """Lines of any shape, rounded to 16 bits: both parts are multiples of a power of two, 2^15 of which hold them all.

    The bits below are zero, and so take next to no place once they are compressed.
    """
    largest = float(np.abs(lines.view(np.float32)).max(initial=0))
    step = np.float32(2.0 ** ceil(log2(largest / 2**15))) if largest else np.float32(1)
    return (np.rint(lines.view(np.float32) / step) * step + np.float32(0)).view(np.complex64)


def decimated_samples(full: FullMatrix) -> int:
    """Samples of a channel: those of the record, decimated by the largest integer factor that keeps its band."""
    coarsest = max(1, int(full.samples / MIN_SAMPLES_PER_PERIOD / (full.first_bin + len(full.frequency))))
    return full.samples // max(step for step in range(1, coarsest + 1) if full.samples % step == 0)


def channels(full: FullMatrix, matrix: NDArray[np.complex64]) -> NDArray[np.float32]:
    """RF of all pairs in time.

    Parameters
    ----------
    full : FullMatrix
        Its frequencies and samples.
    matrix : ndarray of shape (bins, receivers, transmitters)
        Spectra of a frame.

    Returns
    -------
    ndarray of shape (transmitters, receivers, samples)
        From time 0 on, when the element sends.
    """
    elements, samples = len(full.centres), decimated_samples(full)
    echoes = np.empty((elements, elements, samples), np.float32)
    spectra = np.zeros((elements, samples // 2 + 1), np.complex64)
    band = slice(full.first_bin, full.first_bin + len(full.frequency))
    for transmitter in range(elements):
        spectra[:, band] = matrix[:, :, transmitter].T
        echoes[transmitter] = fft.irfft(spectra, samples, axis=1)
    return echoes * np.float32(samples / full.samples)


def quantise(echoes: NDArray[np.float32]) -> tuple[NDArray[np.int16], float]:
    """Echoes (any shape) as 16-bit numbers, and the value of one step; the largest is 32767."""
    step = float(np.abs(echoes).max()) / 32767 or 1.0
    return np.rint(echoes / np.float32(step)).astype(np.int16), step


def metadata(config: Config, scanner: Scanner) -> tuple[Arrays, dict[str, Any]]:
    """Describe how the RF was made: all that is needed to focus it again.

    Parameters
    ----------
    config : Config
        Configuration of any case.
    scanner : Scanner
        Scanner of that configuration.

    Returns
    -------
    arrays, attributes : dict
        The group `rf` of the repository: coordinates and transmits, settings in SI units.
    """
    scan, matrix = scanner.scan, scanner.matrix
    waves = TRANSMIT_SEQUENCES[config.rf.transmit](config.probe, config.rf, scan)
    arrays = {f"transmit_{name}": getattr(waves, name) for name in ("delay", "weight", "origin", "t0_distance")}
    arrays |= {"line_angle": scan.angle, "line_origin": scan.line_origin, "range": scanner.range}
    arrays |= dict.fromkeys(("element", "transmitter", "receiver"), matrix.centres)
    sampling = matrix.sampling * decimated_samples(matrix) / matrix.samples
    arrays["sample"] = np.arange(decimated_samples(matrix)) / sampling
    settings = _settings(config) | {
        "sampling_frequency": float(sampling),
        "demodulation_frequency": scanner.frequency,
        "foci": waves.foci.tolist(),
    }
    return arrays, settings


def _settings(config: Config) -> dict[str, Any]:
    probe, rf = config.probe, config.rf
    return {
        "sound_speed": probe.sound_speed_m_per_s,
        "centre_frequency": probe.frequency_MHz * MHz,
        "bandwidth": probe.bandwidth,
        "element_width": probe.width_um * um,
        "element_height": probe.height_mm * mm,
        "elevation_focus": probe.elevation_focus_mm * mm,
        "attenuation": probe.attenuation_dB_per_cm_MHz * dB_per_cm_MHz,
        "transmit": rf.transmit,
        "scan": rf.scan,
        "apodization": rf.apodization,
        "transmit_apodization": sent_apodization(rf),
        "harmonic": rf.harmonic,
        "f_number": rf.f_number,
        "accuracy": LENS_ACCURACY if rf.elevation_beam else PLANE_ACCURACY,
    }
