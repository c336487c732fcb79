"""The same heart and speckle, sliced and whole: what motion through the plane costs, and where 2-D strain errs.

    python -m benchmarks.volumes 0 1 2 3 4 5 6 7      # hearts, four to seven minutes of CPU time each
    python -m benchmarks.volumes table

A heart is imaged in three dimensions and tracked there, and two slices of the same volumes are tracked as a clip is:
the middle short axis, and the long axis along the beam. Errors are those of the motion in the plane of the slice, at
the same points. Rows are added to results/volumes.csv as they are made.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from scipy.ndimage import zoom

import echotruth as et
from echotruth.config.tracking import BsplineDic
from echotruth.evaluation.strain import StrainOperator
from echotruth.evaluation.volume import VolumePoints
from echotruth.heart import Heart
from echotruth.mechanics.fibres import unit
from echotruth.notebook.volume import tracked_positions
from echotruth.repository.datasets import case_of, imaged_heart
from echotruth.tracking.quality import IMAGE_FRACTION
from echotruth.tracking.tracker import track
from echotruth.units import mm

TABLE = Path(__file__).parent / "results/volumes.csv"
RADIUS = 0.45e-3
"""Of the strain operator, m."""
INFARCT = {"pathology.infarct.segments": [7, 8, 13, 14], "pathology.infarct.age": "fresh"}
BLOCK = {"pathology.activation.preset": "lbbb"}
REALISTIC = {
    "realism.preset": "mouse",
    "realism.ring_down.level_dB": None,
    "bmode.dropout.loss_dB": 0,
    "bmode.dropout.edge_loss_dB": 0,
}
"""Keys of hearts with blood, surroundings, noise and haze."""
HEARTS: list[tuple[str, int, dict[str, Any]]] = [
    ("healthy", 11, {}),
    ("healthy", 12, {"geometry.scale": 0.95, "loop.circulation.contractility": 0.85}),
    ("infarct", 13, INFARCT),
    ("infarct", 14, INFARCT | {"pathology.infarct.segments": [9, 10, 15]}),
    ("block", 15, BLOCK),
    ("block", 16, BLOCK | {"loop.circulation.contractility": 1.1}),
    ("healthy, realistic", 11, REALISTIC),
    ("turned", 31, {"motion.kind": "rigid", "motion.rigid.rotation_deg": 15}),
]
"""Diagnosis, seed, and keys; the last only turns."""
FITTED: list[tuple[str, int, dict[str, Any]]] = [
    ("healthy", 21, {"loop.circulation.contractility": 0.9}),
    ("block", 23, BLOCK),
    ("healthy, realistic", 24, REALISTIC),
    ("infarct, realistic", 25, INFARCT | REALISTIC),
]
"""Hearts on which the quality of volumes is fitted (benchmarks/quality.py)."""
SETTINGS: dict[str, Any] = {
    "geometry": {"circumferential_elements": 18, "longitudinal_elements": 9, "transmural_elements": 2},
    "loop": {"kind": "circulation", "frames": 16},
    "views": {"whole": {"plane": "volume"}},
    "probe": {"preset": "mouse_row_column_15MHz"},
}
SLICES = {"short_axis": ("elevation", "lateral", 0, "CC"), "long_axis": ("lateral", "elevation", 2, "LL")}
"""Slice -> the dimension that it is across, that beside the axial one, its number in a vector, and its strain."""


def beating(seed: int, keys: dict[str, Any]) -> Heart:
    """A heart of a seed and keys."""
    return et.beat(et.configure(et.configure(**SETTINGS), seed=seed, **keys))


def made(number: int) -> pd.DataFrame:
    """Rows of one heart."""
    diagnosis, seed, keys = HEARTS[number]
    heart = beating(seed, keys)
    started = time.process_time()
    clip = et.image(heart, "whole")
    imaged = time.process_time()
    tracked = et.track(clip, "bspline_dic")
    row = et.evaluate(tracked, heart).to_dict()
    row |= {"image_cpu_s": imaged - started, "track_cpu_s": time.process_time() - imaged}
    wall = VolumePoints(*imaged_heart(clip, heart), tracked_positions(tracked), RADIUS)
    row |= stated(clip, tracked, wall)
    rows = [{"heart": number, "diagnosis": diagnosis, "seed": seed, "tracked": "volume", **row}]
    for name in SLICES if "motion.kind" not in keys else ():
        rows.append({"heart": number, "diagnosis": diagnosis, "seed": seed, "tracked": name})
        rows[-1] |= sliced(name, clip, tracked, wall)
    return pd.DataFrame(rows)


def stated(clip: xr.Dataset, tracked: xr.Dataset, wall: VolumePoints) -> dict[str, float]:
    """Quality that is stated, and points that are right: the means of all frames but the first."""
    error = np.linalg.norm(tracked["displacement"].values - wall.displacement, axis=-1)[1:]
    side = max(case_of(clip).config.volume.field_mm) * mm
    quality = tracked["quality"].values[1:]
    return {"stated_percent": 100 * quality.mean(), "right_percent": 100 * (error < IMAGE_FRACTION * side).mean()}


def sliced(name: str, clip: xr.Dataset, tracked: xr.Dataset, every: VolumePoints) -> dict[str, float]:
    """Errors in the plane at ES of a slice that is tracked alone, and of the volume, at the points of the slice.

    Those of the whole wall are `every`.
    """
    heart = every.heart
    across, beside, component, along = SLICES[name]
    planes = np.unique(tracked[across])
    plane = planes[np.abs(planes).argmin()]
    own = tracked.isel(point=np.flatnonzero(tracked[across].values == plane))
    flat = clip.sel({across: plane}, method="nearest").transpose("frame", "axial", beside)
    axial, other = flat["axial"].values, flat[beside].values
    # Square pixels, as trackers of slices want them: the finer side of a voxel along both.
    step, ratio = axial[1] - axial[0], (other[1] - other[0]) / (axial[1] - axial[0])
    wider = partial(zoom, zoom=(1, ratio), grid_mode=True, mode="nearest")
    images = np.stack([wider(frame, order=1) for frame in flat["image"].values])
    mask = wider(flat["mask"].values.astype(np.uint8), order=0) > 0
    first = other[0] - (ratio - 1) / 2 * step
    points = np.column_stack([own[beside].values - first, own["axial"].values - axial[0]]) / step
    found = step * track(images, points, mask, step, clip["time"].values, 0, BsplineDic())[0][heart.es]
    position = tracked_positions(own)
    wall, in_plane = replace(every, position=position), [component, 1]
    true, whole = wall.displacement[heart.es], tracked["displacement"].values[heart.es]
    of_volume = own["displacement"].values[heart.es]
    errors = {"slice": found - true[:, in_plane], "volume": (of_volume - true)[:, in_plane]}
    known = np.isfinite(errors["slice"]).all(axis=1) & np.isfinite(errors["volume"]).all(axis=1)
    size, number = np.linalg.norm(true[known][:, in_plane]), ("RR", "CC", "LL").index(along)
    axes = wall.operator.axes[:, [0, number]][:, :, in_plane]
    strain = every.operator.strain(whole[None])[0, :, number]
    means = {
        "true": wall.strain(heart.es)[:, number].mean(),
        "slice": np.nanmean(StrainOperator(position[:, in_plane], unit(axes), RADIUS).strain(found[None])[0, :, 1]),
        "volume": np.nanmean(strain[tracked[across].values == plane]),
    }
    return {
        **{f"nrmse_{of}_percent": 100 * np.linalg.norm(error[known]) / size for of, error in errors.items()},
        "through_plane_um": 1e6 * np.sqrt(np.mean(true[:, 2 - component] ** 2)),
        **{f"e_{along.lower()}_{of}_pp": 100 * mean for of, mean in means.items()},
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("hearts", nargs="+", help=f"numbers of hearts, 0 to {len(HEARTS) - 1}; or table")
    numbers = parser.parse_args().hearts
    if numbers == ["table"]:
        print(pd.read_csv(TABLE).T.to_string(float_format="{:.2f}".format))
        return
    for number in map(int, numbers):
        before = pd.read_csv(TABLE).query("heart != @number") if TABLE.exists() else pd.DataFrame()
        table = pd.concat([before, made(number)]).sort_values(["heart", "tracked"])
        table.to_csv(TABLE, index=False, float_format="%.4g")


if __name__ == "__main__":
    main()
