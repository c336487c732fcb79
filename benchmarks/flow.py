"""Flow from frame to frame: how fast pairs are read, and how well it composes to the motion since end-diastole.

    python benchmarks/flow.py               # a small heart, half a minute
    python benchmarks/flow.py out/default   # a heart of a repository

The truth of the heart is written to a store of its own as the workflow writes it, beside images of noise, and read
again on one core: pairs of frames of 256 px with the flow between them. Composed is the flow of 512 px of each view,
from end-diastole to the last frame, and compared with the tissue itself. The results stand in
benchmarks/results/flow.md.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import zarr
from scipy.ndimage import gaussian_filter, map_coordinates

import echotruth as et
from echotruth.cases import expand
from echotruth.config.building import configure
from echotruth.heart import Heart
from echotruth.imaging.bmode import pixel_centres
from echotruth.imaging.flow import STEPS, slice_thickness
from echotruth.imaging.labels import unpack
from echotruth.imaging.tracks import follow
from echotruth.imaging.truth import pixel_truth
from echotruth.imaging.view import imaging_plane
from echotruth.learning import FlowPairs
from echotruth.repository.layout import lay_out
from echotruth.repository.rounding import length_quantum, rounded
from echotruth.workflow.job import Job

RESULTS = Path(__file__).parent / "results"
SMALL = {"circumferential_elements": 12, "longitudinal_elements": 8, "transmural_elements": 2}
SIZE, VIEW, NEXT = 256, "mid", list(STEPS).index("next")
NEAR = {"1 um": 1e-6, "5 um": 5e-6, "20 um": 20e-6}
"""Greatest distance of tissue from the plane, m, of the rows of the table."""


def stored(folder: Path, heart: Heart) -> Path:
    """A repository of the heart with truth and images, of noise, of one view and size."""
    config = heart.config.model_copy(update={"name": folder.name, "cases": configure({}).cases})
    (case,) = expand(config)
    lay_out(folder, config, [case])
    plane = imaging_plane(config.views[VIEW], config.rf, heart.endo_at_ed)
    posed = {"scatterer_count": 0, "origin": plane.origin, "axes": plane.axes, "centre": np.zeros(2)}
    noise = np.random.default_rng(1).standard_normal((config.loop.frames, SIZE, SIZE))
    image = np.clip(128 + 200 * gaussian_filter(noise, (0, 1, 1)), 0, 255).astype(np.uint8)
    truth = pixel_truth(heart, plane, *pixel_centres(config.bmode, SIZE))
    kept = ("geometry", "fibres", "pathology", "mechanics")
    Job(folder, "mechanics", case.id).commit({name: heart.arrays[name] for name in kept})
    Job(folder, "phantom", case.id, VIEW).commit({"phantom": posed})
    Job(folder, "truth", case.id, VIEW, SIZE).commit({f"truth/{SIZE}": truth})
    Job(folder, "bmode", case.id, VIEW, SIZE).commit({f"bmode/{SIZE}": {"image": image}})
    return folder


def direct(folder: Path) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Pairs read by zarr, two frames and the flow from the first to the second at a time."""
    store = zarr.open_group(folder / f"{folder.name}.zarr", mode="r", use_consolidated=False)
    image, flow = store[f"bmode/{SIZE}/image"], store[f"truth/{SIZE}/flow"]
    view = list(np.asarray(store["phantom/view"])).index(VIEW)
    for frame in range(image.shape[2] - 1):
        yield image[0, view, frame : frame + 2], flow[0, view, frame, NEXT]


def whole(folder: Path) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Pairs read by zarr, all frames of a clip at once."""
    store = zarr.open_group(folder / f"{folder.name}.zarr", mode="r", use_consolidated=False)
    view = list(np.asarray(store["phantom/view"])).index(VIEW)
    image, flow = store[f"bmode/{SIZE}/image"][0, view], store[f"truth/{SIZE}/flow"][0, view, :, NEXT]
    for frame in range(len(image) - 1):
        yield image[frame : frame + 2], flow[frame]


def clip(folder: Path) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Pairs of a clip that is read as a whole."""
    read = et.Repository(folder).clip("heart", VIEW, SIZE, variables=("image", "flow"))
    image, flow = read["image"].values, read["flow"].sel(to="next").values
    for frame in range(len(image) - 1):
        yield image[frame : frame + 2], flow[frame]


def rate(pairs: Callable[[], Iterator[object]]) -> float:
    """Pairs per second of processor time, the best of ten."""
    rates = []
    for _ in range(10):
        start = time.process_time()
        count = sum(1 for _ in pairs())
        rates.append(count / (time.process_time() - start))
    return max(rates)


@dataclass(frozen=True)
class Composed:
    """Flow composed from end-diastole to the last frame, by pixel in the wall.

    Attributes
    ----------
    error : ndarray of shape (n,), px
        Largest distance over all frames from the tissue; NaN where flow was lost.
    of_the_grid : ndarray of shape (n,), px
        The same from the path that the exact motion in the plane composes to, without pixels.
    elevation : ndarray of shape (n,), m
        Largest distance of the tissue from the plane.
    half_slice : ndarray of shape (n,), m
    """

    error: np.ndarray
    of_the_grid: np.ndarray
    elevation: np.ndarray
    half_slice: np.ndarray


def composed(heart: Heart, view: str) -> Composed:
    """Compose the flow of a view at 512 px, rounded as it is stored."""
    config = heart.config
    plane = imaging_plane(config.views[view], config.rf, heart.endo_at_ed)
    axial, lateral = pixel_centres(config.bmode, 512)
    truth, spacing = pixel_truth(heart, plane, axial, lateral), axial[1] - axial[0]
    flow = rounded(truth["flow"], length_quantum(config))
    rows, columns = np.nonzero(unpack(truth["labels"])["mask"][0])
    start = np.column_stack([lateral[columns], axial[rows]])
    positions, origin = heart.nodes + heart.displacement, np.array([lateral[0], axial[0]])
    true, exact = follow(positions, heart.cells, plane, start), start
    place, error, grid = (start - origin) / spacing, np.zeros(len(rows)), np.zeros(len(rows))
    for frame in range(len(flow) - 1):
        image = np.moveaxis(flow[frame, NEXT, ..., :2], -1, 0).astype(float)
        steps = [map_coordinates(each, place.T[::-1], order=1, cval=np.nan) for each in image]
        place = place + np.stack(steps, -1) / spacing
        inside = np.isfinite(exact).all(axis=1)
        exact = exact.copy()
        exact[inside] = follow(positions[frame : frame + 2], heart.cells, plane, exact[inside])[1, :, :2]
        error = np.maximum(error, np.linalg.norm(place - (true[frame + 1, :, :2] - origin) / spacing, axis=1))
        grid = np.maximum(grid, np.linalg.norm(place - (exact - origin) / spacing, axis=1))
    return Composed(error, grid, np.abs(true[..., 2]).max(axis=0), slice_thickness(config, np.hypot(*start.T)) / 2)


def table(heart: Heart) -> list[dict[str, object]]:
    """Errors of composed flow by view and distance from the plane."""
    rows = []
    for view in heart.config.views:
        found = composed(heart, view)
        for name, limit in {**NEAR, "the slice": found.half_slice, "all": np.inf}.items():
            near, known = found.elevation < limit, np.isfinite(found.error)
            if (near & known).any():
                median, p95, largest = np.quantile(found.error[near & known], (0.5, 0.95, 1))
                rows.append(
                    {"view": view, "within": name, "pixels": int((near & known).sum()), "median": median, "p95": p95}
                    | {"largest": largest, "of_the_grid": float(np.nanmax(found.of_the_grid[near & known]))}
                    | {"lost": 1 - float(known[near].mean())}
                )
    return rows


def page(found: dict) -> str:
    """The results as a page."""
    lines = [
        "# Flow",
        "",
        f"`python benchmarks/flow.py`, of {found['heart']}.",
        "",
        f"Pairs of {SIZE} px with the flow between them, read on one core, per second of processor time:",
        "",
        "| way | pairs/s |",
        "|---|---|",
        *(f"| {name} | {value:.0f} |" for name, value in found["pairs_per_s"].items()),
        "",
        "Flow of 512 px composed from end-diastole to the last frame, largest error over all frames, px. `within`:",
        "tissue that is never farther from the plane; `of the grid`: largest part of the error due to pixels and",
        "rounding, the distance from what the exact motion in the plane composes to; `lost`: share of it that comes to",
        "the edge of the wall, where not all pixels around it have a flow.",
        "",
        "| view | within | pixels | median | 95 % | largest | of the grid | lost |",
        "|---|---|---|---|---|---|---|---|",
        *(
            f"| {r['view']} | {r['within']} | {r['pixels']} | {r['median']:.3f} | {r['p95']:.3f} | {r['largest']:.3f} "
            f"| {r['of_the_grid']:.3f} | {100 * r['lost']:.0f} % |"
            for r in found["composed"]
        ),
        "",
    ]
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("repository", type=Path, nargs="?", help="folder of a repository with a heart, as out/default")
    parser.add_argument("--case", default="heart")
    parser.add_argument("--results", type=Path, default=RESULTS)
    arguments = parser.parse_args()
    if arguments.repository is None:
        heart, name = et.beat(et.configure(geometry=SMALL)), "a small heart"
    else:
        heart = et.Repository(arguments.repository).heart(arguments.case)
        name = f"the heart of {arguments.repository.name}"
    with tempfile.TemporaryDirectory() as folder:
        made = stored(Path(folder) / "flow", heart)
        ways = {
            "`zarr`, pair by pair": lambda: direct(made),
            "`zarr`, a clip at once": lambda: whole(made),
            '`echotruth.Repository.clip(..., variables=("image", "flow"))`': lambda: clip(made),
            "`echotruth.learning.FlowPairs`": lambda: iter(FlowPairs(made, ["heart"], [VIEW], SIZE)),
        }
        rates = {way: rate(pairs) for way, pairs in ways.items()}
    found = {"heart": name, "pairs_per_s": rates, "composed": table(heart)}
    arguments.results.mkdir(parents=True, exist_ok=True)
    (arguments.results / "flow.json").write_text(json.dumps(found, indent=1) + "\n")
    (arguments.results / "flow.md").write_text(page(found))
    print(page(found))


if __name__ == "__main__":
    main()
