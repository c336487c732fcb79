"""How far trackers agree with themselves, each other and the eye in a real echo, of which no motion is known.

    python benchmarks/real_echo.py --clip color3d_jpeg_baseline.dcm

The clip, its cycle and the wall drawn in it by hand are those of realism.py. Each tracker follows the wall, forwards
only, from end-diastole to the next one, and then through the same frames back to the first. `beat` is how far points
are from their start at the next end-diastole, to which a heart comes back but for a beat's difference from the next;
`there and back`, how far they are from it in the end, where they must be; its errors cancel where a tracker errs alike
on both ways, so that one that sees no motion has none. `eye` is the distance of the endocardium at end-systole from the
one drawn there. The walls of SENSITIVITY are drawn elsewhere, and tracked in images of half the side. A network knows
whole cycles alone, so that BOTH_WAYS follow the one beat forwards and backwards, and have no way there and back. The
result is results/real_echo.json and .md.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import xarray as xr
from apical_clip import CYCLE, FRAME_ED, HERE, PIXEL_MM, VIEW, drawn_wall, real_clip, real_scan
from numpy.typing import NDArray
from report import table
from scipy.spatial import cKDTree

import echotruth as et

TRACKERS: dict[str, tuple[str, dict[str, Any]]] = {
    "bspline_dic": ("bspline_dic", {}),
    "bspline_dic, grey values": ("bspline_dic", {"dynamic_range_dB": 0.0}),
    "affine_dic": ("examples.affine_dic:track", {}),
    "window_deformation": ("window_deformation", {}),
    "dis": ("dis", {}),
    "dis_fine": ("dis", {"preset": "fine"}),
}
BOTH_WAYS = ("bspline_dic", "bspline_cnn")
LAST, ES, FRAME_MS = FRAME_ED + CYCLE[1] - CYCLE[0], CYCLE[1] - FRAME_ED, 1000 / 30
"""Next end-diastole; end-systole, counted from the first one; time between frames."""
ORDER = [*range(FRAME_ED, LAST + 1), *range(LAST - 1, FRAME_ED - 1, -1)]
SENSITIVITY = {"as drawn": (0, 0, 0), "2 px to the right": (2, 0, 0), "2 px down": (0, 2, 0), "2 px thicker": (0, 0, 1)}
"""Shift of the wall, and by how much each border is moved outwards from the wall, px of the full image."""
ERRORS = ("beat", "there and back", "end-systole")


def moved(wall: et.Wall, right: float, down: float, outwards: float, scale: float) -> et.Wall:
    """A wall that is shifted and made thicker, in images of which a pixel is `scale` of the clip's."""
    borders = []
    for border, sign in ((wall.endocardium, -1), (wall.epicardium, 1)):
        along = np.gradient(border, axis=0)
        normal = np.column_stack([along[:, 1], -along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]
        borders.append((border + [right, down] + sign * outwards * normal + 0.5) / scale - 0.5)
    return et.Wall(*borders, VIEW)


def tracked(frames: NDArray[np.uint8], wall: et.Wall, tracker: str, scale: int = 1) -> xr.Dataset:
    """The wall followed there and back."""
    small = [cv2.resize(frame, None, fx=1 / scale, fy=1 / scale, interpolation=cv2.INTER_AREA) for frame in frames]
    clip = et.read_clip(np.stack(small)[ORDER], spacing_mm=scale * PIXEL_MM, frame_time_ms=FRAME_MS)
    return et.speckle_tracking(clip, wall, TRACKERS[tracker][0], reference="previous", **TRACKERS[tracker][1])


def tracked_beat(frames: NDArray[np.uint8], wall: et.Wall, method: str) -> xr.Dataset:
    """The wall followed over one beat, both ways."""
    clip = et.read_clip(frames[FRAME_ED : LAST + 1], spacing_mm=PIXEL_MM, frame_time_ms=FRAME_MS)
    return et.speckle_tracking(clip, wall, method)


def length(vectors: NDArray[np.float64]) -> float:
    """Root mean square length, mm, of vectors (..., 2), m, that are known."""
    return 1e3 * float(np.sqrt(np.nanmean((vectors**2).sum(-1))))


def measures(strain: xr.Dataset) -> dict[str, float]:
    """Errors of a tracker, mm."""
    motion = strain["displacement"].values
    line = strain["line_position"].values[ES][strain["line_contour"].values == 0] * 1e3 / PIXEL_MM
    far = cKDTree(drawn_wall(CYCLE[0]).endocardium).query(line[np.isfinite(line).all(-1)])[0]
    ends = dict(zip(ERRORS, (motion[LAST - FRAME_ED], motion[-1], motion[ES]), strict=True))
    medians = {f"{name}, median": 1e3 * float(np.nanmedian(np.hypot(*ends[name].T))) for name in ERRORS[:2]}
    sure = {"quality": float(np.nanmean(strain["quality"].values[ES]))}
    return {name: length(end) for name, end in ends.items()} | medians | {"eye": PIXEL_MM * float(far.mean())} | sure


def report(results: dict[str, Any]) -> str:
    """The page."""
    names, apart = list(results["trackers"]), results["apart"]
    head = ["", "beat (median)", "there and back (median)", "motion to end-systole", "eye"]
    rows, pairs, walls = [], [], []
    for name, m in results["trackers"].items():
        errors = [f"{m[key]:.1f} ({m[key + ', median']:.1f})" for key in ERRORS[:2]]
        rows.append([name, *errors, *(f"{m[key]:.1f}" for key in (ERRORS[2], "eye"))])
        pairs.append([name, *(f"{apart[name][other]:.1f}" if other != name else "" for other in names)])
    for where, each in results["walls"].items():
        walls.append([where, *(" / ".join(f"{m[key]:.1f}" for key in ERRORS) for m in each.values())])
    lines = ["# Trackers in a real echo", "", "Root mean squares over the wall, mm.", "", *table(head, rows), ""]
    lines += [f"The endocardium drawn at end-diastole is {results['still']:.1f} mm from that drawn at end-systole.", ""]
    beats = [
        [name, *(f"{m[key]:.1f}" for key in ("beat", ERRORS[2], "eye")), f"{100 * m['quality']:.0f}"]
        for name, m in results["both ways"].items()
    ]
    lines += ["One beat, forwards and backwards:", ""]
    lines += [*table(["", "beat", "motion to end-systole", "eye", "quality at end-systole, %"], beats), ""]
    lines += ["Distance of two trackers at end-systole, mm:", "", *table(["", *names], pairs), ""]
    lines += [f"Other walls, images of half the side: {' / '.join(ERRORS)}, mm:", "", *table(["", *names], walls), ""]
    return "\n".join([*lines, "`benchmarks/real_echo.py` says how.", ""])


def main() -> None:
    """Track and write results/real_echo.json and .md."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--clip", type=Path, required=True)
    clip = real_clip(parser.parse_args().clip)
    frames, wall = np.where(real_scan(clip.shape[1:]), clip, 0).astype(np.uint8), drawn_wall(FRAME_ED)
    found = {name: tracked(frames, wall, name) for name in TRACKERS}
    at_es = {name: each["displacement"].values[ES] for name, each in found.items()}
    eye = cKDTree(drawn_wall(CYCLE[0]).endocardium).query(wall.endocardium)[0]
    results: dict[str, Any] = {
        "trackers": {name: measures(each) for name, each in found.items()},
        "both ways": {name: measures(tracked_beat(frames, wall, name)) for name in BOTH_WAYS},
        "apart": {a: {b: length(at_es[a] - at_es[b]) for b in TRACKERS if b != a} for a in TRACKERS},
        "still": PIXEL_MM * float(eye.mean()),
        "walls": {
            where: {name: measures(tracked(frames, moved(wall, *how, 2), name, 2)) for name in TRACKERS}
            for where, how in SENSITIVITY.items()
        },
    }
    (HERE / "results/real_echo.json").write_text(json.dumps(results, indent=1) + "\n")
    (HERE / "results/real_echo.md").write_text(report(results))
    print(report(results))


if __name__ == "__main__":
    main()
