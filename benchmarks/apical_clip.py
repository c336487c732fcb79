"""The real apical clip of the package pydicom-data (MIT), and its wall, which was drawn by hand (apical_wall.csv).

120 frames of a human heart, 33.3 ms apart, of 0.51 mm a pixel; reading them needs pydicom.
"""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

import echotruth as et

HERE = Path(__file__).parent
VIEW = "four_chamber"
CYCLE, FRAME_ED, ORIGIN = (6, 33), 22, (31, 84)
"""Frames from end-systole to the next; end-diastole; row and column where the wall's (0, 0) is."""
SECTOR, PIXEL_MM, INTERVAL = (17, 339, 42.0, 40, 380), 0.5105, 1 / 30
"""Row and column of the tip of the sector (px), half its angle (deg), first and last range (px); side of a pixel; and
seconds from frame to frame."""


def real_clip(file: Path) -> NDArray[np.uint8]:
    """Luminance of all frames (frame, row, column)."""
    from PIL import Image
    from pydicom import dcmread
    from pydicom.encaps import generate_frames

    data = dcmread(file)
    frames = generate_frames(data.PixelData, number_of_frames=int(data.NumberOfFrames))
    return np.stack([np.asarray(Image.open(BytesIO(frame)).convert("YCbCr"))[..., 0] for frame in frames])


def real_scan(shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Pixels of the clip within its sector, without the writing beside it."""
    tip, middle, half, first, last = SECTOR
    rows, columns = np.indices(shape)
    reach, angle = np.hypot(rows - tip, columns - middle), np.degrees(np.arctan2(columns - middle, rows - tip))
    return (np.abs(angle) < half) & (reach > first) & (reach < last)


def drawn_wall(frame: int) -> et.Wall:
    """The wall in a frame of the cycle: linear in time between those drawn, point by point."""
    points = pd.read_csv(HERE / "apical_wall.csv", comment="#")
    drawn = sorted(points["frame"].unique())
    times = [*drawn, drawn[0] + CYCLE[1] - CYCLE[0]]
    after = min(int(np.searchsorted(times, frame, side="right")), len(times) - 1)
    share = (frame - times[after - 1]) / (times[after] - times[after - 1])
    borders = []
    for part in ("endocardium", "epicardium"):
        before, then = (
            _resampled(points[(points["frame"] == drawn[k % len(drawn)]) & (points["part"] == part)])
            for k in (after - 1, after)
        )
        borders.append((1 - share) * before + share * then + ORIGIN[::-1])
    return et.Wall(*borders, VIEW)


def _resampled(points: pd.DataFrame, number: int = 100) -> NDArray[np.float64]:
    """Points (number, 2) at equal distances along a border."""
    line = points[["lateral_px", "axial_px"]].to_numpy(float)
    along = np.append(0, np.linalg.norm(np.diff(line, axis=0), axis=1).cumsum())
    return np.column_stack([np.interp(np.linspace(0, along[-1], number), along, line[:, k]) for k in (0, 1)])
