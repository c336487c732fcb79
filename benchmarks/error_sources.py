"""Whose the error of `bspline_dic` is: its own, the plane's or the images', and of what in the images.

    echotruth run benchmark && echotruth run config/ablation.yaml                  # four hours on two cores
    python benchmarks/error_sources.py out/benchmark out/ablation --jobs 2         # ten minutes

The first tables are of the hearts of the half test of the benchmark, at end-systole: NRMSE, mean over the views of a
heart and median over the hearts, and bias of GCS (short axis) and GLS (long axis), mean over the hearts.

own      on images of blobs that move in the plane as their tissue does (tracking_split.py), without carrier, motion
         through the plane or decorrelation: what the tracker misses there is its own.
plane    of a perfect tracker of the plane (docs/difficulty.md), both ways weighted by the number of steps: what leaves
         and enters the plane.
images   on the images of the repository.
rest     root of the square of `images` less those of `own` and `plane`, of every heart: what the beam, and realistic
         acoustics, make of the speckle. 0 where it would be negative.

The last is of the hearts of config/ablation.yaml, with realistic acoustics from which one thing at a time is taken.
Each case has its own speckle, so that small differences say nothing. The results are results/error_sources.md.
"""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
import report
from suite.conditions import PLAIN, main_conditions
from suite.records import read
from suite.splits import TEST
from tracking_split import TRACKER, blobs

from echotruth.evaluation.clip import read_clips
from echotruth.evaluation.difficulty.plane import both_ways, plane_path
from echotruth.evaluation.parallel import in_processes
from echotruth.evaluation.scoring import Truth, metrics, read_truth, score
from echotruth.heart import Heart
from echotruth.imaging.bmode import downsample
from echotruth.imaging.view import Plane
from echotruth.repository.reader import Repository
from echotruth.tracking import track
from echotruth.tracking.bidirectional import forward_backward

RESULTS = Path(__file__).parent / "results"
NAME = "bspline_dic"
NRMSE = "nrmse_percent"
METRICS = (NRMSE, "gcs_bias_pp", "gls_bias_pp")
TAKEN_AWAY = {
    "realistic": {
        "none": "nothing",
        "five_foci": "the single focus: five",
        "no_rib": "rib",
        "no_decorrelation": "decorrelation",
        "no_surroundings": "blood and surroundings",
        "no_noise": "noise and haze",
    },
    "ideal": {"none": "all: ideal acoustics", "no_through_plane": "all, and motion through the plane"},
}
"""Variations of config/ablation.yaml, and none, by acoustics."""
Row = dict[str, str | int | float]


def limits(folder: Path, view: tuple[str, str]) -> list[Row]:
    """What a tracker misses without the beam in a view, named by case and view; a row for each image size."""
    repository = Repository(folder)
    truth, given, plane = read_truth(repository, *view), read_clips(repository, *view), repository.plane(*view)
    heart = repository.heart(view[0])
    free = blobs(heart, plane, next(iter(given.values())))
    perfect = metrics(score(perfect_tracker(heart, plane, truth), truth), truth.wall.plane)
    rows: list[Row] = []
    for size, clip in given.items():
        frames = downsample(free, free.shape[-1] // size)
        answer = clip.on_grid(*track(frames, *clip.tracker_arguments[1:], TRACKER))[0]
        found = metrics(score(answer, truth), truth.wall.plane)
        values = {f"{name} {of}": each[name] for of, each in (("own", found), ("plane", perfect)) for name in METRICS}
        rows.append({"case": view[0], "view": view[1], "size_px": size, **values})
    print(*view, *(f"{row[f'{NRMSE} own']:.1f}" for row in rows), f"{perfect[NRMSE]:.1f}", flush=True)
    return rows


def perfect_tracker(heart: Heart, plane: Plane, truth: Truth) -> np.ndarray:
    """Displacement on the grid of a perfect tracker of the plane, m, of the shape of a tracker's."""
    frames = len(truth.displacement)
    ways = []
    for order in forward_backward(frames):
        path = plane_path(heart, plane, truth.wall.position, order)
        ways.append((path - truth.wall.position)[np.argsort(order)])
    # The variance of a way is that of its steps: after frame of frames, and as many as are left.
    steps = np.arange(frames)[:, None] / frames
    found = np.full((frames, *truth.inside.shape, 2), np.nan)
    found[:, truth.inside] = both_ways(*ways, (steps, 1 - steps))
    return found


def of_hearts(found: pd.DataFrame, names: list[str]) -> pd.DataFrame:
    """Columns of clips, mean over the views of each heart and image size that have a value."""
    return found.groupby(["heart", "size_px"], sort=False)[names].mean().reset_index()


def sources(folder: Path, test: pd.DataFrame, jobs: int) -> list[str]:
    """Lines of the tables of the benchmark, of the clips of its half test."""
    conditions = main_conditions(test[test["tracker"] == NAME])
    # Cases of a heart differ in their acoustics alone, of which blobs have none.
    once = pd.concat(conditions.values()).drop_duplicates(["heart", "view"])
    views = list(zip(once["case"], once["view"], strict=True))
    found = pd.DataFrame([row for rows in in_processes(partial(limits, folder), views, jobs) for row in rows])
    found = found.merge(once[["case", "view", "heart"]], on=["case", "view"]).drop(columns="case")
    names = [f"{name}{of}" for name in METRICS for of in (" own", " plane", "")]
    errors, biases = [], []
    for condition, part in conditions.items():
        hearts = of_hearts(part.merge(found, on=["heart", "view", "size_px"]), names)
        rest = hearts[NRMSE] ** 2 - hearts[f"{NRMSE} own"] ** 2 - hearts[f"{NRMSE} plane"] ** 2
        hearts["rest"] = np.sqrt(np.maximum(rest, 0))
        for size, of_size in hearts.groupby("size_px", sort=False):
            medians = of_size[[f"{NRMSE} own", f"{NRMSE} plane", "rest", NRMSE]].median()
            errors.append([condition, size, *(f"{value:.1f}" for value in medians)])
            means = of_size[[f"{name}{of}" for name in METRICS[1:] for of in (" own", " plane", "")]].mean()
            biases.append([condition, size, *(f"{value:.2f}" for value in means)])
    strains = [f"{strain}: {of}" for strain in ("GCS", "GLS") for of in ("own", "plane", "images")]
    return [
        *report.table(["condition", "px", "own", "plane", "rest", "images"], errors),
        "",
        "Bias of global strain, percentage points, mean over the hearts.",
        "",
        *report.table(["condition", "px", *strains], biases),
    ]


def ablation(folder: Path, every: pd.DataFrame, jobs: int) -> list[str]:
    """Lines of the table of config/ablation.yaml: hearts over what was taken away, 512 / 256 / 128 px.

    Parameters
    ----------
    folder : Path
        Folder of its repository.
    every : DataFrame
        Clips of the benchmark, in which these hearts are with all of it, and with none.
    jobs : int
        Number of processes.
    """
    found = read([folder], [], jobs).clips
    hearts = list(dict.fromkeys(found["heart"]))
    found = pd.concat([found, every[every["variation"].isin(PLAIN)]])
    found = found[found["tracker"] == NAME]
    lines = []
    for acoustics, names in TAKEN_AWAY.items():
        part = found[found["acoustics"] == acoustics]
        for variation, name in names.items():
            mean = of_hearts(part[part["variation"] == variation], [NRMSE]).set_index(["heart", "size_px"])[NRMSE]
            lines.append([name, *(_sizes(mean[heart] if heart in mean else mean[:0]) for heart in hearts)])
    return report.table(["taken away", *hearts], lines)


def _sizes(errors: pd.Series) -> str:
    """Errors of the image sizes of a heart, from the largest on; a dash where there is none."""
    return " / ".join(f"{error:.1f}" for error in errors.sort_index(ascending=False)) or "–"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("benchmark", type=Path, help="folder of the repository of config/benchmark.yaml")
    parser.add_argument("ablation", type=Path, help="folder of the repository of config/ablation.yaml")
    parser.add_argument("--jobs", type=int, default=1, help="number of processes (default: 1)")
    given = parser.parse_args()
    records = read([given.benchmark], [], given.jobs)
    text = [
        *("# Whose the error is", "", f"NRMSE of `{NAME}` at end-systole, %.", ""),
        *("## The half test of the benchmark", ""),
        "Median over the hearts of the mean over the views. `own`: on images without a beam. `plane`: of a perfect",
        "tracker of the plane. `rest`: what is left of `images`, in squares: the beam and the acoustics.",
        *("", *sources(given.benchmark, records.of_split(TEST).clips, given.jobs), ""),
        *("## One thing taken away", ""),
        "Hearts of the half develop, mean over the views, 512 / 256 / 128 px.",
        *("", *ablation(given.ablation, records.clips, given.jobs), ""),
    ]
    (RESULTS / "error_sources.md").write_text("\n".join(text))


if __name__ == "__main__":
    main()
