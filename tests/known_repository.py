"""A repository of a heart that moves as a rigid body, with images of which every pixel is known."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import finished_repository
import numpy as np

import echotruth as et
from echotruth.cases import Case, expand
from echotruth.config import Config
from echotruth.heart import Heart
from echotruth.imaging.bmode import pixel_centres
from echotruth.imaging.labels import unpack
from echotruth.imaging.medium.tissue_images import TissueImages
from echotruth.imaging.truth import pixel_truth
from echotruth.imaging.view import imaging_plane
from echotruth.workflow.job import Job, Result

SIZES = (128, 64)
FRAMES = finished_repository.FRAMES
SHIFT = np.array([300e-6, -200e-6, 150e-6])
"""Lateral, axial and elevation shift in the last frame of a short-axis view, m."""

SETTINGS = {
    "name": "known",
    "geometry": {"circumferential_elements": 12, "longitudinal_elements": 6, "transmural_elements": 1},
    "motion": {"kind": "rigid", "time_course": "ramp", "rigid": {"rotation_deg": 0.0}},
    "loop": {"frames": FRAMES},
    "views": {"mid": {"position": 0.5}, "long": {"plane": "long_axis", "rotation_deg": 30.0}},
    "bmode": {"size_px": SIZES[0], "downsampling": (1, 2)},
    "tracking": {
        "grid": 0.04,
        "trackers": {name: {"method": "phase_correlation", "window_px": 16} for name in ("one", "two")},
    },
}
SETTINGS["motion"]["rigid"] |= {
    f"{axis}_um": float(1e6 * shift) for axis, shift in zip(("lateral", "axial", "elevation"), SHIFT, strict=True)
}


FOUND = {
    "one": {
        "displacement": 1e-4,
        "tracked_region_strain": 0.1,
        "tracked_segment_strain": 0.11,
        "tracked_line_strain": -0.12,
        "tracked_rotation": 0.13,
    },
    "two": {
        "displacement": 2e-4,
        "tracked_region_strain": 0.2,
        "tracked_segment_strain": 0.21,
        "tracked_line_strain": -0.22,
        "tracked_rotation": 0.23,
    },
}
"""What the two trackers found: told apart by their values."""

TRUE = {
    "true_region_strain": np.reshape([0.3, 0.4, 0.5], (3, 1, 1, 1, 1)),
    "true_segment_strain": np.reshape([0.31, 0.41, 0.51], (3, 1, 1, 1, 1)),
    "true_line_strain": -0.14,
    "true_rotation": 0.15,
}
"""Of the three references, told apart by their values."""


@dataclass(eq=False)
class Known:
    """The repository and what it was made of."""

    folder: Path
    config: Config
    heart: Heart

    @property
    def case(self) -> Case:
        return expand(self.config)[0]

    def images(self, size: int) -> np.ndarray:
        return known_images(size)

    @property
    def spacing(self) -> float:
        """Of the largest image, m."""
        return 1e-3 * self.config.bmode.field_of_view_mm / SIZES[0]

    def plane(self, view: str):
        return imaging_plane(self.config.views[view], self.config.rf, self.heart.endo_at_ed)

    def labels(self, view: str, size: int) -> dict[str, np.ndarray]:
        """Mask, layer, segment and region of the pixels, each (frame, axial, lateral)."""
        return unpack(self.truth(view, size)["labels"])

    def arrays(self, job: Job) -> Result:
        """Known arrays of a job, by group."""
        if job.stage in ("points", "tracking"):
            return {group: TRUE if job.tracker is None else FOUND[job.tracker] for group in job.groups()}
        if job.stage == "truth":
            return {f"truth/{size}": self.truth(job.view_name, size) for size in job.config.bmode.sizes}
        return {f"bmode/{size}": {"image": known_images(size)} for size in job.config.bmode.sizes}

    @cache  # noqa: B019 - one object a session
    def truth(self, view: str, size: int) -> dict[str, np.ndarray]:
        plane, pixels = self.plane(view), pixel_centres(self.config.bmode, size)
        return pixel_truth(self.heart, plane, *pixels, TissueImages(self.config, self.heart, plane, *pixels))


def known_images(size: int) -> np.ndarray:
    """A bright block near the array on the side of positive lateral, a dim one far from it on the other."""
    images = np.full((FRAMES, SIZES[0], SIZES[0]), 10, np.uint8)
    images[:, 16:32, 96:112] = 220
    images[:, 96:112, 16:32] = 40 + 40 * np.arange(FRAMES)[:, None, None]
    step = SIZES[0] // size
    return images[:, ::step, ::step]


def known_at(folder: Path, settings: dict) -> Known:
    """The repository that is made of the settings in a folder."""
    return Known(folder, et.configure(settings), et.beat(et.configure(settings, cases={}), progress=False))


def make(folder: Path, settings: dict, **changed: np.ndarray) -> Known:
    """Write a repository as the workflow does, with known images, and other arrays of any name if they are given."""
    known = known_at(folder, settings)

    def result(job: Job) -> Result:
        arrays = known.arrays(job)
        return overlaid(job, {name: values | changed for name, values in arrays.items()})

    finished_repository.finish(folder, known.config, result)
    return known


def overlaid(job: Job, known: Result) -> Result:
    """Arrays of a job: known ones, and those that are made up for all others."""
    arrays = finished_repository.blank(job)
    for group, values in arrays.items():
        for name in values.keys() & known.get(group, {}).keys():
            values[name] = np.broadcast_to(known[group][name], np.shape(values[name]))
    return arrays
