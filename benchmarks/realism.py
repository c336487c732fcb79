"""How alike the images and a real clip are: peak correlation from frame to frame, and how much of the sector is dark.

    python benchmarks/realism.py --beat beat.npz --clip color3d_jpeg_baseline.dcm

The real clip is that of the package pydicom-data (MIT), an apical view of a human heart, 120 frames 33.3 ms apart, of
0.51 mm a pixel; reading it needs pydicom. Without --clip its row is left as it is in the last report. --beat keeps the
beat of the default heart, which takes minutes to solve.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator
from functools import partial
from hashlib import sha256
from io import BytesIO
from itertools import pairwise
from pathlib import Path

import numpy as np
from report import table
from skimage.feature import match_template

from echotruth.config import Config, Rf
from echotruth.config.loading import load
from echotruth.fem.location import locate
from echotruth.heart import Heart
from echotruth.imaging.bmode import bmode_clip, pixel_centres, time_gain_compensation
from echotruth.imaging.sequence import Sequence
from echotruth.imaging.view import Plane, imaging_plane

HERE = Path(__file__).parent
FRAMES = 27
"""Frames of a cycle. The real clip repeats itself after 27.5 of its frames (0.92 s), so one of ours is one of its."""
EVERY = 6
"""A pair of frames is imaged every so many."""
SIZE = 256
"""Pixels along a side, 47 um each. Our cavity is 6.8 mm long and the real one 79 mm: its pixels would be 44 um."""
WINDOWS = (24, 48)
"""Sides of the windows, px."""
SEARCH = 8
"""How far a window is sought to every side in the next frame, px."""
DARK = 4
"""Grey levels, of 255, up to which a pixel is dark."""
REAL = {"septum": (302, 190, 245), "lateral": (400, 220, 310), "blood": (345, 195, 240)}
"""In the real clip: column, first and last row of the middles of windows, px."""
REAL_SECTOR = (17, 339, 42.0, 40, 380)
"""In the real clip: row and column of its tip (px), half its angle (deg), and its first and last range (px)."""

Measures = dict[str, float]
Places = dict[str, list[tuple[int, int]]]


def peak(before: np.ndarray, after: np.ndarray, place: tuple[int, int], side: int) -> float:
    """Largest normalised correlation of a window of one frame with windows near it in the next."""
    row, column = (middle - side // 2 for middle in place)
    window = before[row : row + side, column : column + side].astype(float)
    near = after[row - SEARCH : row + side + SEARCH, column - SEARCH : column + side + SEARCH].astype(float)
    return float(match_template(near, window).max()) if window.std() > 0 else np.nan


def correlations(pairs: list[tuple[np.ndarray, np.ndarray]], places: Places) -> Measures:
    """Mean peak correlation of every tissue and window."""
    return {
        f"{tissue}, {side} px": float(np.nanmean([peak(*pair, place, side) for pair in pairs for place in middles]))
        for side in WINDOWS
        for tissue, middles in places.items()
    }


def real_clip(file: Path) -> np.ndarray:
    """Luminance of all frames (frame, row, column), uint8."""
    from PIL import Image
    from pydicom import dcmread
    from pydicom.encaps import generate_frames

    data = dcmread(file)
    frames = generate_frames(data.PixelData, number_of_frames=int(data.NumberOfFrames))
    return np.stack([np.asarray(Image.open(BytesIO(frame)).convert("YCbCr"))[..., 0] for frame in frames])


def measure_real(file: Path) -> Measures:
    """The measures of the real clip; frames that are there twice are passed over."""
    frames = real_clip(file)
    pairs = [(a, b) for a, b in pairwise(frames) if (a != b).any()]
    places = {name: [(row, column) for row in range(low, high, 11)] for name, (column, low, high) in REAL.items()}
    tip, middle, half, first, last = REAL_SECTOR
    row, column = np.indices(frames.shape[1:])
    reach, angle = np.hypot(row - tip, column - middle), np.degrees(np.arctan2(column - middle, row - tip))
    sector = (np.abs(angle) < half) & (reach > first) & (reach < last)
    return correlations(pairs[::3], places) | {"dark": float((frames[:, sector] <= DARK).mean())}


def heart(arrays: dict[str, np.ndarray]) -> tuple[Heart, np.ndarray]:
    """A heart at `FRAMES` times of a cycle, by periodic cubic splines, and the times, s."""
    from scipy.interpolate import CubicSpline

    time, displacement = arrays["mechanics/time"], arrays["mechanics/displacement"]
    period = time[-1] + time[1] - time[0]
    course = CubicSpline(np.append(time, period), np.concatenate([displacement, displacement[:1]]), bc_type="periodic")
    times = np.arange(FRAMES) * period / FRAMES
    es = int(np.abs(times - time[arrays["mechanics/es_frame"]]).argmin())
    mesh = arrays["geometry/node_position"], arrays["geometry/cell_node"].astype(np.int32)
    depth, endo = arrays["fibres/wall_depth"], arrays["geometry/endo"].astype(np.int32)
    groups = {"geometry": ("endo", "epi"), "fibres": ("fibre",)}
    of = {group: {name: arrays[f"{group}/{name}"] for name in names} for group, names in groups.items()}
    return Heart(*mesh, course(times), depth, endo, 6, es, arrays=of), times


def beat_of(config: Config, file: Path) -> dict[str, np.ndarray]:
    """Arrays of a heart's beat, by `group/name`, solved where the file is not there."""
    if not file.exists():
        from echotruth.mechanics.beat import beat

        result = beat(config)
        file.parent.mkdir(parents=True, exist_ok=True)
        np.savez(file, **{f"{group}/{name}": value for group, of in result.items() for name, value in of.items()})
    with np.load(file) as arrays:
        return {name: arrays[name] for name in arrays.files}


def random(name: str) -> np.random.Generator:
    """A generator for every name."""
    return np.random.default_rng(np.frombuffer(sha256(name.encode()).digest(), np.uint32))


def pictures(config: Config, beating: Heart, time: np.ndarray, where: Plane) -> Iterator[np.ndarray]:
    """Lines of two frames in a row, and so on through the cycle: (2, lines, ranges)."""
    sequence = Sequence(config, beating, where, random, time)
    scanner, acquire = sequence.scanner, sequence.acquisition(sequence.scatterers())
    gain = time_gain_compensation(config.probe, config.bmode, scanner.range)
    show = partial(bmode_clip, scan=scanner.scan, range_=scanner.range, bmode=config.bmode, gain=gain)
    lines = [scanner.beamform(acquire(k + more)) for k in range(0, FRAMES - 1, EVERY) for more in (0, 1)]
    yield from show(np.stack(lines))[SIZE]


def our_places(beating: Heart, where: Plane, centres: tuple[np.ndarray, np.ndarray]) -> Places:
    """Middles of windows at five heights: of the septum, the lateral wall and the cavity at end-diastole, px."""
    places: Places = {"septum": [], "lateral": [], "blood": []}
    for height in np.linspace(-4.2e-3, -2e-3, 5):
        for side, name in ((1, "septum"), (-1, "lateral")):
            lateral = side * np.linspace(0, 5e-3, 500)
            line = np.stack([lateral, 0 * lateral, 0 * lateral + height], axis=1)
            wall = line[locate(beating.positions(0), beating.cells, line).cell >= 0].mean(axis=0)
            places[name].append(pixel(where.to_image(wall), centres))
        places["blood"].append(pixel(where.to_image(np.array([0, 0, height])), centres))
    return places


def pixel(place: np.ndarray, centres: tuple[np.ndarray, np.ndarray]) -> tuple[int, int]:
    """Row and column of a place in the image (lateral, axial, elevation), m."""
    return int(np.abs(centres[0] - place[1]).argmin()), int(np.abs(centres[1] - place[0]).argmin())


def measure_ours(config: Config, beating: Heart, time: np.ndarray, save: Callable[[np.ndarray], None]) -> Measures:
    """The measures of the long-axis view of the default heart."""
    where = imaging_plane(config.views["long_axis"], config.rf, beating.positions(0)[beating.endo.ravel()])
    frames = np.stack(list(pictures(config, beating, time, where)))
    save(frames)
    centres = pixel_centres(config.bmode, SIZE)
    axial, lateral = np.meshgrid(*centres, indexing="ij")
    sector = np.abs(np.arctan2(lateral, axial)) < 0.98 * config.rf.si().sector / 2
    found = correlations(list(zip(frames[::2], frames[1::2], strict=True)), our_places(beating, where, centres))
    return found | {"dark": float((frames[:, sector] <= DARK).mean())}


def report(results: dict[str, Measures]) -> str:
    """The table."""
    names = list(next(iter(results.values())))
    rows = [[row, *(f"{values[name]:.2f}" for name in names)] for row, values in results.items()]
    note = (
        "Mean peak of the normalised cross-correlation of square windows from one frame to the next, 1/27 of a cycle"
        f" later, and share of the sector with a grey level of {DARK} of 255 or less. `benchmarks/realism.py` says how."
    )
    return "\n".join(["# How alike ours and a real clip are", "", *table(["", *names], rows), "", note, ""])


def main() -> None:
    """Measure and write results/realism.json, .md and the first frame of each as a picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--beat", type=Path, default=HERE / ".cache/beat.npz")
    parser.add_argument("--clip", type=Path)
    parser.add_argument("--pictures", type=Path, help="folder for the frames, as .npy")
    given = parser.parse_args()
    file = HERE / "results/realism.json"
    results = json.loads(file.read_text()) if file.exists() else {}
    if given.clip:
        results["real, apical view"] = measure_real(given.clip)
    beating, time = heart(beat_of(Config(), given.beat))
    configs = {"realistic": load(HERE.parent / "config/realistic.yaml"), "as printed": Config(rf=Rf(focal_zones=1))}
    for name, config in configs.items():
        keep = partial(np.save, given.pictures / f"{name}.npy") if given.pictures else lambda frames: None
        results[name] = measure_ours(config, beating, time, keep)
        print(name, results[name], flush=True)
    file.write_text(json.dumps(results, indent=1) + "\n")
    file.with_suffix(".md").write_text(report(results))


if __name__ == "__main__":
    main()
