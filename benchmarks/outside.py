"""Trackers on motions that no heart makes, in images of our own and of another simulator, and on a disk that turned.

    python -m benchmarks.outside phantoms --jobs 2        # half an hour; goes on where it was stopped
    python -m benchmarks.outside pymust PWI_disk.mat      # needs PyMUST, of whose examples the file is
    python -m benchmarks.outside disk PWI_disk.mat

Phantoms are left ventricles of the shape and the look of their species, which move in the plane of their short axis.
PyMUST shows rings in water that move alike, by the array, the beamformer and the grey map with which it shows a disk
that turned in water (https://github.com/creatis-ULTIM/PyMUST, examples/rotatingDisk_real.ipynb). The rate of the disk
is that of its Doppler velocity, which grows across the beam by it; its axis is where frames turned back by it are most
alike. Rings, of the disk too, move there and back, and are tracked as a user's clip is. Rows are added to
results/outside.csv as they are made; the page of the suite has them.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.io import loadmat
from scipy.ndimage import center_of_mass
from threadpoolctl import threadpool_limits

import echotruth as et
from benchmarks.parallel import in_processes
from benchmarks.suite.hearts import LENGTHS_MM, TRACKERS, configured
from benchmarks.suite.scores import view_clips
from echotruth.evaluation.point_tracks import SIDE
from echotruth.evaluation.reliability import WITHIN
from echotruth.evaluation.scoring import estimated
from echotruth.mechanics.geometry.ellipsoid import semi_axes
from echotruth.mechanics.prescribed import motion_amplitude
from echotruth.tracking.plausibility import REFERENCE_WALL_MM
from echotruth.units import mm

TABLE = Path(__file__).parent / "results/outside.csv"
Floats = NDArray[np.float64]
Row = dict[str, Any]


class Wall(NamedTuple):
    """Inner and outer radius of the wall at the height of points, (n,), m."""

    inner: Floats
    outer: Floats

    def depth(self, radius: Floats) -> Floats:
        """Depth in the wall of points at a radius: 0 at the endocardium, 1 at the epicardium."""
        return np.clip((radius - self.inner) / np.maximum(self.outer - self.inner, 1e-9), 0, 1)


Polar = Callable[[Wall, Floats, Floats, np.random.Generator], tuple[Floats, Floats]]
"""Shift along the radius, m, and angle, rad, at end-systole of points at a radius, m, and angle, rad."""

VIEW, CHANGE = "mid", 0.25
"""View, and the change of the area of the cavity, of its area, where a wall contracts or is dilated."""
TURN = np.radians(10)
SPECIES, SPECKLES = ("mouse", "human"), (1,)
STEP = 1e-4
"""Of the pixels of PyMUST's images, m."""
LATERAL, DEPTH = STEP * np.arange(-125, 126), STEP * np.arange(100, 351)
RANGE_DB, LIT = 30, 60
"""Of its grey map, from black to white; and the blurred grey of the disk at least."""
WALL, STEPS = (6e-3, 9e-3), 2
"""Inner and outer radius of the ring that is tracked, m, and step of the frames of the disk."""
FRAMES, DENSITY = 12, 6e7
"""Frames of a simulated ring to end-systole, and its scatterers, 1/m^2."""
CLIP = ("images", "motion", "speckle")


def inflated(wall: Wall, radius: Floats, change: float | Floats) -> Floats:
    """Shift along the radius at a constant area of the wall, m, by a change of the square of the inner radius."""
    return np.sqrt(radius**2 + change * wall.inner**2) - radius


def sector(angle: Floats, width: float = np.pi / 3) -> Floats:
    """1 in the middle of a sector at 0, 0 beyond its width."""
    apart = np.abs((angle + np.pi) % (2 * np.pi) - np.pi) / width
    return np.where(apart < 1, np.cos(np.pi / 2 * apart) ** 2, 0)


def rotation(
    turn: float, wall: Wall, radius: Floats, angle: Floats, random: np.random.Generator
) -> tuple[Floats, Floats]:
    """The whole wall turns by an angle, rad."""
    return 0 * radius, turn + 0 * angle


def smooth_field(wall: Wall, radius: Floats, angle: Floats, random: np.random.Generator) -> tuple[Floats, Floats]:
    """Random harmonics 0 to 4 around and polynomials to the second degree through the wall."""
    depth, size = wall.depth(radius), 0.12 * (wall.outer - wall.inner)
    shift = [
        sum(
            random.normal(0, 1 / (1 + k)) * np.cos(k * angle + random.uniform(0, 2 * np.pi)) * (depth - 0.5) ** power
            for k in range(5)
            for power in range(3)
        )
        for _ in range(2)
    ]
    return size * shift[0], size * shift[1] / np.maximum(radius, 1e-6)


MOTIONS: dict[str, Polar] = {
    "still": lambda wall, r, a, random: (0 * r, 0 * a),
    "rotation": partial(rotation, TURN),
    "twist by layer": lambda wall, r, a, random: (
        0 * r,
        TURN * (wall.depth(r) - 0.5),
    ),
    "contraction": lambda wall, r, a, random: (inflated(wall, r, -1.4 * CHANGE), 0 * a),
    "akinetic sector": lambda wall, r, a, random: (inflated(wall, r, -1.4 * CHANGE * (1 - sector(a))), 0 * a),
    "bulging sector": lambda wall, r, a, random: (inflated(wall, r, -1.4 * CHANGE * (1 - 1.4 * sector(a))), 0 * a),
    "dilation": lambda wall, r, a, random: (inflated(wall, r, CHANGE), 0 * a),
    "shrinking": lambda wall, r, a, random: (-0.12 * r, 0 * a),
    "smooth field": smooth_field,
}
"""Name -> motion. What shrinks gets thinner as it gets narrower; other walls keep their area, or nearly so."""


def phantom(species: str, speckle: int) -> et.Config:
    """Configuration of a heart at rest, with the settings and trackers of the suite."""
    rest = {"motion.kind": "rigid", "motion.rigid.lateral_um": 0, "motion.rigid.axial_um": 0}
    shape = {"geometry.circumferential_elements": 48, "loop.kind": "measured"}
    return configured(species, rest | shape | {"realism.preset": species, "seed": speckle})


def wall_at(config: et.Config, height: Floats) -> Wall:
    """The wall at heights (n,), m, below the base."""
    return Wall(
        *(a * np.sqrt(np.maximum(1 - ((height + base) / c) ** 2, 0)) for a, c, base in semi_axes(config.geometry))
    )


def displacement(nodes: Floats, wall: Wall, motion: Polar, speckle: int, amplitude: Floats) -> Floats:
    """Displacement of nodes (n, 3) in every frame, (frame, n, 3), m."""
    radius, angle = np.hypot(nodes[:, 0], nodes[:, 1]), np.arctan2(nodes[:, 1], nodes[:, 0])
    shift, turn = motion(wall, radius, angle, np.random.default_rng(speckle))
    moved = radius + amplitude[:, None] * shift, angle + amplitude[:, None] * turn
    place = np.stack([moved[0] * np.cos(moved[1]), moved[0] * np.sin(moved[1])], -1)
    return np.concatenate([place - nodes[:, :2], np.zeros((*place.shape[:2], 1))], -1)


def moving(config: et.Config, motion: str, speckle: int) -> et.Heart:
    """A heart that moves to its end-systole in the middle of the cycle and back."""
    at_rest, amplitude = et.beat(config, progress=False), motion_amplitude("cosine", config.loop.frames)
    wall = wall_at(config, at_rest.nodes[:, 2])
    found = displacement(at_rest.nodes, wall, MOTIONS[motion], speckle, amplitude)
    return replace(at_rest, displacement=found, es=int(np.argmax(amplitude)))


def phantom_rows(given: tuple[str, str, int]) -> list[Row]:
    """Rows of the trackers on a phantom: species, motion and speckle are given."""
    species, motion, speckle = given
    config = phantom(species, speckle)
    (case,) = et.expand(config)
    names, rows = {"images": species, "motion": motion, "speckle": speckle}, []
    with threadpool_limits(1):
        truth, _, (clip, _) = view_clips(case, moving(config, motion, speckle), VIEW)
        for tracker, settings in config.tracking.trackers.items():
            (found, quality), _ = estimated(clip, settings)
            moved, es = (found * clip.spacing, truth.displacement), truth.es
            radial = [truth.operator.strain(each)[es, :, 0] for each in moved]
            rows.append(names | {"tracker": tracker} | scores(moved, quality, es, clip.size * clip.spacing, radial))
    return rows


def scores(
    displacement: tuple[Floats, Floats], quality: Floats, es: int, side: float, radial: Sequence[Floats]
) -> dict[str, float]:
    """How tracked and true displacement (frame, point, 2), m, differ, and their radial strain (point,) at end-systole.

    `side` is that of the image, m.
    """
    found, true = (each * SIDE / side for each in displacement)
    apart = np.linalg.norm(np.nan_to_num(found) - true, axis=-1)
    right = np.isfinite(found).all(-1) & (apart < WITHIN)
    is_stated = np.isfinite(quality).any()
    return {
        "error_px": np.sqrt(np.mean(apart[es] ** 2)),
        "motion_px": np.sqrt(np.mean((true[es] ** 2).sum(-1))),
        "radial_strain_percent": 100 * np.nanmean(radial[0]),
        "true_radial_strain_percent": 100 * np.nanmean(radial[1]),
        "stated_percent": 100 * np.mean(np.nan_to_num(quality[1:])) if is_stated else np.nan,
        "right_percent": 100 * np.mean(right[1:]),
    }


class Array:
    """The linear array that saw the disk, one plane wave a frame, and its images by PyMUST.

    Parameters
    ----------
    file : Path
        PWI_disk.mat.
    """

    def __init__(self, file: Path):
        import pymust

        given = loadmat(file)
        self.pymust, self.echoes, self.param = pymust, given["RF"].astype(float), pymust.utils.Param()
        for name in given["param"].dtype.names:
            self.param[name] = given["param"][name][0, 0].astype(float)
        for name in set(self.param) - {"t0", "TXdelay"}:
            self.param[name] = self.param[name].item()
        self.param.Nelements, self.param.fnumber, self.param.radius = int(self.param.Nelements), None, np.inf

    def beamformed(self, echoes: Floats, **changes: Any) -> NDArray[np.complex128]:
        """Complex images (axial, lateral, frame) of echoes (sample, element, frame)."""
        param = self.param.copy()
        param.update(changes)
        demodulated = self.pymust.rf2iq(echoes, param)
        matrix = self.pymust.dasmtx(1j * np.array(echoes.shape[:2]), *np.meshgrid(LATERAL, DEPTH), param)
        flat = matrix @ demodulated.reshape(-1, echoes.shape[2], order="F")
        return flat.reshape(len(DEPTH), len(LATERAL), -1, order="F")

    def images(self, positions: Floats, amplitude: Floats) -> NDArray[np.complex128]:
        """Complex images of scatterers at positions (frame, n, 2), lateral and depth, m."""
        param = self.param.copy()
        param.fs, param.t0 = 4 * param.fc, np.zeros((1, 1))
        sent = np.zeros((1, param.Nelements))
        shots = [self.pymust.simus(x, z, amplitude, sent, param)[0] for x, z in positions.transpose(0, 2, 1)]
        samples = min(len(each) for each in shots)
        echoes = np.stack([each[:samples] for each in shots], -1)
        return self.beamformed(echoes, fs=param.fs, t0=param.t0)

    def grey(self, images: NDArray[np.complex128]) -> NDArray[np.uint8]:
        """Grey levels (frame, axial, lateral)."""
        return np.moveaxis(self.pymust.bmode(images, RANGE_DB), -1, 0).astype(np.uint8)

    def rate(self, images: NDArray[np.complex128], inside: NDArray[np.bool_]) -> float:
        """Rate of a disk, rad/s, from the lateral to the axial direction: how the axial velocity grows across the beam.

        The velocity is that of the phase from frame to frame over that from row to row (Loupas et al., IEEE Trans
        Ultrason 1995; 42:672), because a wide aperture and attenuation lower the frequency along the beam.
        """
        in_time = (images[..., 1:] * images[..., :-1].conj()).sum(-1)[inside]
        along = np.angle((images[1:] * images[:-1].conj())[inside[1:]].sum()) % (2 * np.pi)
        velocity = -np.angle(in_time) / along * STEP * self.param.PRF
        weight, lateral = np.sqrt(np.abs(in_time)), np.broadcast_to(LATERAL, inside.shape)[inside]
        return float(np.polyfit(lateral, velocity, 1, w=weight)[0])


def ring_rows(names: Row, frames: NDArray[np.uint8], centre: Floats, motion: Polar, amplitude: Floats) -> list[Row]:
    """Rows of the trackers on a ring about a centre, px, that moves in frames (frame, axial, lateral), and back."""
    again = [*range(len(frames)), *range(len(frames) - 2, 0, -1)]
    clip = et.read_clip(frames[again], spacing_mm=1e3 * STEP, frame_time_ms=4)
    around = np.linspace(0, 2 * np.pi, 90, endpoint=False)
    circle = np.column_stack([np.cos(around), np.sin(around)])
    drawn = et.Wall(*(centre + radius / STEP * circle for radius in WALL), VIEW)
    es, rows = len(frames) - 1, []
    scale = np.diff(WALL).item() / (REFERENCE_WALL_MM * mm)  # over a mouse, of which the lengths of the suite are
    lengths = {
        name: {key: scale * value for key, value in given.get("options", given).items()}
        for name, given in LENGTHS_MM.items()
    }
    for tracker, given in TRACKERS.items():
        options = {
            key: value for key, value in (given | lengths.get(tracker, {})).items() if key not in ("method", "track")
        }
        strain = et.speckle_tracking(clip, drawn, given.get("track", given["method"]), **options)
        offset = strain["position"].values - centre * STEP
        true = on_ring(offset, motion, amplitude)[again]
        far, near = (offset * (1 + sign * 1e-3) for sign in (1, -1))
        along = far - near + on_ring(far, motion, amplitude)[es] - on_ring(near, motion, amplitude)[es]
        radial = ((np.linalg.norm(along, axis=-1) / np.linalg.norm(far - near, axis=-1)) ** 2 - 1) / 2
        moved = strain["displacement"].values, true
        thickening = strain["strain"].values[es, :, 0], radial
        one = scores(moved, strain["quality"].values, es, len(DEPTH) * STEP, thickening)
        rows.append(names | {"tracker": tracker} | one)
    return rows


def on_ring(offset: Floats, motion: Polar, amplitude: Floats) -> Floats:
    """Displacement (frame, n, 2), m, of points of a ring (n, 2), m from its centre."""
    wall = Wall(*(np.full(len(offset), radius) for radius in WALL))
    nodes = np.column_stack([offset, np.zeros(len(offset))])
    return displacement(nodes, wall, motion, SPECKLES[0], amplitude)[..., :2]


def disk_rows(array: Array) -> list[Row]:
    """Rows of the trackers on the disk."""
    images = array.beamformed(array.echoes)
    frames, times = array.grey(images[..., ::STEPS]), np.arange(0, images.shape[-1], STEPS) / array.param.PRF
    lit = cv2.GaussianBlur(np.median(frames, 0), (0, 0), 5) > LIT
    turn = array.rate(images, lit) * times
    lateral, depth = np.array(center_of_mass(lit))[::-1]
    axis = max(
        (np.array([lateral, depth + more]) for more in range(-15, 16)), key=partial(_likeness, frames, lit, turn)
    )
    print(f"axis at {axis} px, {turn[1] / times[1]:.1f} rad/s, {np.degrees(turn[-1]):.1f} degrees")
    names = {"images": "disk", "motion": "rotation", "speckle": 1}
    return ring_rows(names, frames, axis, partial(rotation, turn[-1]), times / times[-1])


def _likeness(frames: NDArray[np.uint8], inside: NDArray[np.bool_], turn: Floats, axis: Floats) -> float:
    """Correlation of frames with those a third of the clip later, which are turned back about an axis, px."""
    later = len(frames) // 3
    back = cv2.getRotationMatrix2D(axis, np.degrees(turn[later]), 1)
    pairs = (
        (one, cv2.warpAffine(other, back, one.shape[::-1])) for one, other in zip(frames, frames[later:], strict=False)
    )
    return float(np.mean([np.corrcoef(one[inside], other[inside])[0, 1] for one, other in pairs]))


def pymust_rows(array: Array, motion: str) -> list[Row]:
    """Rows of the trackers on a ring in water, as the array of the disk would see it."""
    random, outer = np.random.default_rng(SPECKLES[0]), WALL[1]
    place = random.uniform(-outer, outer, (round(4 * outer**2 * DENSITY), 2))
    radius = np.linalg.norm(place, axis=-1)
    kept, amplitude = place[(radius < outer) & (radius > WALL[0])], np.sin(np.linspace(0, np.pi / 2, FRAMES)) ** 2
    moved, centre = kept + on_ring(kept, MOTIONS[motion], amplitude), np.full(2, (len(LATERAL) - 1) / 2)
    images = array.images(moved + [0, DEPTH.mean()], random.normal(size=len(kept)))
    names = {"images": "PyMUST", "motion": motion, "speckle": 1}
    return ring_rows(names, array.grey(images), centre, MOTIONS[motion], amplitude)


def add(rows: list[Row]) -> None:
    """Add rows to the table."""
    pd.DataFrame(rows).to_csv(TABLE, mode="a", header=not TABLE.is_file(), index=False, float_format="%.4g")


def missing(named: Iterable[tuple[str, str, int]]) -> list[tuple[str, str, int]]:
    """Clips, by images, motion and speckle, that the table does not have."""
    there = set()
    if TABLE.is_file():
        there = set(pd.read_csv(TABLE)[list(CLIP)].itertuples(index=False, name=None))
    return [each for each in named if each not in there]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    phantoms = commands.add_parser("phantoms")
    phantoms.add_argument("--jobs", type=int, default=1)
    for name in ("pymust", "disk"):
        commands.add_parser(name).add_argument("file", type=Path)
    given = parser.parse_args()
    if given.command == "phantoms":
        for rows in in_processes(phantom_rows, missing(product(SPECIES, MOTIONS, SPECKLES)), given.jobs):
            add(rows)
    elif given.command == "pymust":
        for _, motion, _ in missing(("PyMUST", motion, 1) for motion in MOTIONS):
            add(pymust_rows(Array(given.file), motion))
    elif missing([("disk", "rotation", 1)]):
        add(disk_rows(Array(given.file)))


if __name__ == "__main__":
    main()
