"""Scan lines: the straight lines along which a frame is focused.

Coordinates are those of the probe: origin at the centre of the array, in the order lateral, axial.
"""

from dataclasses import dataclass

import numpy as np

from echotruth.config import Config, Probe, Rf
from echotruth.units import deg, mm, um


@dataclass(frozen=True)
class Sector:
    """Lines that fan out from the centre of the array.

    Attributes
    ----------
    angle : ndarray (lines,)
        From the axial axis, rad, evenly spaced; the smallest lateral coordinate first.
    """

    angle: np.ndarray

    @property
    def line_origin(self) -> np.ndarray:
        """Lateral coordinate at which each line leaves the array, shape (lines,), m."""
        return np.zeros(len(self.angle))

    def to_scan_coordinates(self, lateral: np.ndarray, axial: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Line index (fractional) and range (m) of points of any shape, m."""
        line = (np.arctan2(lateral, axial) - self.angle[0]) / (self.angle[1] - self.angle[0])
        return line, np.hypot(lateral, axial)


@dataclass(frozen=True)
class Linear:
    """Parallel lines, straight ahead.

    Attributes
    ----------
    line_origin : ndarray (lines,)
        Lateral coordinate at which each line leaves the array, m, evenly spaced; the smallest first.
    """

    line_origin: np.ndarray

    @property
    def angle(self) -> np.ndarray:
        """Angle of each line from the axial axis, shape (lines,), rad: all 0."""
        return np.zeros(len(self.line_origin))

    def to_scan_coordinates(self, lateral: np.ndarray, axial: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Line index (fractional) and range (m) of points of any shape, m."""
        line = (lateral - self.line_origin[0]) / (self.line_origin[1] - self.line_origin[0])
        line, range_ = np.broadcast_arrays(line, axial)
        return line, range_


Scan = Sector | Linear


def scan_lines(probe: Probe, rf: Rf) -> Scan:
    """Lines of a frame; those of a linear scan span the array, or `rf.width_mm` if that is set."""
    half = (rf.sector_deg * deg if rf.scan == "sector" else scan_width(probe, rf)) / 2
    values = np.linspace(-half, half, rf.lines)
    return Sector(values) if rf.scan == "sector" else Linear(values)


def scan_width(probe: Probe, rf: Rf) -> float:
    """Distance between the outermost lines of a linear scan, m."""
    length = probe.elements * (probe.pitch_um * um)
    width = rf.width_mm * mm if rf.width_mm else length
    if width > length * (1 + 1e-9):
        raise ValueError(f"Lines over {1e3 * width:g} mm need a longer array: this one measures {1e3 * length:g} mm.")
    return width


def sample_positions(scan: Scan, range_: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lateral and axial coordinates (lines, ranges), m, of the samples of all lines at ranges (ranges,), m."""
    lateral = scan.line_origin[:, None] + np.sin(scan.angle)[:, None] * range_
    return lateral, np.cos(scan.angle)[:, None] * range_


def voxel_centres(config: Config) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Axial, elevation and lateral coordinates of the voxels of a volume, each of shape (n,), m."""
    steps = zip(config.volume.size, config.volume.voxel_mm, strict=True)
    axial, elevation, lateral = ((np.arange(count) - (count - 1) / 2) * (step * mm) for count, step in steps)
    return axial + config.rf.focus_mm * mm, elevation, lateral
