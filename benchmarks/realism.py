"""How alike our images and real clips are: brightness, contrast, grain, and likeness from frame to frame.

    python benchmarks/realism.py --clips FOLDER --mice FOLDER

In a folder, every .mp4 twice as wide as high has the mask of the cavity in its right half; in one as wide as high the
cavity is not known. Of people they are the apical four-chamber views of the repository echonet/dynamic (docs/media,
which may not be passed on: numbers are committed, never pictures) and color3d_jpeg_baseline.dcm of the package
pydicom-data (apical_clip.py); of mice example/images/segmentation.mp4 of sunjaeyoon/echo_segmentation (MIT), and
dia.png and sys.png of pfizer-opensource/mouse-echo-neural-net (images, Apache-2.0), in which the outline of the cavity
is drawn in yellow. Without a folder its numbers are those of the last report. --cache keeps the beats of our hearts,
which take minutes to solve.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any

import apical_clip
import cv2
import numpy as np
from numpy.typing import NDArray
from report import table
from scipy.ndimage import binary_fill_holes, distance_transform_edt, gaussian_filter, map_coordinates

import echotruth as et
from echotruth.config import Config
from echotruth.config.merging import nested
from echotruth.heart import Heart
from echotruth.imaging.bmode import bmode_clip, clip_gain, pixel_centres
from echotruth.imaging.labels import TissueLabel
from echotruth.imaging.medium.tissue_images import TissueImages
from echotruth.imaging.sequence import Sequence
from echotruth.imaging.view import before_probe
from echotruth.loop.cycle import period

HERE = Path(__file__).parent
ECHONET, EXAMPLE, IMAGE_PX = (4, 61, 44.0, 110), (60, 291, 43.3, 480), 112
"""Row and column of the tip of the sector, half its angle (deg) and its depth (px), read by eye from the images of 112
px of echonet/dynamic, and from Example1.mp4."""
DEPTH_PX = 110
"""Depth to which all sectors are scaled, px, so that all are as coarse as those of echonet/dynamic."""
FRAMES, SHOWN = 24, (0, 1, 6, 7, 8, 9, 14, 15, 21)
"""Frames of a cycle of ours, and those that are imaged."""
DRAWS, SEED = 40, 2
"""Clips of which the acoustics are drawn, and their seed: ranges were chosen by those of other seeds."""
SIZE, BLACK = 256, 4
"""Pixels along a side of ours, and the grey level up to which a pixel is black."""
NEXT_S, FIFTH_S, MEASURED = 0.04, 0.2, 24
"""Time to the next frame and to the fifth, of a human beat in 24 frames, s; and frames of a real clip in a mean."""
MESH = {"circumferential_elements": 12, "longitudinal_elements": 8, "transmural_elements": 2}
OURS = {"human": ("realistic_human", "four_chamber"), "mouse": ("realistic", "mid")}
"""Species of ours -> configuration and view."""

Masks = NDArray[np.bool_]
Row = dict[str, float]


@dataclass(frozen=True)
class Clip:
    """Frames in which the cavity is known.

    Attributes
    ----------
    images : ndarray of shape (frame, row, column), uint8
    cavity : ndarray of shape (frame, row, column), bool, or None
        None where it is not known.
    sector : tuple of float, or None
        Row and column of its tip (px), half its angle (deg), and its depth (px); None if the image is a rectangle.
    time : ndarray of shape (frame,)
        Numbers of the frames.
    interval : float
        Time from a number to the next, s.
    """

    images: NDArray[np.uint8]
    cavity: Masks | None
    sector: tuple[float, float, float, float] | None
    time: NDArray[np.int64]
    interval: float

    def scaled(self) -> Clip:
        """The clip with a sector of DEPTH_PX."""
        assert self.sector is not None
        row, column, half, depth = self.sector
        scale = DEPTH_PX / depth
        size = tuple(round(side * scale) for side in self.images.shape[:0:-1])
        images = np.stack([cv2.resize(each, size, interpolation=cv2.INTER_AREA) for each in self.images])
        cavity = self.cavity
        if cavity is not None:
            resized = [cv2.resize(each.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST) for each in cavity]
            cavity = np.stack(resized) > 0
        tip = ((each + 0.5) * scale - 0.5 for each in (row, column))
        return Clip(images, cavity, (*tip, half, DEPTH_PX), self.time, self.interval)

    @cached_property
    def grid(self) -> NDArray[np.int64]:
        """Rows and columns of the pixels."""
        return np.indices(self.images.shape[1:])

    @cached_property
    def polar(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Range over depth, and angle over half of that of the sector, of the pixels."""
        assert self.sector is not None
        row, column, half, depth = self.sector
        rows, columns = self.grid[0] - row, self.grid[1] - column
        return np.hypot(rows, columns) / depth, np.degrees(np.arctan2(columns, rows)) / half

    @cached_property
    def scan(self) -> Masks:
        """Pixels of the sector, without its edges."""
        if self.sector is None:
            return np.ones(self.images.shape[1:], bool)
        reach, angle = self.polar
        return (np.abs(angle) < 0.97) & (reach > 0.03) & (reach < 0.98)

    @cached_property
    def beating(self) -> NDArray[np.int64]:
        """Frames in which the cavity is found: with at least a third of its usual area."""
        assert self.cavity is not None
        area = self.cavity.sum(axis=(1, 2))
        return np.flatnonzero(area > 0.3 * np.median(area))

    @property
    def ed_es(self) -> tuple[int, int]:
        """Frames of the largest and of the smallest cavity."""
        assert self.cavity is not None
        area = self.cavity[self.beating].sum(axis=(1, 2))
        return int(self.beating[area.argmax()]), int(self.beating[area.argmin()])

    def measured(self, frames: NDArray[np.int64]) -> NDArray[np.int64]:
        """Evenly spaced frames of those given, at most MEASURED or so."""
        return frames[:: max(1, len(frames) // MEASURED)]

    def inner(self, frame: int) -> Masks:
        """The cavity without its border."""
        assert self.cavity is not None
        return (distance_transform_edt(self.cavity[frame]) > 2) & self.scan

    def ring(self, frame: int) -> Masks:
        """The wall: a ring round the cavity, as thick as 0.3 of the radius of a disk of its area, not at its base."""
        assert self.cavity is not None
        cavity = self.cavity[frame]
        distance, rows = distance_transform_edt(~cavity), np.flatnonzero(cavity.any(axis=1))
        low = rows[0] + 0.85 * np.ptp(rows) if self.sector else np.inf
        thickness = 0.3 * np.sqrt(cavity.sum() / np.pi)
        return (distance > 1) & (distance < 1 + thickness) & (self.grid[0] < low) & self.scan

    def later(self, frames: NDArray[np.int64], seconds: float) -> Iterator[tuple[int, int]]:
        """Pairs of frames that are so far apart."""
        number = {int(time): frame for frame, time in enumerate(self.time)}
        lag = max(1, round(seconds / self.interval))
        for frame in frames:
            if (after := number.get(int(self.time[frame]) + lag)) is not None:
                yield int(frame), after

    def detail(self, frame: int) -> NDArray[np.float64]:
        """The image without its Gaussian mean of 3 px."""
        image, share = self.images[frame].astype(float), gaussian_filter(self.scan.astype(float), 3)
        return image - gaussian_filter(np.where(self.scan, image, 0), 3) / np.maximum(share, 1e-6)

    def likeness(self, frames: NDArray[np.int64], seconds: float, where: Masks | None = None) -> float:
        """Mean correlation of details with those of a later frame: in a region, or in the cavity of both."""
        found = []
        for one, other in self.later(frames, seconds):
            both = self.inner(one) & self.inner(other) if where is None else where
            found.append(np.corrcoef(self.detail(one)[both], self.detail(other)[both])[0, 1])
        return float(np.mean(found))


def image_rows(clip: Clip) -> Row:
    """Rows of a sector that need no cavity."""
    frames, (reach, angle) = clip.measured(np.arange(len(clip.images))), clip.polar
    grey = clip.images[frames][:, clip.scan].astype(float)
    mean = clip.images[frames].mean(axis=0)
    near, middle = clip.scan & (reach > 0.09) & (reach < 0.24), clip.scan & (reach > 0.35) & (reach < 0.65)
    outer = (np.abs(angle) > 0.73) & (np.abs(angle) < 0.98) & (reach > 0.12) & (reach < 0.6)
    return {
        "mean grey in the sector": float(grey.mean()),
        "95th percentile": float(np.percentile(grey, 95)),
        "99.9th percentile": float(np.percentile(grey, 99.9)),
        "black": float((grey <= BLACK).mean()),
        "near field, 0.09 to 0.24 of the depth": float(mean[near].mean()),
        "outer 12 degrees, right": float(mean[outer & (angle > 0)].mean()),
        "outer 12 degrees, left": float(mean[outer & (angle < 0)].mean()),
        "edges over centre, 0.35 to 0.65": float(
            mean[middle & (np.abs(angle) > 0.7)].mean() / mean[middle & (np.abs(angle) < 0.3)].mean()
        ),
        "near field, grain across over along": float(np.mean([near_grain(clip, frame) for frame in frames])),
        "near field, likeness to the next frame": clip.likeness(frames, NEXT_S, near),
        "near field, likeness to the fifth frame": clip.likeness(frames, FIFTH_S, near),
        "fine over coarse power": float(np.mean([fineness(clip, frame) for frame in frames])),
    }


def near_grain(clip: Clip, frame: int) -> float:
    """Widths of the near field's grain across over along the beam: those at half of the autocorrelation of detail."""
    assert clip.sector is not None
    row, column, half, depth = clip.sector
    reach, angle = np.arange(0.09, 0.24, 0.5 / depth) * depth, np.radians(np.linspace(-0.9 * half, 0.9 * half, 128))
    places = [row + np.outer(np.cos(angle), reach), column + np.outer(np.sin(angle), reach)]
    value = map_coordinates(clip.detail(frame), places, order=1)
    across, along = (_width(np.moveaxis(value - value.mean(), axis, 0)) for axis in (0, 1))
    return float(across * (angle[1] - angle[0]) * reach.mean() / (along * (reach[1] - reach[0])))


def _width(value: NDArray[np.float64]) -> float:
    """Lag along the first axis at which the autocorrelation falls to one half, samples, by linear interpolation."""
    before, power = 1.0, (value**2).mean()
    for lag in range(1, len(value) - 1):
        now = (value[lag:] * value[:-lag]).mean() / power
        if now < 0.5:
            return float(lag - 1 + (before - 0.5) / (before - now))
        before = now
    return len(value) - 1.0


def fineness(clip: Clip, frame: int) -> float:
    """Power of the image beyond its Gaussian mean of 1 px over that between the means of 1 and 4 px."""
    image = clip.images[frame].astype(float)
    fine, coarse = (gaussian_filter(image, width)[clip.scan] for width in (1, 4))
    return float(((image[clip.scan] - fine) ** 2).mean() / ((fine - coarse) ** 2).mean())


def cavity_rows(clip: Clip) -> Row:
    """Rows that need the cavity."""
    assert clip.cavity is not None
    frames, (ed, es) = clip.measured(clip.beating), clip.ed_es
    inner = [clip.images[frame][clip.inner(frame)].astype(float) for frame in frames]
    return {
        "wall over cavity, end-diastole": _contrast(clip, ed),
        "wall over cavity, end-systole": _contrast(clip, es),
        "cavity": float(np.mean([each.mean() for each in inner])),
        "cavity, deviation over mean": float(np.mean([each.std() / each.mean() for each in inner])),
    }


def _contrast(clip: Clip, frame: int) -> float:
    """Mean grey level of the wall over that of the cavity."""
    return float(clip.images[frame][clip.ring(frame)].mean() / clip.images[frame][clip.inner(frame)].mean())


def wall_rows(clip: Clip) -> Row:
    """Rows of the wall and of motion, of a long axis."""
    assert clip.cavity is not None
    patches, sides, apex = [], [], []
    for frame in clip.measured(clip.beating):
        image, ring, cavity = clip.images[frame], clip.ring(frame), clip.cavity[frame]
        rows, columns = (each - each[cavity].mean() for each in clip.grid)
        angle = np.degrees(np.arctan2(columns, -rows))
        part = np.floor(angle / 20)
        parts = [ring & (part == each) for each in np.unique(part[ring])]
        means = np.array([image[each].mean() for each in parts if each.sum() > 5])
        patches.append(means.std() / means.mean())
        sides.append(image[ring & (angle < -30)].mean() / image[ring & (angle > 30)].mean())
        points = np.argwhere(cavity)
        apex.append(points[: max(5, len(points) // 30)].mean(axis=0))
    return {
        "patchiness of the wall": float(np.mean(patches)),
        "left over right wall": float(np.mean(sides)),
        "cavity, likeness to the next frame": clip.likeness(clip.measured(clip.beating), NEXT_S),
        "motion of the cavity's apex, of the depth": float(np.hypot(*np.ptp(apex, axis=0)) / DEPTH_PX),
    }


def human_rows(clip: Clip) -> Row:
    """All rows of a human clip."""
    clip = clip.scaled()
    return image_rows(clip) | (cavity_rows(clip) | wall_rows(clip) if clip.cavity is not None else {})


def mouse_rows(clip: Clip) -> Row:
    """All rows of a clip of a mouse."""
    grey = clip.images[:, clip.scan]
    return cavity_rows(clip) | {"black": float((grey <= BLACK).mean()), "mean grey": float(grey.mean())}


def frames_of(file: Path) -> tuple[NDArray[np.uint8], float]:
    """Frames of a film (frame, row, column, colour: blue, green, red), and the time between them, s."""
    film, frames = cv2.VideoCapture(str(file)), []
    while (read := film.read())[0]:
        frames.append(read[1])
    return np.stack(frames), 1 / film.get(cv2.CAP_PROP_FPS)


def human_clips(folder: Path) -> Iterator[tuple[str, Clip]]:
    """The real clips of people of a folder, by name."""
    for file in sorted(folder.glob("*.mp4")):
        frames, interval = frames_of(file)
        rows, columns = frames.shape[1:3]
        blue = frames[:, :, rows:, 0].astype(int) - frames[:, :, rows:, 2] > 60
        cavity = np.stack([binary_fill_holes(each) for each in blue]) if columns == 2 * rows else None
        sector = ECHONET if rows == IMAGE_PX else EXAMPLE
        images = frames[:, :, :rows].mean(axis=-1).astype(np.uint8)
        yield file.stem, Clip(images, cavity, sector, np.arange(len(images)), interval)
    for file in folder.glob("color3d_jpeg_baseline.dcm"):
        images, cycle = apical_clip.real_clip(file), np.arange(*apical_clip.CYCLE)
        cavity = np.zeros((len(cycle), *images.shape[1:]), np.uint8)
        for mask, frame in zip(cavity, cycle, strict=True):
            cv2.fillPoly(mask, [np.rint(apical_clip.drawn_wall(frame).endocardium).astype(np.int32)], 1)
        tip, column, half, _, depth = apical_clip.SECTOR
        images = np.where(apical_clip.real_scan(images.shape[1:]), images, 0)[cycle]
        yield file.stem, Clip(images, cavity > 0, (tip, column, half, depth), cycle, apical_clip.INTERVAL)


def mouse_clips(folder: Path) -> Iterator[tuple[str, Clip]]:
    """The real clips of mice of a folder, by name."""
    for file in sorted(folder.glob("*.mp4")):
        frames, interval = frames_of(file)
        rows = frames.shape[1]
        images, cavity = frames[:, :, :rows].mean(axis=-1).astype(np.uint8), frames[:, :, rows:].mean(axis=-1) > 127
        yield file.stem, Clip(images, cavity, None, np.arange(len(images)), interval)
    if files := sorted(folder.glob("*.png")):
        frames = np.stack([cv2.imread(str(file)) for file in files]).astype(int)
        outline = np.minimum(frames[..., 1], frames[..., 2]) - frames[..., 0] > 50
        cavity = np.stack([binary_fill_holes(cv2.dilate(each.astype(np.uint8), np.ones((3, 3)))) for each in outline])
        yield "stills", Clip(frames.mean(axis=-1).astype(np.uint8), cavity, None, np.arange(len(files)), 1.0)


def our_clip(config: Config, heart: Heart, view: str, shown: tuple[int, ...] = SHOWN) -> Clip:
    """Frames of a view of a heart of ours."""
    moving, plane = before_probe(heart, config, view)
    sequence = Sequence(config, moving, plane, random)
    scanner, acquire = sequence.scanner, sequence.acquisition(sequence.scatterers())
    lines = np.stack([scanner.beamform(acquire(frame)) for frame in shown])
    gain = clip_gain(config.probe, config.bmode, (FRAMES, lines.shape[1]), scanner.range, random("dropout"))
    images = bmode_clip(lines, scanner.scan, scanner.range, config.bmode, gain[list(shown)])[SIZE]
    tissue = TissueImages(config, moving, plane, *pixel_centres(config.bmode, SIZE))
    cavity = np.isin([tissue(frame) for frame in shown], (TissueLabel.CAVITY, TissueLabel.PAPILLARY_MUSCLE))
    depth = config.depth_mm / config.bmode.field_of_view_mm * SIZE
    sector = (-0.5, SIZE / 2 - 0.5, config.rf.sector_deg / 2, depth) if config.rf.scan == "sector" else None
    return Clip(images, cavity, sector, np.array(shown), period(config.loop) / FRAMES)


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


def our_rows(species: str, cache: Path) -> Row:
    """All rows of a clip of ours."""
    file, view = OURS[species]
    mesh = {f"geometry.{key}": value for key, value in MESH.items()}
    config = et.configure(HERE.parent / f"config/{file}.yaml", **nested(mesh | {"loop.frames": FRAMES}))
    clip = our_clip(config, solved(config, cache / f"{species}.npz"), view)
    return human_rows(clip) if species == "human" else mouse_rows(clip)


def drawn_rows(cache: Path) -> list[Row]:
    """Rows at end-diastole of hearts with drawn acoustics; end-systole is imaged too, whose echoes are brighter."""
    mesh = {f"geometry.{key}": value for key, value in MESH.items()}
    keys = {"seed": {"integers": [1, 10**6]}}
    draw = {"cases.draw": {"number": DRAWS, "seed": SEED, "preset": "acoustics", "keys": keys}}
    config = et.configure(HERE.parent / "config/realistic_human.yaml", **nested(mesh | {"loop.frames": FRAMES} | draw))
    heart, found = solved(config, cache / "human.npz"), []
    for case in et.expand(config):
        clip = our_clip(case.config, heart, "four_chamber", (0, heart.es)).scaled()
        grey = clip.images[0, clip.scan]
        found.append(
            {"mean grey in the sector": float(grey.mean()), "wall over cavity, end-diastole": _contrast(clip, 0)}
        )
        print(case.id, found[-1], flush=True)
    return found


def drawn_share(results: dict[str, Any]) -> float:
    """Share of the drawn clips whose brightness and contrast both lie within the ranges of the real ones."""
    names = results["drawn"][0]
    real = {name: [each[name] for each in results["people"].values() if name in each] for name in names}
    within = [all(min(real[n]) <= each[n] <= max(real[n]) for n in names) for each in results["drawn"]]
    return float(np.mean(within))


def report(results: dict[str, Any]) -> str:
    """The page."""
    lines = [
        "# How alike ours and real clips are",
        "",
        "Means over frames; grey levels are of 255. Each real clip is one value of a row. All sectors are scaled to a"
        " depth of 110 px. The wall is a ring round the cavity, whose masks in the clips of echonet/dynamic are those"
        " of a network. `benchmarks/realism.py` says how.",
    ]
    for real, ours in (("people", "human"), ("mice", "mouse")):
        clips, rows = results[real], []
        for row, value in results[ours].items():
            values = [each[row] for each in clips.values() if row in each]
            outside = "" if min(values) <= value <= max(values) else "outside"
            limits = f"{_shown(min(values))} to {_shown(max(values))}"
            rows.append([row, limits, _shown(float(np.median(values))), _shown(value), outside])
        within = sum(not row[-1] for row in rows)
        lines += ["", *table([real, f"{len(clips)} real clips", "median", f"our {ours}", ""], rows)]
        lines += ["", f"Within the range: {within} of {len(rows)} rows."]
    share = f"{100 * drawn_share(results):.0f} % of {len(results['drawn'])}"
    lines += ["", f"Of clips with drawn `acoustics`, {share} have brightness and contrast of the real ones together."]
    return "\n".join([*lines, ""])


def _shown(value: float) -> str:
    return f"{value:.3g}"


def main() -> None:
    """Measure and write results/realism.json and .md."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--clips", type=Path, help="real clips of people")
    parser.add_argument("--mice", type=Path, help="real clips of mice")
    parser.add_argument("--draws", action="store_true", help="image hearts with drawn acoustics again")
    parser.add_argument("--cache", type=Path, default=HERE / ".cache")
    given = parser.parse_args()
    file = HERE / "results/realism.json"
    results = json.loads(file.read_text()) if file.exists() else {}
    if given.clips:
        results["people"] = {name: human_rows(clip) for name, clip in human_clips(given.clips)}
    if given.mice:
        results["mice"] = {name: mouse_rows(clip) for name, clip in mouse_clips(given.mice)}
    if given.draws or "drawn" not in results:
        results["drawn"] = drawn_rows(given.cache)
    for name in OURS:
        results[name] = our_rows(name, given.cache)
        print(name, {row: _shown(value) for row, value in results[name].items()}, flush=True)
    file.write_text(json.dumps(results, indent=1) + "\n")
    file.with_suffix(".md").write_text(report(results))


if __name__ == "__main__":
    main()
