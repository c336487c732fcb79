"""Clips of human hearts of ours to learn from: everything that can be drawn is, and of every pixel the tissue is known.

Hearts on a coarse mesh have the shape, muscle, load and disease of `hearts`, and each clip has pose, tissues, acoustics
of `acoustics` and DRAWN. Of a frame decibels are kept: gain and grey map may be drawn each time that it is shown.
"""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from apical_clip import VIEW
from numpy.typing import NDArray
from physiology_pictures import ELEMENTS
from realism import solved

import echotruth as et
from echotruth.imaging.bmode import bmode_clip, clip_gain, pixel_centres
from echotruth.imaging.labels import TissueLabel
from echotruth.imaging.medium.tissue_images import TissueImages
from echotruth.imaging.sequence import Sequence
from echotruth.imaging.truth import wall_mask
from echotruth.imaging.view import before_probe
from echotruth.seeds import generator

HEARTS, CYCLE, SHOWN = 28, 12, 3
"""Hearts, frames of a beat, and frames of a clip."""
IMAGED, RANGE_DB = 128, 100.0
"""Pixels along a side of an image, 200 mm, and decibels from black to white."""
APEX = {"geometry.apex_wall_mm": {"uniform": [2, 10]}}
"""What is drawn of a heart beside `hearts`: that of the human clip was drawn thicker than ours is by default."""
DRAWN: dict[str, Any] = {
    f"views.{VIEW}.rotation_deg": {"uniform": [-65, 5]},
    f"views.{VIEW}.tilt_deg": {"uniform": [-12, 12]},
    f"views.{VIEW}.angle_deg": {"uniform": [-12, 25]},
    f"views.{VIEW}.offset.lateral_mm": {"uniform": [-15, 15]},
    f"views.{VIEW}.offset.axial_mm": {"uniform": [-8, 16]},
    "realism.backscatter.variation_dB": {"uniform": [1, 8]},
    "realism.neighbours.chambers_dB": {"uniform": [-10, 3]},
    "realism.neighbours.lung_dB": {"uniform": [-12, 4]},
    "realism.neighbours.chest_wall_dB": {"uniform": [-8, 5]},
    "realism.neighbours.leaflets_dB": {"uniform": [4, 18]},
    "realism.neighbours.papillary_muscles_dB": {"uniform": [-12, 2]},
    "realism.surroundings.level_dB": {"uniform": [-22, -2]},
    "realism.haze.level_dB": {"uniform": [-16, 2]},
    "realism.shadow.level_dB": {"uniform": [-20, -3]},
    "realism.aberration.delay_ns": {"uniform": [0, 40]},
}
"""What is drawn of a clip beside `acoustics`; by eye, around `realism.preset: human` and the four-chamber view."""
MACHINE = {"dynamic_range_dB": RANGE_DB, "gain_dB": 0.0, "grey_map": "linear", "grey_gamma": 1.0}
MACHINE |= {"smoothing": 0.0, "edge_enhancement": 0.0}
LABELS = 6
"""The rest, cavity, wall, left atrium, right ventricle and right atrium, as :class:`TissueLabel` numbers them."""
Frame = tuple[NDArray[np.uint8], NDArray[np.uint8]]
"""Image, and the labels of its pixels."""


def clips(folder: Path, number: int) -> dict[tuple[int, int], list[Frame]]:
    """Frames of some clips of every heart: (heart, number of the clip) -> frames. The folder keeps them."""
    order = [(heart, clip) for clip in range(number) for heart in range(HEARTS)]
    folder.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(2) as pool:
        files = [folder / f"heart_{heart}.npz" for heart in range(HEARTS)]
        list(pool.map(solved, [case.config for case in hearts()], files))
        return dict(zip(order, pool.map(partial(clip, folder), *zip(*order, strict=True)), strict=True))


def hearts() -> list[et.Case]:
    """Our hearts."""
    base = et.configure(
        geometry=ELEMENTS | {"preset": "human"},
        loop={"frames": CYCLE, "kind": "circulation"},
        views={"preset": "echo"},
        realism={"preset": "human"},
        rf={"lines": 96, "focal_zones": 1},
        phantom={"density_per_mm3": 0.6},
        bmode={"size_px": 2 * IMAGED, "downsampling": [1, 2]},
        cases={"draw": {"preset": "hearts", "number": HEARTS, "seed": 5, "keys": APEX}},
    )
    return et.expand(base)


def clip(folder: Path, heart: int, number: int) -> list[Frame]:
    """Frames of a clip of a heart, in decibels, made where the file is not there."""
    file = folder / f"clip_{number}_{heart}.npz"
    if not file.exists():
        image, label = imaged(folder, heart, 1000 * number + heart)
        np.savez_compressed(file, image=image, label=label)
    with np.load(file) as stored:
        return list(zip(stored["image"], stored["label"], strict=True))


def imaged(folder: Path, index: int, seed: int) -> Frame:
    """Frames of a heart before a probe that is drawn, and the labels of their pixels, (frame, axial, lateral)."""
    of_heart = hearts()[index].config
    heart = solved(of_heart, folder / f"heart_{index}.npz")
    draw = {"preset": "acoustics", "number": 1, "seed": seed, "keys": DRAWN}
    (case,) = et.expand(et.configure(of_heart, cases={"draw": draw}))
    config, random = case.config, partial(generator, case, VIEW)
    moving, plane = before_probe(heart, config, VIEW)
    shown = random("frames").choice(CYCLE, SHOWN, replace=False)
    sequence = Sequence(config, moving, plane, random)
    scanner, acquire = sequence.scanner, sequence.acquisition(sequence.scatterers())
    lines = np.stack([scanner.beamform(acquire(frame)) for frame in shown])
    bmode = config.bmode.model_copy(update=MACHINE)
    gain = clip_gain(config.probe, bmode, (CYCLE, lines.shape[1]), scanner.range, random("dropout"))[shown]
    image = bmode_clip(lines, scan=scanner.scan, range_=scanner.range, bmode=bmode, gain=gain)[IMAGED]
    centres = pixel_centres(config.bmode, IMAGED)
    tissue, labels = TissueImages(config, moving, plane, *centres), []
    for frame in shown:
        label = tissue(frame)
        label[label == TissueLabel.PAPILLARY_MUSCLE] = TissueLabel.CAVITY
        label[label >= LABELS] = TissueLabel.OTHER
        label[wall_mask(replace(moving, displacement=moving.displacement[[frame]]), plane, *centres)] = TissueLabel.WALL
        labels.append(label)
    return image, np.stack(labels)
