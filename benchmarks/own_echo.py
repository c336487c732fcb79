"""Whether an exported clip, tracked as one's own echo, has the global strain that the repository has of it.

    python benchmarks/own_echo.py out/benchmark               # hearts whose label split is develop, ideal acoustics
    python benchmarks/own_echo.py out/benchmark a b --px 256  # some cases

Each clip is exported as DICOM and as MP4, read by `et.read_clip`, and tracked by `et.speckle_tracking` with the default
lengths, which follow from the thickness of the wall, in the borders of the heart at end-diastole. Its middle line is
compared with that of the repository's `bspline_dic` at the same frame, the true end-systole; tracking with the
repository's lengths as well tells what these contribute. The results are results/own_echo.md.
"""

import argparse
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import report
import xarray as xr
from suite.splits import DEVELOP, split_of

import echotruth as et
from echotruth.config.tracking import BsplineDic
from echotruth.evaluation.contours import contours
from echotruth.export import Export, Selection

RESULTS = Path(__file__).parent / "results"
FORMATS = {"dicom": "dcm", "mp4": "mp4"}
METHOD = "bspline_dic"
LENGTHS = ("knots_mm", "margin_um", "gain_mm", "speckle_pixel_um")


class Strain(NamedTuple):
    """Global strain of the middle line of one clip, %.

    At the true end-systole: true, of the repository, of the exported clip by format, and of the DICOM tracked with the
    repository's lengths. `smallest`: of the DICOM at its own end-systole, the frame of the smallest cavity.
    """

    case: str
    view: str
    true: float
    repository: float
    dicom: float
    mp4: float
    same_lengths: float
    smallest: float


def drawn(repository: et.Repository, case: str, view: str, clip: xr.Dataset) -> et.Wall:
    """The wall of a heart at end-diastole, in px of a clip (the image in the repository)."""
    plane = repository.plane(case, view)
    lines = contours(repository.heart(case), plane)
    middle = lines.position[lines.contour == 0].reshape(-1, 2).mean(0)
    first, spacing = np.array([clip["lateral"][0], clip["axial"][0]], float), float(clip["axial"][1] - clip["axial"][0])
    borders = [_chain(lines.position[lines.contour == depth].mean(1), middle) for depth in (0, 2)]
    kind = repository.case(case).config.views[view].plane
    return et.Wall(*((border - first) / spacing for border in borders), kind)


def _chain(points: np.ndarray, middle: np.ndarray) -> np.ndarray:
    """Points (n, 2) in the order of their angle about the middle, beginning behind the largest gap."""
    angle = np.arctan2(*(points - middle).T)
    order = np.argsort(angle)
    gaps = np.diff(angle[order], append=angle[order][0] + 2 * np.pi)
    return points[np.roll(order, -1 - np.argmax(gaps))]


def strain(repository: et.Repository, case: str, view: str, px: int) -> Strain:
    """Track a clip of the repository as one's own."""
    image = repository.clip(case, view, px, variables=("image",))
    wall, es = drawn(repository, case, view, image), repository.heart(case).es
    scale = {"spacing_mm": 1e3 * float(image["axial"][1] - image["axial"][0])}
    scale["frame_time_ms"] = 1e3 * float(image["time"][1])
    settings = repository.case(case).config.tracking.trackers.get(METHOD, BsplineDic())
    same = {name: getattr(settings, name) for name in LENGTHS}
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for kind, suffix in FORMATS.items():
            target = Path(folder) / f"clip.{suffix}"
            export = Export(repository, Selection((case,), (view,), (px,)), kind, output=target)
            list(export.write(export.clips()[0]))
            clip = et.read_clip(target, **({} if kind == "dicom" else scale))
            found[kind] = et.speckle_tracking(clip, wall, METHOD)
            if kind == "dicom":
                found["same_lengths"] = et.speckle_tracking(clip, wall, METHOD, **same)
    curves = repository.curves(case, view, METHOD, px).sel(contour="middle")
    known = {
        name: 100 * float(curves[f"{key}_line_strain"][es])
        for name, key in (("true", "true"), ("repository", "tracked"))
    }
    own = {name: 100 * float(each["line_strain"].sel(contour="middle")[es]) for name, each in found.items()}
    smallest = found["dicom"].attrs[next(key for key in ("gcs_percent", "gls_percent") if key in found["dicom"].attrs)]
    return Strain(case, view, **known, **own, smallest=smallest)


def page(table: pd.DataFrame, px: int) -> list[str]:
    """The page of results."""
    rows = [[row.case, row.view, *(f"{value:.2f}" for value in row[3:])] for row in table.itertuples()]
    text = [
        "# Exported clips, tracked as one's own",
        "",
        f"Global strain of the middle line, % (GCS in a short axis, GLS in a long one), {px} px, `{METHOD}`.",
        "",
        *report.table(["heart", "view", "true", "repository", "DICOM", "MP4", "its lengths", "own end-systole"], rows),
        "",
    ]
    for name, words in (("dicom", "DICOM"), ("mp4", "MP4"), ("same_lengths", "DICOM, the repository's lengths")):
        away = (table[name] - table["repository"]).abs()
        text.append(
            f"- {words}, less the repository's at the same frame: {away.mean():.2f} points on average, "
            f"{away.max():.2f} at most; {(away <= 0.5).sum()} of {len(away)} within 0.5."
        )
    return [*text, ""]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("repository", help="folder of a repository, as out/benchmark")
    parser.add_argument("case", nargs="*", help="cases (default: ideal ones whose label split is develop)")
    parser.add_argument("--px", type=int, help="image size (default: the largest)")
    given = parser.parse_args()
    repository = et.Repository(given.repository)
    ideal = [case.id for case in repository.every.values() if split_of(case) == DEVELOP and case.id.endswith("_ideal")]
    px = given.px or repository.sizes[0]
    rows = []
    for case in given.case or ideal:
        for view in repository.case(case).config.views:
            rows.append(strain(repository, case, view, px))
            print(rows[-1], flush=True)
    (RESULTS / "own_echo.md").write_text("\n".join(page(pd.DataFrame(rows), px)))


if __name__ == "__main__":
    main()
