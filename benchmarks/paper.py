"""The numbers and figures of the paper on three hearts: its authors' own, the one that it prints, and the default.

    echotruth run config/fimh25.yaml
    echotruth run config/paper.yaml
    echotruth run default.yaml  # no keys but the name and `tracking.trackers` of config/paper.yaml
    python benchmarks/paper.py --authors out/fimh25 --printed out/paper --default out/default

`--otherwise "in the plane=out/FOLDER"` adds a column to the table of corrections, for the authors' heart run with
`phantom.in_plane_only: true`.

The page is results/paper.md, its figures are results/paper_*.png. Of the numbers, those of the heart are read from the
groups kinematics, mechanics and physiology, and those of the trackers from tracking.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import report
from paper_figures import Hearts, draw_figures, draw_geometry
from paper_heart import SLICES, Heart, least_strain, tube_ejection_fraction, tube_strain

RESULTS = Path(__file__).parent / "results"
TEXT = Path(__file__).parent / "paper.md.template"
"""The page without its numbers."""

AS_PRINTED = "as_published"
MENDED = ("corrected", "bspline_dic")
TRACKERS = (AS_PRINTED, *MENDED)

REGIONS: dict[str, tuple[tuple[str, ...], bool]] = {
    "mid slice": (("mid",), False),
    "mid slice less its mean motion": (("mid",), True),
    "three slices together": (SLICES, False),
}
"""Views whose points are taken together, and whether the mean motion of each is subtracted."""

PRINTED = {"RR": (0.2411, 0.0407), "CC": (-0.1825, 0.0315)}
"""Mean and standard deviation that the paper prints."""
RR, CC = (PRINTED[name][0] for name in ("RR", "CC"))

NAMES = {
    "authors": "authors' heart",
    "printed": "paper's heart",
    "default": "default heart",
}

ALONE = {"from frame to frame": {"reference": "previous"}, "tapered": {"taper": "hann"}}
"""Corrections of the printed tracker, one at a time."""

NORMALISERS = (
    "RMS error, um",
    "over RMS circumferential",
    "the same less mean motion",
    "over largest circumferential",
    "over RMS in the plane",
    "error in the plane over RMS in the plane",
)
"""Columns of the table of normalisers."""

Cells = Callable[[Heart], str]


def row(name: str, printed: str, value: Cells, hearts: Hearts) -> list[str]:
    """Line of the table: the quantity, as printed, and of each heart."""
    return [name, printed, *(value(heart) for heart in hearts.values())]


def mean_sd(component: str) -> Cells:
    """Mean and standard deviation of a strain."""
    return lambda heart: "{:+.3f} ± {:.3f}".format(*heart.strain(component))


def heart_rows(hearts: Hearts) -> list[list[str]]:
    """The hearts themselves."""

    def layers(heart: Heart) -> str:
        return "{:+.3f} .. {:+.3f}".format(*heart.layer_strain("CC")[[0, -1]])

    def bound(heart: Heart) -> str:
        return f"{least_strain(heart.strain('RR')[0], heart.strain('CC')[0]):+.3f}"

    def tube(heart: Heart) -> str:
        return "{1:+.3f}, {0:+.3f}".format(
            *tube_strain(heart.volumes["edv"], heart.ejection_fraction, heart.volumes["wall"], heart.strain("LL")[0])
        )

    printed = {name: "{:+.4f} ± {:.4f}".format(*value) for name, value in PRINTED.items()}
    return [
        row("E_CC", printed["CC"], mean_sd("CC"), hearts),
        row("E_RR", printed["RR"], mean_sd("RR"), hearts),
        row("E_LL", "shortening", mean_sd("LL"), hearts),
        row("least E_LL that E_RR and E_CC allow", f"{least_strain(RR, CC):+.3f}", bound, hearts),
        row("E_CC, E_RR of a tube that ejects as much", "", tube, hearts),
        row("E_CC, endo .. epi layer", "", layers, hearts),
        row("ejection fraction", "", lambda heart: f"{100 * heart.ejection_fraction:.1f} %", hearts),
        row("twist", "", lambda heart: f"{heart.twist:+.1f} deg", hearts),
    ]


def spread_rows(hearts: Hearts) -> list[list[str]]:
    """Fall of the spread of circumferential displacement through the wall, by finite elements and tracked at 512 px."""

    def fall(region: str, tracker: str | None) -> Cells:
        views, centred = REGIONS[region]
        return lambda heart: f"{heart.fall(views, tracker, centred):+.0f} %"

    lines = []
    for tracker, printed in ((None, "50 %"), *((name, "10 % at most") for name in TRACKERS)):
        source = f"`{tracker}`" if tracker else "FE"
        lines += [
            row(f"fall of the spread, {source}, {region}", printed, fall(region, tracker), hearts) for region in REGIONS
        ]
    return lines


def error_rows(hearts: Hearts, view: str, printed: str) -> list[list[str]]:
    """Error of circumferential displacement over its RMS, by image size, %."""

    def shown(tracker: str) -> Cells:
        return lambda heart: sizes(heart, view, tracker)

    return [row(f"error (%), `{tracker}`, {view}", printed, shown(tracker), hearts) for tracker in TRACKERS]


def step_rows(hearts: Hearts) -> list[list[str]]:
    """The same in the mid slice of some repositories, as printed and with one correction alone, and with more."""

    def anew(options: Mapping[str, str]) -> Cells:
        def cell(heart: Heart) -> str:
            errors = (heart.tracked_anew("mid", size, "phase_correlation", options) for size in heart.sizes)
            return " / ".join(f"{error:.0f}" for error in errors)

        return cell

    def stored(tracker: str) -> Cells:
        return lambda heart: sizes(heart, "mid", tracker)

    lines: dict[str, Cells] = {f"as printed (`{AS_PRINTED}`)": stored(AS_PRINTED)}
    lines |= {f"as printed, but {name}": anew(options) for name, options in ALONE.items()}
    lines |= {"both (`tapered`)": stored("tapered")} | {f"`{tracker}`": stored(tracker) for tracker in MENDED}
    return [[name, *(value(heart) for heart in hearts.values())] for name, value in lines.items()]


def normaliser_rows(hearts: Hearts) -> list[list[str]]:
    """The error in the mid slice in um and by other normalisers, one line a heart and tracker."""
    lines = []
    for name, heart in hearts.items():
        for tracker in TRACKERS:
            found = [heart.normalised("mid", tracker, size) for size in heart.sizes]
            cells = [" / ".join(f"{each[key]:.0f}" for each in found) for key in found[0]]
            lines.append([NAMES[name], f"`{tracker}`", *cells])
    return lines


def sizes(heart: Heart, view: str, tracker: str, measure: str = "circumferential") -> str:
    """Error by image size, %."""
    return " / ".join(f"{heart.normalised(view, tracker, size)[measure]:.0f}" for size in heart.sizes)


def numbers(hearts: Hearts) -> dict[str, float | str]:
    """Numbers of the text."""
    heart = hearts["authors"]
    longitudinal = heart.strain("LL")[0]
    volumes = heart.volumes["edv"], heart.volumes["wall"], longitudinal
    mid = {name: {tracker: sizes(each, "mid", tracker) for tracker in TRACKERS} for name, each in hearts.items()}
    spread, spread_centred = (
        1e6 * np.std(heart.circumferential("mid", heart.sizes[0], None, centred)[0]) for centred in (False, True)
    )
    return {
        "RR": RR,
        "CC": CC,
        "least_ll": float(least_strain(RR, CC)),
        "least_cc": float(least_strain(RR, longitudinal)),
        "least_rr": float(least_strain(CC, longitudinal)),
        "ef_rr": 100 * tube_ejection_fraction(*volumes, 0, RR),
        "ef_cc": 100 * tube_ejection_fraction(*volumes, 1, CC),
        "ef": 100 * heart.ejection_fraction,
        "edv": volumes[0],
        "wall": volumes[1],
        "ll": longitudinal,
        "det_f": float(heart.group("kinematics").volume_ratio_mean[heart.es]),
        "rr": heart.strain("RR")[0],
        "rr_sd": heart.strain("RR")[1],
        "cc": heart.strain("CC")[0],
        "cc_sd": heart.strain("CC")[1],
        "endo_cc": heart.layer_strain("CC")[0],
        "printed_cc": hearts["printed"].strain("CC")[0],
        "default_cc": hearts["default"].strain("CC")[0],
        "corrected": mid["authors"]["corrected"],
        "corrected_apex": sizes(heart, "apex", "corrected"),
        "corrected_centred": sizes(heart, "mid", "corrected", "centred"),
        "corrected_printed": mid["printed"]["corrected"],
        "corrected_default": mid["default"]["corrected"],
        "best": mid["authors"]["bspline_dic"],
        "as_published": mid["authors"][AS_PRINTED],
        "mean_motion": 1e3 * heart.mean_motion("mid"),
        "largest_px": heart.largest_displacement("mid"),
        "twist_ivc": hearts["printed"].measured("twist_ivc"),
        "spread": spread,
        "spread_centred": spread_centred,
        "fall": heart.fall(("mid",)),
        "fall_centred": heart.fall(("mid",), None, True),
        "fall_published": heart.fall(("mid",), AS_PRINTED),
    }


def page(hearts: Hearts, otherwise: Hearts) -> str:
    """Markdown of the page."""
    head = ["", "printed", *(NAMES[name] for name in hearts)]
    rows = [*heart_rows(hearts), *spread_rows(hearts)]
    rows += [*error_rows(hearts, "mid", "20 / 25 / 25"), *error_rows(hearts, "apex", "")]
    parts = {
        "table": report.table(head, rows),
        "normalisers": report.table(["heart", "tracker", *NORMALISERS], normaliser_rows(hearts)),
        "steps": report.table(["", *otherwise], step_rows(otherwise)),
        "bmode": [f"![B-mode of the {NAMES[name]}](paper_bmode_{name}.png)" for name in hearts],
        "bullseyes": [
            f"![{NAMES[name]}, {tracker}](paper_bullseye_{name}_{tracker}.png)"
            for name in hearts
            for tracker in (AS_PRINTED, MENDED[0])
        ],
        "errors": [f"![error through the wall of the {NAMES[name]}](paper_error_{name}.png)" for name in hearts],
    }
    filled = {name: "\n".join(lines) for name, lines in parts.items()}
    return TEXT.read_text().format(**filled, **numbers(hearts))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in NAMES:
        parser.add_argument(f"--{name}", type=Path, required=True, help="folder of a repository")
    text = "the authors' heart imaged otherwise, for the last table"
    parser.add_argument("--otherwise", nargs="*", default=[], metavar="LABEL=FOLDER", help=text)
    given = vars(parser.parse_args())
    hearts = {name: Heart(given[name]) for name in NAMES}
    otherwise = {"imaged as above": hearts["authors"]}
    for pair in given["otherwise"]:
        label, _, folder = pair.partition("=")
        otherwise[label] = Heart(Path(folder))
    draw_geometry(RESULTS / "paper_geometry.png", {NAMES[name]: heart for name, heart in hearts.items()})
    draw_figures(RESULTS, hearts, AS_PRINTED, MENDED[0])
    (RESULTS / "paper.md").write_text(page(hearts, otherwise))


if __name__ == "__main__":
    main()
