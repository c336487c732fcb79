"""Mesh convergence of the paper's heart, for which another code has an axisymmetric solution."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from echotruth.mechanics.kinematics import volume_ratios
from echotruth.report import style
from validation import heart
from validation.report import Report, Row

MESHES = ((12, 6, 1), (18, 9, 2), heart.DEFAULT_MESH, (30, 16, 4), (36, 20, 5))

AXISYMMETRIC = {"E_CC": -0.170, "E_LL": -0.095, "E_RR": 0.54, "T_Ca at ES": 43.0, "stiffness C": 1.1}
"""Wall means at end-systole, kPa, of an axisymmetric mixed solution by another code, made before this solver.

Its loop had 100 mmHg at end-systole, and that which ships has 99.5."""

STRAINS = {"E_RR": 0, "E_CC": 1, "E_LL": 2}
"""Index of each among the components of strain."""


@dataclass(frozen=True)
class Results:
    """Quantities of the heart on each mesh.

    Attributes
    ----------
    meshes : tuple of (int, int, int)
        Elements around, along and through the wall.
    cells : tuple of int
    stiffness, tension : tuple of float, Pa
        C, and T_Ca at end-systole.
    mean, sd : ndarray of shape (n_meshes, 6)
        Of the strain of the wall at end-systole.
    smallest_det_f : tuple of float
        Of all points and frames.
    """

    meshes: tuple[tuple[int, int, int], ...]
    cells: tuple[int, ...]
    stiffness: tuple[float, ...]
    tension: tuple[float, ...]
    mean: np.ndarray
    sd: np.ndarray
    smallest_det_f: tuple[float, ...]


def measure(quick: bool = False) -> Results:
    """The beat on all meshes, or on two that are coarser if `quick`."""
    meshes = ((6, 6, 1), (6, 8, 2)) if quick else MESHES
    solved = [heart.solved_papers(*counts) for counts in meshes]
    strains = [case.strain() for case in solved]
    return Results(
        meshes,
        tuple(len(case.wall.mesh.cells) for case in solved),
        tuple(case.beat.stiffness for case in solved),
        tuple(float(case.beat.active_tension[case.es]) for case in solved),
        np.array([mean for mean, _ in strains]),
        np.array([sd for _, sd in strains]),
        tuple(float(volume_ratios(case.wall.mesh, case.beat.displacement)[0].min()) for case in solved),
    )


def report(results: Results) -> Report:
    """Rows of the page: the default mesh, or the last but one, against the finest."""
    default = results.meshes.index(heart.DEFAULT_MESH) if heart.DEFAULT_MESH in results.meshes else None
    at, best = (-2, -1) if default is None else (default, default)
    finest = f"the finest mesh, {results.cells[-1]} cells"
    other = "axisymmetric solution by another code"
    size, rows = f"{results.cells[at]} cells", []
    for name, (solved, expected, allowed, form) in _compared(results, at).items():
        rows.append(Row(f"{name}, {size}", solved, expected, allowed, finest, form))
    for name, (solved, _, allowed, form) in _compared(results, best).items():
        rows.append(Row(f"{name}, {results.cells[best]} cells", solved, AXISYMMETRIC[name], allowed, other, form))
    rows.append(
        Row(f"smallest det F, {size}", results.smallest_det_f[at], results.smallest_det_f[-1], None, finest, ".2f")
    )
    text = (
        "The paper's heart (config/paper.yaml), its whole beat solved on meshes of 1 to 5 elements through the wall. "
        f"The default mesh has {' x '.join(map(str, heart.DEFAULT_MESH))} elements around, along and through the wall. "
        "Strains are means (and standard deviations) over the wall at its quadrature points, of ES against ED; tension "
        "and stiffness are in kPa. The axisymmetric solution is a mixed one, from before this solver.\n\n"
        "| cells | C (kPa) | T_Ca at ES (kPa) | E_CC (sd) | E_LL (sd) | E_RR (sd) | smallest det F |\n"
        "|---|---|---|---|---|---|---|\n" + "\n".join(_line(results, k) for k in range(len(results.cells)))
    )
    caption = "Wall means of strain, and active tension, at end-systole on finer and finer meshes."
    return Report("The paper's heart under refinement", text, tuple(rows), caption)


def _compared(results: Results, at: int) -> dict[str, tuple[float, float, float, str]]:
    """Name to the value on one mesh and on the finest, the allowed difference, and the number format; kPa."""
    allowed = {"E_CC": 0.01, "E_LL": 0.01, "E_RR": 0.03}
    compared = {
        name: (*results.mean[[at, -1], STRAINS[name]], difference, ".3f") for name, difference in allowed.items()
    }
    for name, values in (("T_Ca at ES", results.tension), ("stiffness C", results.stiffness)):
        solved, finest = values[at] / 1e3, values[-1] / 1e3
        compared[name] = (solved, finest, 0.03 * finest, ".3f")
    return compared


def _line(results: Results, k: int) -> str:
    strains = (f"{results.mean[k, i]:.3f} ({results.sd[k, i]:.3f})" for i in (1, 2, 0))
    values = (f"{results.stiffness[k] / 1e3:.3f}", f"{results.tension[k] / 1e3:.2f}", *strains)
    return f"| {results.cells[k]} | {' | '.join(values)} | {results.smallest_det_f[k]:.2f} |"


@style.styled
def draw(results: Results) -> Figure:
    """Strains and tension against the number of cells."""
    figure = style.figure(7.2, 3.0)
    left, right = figure.subplots(1, 2)
    for name, component in STRAINS.items():
        shown = style.QUANTITIES[name.removeprefix("E_")]
        look = {"color": shown.colour, "markersize": 4, "label": shown.tex}
        left.semilogx(results.cells, shown.factor * results.mean[:, component], "o-", **look)
    left.set(xlabel="Cells", ylabel="Wall mean at end-systole (%)")
    left.legend(loc="center right")
    right.semilogx(results.cells, np.array(results.tension) / 1e3, "o-", color=style.SOLVED, markersize=4)
    right.set(xlabel="Cells", ylabel="$T_{Ca}$ at end-systole (kPa)")
    return figure
