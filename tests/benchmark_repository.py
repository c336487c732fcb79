"""A small benchmark: hearts that move as rigid bodies, with speckle that moves with them, and labels."""

from functools import cache
from pathlib import Path

import numpy as np
from finished_repository import finish, solved
from known_repository import FRAMES, SETTINGS, SHIFT, overlaid
from scipy.ndimage import gaussian_filter, map_coordinates

import echotruth as et
from echotruth.workflow.job import Job, Result

TABLE = """case,seed,loop.heart_rate_per_min,label.heart,label.split,label.group,label.acoustics,label.variation
a_ideal,1,500,a,test,healthy,ideal,none
b_ideal,2,600,b,test,dilation,ideal,none
c_ideal,3,500,c,develop,healthy,ideal,none
"""

SIZE = 64

CONFIGURED = SETTINGS | {
    "name": "bench",
    "bmode": {"size_px": SIZE, "downsampling": (1,)},
    "views": {"mid": {"position": 0.5}},
    "tracking": {"trackers": {"dis": {"method": "dis"}}, "grid_px": 4},
}


@cache
def moving_speckle() -> np.ndarray:
    """Speckle that moves with the heart, (frame, axial, lateral), uint8."""
    texture = gaussian_filter(np.random.default_rng(1).standard_normal((2 * SIZE, 2 * SIZE)), 1.5)
    spacing = 1e-3 * et.configure(CONFIGURED).bmode.field_of_view_mm / SIZE
    axial, lateral = np.mgrid[:SIZE, :SIZE] + SIZE / 2
    shifts = np.linspace(0, 1, FRAMES)[:, None] * SHIFT[:2] / spacing
    frames = [map_coordinates(texture, [axial - shift[1], lateral - shift[0]], order=3) for shift in shifts]
    return np.clip(120 + 60 * np.array(frames) / texture.std(), 0, 255).astype(np.uint8)


def make(folder: Path) -> Path:
    """Write the repository as the workflow does; tracking is its own."""
    (folder.parent / "hearts.csv").write_text(TABLE)
    return finish(folder, et.configure(CONFIGURED | {"cases": {"file": str(folder.parent / "hearts.csv")}}), result)


def result(job: Job) -> Result:
    """Arrays of a job."""
    if job.stage in ("tracking", "truth"):
        return solved(job)
    return overlaid(job, {f"bmode/{SIZE}": {"image": moving_speckle()}})
