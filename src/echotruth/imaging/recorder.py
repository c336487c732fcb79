"""Records the RF: lines, and channel data from which any transmit can be made.

A channel is the RF of one element after one element has sent alone. All of them hold what any focused, plane or
diverging transmit would have recorded: the sum of its elements' channels, delayed and weighted. They take less room
than 64 focused transmits.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from echotruth.config import Config
from echotruth.imaging.beamforming.scanner import Scanner
from echotruth.imaging.beamforming.transmit import TRANSMIT_SEQUENCES
from echotruth.imaging.rf.full_matrix import PLANE_ACCURACY, FullMatrix

LENS_ACCURACY = 0.015
"""Relative error (L2) of the RF under a lens, from `FullMatrix.accurate_from` on; see docs/conventions.md."""

MIN_SAMPLES_PER_PERIOD = 2.1
"""Minimum samples per period of the highest frequency; finer records are decimated."""

Arrays = dict[str, NDArray[Any]]


class RfRecorder:
    """Records the frames of one view.

    Parameters
    ----------
    keep : list of str
        Value of `rf.keep`.
    matrix : FullMatrix
    frames : int
    """

    def __init__(self, keep: list[str], matrix: FullMatrix, frames: int) -> None:
        elements = len(matrix.centres)
        self._matrix, self._keep_lines, self._arrays = matrix, "lines" in keep, Arrays()
        if "channels" in keep:
            # Integers, because all frames stay in memory until the job writes them together.
            self._arrays["channels"] = np.zeros((frames, elements, elements, decimated_samples(matrix)), np.int16)
            self._arrays["channels_step"] = np.zeros(frames)

    def add(self, frame: int, matrix: NDArray[np.complex64]) -> None:
        """Record the channels of a frame, from its full matrix (bins, receivers, transmitters)."""
        if "channels" in self._arrays:
            numbers, step = quantise(channels(self._matrix, matrix))
            self._arrays["channels"][frame], self._arrays["channels_step"][frame] = numbers, step

    def finish(self, lines: NDArray[np.complex64]) -> Arrays:
        """All arrays that were recorded, with the lines (frames, lines, ranges) if they are to be kept."""
        return ({"lines": lines} if self._keep_lines else {}) | self._arrays


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


def metadata(config: Config, scanner: Scanner) -> tuple[Arrays, dict[str, int], dict[str, Any]]:
    """Describe how the RF was made: all that is needed to focus it again.

    Parameters
    ----------
    config : Config
        Configuration of any case.
    scanner : Scanner
        Scanner of that configuration.

    Returns
    -------
    arrays, sizes, attributes : dict
        The group `rf` of the repository: coordinates and transmits, lengths of dimensions, settings in SI units.
    """
    scan, matrix = scanner.scan, scanner.matrix
    waves = TRANSMIT_SEQUENCES[config.rf.transmit](config.probe, config.rf, scan)
    arrays = {f"transmit_{name}": getattr(waves, name) for name in ("delay", "weight", "origin", "t0_distance")}
    arrays |= {"line_angle": scan.angle, "line_origin": scan.line_origin, "range": scanner.range}
    arrays |= dict.fromkeys(("element", "transmitter", "receiver"), matrix.centres)
    sampling = matrix.sampling * decimated_samples(matrix) / matrix.samples
    arrays["sample"] = np.arange(decimated_samples(matrix)) / sampling
    sizes = {"line": len(scan.angle), "transmit": len(waves.delay)}
    settings = _settings(config) | {
        "sampling_frequency": float(sampling),
        "demodulation_frequency": scanner.frequency,
        "foci": waves.foci.tolist(),
        "accuracy_from": matrix.accurate_from,
    }
    return arrays, sizes, settings


def _settings(config: Config) -> dict[str, Any]:
    probe, rf = config.probe.si(), config.rf
    return {
        "sound_speed": probe.sound_speed,
        "centre_frequency": probe.frequency,
        "bandwidth": probe.bandwidth,
        "element_width": probe.width,
        "element_height": probe.height,
        "elevation_focus": probe.elevation_focus,
        "attenuation": probe.attenuation,
        "transmit": rf.transmit,
        "scan": rf.scan,
        "apodization": rf.apodization,
        "f_number": rf.f_number,
        "accuracy": LENS_ACCURACY if rf.elevation_beam else PLANE_ACCURACY,
    }
