"""How alike our images and a real clip are: grey levels by region, and the grain of the wall.

    python benchmarks/realism.py --clip color3d_jpeg_baseline.dcm

The real clip is that of the package pydicom-data (MIT), an apical view of a human heart, 120 frames 33.3 ms apart, of
0.51 mm a pixel; reading it needs pydicom. In it the wall was drawn by hand (apical_wall.csv); in ours it is known.
Without --clip its numbers are those of the last report. --cache keeps the beats of the hearts, which take minutes to
solve. Lengths are those of a human heart; in a mouse they are 12.5 times as short.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from report import table
from scipy.ndimage import distance_transform_edt, gaussian_filter, label, map_coordinates
from skimage.feature import match_template
from skimage.morphology import convex_hull_image

import echotruth as et
from echotruth.config import Config
from echotruth.heart import Heart
from echotruth.imaging.bmode import bmode_clip, clip_gain, pixel_centres
from echotruth.imaging.sequence import Sequence
from echotruth.imaging.truth import wall_mask
from echotruth.imaging.view import Plane, before_probe
from echotruth.units import deg

HERE = Path(__file__).parent
CYCLE, FRAME_ED, ORIGIN = (6, 33), 22, (31, 84)
"""Of the real clip: frames from end-systole to the next; end-diastole; row and column where the wall's (0, 0) is."""
SECTOR, PIXEL_MM = (17, 339, 42.0, 40, 380), 0.5105
"""Of the real clip: row and column of the tip of the sector (px), half its angle (deg), first and last range (px); and
the side of a pixel."""
FRAMES, SHOWN = 24, (0, 1, 4, 5, 8, 9, 14, 15, 19, 20)
"""Frames of a cycle of ours, and those that are imaged, in pairs."""
VIEW, SIZE, BLACK = "four_chamber", 512, 4
"""The view of ours, its pixels along a side, and the grey level up to which a pixel is black."""
MESH = {"circumferential_elements": 12, "longitudinal_elements": 8, "transmural_elements": 2}
CLIPS = {
    "human": ("human", "human"),
    "human, ideal": ("human", "none"),
    "mouse": ("mouse", "mouse"),
    "mouse, ideal": ("mouse", "none"),
}
"""Name of ours -> `geometry.preset` and `realism.preset`."""
FITTED = (
    "behind the atria",
    "cavity",
    "near field",
    "septum",
    "lateral wall",
    "neither wall nor cavity, not black",
    "sides of the far half",
)
"""Rows to which the presets were fitted, in the human heart at end-diastole and end-systole."""
SEARCH, WINDOW_MM = 8, 12.0
"""How far a window is sought to every side in the next frame, px, and its side."""

Masks = NDArray[np.bool_]
Row = dict[str, float]


@dataclass(frozen=True)
class Picture:
    """A frame of which the wall is known; lengths are of a human heart.

    Attributes
    ----------
    image, following : ndarray of shape (axial, lateral), uint8
        The frame, and one that follows it by 1/24 to 1/27 of a cycle.
    wall, scan : ndarray of shape (axial, lateral), bool
        Pixels of the wall, and those within the sector.
    tip : tuple of float
        Row and column of the tip of the sector, px.
    mm : float
        Side of a pixel.
    """

    image: NDArray[np.uint8]
    following: NDArray[np.uint8]
    wall: Masks
    scan: Masks
    tip: tuple[float, float]
    mm: float

    @cached_property
    def grid(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Rows and columns of the pixels."""
        rows, columns = np.indices(self.image.shape)
        return rows, columns

    @cached_property
    def reach(self) -> NDArray[np.float64]:
        """Range of the pixels, mm."""
        return np.hypot(self.grid[0] - self.tip[0], self.grid[1] - self.tip[1]) * self.mm

    @cached_property
    def angle(self) -> NDArray[np.float64]:
        """Angle of the pixels from the middle of the sector, deg."""
        return np.degrees(np.arctan2(self.grid[1] - self.tip[1], self.grid[0] - self.tip[0]))

    @cached_property
    def cavity(self) -> Masks:
        """What the wall encloses, up to the straight line across its base."""
        parts, _ = label(convex_hull_image(self.wall) & ~self.wall)
        return parts == np.argmax(np.bincount(parts.ravel())[1:]) + 1

    @cached_property
    def sides(self) -> tuple[Masks, Masks]:
        """Septum and lateral wall at the heights of the cavity, but for its ends."""
        low, high = np.percentile(self.grid[0][self.cavity], (20, 90))
        beside = self.wall & (self.grid[0] > low) & (self.grid[0] < high)
        left = self.grid[1] < self.grid[1][self.cavity].mean()
        return beside & left, beside & ~left

    def grey(self, where: Masks) -> float:
        """Mean grey level of pixels in the scan."""
        return float(self.image[where & self.scan].mean()) if (where & self.scan).any() else np.nan


def measures(picture: Picture) -> Row:
    """All rows of a frame."""
    reach, angle, cavity = picture.reach, np.abs(picture.angle), picture.image[picture.cavity].astype(float)
    septum, lateral = picture.sides
    outside = picture.scan & ~picture.wall & ~picture.cavity
    return {
        "far field, 130-175 mm": picture.grey((reach > 130) & (reach < 175)),
        "behind the atria": picture.grey((reach > 155) & (reach < 175) & (angle < 14)),
        "sides of the far half": picture.grey((reach > 100) & (angle > 28)),
        "near field": picture.grey((reach > 15) & (reach < 40)),
        "cavity": float(cavity.mean()),
        "cavity, deviation over mean": float(cavity.std() / cavity.mean()),
        "septum": picture.grey(septum),
        "lateral wall": picture.grey(lateral),
        "wall": picture.grey(picture.wall),
        "neither wall nor cavity, not black": float((picture.image[outside] > BLACK).mean()),
        "correlation with the mirror image": mirror_correlation(picture),
        "wall, likeness to the next frame": likeness(picture),
    } | grain(picture)


def mirror_correlation(picture: Picture) -> float:
    """Correlation of the image, smoothed by 3 mm, with its mirror image about the middle of the sector."""
    (rows, columns), tip = picture.grid, picture.tip[1]
    smooth = gaussian_filter(np.where(picture.scan, picture.image, 0).astype(float), 3 / picture.mm)
    mirrored = map_coordinates(smooth, [rows, 2 * tip - columns], order=1)
    both = picture.scan & (map_coordinates(picture.scan.astype(float), [rows, 2 * tip - columns], order=0) > 0.5)
    return float(np.corrcoef(smooth[both], mirrored[both])[0, 1])


def likeness(picture: Picture) -> float:
    """Mean peak correlation of windows about the wall with those near them in the next frame."""
    side = round(WINDOW_MM / picture.mm)
    deep = np.argwhere(distance_transform_edt(picture.wall) > side / 4)
    middles = deep[:: max(len(deep) // 20, 1)]
    return float(np.nanmean([_peak(picture, middle, side) for middle in middles]))


def _peak(picture: Picture, middle: NDArray[np.int64], side: int) -> float:
    """Largest correlation of a window with those near it in the next frame."""
    row, column = np.maximum(middle - side // 2, SEARCH)
    window = picture.image[row : row + side, column : column + side].astype(float)
    near = picture.following[row - SEARCH : row + side + SEARCH, column - SEARCH : column + side + SEARCH]
    fits = np.all(np.array(near.shape) >= window.shape) and window.std() > 0
    return float(match_template(near.astype(float), window).max()) if fits else np.nan


def grain(picture: Picture) -> Row:
    """Widths of speckle in the wall along and across the beam: full ones at half the autocorrelation of grey levels."""
    reach, angle = picture.reach[picture.wall], np.radians(picture.angle[picture.wall])
    ranges, angles = np.arange(reach.min(), reach.max(), picture.mm), np.linspace(angle.min(), angle.max(), 256)
    along = np.outer(np.cos(angles), ranges), np.outer(np.sin(angles), ranges)
    grid = [picture.tip[axis] + along[axis] / picture.mm for axis in (0, 1)]
    inside = map_coordinates(picture.wall.astype(float), grid, order=1) > 0.99
    thickness = 4 * distance_transform_edt(picture.wall)[picture.wall].mean()
    weight = gaussian_filter(picture.wall.astype(float), thickness / 3)
    mean = gaussian_filter(np.where(picture.wall, picture.image, 0).astype(float), thickness / 3)
    value = map_coordinates(picture.image - mean / np.where(picture.wall, weight, 1), grid, order=1)
    axial = _width(value, inside, 1) * picture.mm
    lateral = _width(value, inside, 0) * (angles[1] - angles[0]) * float(ranges.mean())
    return {"grain along the beam, mm": axial, "grain across over along": lateral / axial}


def _width(value: NDArray[np.float64], inside: Masks, axis: int) -> float:
    """Full width at half maximum of the autocorrelation along an axis, samples, by linear interpolation."""
    value, inside = np.moveaxis(np.where(inside, value, 0), axis, 0), np.moveaxis(inside, axis, 0)
    before, power = 1.0, (value**2).sum() / max(inside.sum(), 1)
    for lag in range(1, len(value)):
        both = inside[lag:] & inside[:-lag]
        now = (value[lag:] * value[:-lag])[both].mean() / power if both.any() else 0.0
        if now < 0.5:
            return 2 * (lag - 1 + (before - 0.5) / (before - now))
        before = now
    return np.nan


def real_clip(file: Path) -> NDArray[np.uint8]:
    """Luminance of all frames (frame, row, column)."""
    from PIL import Image
    from pydicom import dcmread
    from pydicom.encaps import generate_frames

    data = dcmread(file)
    frames = generate_frames(data.PixelData, number_of_frames=int(data.NumberOfFrames))
    return np.stack([np.asarray(Image.open(BytesIO(frame)).convert("YCbCr"))[..., 0] for frame in frames])


def real_pictures(file: Path) -> Iterator[Picture]:
    """A cycle of the real clip. Frames that are there twice are followed by the first that differs."""
    frames = real_clip(file)
    shape, tip = frames.shape[1:], SECTOR[:2]
    for k in range(*CYCLE):
        following = next(frame for frame in frames[k + 1 :] if (frame != frames[k]).any())
        yield Picture(frames[k], following, drawn_wall(k).mask(shape), real_scan(shape), tip, PIXEL_MM)


def real_scan(shape: tuple[int, ...]) -> Masks:
    """Pixels of the real clip within its sector, without the writing beside it."""
    tip, middle, half, first, last = SECTOR
    rows, columns = np.indices(shape)
    reach, angle = np.hypot(rows - tip, columns - middle), np.degrees(np.arctan2(columns - middle, rows - tip))
    return (np.abs(angle) < half) & (reach > first) & (reach < last)


def drawn_wall(frame: int) -> et.Wall:
    """The wall of the real clip in a frame of the cycle: linear in time between those drawn, point by point."""
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


def our_pictures(config: Config, beating: Heart, plane: Plane) -> Iterator[Picture]:
    """Frames of a long-axis view of a heart."""
    sequence = Sequence(config, beating, plane, random)
    scanner, acquire = sequence.scanner, sequence.acquisition(sequence.scatterers())
    gain = clip_gain(config.probe, config.bmode, len(scanner.scan.angle), scanner.range, random("dropout"))
    lines = np.stack([scanner.beamform(acquire(frame)) for frame in SHOWN])
    images = bmode_clip(lines, scan=scanner.scan, range_=scanner.range, bmode=config.bmode, gain=gain)[SIZE]
    centres = pixel_centres(config.bmode, SIZE)
    axial, lateral = np.meshgrid(*centres, indexing="ij")
    scan = np.abs(np.arctan2(lateral, axial)) < 0.98 * (config.rf.sector_deg * deg) / 2
    mm = config.bmode.field_of_view_mm / SIZE * (1 if config.geometry.preset == "human" else 12.5)
    for index in range(0, len(SHOWN), 2):
        still = replace(beating, displacement=beating.displacement[[SHOWN[index]]])
        wall = wall_mask(still, plane, *centres).reshape(SIZE, SIZE)
        yield Picture(images[index], images[index + 1], wall, scan, (-0.5, SIZE / 2 - 0.5), mm)


def solved(config: Config, file: Path) -> Heart:
    """A beating heart, solved where the file is not there."""
    if not file.exists():
        from echotruth.mechanics.beat import beat

        file.parent.mkdir(parents=True, exist_ok=True)
        result = beat(config)
        np.savez(file, **{f"{group}/{name}": value for group, of in result.items() for name, value in of.items()})
    with np.load(file) as stored:
        arrays: dict[str, dict[str, Any]] = {}
        for name in stored.files:
            arrays.setdefault(name.split("/")[0], {})[name.split("/")[1]] = stored[name]
    return Heart.of(arrays, config)


def random(name: str) -> np.random.Generator:
    """A generator for every name."""
    return np.random.default_rng(np.frombuffer(sha256(name.encode()).digest(), np.uint32))


def summary(rows: list[Row], ed: int) -> dict[str, list[float | None]]:
    """Least, mean and largest value of each row over the frames, or None; the wall also over that at end-diastole."""
    found = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    found["wall, over that at end-diastole"] = found["wall"] / found["wall"][ed]
    return {
        name: [float(f(values)) if np.isfinite(values).all() else None for f in (np.min, np.mean, np.max)]
        for name, values in found.items()
    }


def report(results: dict[str, dict[str, list[float | None]]]) -> str:
    """The page."""
    real, ours = results["real"], {name: each for name, each in results.items() if name != "real"}
    within = {name: {row: _within(each[row][1], real[row]) for row in real} for name, each in ours.items()}
    rows = []
    for row, (low, mean, high) in real.items():
        cells = [_shown(each[row][1]) + ("" if within[name][row] else " (outside)") for name, each in ours.items()]
        fitted = "fitted" if row in FITTED else ""
        rows.append([row, _shown(mean), f"{_shown(low)} to {_shown(high)}", *cells, fitted])
    counts = []
    for name, rows_within in within.items():
        free = [value for row, value in rows_within.items() if row not in FITTED]
        all_rows = f"{sum(rows_within.values())} of {len(real)} rows"
        counts.append(f"- {name}: {all_rows}, {sum(free)} of {len(free)} not fitted")
    note = (
        "Means over frames of a cycle of a four-chamber view; the range is that over the frames of the real clip. Grey"
        " levels are of 255. It is one recording of one person: what lies outside need not be wrong. The image of a"
        " mouse ends before the roof of its atria. `benchmarks/realism.py` says how."
    )
    head = ["", "real", "its frames", *ours, ""]
    lines = ["# How alike ours and a real clip are", "", note, "", *table(head, rows), "", "Within the range:", ""]
    return "\n".join([*lines, *counts, ""])


def _within(value: float | None, limits: list[float | None]) -> bool:
    """Whether a mean is there and lies within the least and the largest value of the real clip."""
    low, _, high = limits
    return value is not None and low is not None and high is not None and low <= value <= high


def _shown(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"


def main() -> None:
    """Measure and write results/realism.json and .md."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--clip", type=Path)
    parser.add_argument("--cache", type=Path, default=HERE / ".cache")
    given = parser.parse_args()
    file = HERE / "results/realism.json"
    results = {} if given.clip else {"real": json.loads(file.read_text())["real"]}
    if given.clip:
        results["real"] = summary([measures(each) for each in real_pictures(given.clip)], FRAME_ED - CYCLE[0])
    for name, (species, acoustics) in CLIPS.items():
        geometry, realism = MESH | {"preset": species}, {"preset": acoustics}
        config = et.configure(geometry=geometry, realism=realism, loop={"frames": FRAMES}, views={"preset": "echo"})
        heart, plane = before_probe(solved(config, given.cache / f"{species}.npz"), config, VIEW)
        rows = [measures(each) for each in our_pictures(config, heart, plane)]
        results[name] = summary(rows, 0)
        print(name, {row: _shown(values[1]) for row, values in results[name].items()}, flush=True)
    file.write_text(json.dumps(results, indent=1) + "\n")
    file.with_suffix(".md").write_text(report(results))


if __name__ == "__main__":
    main()
