"""Ultrasound clips in DICOM: pixels of the two-dimensional region, its scale, the times of frames and R waves.

Attributes are those of DICOM PS3.3: US Region Calibration (C.8.5.5), Cine (C.7.6.5), Multi-frame (C.7.6.6) and
Cardiac Synchronization.
"""

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.echo.failure import FEWEST_FRAMES, EchoError, reading
from echotruth.echo.recording import Recording, grey
from echotruth.extras import optional

TWO_DIMENSIONAL, CENTIMETRES = 1, 3
"""Spatial format of a region that is an image, and unit of its directions (PS3.3 C.8.5.5.1)."""


def read(path: Path) -> Recording:
    """Read the largest two-dimensional region of a DICOM file.

    Parameters
    ----------
    path : Path

    Returns
    -------
    Recording

    Raises
    ------
    EchoError
        If pydicom is not installed, or the file holds no clip that it can decode.
    """
    pydicom = optional("pydicom", "clinical", EchoError, f"{path}: ")
    with reading(path, "no DICOM clip that can be decoded"):
        image = pydicom.dcmread(path)
        pixels = np.asarray(image.pixel_array)
    colours = int(getattr(image, "SamplesPerPixel", 1)) > 1
    if pixels.ndim != 3 + colours:
        raise EchoError(f"{path}: has 1 frame: a clip needs {FEWEST_FRAMES} or more")
    with reading(path, "a damaged DICOM clip: its region, scale or times cannot be read"):
        return _recording(image, pixels, path)  # values are decoded when they are asked for


def _recording(image: Any, pixels: NDArray[Any], path: Path) -> Recording:
    """The largest region of the pixels (frame, axial, lateral), or with colours last, with its scale and times."""
    if image.PhotometricInterpretation == "PALETTE COLOR":
        pixels = import_module("pydicom.pixels").apply_color_lut(pixels, image)
    region = _region(image)
    if region is not None:
        top, left = int(region.RegionLocationMinY0), int(region.RegionLocationMinX0)
        pixels = pixels[:, top : int(region.RegionLocationMaxY1) + 1, left : int(region.RegionLocationMaxX1) + 1]
    waves = np.atleast_1d(np.asarray(getattr(image, "RWaveTimeVector", []), float)) * 1e-3
    frames = grey(pixels, str(path))
    # MONOCHROME1 shows 0 as white.
    frames = 255 - frames if image.PhotometricInterpretation == "MONOCHROME1" else frames
    return Recording(frames, _spacing(image, region), _times(image, len(pixels)), waves)


def _region(image: Any) -> Any:
    """The largest two-dimensional region of an image, or None.

    One that goes beyond the image is that of an image which was made smaller since: neither its place nor its scale
    holds.
    """
    regions = [
        region
        for region in getattr(image, "SequenceOfUltrasoundRegions", [])
        if getattr(region, "RegionSpatialFormat", None) == TWO_DIMENSIONAL
        and int(region.RegionLocationMaxX1) < int(image.Columns)
        and int(region.RegionLocationMaxY1) < int(image.Rows)
    ]
    return max(regions, key=_area, default=None)


def _area(region: Any) -> int:
    height = int(region.RegionLocationMaxY1) - int(region.RegionLocationMinY0)
    return height * (int(region.RegionLocationMaxX1) - int(region.RegionLocationMinX0))


def _spacing(image: Any, region: Any) -> tuple[float, ...]:
    """Axial and lateral distance of pixel centres, m, or () where the file does not say."""
    if region is not None and getattr(region, "PhysicalUnitsXDirection", None) == CENTIMETRES:
        return abs(float(region.PhysicalDeltaY)) * 1e-2, abs(float(region.PhysicalDeltaX)) * 1e-2
    for name in ("PixelSpacing", "ImagerPixelSpacing"):
        if (given := getattr(image, name, None)) is not None:
            return float(given[0]) * 1e-3, float(given[1]) * 1e-3
    return ()


def _times(image: Any, frames: int) -> Floats:
    """Times of frames since the first, s, or none where the file does not say."""
    steps = np.atleast_1d(np.asarray(getattr(image, "FrameTimeVector", []), float)) * 1e-3
    if len(steps) == frames:
        return np.cumsum(steps) - steps[0]
    if float(getattr(image, "FrameTime", 0) or 0) > 0:
        return np.arange(frames, dtype=float) * float(image.FrameTime) * 1e-3
    for name in ("CineRate", "RecommendedDisplayFrameRate"):
        if float(getattr(image, name, 0) or 0) > 0:
            return np.arange(frames, dtype=float) / float(getattr(image, name))
    return np.empty(0)
