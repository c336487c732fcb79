"""Picture of docs/realism.md: a mouse imaged ideally and realistically, a human heart, and a human echo.

    python benchmarks/realism_picture.py    # five minutes on one core

The human echo is the example ybr_color of the package pydicom (MIT), an apical four-chamber view.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from itertools import chain
from pathlib import Path

import numpy as np

import echotruth as et
from echotruth.cases import Case
from echotruth.heart import Heart
from echotruth.imaging.bmode import bmode_clip, time_gain_compensation
from echotruth.imaging.sequence import Sequence
from echotruth.imaging.view import imaging_plane
from echotruth.seeds import generator

OUT = Path(__file__).parents[1] / "docs/gallery/realism.png"
SIDE = 256
"""Pixels along a side of our images."""
SECTOR = (86, 36, 274, 224)
"""Left, top, right and bottom of the ventricles in the human echo, px."""


def images(heart: Heart, view: str) -> list[np.ndarray]:
    """End-diastole and end-systole of a view of a heart, (SIDE, SIDE), uint8 each."""
    config = heart.config
    assert config is not None
    plane = imaging_plane(config.views[view], config.rf, heart.endo_at_ed)
    sequence = Sequence(config, heart, plane, partial(generator, Case("heart", {}, config), view))
    acquire, scanner = sequence.acquisition(sequence.scatterers()), sequence.scanner
    lines = np.stack([scanner.beamform(acquire(frame)) for frame in (0, heart.es)])
    gain = time_gain_compensation(config.probe, config.bmode, scanner.range)
    return list(bmode_clip(lines, scanner.scan, scanner.range, config.bmode, gain)[SIDE])


def real() -> list[np.ndarray]:
    """Two frames of the human echo, cut to the heart and enlarged to SIDE."""
    import cv2
    from pydicom import examples

    clip = et.read_clip(examples.get_path("ybr_color"), spacing_mm=1.02, crop=SECTOR)["image"].values
    return [cv2.resize(clip[frame], (SIDE, SIDE), interpolation=cv2.INTER_CUBIC) for frame in (19, 4)]


def main() -> None:
    """Image, and write the picture."""
    from PIL import Image

    size = {"bmode": {"size_px": SIDE, "downsampling": [1]}}
    coarse = {"circumferential_elements": 12, "longitudinal_elements": 8, "transmural_elements": 2}
    mouse = et.beat(et.configure("demo", geometry=coarse, realism={"preset": "none"}, **size), progress=False)
    human = et.beat(et.configure("realistic_human", geometry=coarse, **size), progress=False)
    realistic = replace(mouse, config=et.configure(mouse.config, realism={"preset": "mouse"}))
    hearts, rows = (mouse, realistic, human), []
    for views, echo in zip((("mid",) * 3, ("long_axis", "long_axis", "four_chamber")), real(), strict=True):
        shown = [images(heart, view) for heart, view in zip(hearts, views, strict=True)]
        rows.append([*chain(*shown), echo])
    picture = np.vstack([np.hstack(row) for row in rows])
    Image.fromarray(picture).save(OUT, optimize=True)


if __name__ == "__main__":
    main()
