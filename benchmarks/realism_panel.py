"""What a real clip, an ideal one of ours and a realistic one look like, in numbers, beside published ranges.

    python benchmarks/realism_panel.py --beat beat.npz --clip color3d_jpeg_baseline.dcm

The clips are those of benchmarks/realism.py, and the numbers those of benchmarks/echo_statistics.py. In the real clip
the wall was drawn by hand (apical_wall.csv); in ours it is known. Without --clip the numbers of the real clip are those
of the last report. The results are results/realism_panel.json and .md.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from echo_statistics import Echo, Masks, cavity_of, percentiles, statistics
from numpy.typing import NDArray
from realism import EVERY, FRAMES, REAL_SECTOR, SIZE, beat_of, heart, pictures, real_clip
from report import table

import echotruth as et
from echotruth.config import Config
from echotruth.heart import Heart
from echotruth.imaging.bmode import pixel_centres
from echotruth.imaging.truth import wall_mask
from echotruth.imaging.view import imaging_plane

HERE = Path(__file__).parent
REAL_CYCLE, REAL_ED, REAL_ES = (6, 33), 22, 33
"""Frames of the real clip: first at end-systole and the one after the last; end-diastole; the next end-systole."""
REAL_ORIGIN = (31, 84)
"""Row and column of the full-size image at which the part begins in which the wall was drawn."""
REAL_RANGES_DB = (50.0, 60.0, 70.0)
"""Dynamic ranges that the scanner may have had: the file does not say which it was."""

PUBLISHED: dict[str, tuple[float, float, str]] = {
    "wall / blood, contrast to speckle": (0.68, 1.34, "1"),
    "ED over ES, dB": (0.0, 6.2, "2"),
    "time of the minimum / of ES": (0.77, 1.39, "3"),
}
"""Published ranges and the number of their source in :data:`SOURCES`."""

SOURCES = (
    "Means of the muscle-to-cavity contrast-to-speckle ratio in three regions of apical views of 25 patients,"
    " fundamental and harmonic (Mayo Clin Proc 73 (1998), Image enhancement by noncontrast harmonic echocardiography,"
    " part II). Its abstract does not say how it is defined; here it is the difference of mean grey levels over the"
    " root of the sum of their variances.",
    "None in apical views, and up to 4.6 +/- 1.6 dB in parasternal ones, of 20 healthy men (Cyclic variation of"
    " ultrasound backscatter in normal myocardium is view dependent); 4.6 +/- 0.2 dB in mice, parasternal long axis"
    " (Kovacs et al. 2003).",
    "Normalised delay 1.08 +/- 0.31 of the septum in the apical four-chamber view of 23 healthy people (Finch-Johnston"
    " et al. 2000, J Am Soc Echocardiogr 13:9), 1.02 +/- 0.03 in mice (Kovacs et al. 2003); that of the lateral wall in"
    " the former was 2.20 +/- 0.79.",
)

OF_CYCLE = ("ED over ES, dB", "time of the minimum / of ES")
"""Statistics that need a whole cycle."""

FITTED = {
    "wall / blood, dB": "human to this clip",
    "free wall / tissue beyond, dB": "human to this clip",
    "wall, 10 to 90 %, dB": "human to this clip",
    "axial width / wall": "human to this clip",
    "wall, next frame, correlation": "human to this clip",
    "ED over ES, dB": "both to mice",
}
"""Statistics to which the presets of `realism` were fitted, or ones like them, and to what. The levels were sought in
end-diastole, the frame after it and end-systole of the same view."""
VIEW = "four_chamber"
HUMAN_MESH = {
    "geometry": {"circumferential_elements": 12, "longitudinal_elements": 8, "transmural_elements": 2},
}


def real_echo(file: Path) -> Echo:
    """The real clip, from one end-systole to the next, at full size."""
    frames = real_clip(file)[slice(*REAL_CYCLE)]
    rows, columns = np.indices(frames.shape[1:])
    tip, middle, half, first, last = REAL_SECTOR
    reach, angle = np.hypot(rows - tip, columns - middle), np.degrees(np.arctan2(columns - middle, rows - tip))
    wall = np.stack([drawn_wall(k, frames.shape[1:]) for k in range(*REAL_CYCLE)])
    # Frames that are there twice have no motion between them.
    pairs = [pair for pair in pairwise(range(len(frames))) if (frames[pair[0]] != frames[pair[1]]).any()]
    return Echo(
        frames=frames,
        wall=wall,
        cavity=np.stack([cavity_of(mask) for mask in wall]),
        scan=(np.abs(angle) < half) & (reach > first) & (reach < last),
        probe=(tip, middle),
        free_side=1,
        phase=(np.arange(*REAL_CYCLE) - REAL_ED) / len(frames) % 1,
        es_phase=(REAL_ES - REAL_ED) / len(frames),
        pairs=pairs[::3],
    )


def drawn_wall(frame: int, shape: tuple[int, ...]) -> Masks:
    """The wall of the real clip in a frame of the cycle: linear in time between those drawn, point by point."""
    table = pd.read_csv(HERE / "apical_wall.csv", comment="#")
    drawn = sorted(table["frame"].unique())
    times = [*drawn, drawn[0] + REAL_CYCLE[1] - REAL_CYCLE[0]]
    borders = []
    for part in ("endocardium", "epicardium"):
        lines = [_resampled(table[(table["frame"] == k) & (table["part"] == part)]) for k in drawn]
        lines.append(lines[0])
        after = min(int(np.searchsorted(times, frame, side="right")), len(times) - 1)
        share = (frame - times[after - 1]) / (times[after] - times[after - 1])
        borders.append((1 - share) * lines[after - 1] + share * lines[after] + REAL_ORIGIN[::-1])
    return et.Wall(*borders, "four_chamber").mask((shape[0], shape[1]))


def _resampled(points: pd.DataFrame, number: int = 100) -> NDArray[np.float64]:
    """Points (number, 2) at equal distances along a border."""
    line = points[["lateral_px", "axial_px"]].to_numpy(float)
    along = np.append(0, np.linalg.norm(np.diff(line, axis=0), axis=1).cumsum())
    return np.column_stack([np.interp(np.linspace(0, along[-1], number), along, line[:, k]) for k in (0, 1)])


def our_echo(config: Config, beating: Heart, time: NDArray[np.float64]) -> Echo:
    """Ten frames of a long-axis view of a heart."""
    where = imaging_plane(config.views[VIEW], config.rf, beating.positions(0)[beating.endo.ravel()])
    frames = np.stack(list(pictures(config, beating, time, where)))
    numbers = [k + more for k in range(0, FRAMES - 1, EVERY) for more in (0, 1)]
    centres = pixel_centres(config.bmode, SIZE)
    still = (replace(beating, displacement=beating.displacement[[k]]) for k in numbers)
    wall = np.stack([wall_mask(one, where, *centres) for one in still])
    axial, lateral = np.meshgrid(*centres, indexing="ij")
    return Echo(
        frames=frames,
        wall=wall,
        cavity=np.stack([cavity_of(mask) for mask in wall]),
        scan=np.abs(np.arctan2(lateral, axial)) < 0.98 * config.rf.si().sector / 2,
        probe=(-0.5, SIZE / 2 - 0.5),
        # The septum is at negative lateral coordinates.
        free_side=1,
        phase=np.array(numbers) / FRAMES,
        es_phase=beating.es / FRAMES,
        pairs=[(k, k + 1) for k in range(0, len(numbers), 2)],
        dynamic_range_dB=config.bmode.dynamic_range_dB,
    )


def measure_real(file: Path) -> dict[str, Any]:
    """Statistics of the real clip, and their range.

    The range is over the dynamic ranges that the scanner may have had, over the two walls and, of what needs no whole
    cycle, over thirds of it.
    """
    echo = real_echo(file)
    free = np.stack([_half(echo, k) for k in range(len(echo.frames))])
    variants = [statistics(replace(echo, dynamic_range_dB=decibels)) for decibels in REAL_RANGES_DB]
    variants += [statistics(replace(echo, wall=echo.wall & side)) for side in (free, ~free)]
    third = len(echo.frames) // 3
    for first in range(0, len(echo.frames), third):
        part = statistics(_between(echo, first, first + third))
        variants.append({name: np.nan if name in OF_CYCLE else value for name, value in part.items()})
    # Without a free wall, as in the septum alone, some numbers are not there.
    spread = {
        name: [float(f([each[name] for each in variants])) for f in (np.nanmin, np.nanmax)] for name in variants[0]
    }
    return {"statistics": statistics(echo), "range": spread, "grey": percentiles(echo)}


def _between(echo: Echo, first: int, stop: int) -> Echo:
    """Some frames of a clip."""
    kept = slice(first, stop)
    pairs = [(a - first, b - first) for a, b in echo.pairs if first <= a and b < stop]
    arrays = {name: getattr(echo, name)[kept] for name in ("frames", "wall", "cavity", "phase")}
    return replace(echo, **arrays, pairs=pairs)


def _half(echo: Echo, frame: int) -> Masks:
    """Half of the image with the free wall."""
    columns = np.indices(echo.scan.shape)[1]
    return echo.free_side * (columns - columns[echo.cavity[frame]].mean()) > 0


def expected(name: str, real: dict[str, Any]) -> tuple[float, float]:
    """Published range of a statistic, or that measured in the real clip."""
    if name in PUBLISHED:
        return PUBLISHED[name][:2]
    low, high = real["range"][name]
    return low, high


def report(results: dict[str, dict[str, Any]]) -> str:
    """The page."""
    real, ours = results["real"], {name: each for name, each in results.items() if name != "real"}
    rows = []
    for name, value in real["statistics"].items():
        low, high = expected(name, real)
        source = f"published [{PUBLISHED[name][2]}]" if name in PUBLISHED else "measured"
        values = [each["statistics"][name] for each in ours.values()]
        within = [f"{found:.2f}{'' if low <= found <= high else ' (outside)'}" for found in values]
        rows.append([name, f"{value:.2f}", f"{low:.2f} to {high:.2f}, {source}", *within, FITTED.get(name, "")])
    grey = [
        [name, tissue, *(f"{level:.0f}" for level in levels)]
        for name, each in results.items()
        for tissue, levels in each["grey"].items()
    ]
    lines = [
        "# Looks in numbers",
        "",
        "The real clip is one human apical view. Measured ranges are over dynamic ranges of 50 to 70 dB, as its file"
        " does not tell, over its septum and its free wall alone, and over thirds of its cycle. Ours are four-chamber"
        " views at ten times of a cycle: of the default mouse, ideal and with `realism.preset: mouse`, and of the human"
        " heart of `config/realistic_human.yaml` on a mesh of 12 x 8 x 2 elements.",
        "",
        *table(["", "real", "expected", *ours, "fitted"], rows),
        "",
        *(f"{counted(name, each, real)}" for name, each in ours.items()),
        "",
        "Grey levels that 10, 50 and 90 % of the pixels do not exceed:",
        "",
        *table(["clip", "tissue", "10 %", "50 %", "90 %"], grey),
        "",
        *(f"{number}. {source}" for number, source in enumerate(SOURCES, 1)),
        "",
    ]
    return "\n".join(lines)


def counted(name: str, found: dict[str, Any], real: dict[str, Any]) -> str:
    """How many statistics that were not fitted lie within their range."""
    free = [each for each in found["statistics"] if each not in FITTED]
    limits = {each: expected(each, real) for each in free}
    within = sum(limits[each][0] <= found["statistics"][each] <= limits[each][1] for each in free)
    return f"- {name}: {within} of the {len(free)} statistics that were not fitted lie within their range."


def measure_ours(config: Config, beating: Heart, time: NDArray[np.float64]) -> dict[str, Any]:
    """Statistics and grey levels of a long-axis view of a heart."""
    echo = our_echo(config, beating, time)
    return {"statistics": statistics(echo), "grey": percentiles(echo)}


def main() -> None:
    """Measure and write results/realism_panel.json and .md."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--beat", type=Path, default=HERE / ".cache/beat.npz")
    parser.add_argument("--human-beat", type=Path, default=HERE / ".cache/beat_human.npz")
    parser.add_argument("--clip", type=Path)
    given = parser.parse_args()
    file = HERE / "results/realism_panel.json"
    results = json.loads(file.read_text()) if file.exists() else {}
    if given.clip:
        results["real"] = measure_real(given.clip)
    elif "real" not in results:
        parser.error("there is no earlier report: give --clip")
    results = {"real": results["real"]}
    mouse = et.configure(views={"preset": "echo"})
    human = et.configure(HERE.parent / "config/realistic_human.yaml", **HUMAN_MESH)
    beats = {"mouse": heart(beat_of(mouse, given.beat)), "human": heart(beat_of(human, given.human_beat))}
    realistic = et.configure(mouse, realism={"preset": "mouse"})
    for name, config in {"mouse, ideal": mouse, "mouse": realistic, "human": human}.items():
        results[name] = measure_ours(config, *beats[config.geometry.preset])
        print(name, results[name], flush=True)
    file.write_text(json.dumps(results, indent=1) + "\n")
    file.with_suffix(".md").write_text(report(results))


if __name__ == "__main__":
    main()
