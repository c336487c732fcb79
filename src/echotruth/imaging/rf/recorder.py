"""What is kept of the RF: lines, and channel data from which any transmit can be made.

A channel is the RF of one element after one element has sent alone. All of them hold what any focused, plane or
diverging transmit would have recorded: the sum of its elements' channels, delayed and weighted. They take less room
than 64 focused transmits.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from echotruth.config import Config
from echotruth.imaging.beamforming.scanner import Scanner
from echotruth.imaging.beamforming.transmit import KINDS
from echotruth.imaging.rf.full_matrix import FullMatrix

LENS_ACCURACY = 0.015
"""Relative error (L2) of the RF under a lens, from the range on that the lens tells; see docs/conventions.md."""

PER_PERIOD = 2.1
"""Samples kept per period of the highest frequency, at least; a record that is finer is thinned."""

Arrays = dict[str, NDArray[Any]]


class Kept:
    """What is kept of the frames of one view.

    Parameters
    ----------
    keep : list of str
        As `rf.keep`.
    matrix : FullMatrix
    frames : int
    """

    def __init__(self, keep: list[str], matrix: FullMatrix, frames: int) -> None:
        elements = len(matrix.centres)
        self._matrix, self._lines, self.arrays = matrix, "lines" in keep, Arrays()
        if "channels" in keep:
            # Whole numbers, for all frames lie in memory until the job writes them at once.
            self.arrays["channels"] = np.zeros((frames, elements, elements, samples_kept(matrix)), np.int16)
            self.arrays["channels_step"] = np.zeros(frames)

    def add(self, frame: int, matrix: NDArray[np.complex64]) -> None:
        """Keep the channels of a frame, of its full matrix (bins, receivers, transmitters)."""
        if "channels" in self.arrays:
            kept, step = digitised(channels(self._matrix, matrix))
            self.arrays["channels"][frame], self.arrays["channels_step"][frame] = kept, step

    def finish(self, lines: NDArray[np.complex64]) -> Arrays:
        """All arrays kept, with the lines (frames, lines, ranges) if they are."""
        return ({"lines": lines} if self._lines else {}) | self.arrays


def samples_kept(full: FullMatrix) -> int:
    """Samples of a channel: all of the record, or every second one or third ... where they hold its band."""
    most = max(1, int(full.samples / PER_PERIOD / (full.first + len(full.frequency))))
    return full.samples // max(step for step in range(1, most + 1) if full.samples % step == 0)


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
    elements, samples = len(full.centres), samples_kept(full)
    found = np.empty((elements, elements, samples), np.float32)
    spectra = np.zeros((elements, samples // 2 + 1), np.complex64)
    band = slice(full.first, full.first + len(full.frequency))
    for transmitter in range(elements):
        spectra[:, band] = matrix[:, :, transmitter].T
        found[transmitter] = fft.irfft(spectra, samples, axis=1)
    return found * np.float32(samples / full.samples)


def digitised(echoes: NDArray[np.float32]) -> tuple[NDArray[np.int16], float]:
    """Echoes (any shape) as 16-bit numbers, and the value of one step; the largest is 32767."""
    step = float(np.abs(echoes).max()) / 32767 or 1.0
    return np.rint(echoes / np.float32(step)).astype(np.int16), step


def described(config: Config, scanner: Scanner) -> tuple[Arrays, dict[str, int], dict[str, Any]]:
    """How the RF that is kept was made: all that is needed to focus it again.

    Parameters
    ----------
    config : Config
        Of any case.
    scanner : Scanner
        Of that.

    Returns
    -------
    arrays, sizes, attributes : dict
        Of the group `rf` in the repository: values of coordinates and transmits, lengths of dimensions, settings in
        SI units.
    """
    waves, scan, matrix = KINDS[config.rf.transmit](config.probe, config.rf, scanner.scan), scanner.scan, scanner.matrix
    arrays = {f"transmit_{name}": getattr(waves, name) for name in ("delay", "weight", "origin", "lead")}
    arrays |= {"line_angle": scan.angle, "line_foot": scan.foot, "range": scanner.range}
    arrays |= dict.fromkeys(("element", "transmitter", "receiver"), matrix.centres)
    sampling = matrix.sampling * samples_kept(matrix) / matrix.samples
    arrays["sample"] = np.arange(samples_kept(matrix)) / sampling
    sizes = {"line": len(scan.angle), "transmit": len(waves.delay)}
    return (
        arrays,
        sizes,
        _settings(config)
        | {
            "sampling_frequency": float(sampling),
            "demodulation_frequency": scanner.frequency,
            "foci": waves.foci.tolist(),
            "accuracy_from": matrix.accurate_from,
        },
    )


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
        "accuracy": LENS_ACCURACY if rf.elevation else rf.accuracy,
    }
