"""The default heart on finer and finer meshes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from echotruth.mechanics.kinematics import volume_ratios
from echotruth.report import style
from validation import heart
from validation.report import Report, Row

MESHES = ((12, 6, 1), (18, 9, 2), heart.SHIPPED, (30, 16, 4), (36, 20, 5))

AXISYMMETRIC = {"E_CC": -0.170, "E_LL": -0.095, "E_RR": 0.54, "T_Ca at ES": 43.0, "stiffness C": 1.1}
"""Wall means at end-systole, kPa, of an axisymmetric mixed solution by another code, made before this solver."""

STRAINS = {"E_RR": 0, "E_CC": 1, "E_LL": 2}
"""Name to place among the components of strain."""


@dataclass(frozen=True)
class Numbers:
    """What comes out of the heart on each mesh.

    Attributes
    ----------
    meshes : tuple of (int, int, int)
        Elements around, along and through the wall.
    cells : tuple of int
    stiffness, tension : tuple of float, Pa
        C, and T_Ca at end-systole.
    mean, sd : ndarray of shape (n_meshes, 6)
        Of the strain of the wall at end-systole.
    smallest : tuple of float
        det F of all points and frames.
    """

    meshes: tuple[tuple[int, int, int], ...]
    cells: tuple[int, ...]
    stiffness: tuple[float, ...]
    tension: tuple[float, ...]
    mean: np.ndarray
    sd: np.ndarray
    smallest: tuple[float, ...]


def measure(quick: bool = False) -> Numbers:
    """The beat on all meshes; on the two coarsest where it is to be quick."""
    meshes = MESHES[:2] if quick else MESHES
    solved = [heart.solved(*counts) for counts in meshes]
    strains = [each.strain() for each in solved]
    return Numbers(
        meshes,
        tuple(len(each.wall.mesh.cells) for each in solved),
        tuple(each.beat.stiffness for each in solved),
        tuple(float(each.beat.tension[each.es]) for each in solved),
        np.array([mean for mean, _ in strains]),
        np.array([sd for _, sd in strains]),
        tuple(float(volume_ratios(each.wall.mesh, each.beat.displacement)[0].min()) for each in solved),
    )


def report(numbers: Numbers) -> Report:
    """Rows of the page: the mesh that ships, or the last but one, against the finest."""
    shipped = numbers.meshes.index(heart.SHIPPED) if heart.SHIPPED in numbers.meshes else None
    at, best = (-2, -1) if shipped is None else (shipped, shipped)
    finest = f"the finest mesh, {numbers.cells[-1]} cells ({' x '.join(map(str, numbers.meshes[-1]))})"
    other = "axisymmetric mixed solution by another code, from before this one; not made anew here"
    size, rows = f"{numbers.cells[at]} cells", []
    for name, (found, expected, allowed, form) in _judged(numbers, at).items():
        rows.append(Row(f"{name}, {size}", found, expected, allowed, finest, form))
    for name, (found, _, allowed, form) in _judged(numbers, best).items():
        rows.append(Row(f"{name}, {numbers.cells[best]} cells", found, AXISYMMETRIC[name], allowed, other, form))
    rows.append(Row(f"smallest det F, {size}", numbers.smallest[at], numbers.smallest[-1], None, finest, ".2f"))
    text = (
        "The default heart, its whole beat solved on meshes of 1 to 5 elements through the wall. "
        f"The mesh that ships has {' x '.join(map(str, heart.SHIPPED))} elements around, along and through the wall. "
        "Strains are means (and standard deviations) over the wall at its quadrature points, of ES against ED; tension "
        "and stiffness are in kPa.\n\n"
        "| cells | C (kPa) | T_Ca at ES (kPa) | E_CC (sd) | E_LL (sd) | E_RR (sd) | smallest det F |\n"
        "|---|---|---|---|---|---|---|\n" + "\n".join(_line(numbers, k) for k in range(len(numbers.cells)))
    )
    caption = "Wall means of strain, and active tension, at end-systole on finer and finer meshes."
    return Report("The default heart under refinement", text, tuple(rows), caption)


def _judged(numbers: Numbers, at: int) -> dict[str, tuple[float, float, float, str]]:
    """Name to value on one mesh, on the finest, what they may differ by, and how they are written; kPa."""
    allowed = {"E_CC": 0.01, "E_LL": 0.01, "E_RR": 0.03}
    judged = {name: (*numbers.mean[[at, -1], STRAINS[name]], each, ".3f") for name, each in allowed.items()}
    for name, values in (("T_Ca at ES", numbers.tension), ("stiffness C", numbers.stiffness)):
        found, finest = values[at] / 1e3, values[-1] / 1e3
        judged[name] = (found, finest, 0.03 * finest, ".3f")
    return judged


def _line(numbers: Numbers, k: int) -> str:
    strains = (f"{numbers.mean[k, i]:.3f} ({numbers.sd[k, i]:.3f})" for i in (1, 2, 0))
    values = (f"{numbers.stiffness[k] / 1e3:.3f}", f"{numbers.tension[k] / 1e3:.2f}", *strains)
    return f"| {numbers.cells[k]} | {' | '.join(values)} | {numbers.smallest[k]:.2f} |"


@style.styled
def draw(numbers: Numbers) -> Figure:
    """Strains and tension against the number of cells."""
    sheet = style.figure(7.2, 3.0)
    left, right = sheet.subplots(1, 2)
    colours = {"E_RR": style.RADIAL, "E_CC": style.CIRCUMFERENTIAL, "E_LL": style.LONGITUDINAL}
    for name, place in STRAINS.items():
        left.semilogx(numbers.cells, numbers.mean[:, place], "o-", color=colours[name], markersize=4, label=name)
    left.set(xlabel="cells", ylabel="wall mean at end-systole")
    left.legend(loc="center right")
    right.semilogx(numbers.cells, np.array(numbers.tension) / 1e3, "o-", color=style.MET, markersize=4)
    right.set(xlabel="cells", ylabel="T_Ca at end-systole (kPa)")
    return sheet
