"""The published mouse heart in a repository, against its files: strains, twist and volumes.

    echotruth run config/fimh25.yaml
    python benchmarks/fimh25.py out/fimh25 FIMH25_tutorial/Datasets/Mouse_LV_FE/vtks

What the store holds is compared with what meshio and NumPy find in two of the files: strain of linear tetrahedra along
axes from the distances to the two surfaces instead of Laplace's equation, twist of the nodes about the z axis of the
files, and the volume of the cavity, closed at its rim, by the divergence theorem. The table is results/fimh25.md.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import meshio
import numpy as np
from scipy.spatial import cKDTree

import echotruth as et

UNIT = 1e-4
"""m."""
ED, ES = 4, 33
"""Numbers in the names of the files of the largest and of the smallest cavity."""


def read(folder: Path, number: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (n, 3), m, and tetrahedra (n_cells, 4) of a file."""
    mesh = meshio.read(folder / f"position_{number:04d}.vtk")
    return UNIT * mesh.points, mesh.cells_dict["tetra"]


def surfaces(nodes: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Outer triangles (n, 3), normals out of the wall, and their sides: 0 endocardium, 1 epicardium, 2 base.

    The base is what lies within 0.25 mm of the top and faces it; of the rest, what faces the long axis is endocardium.
    """
    faces = cells[:, [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]].reshape(-1, 3)
    _, index, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    facets = faces[index[count == 1]]
    corner = nodes[facets]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    centre, top = corner.mean(axis=1), nodes[:, 2].max()
    base = (centre[:, 2] > top - 2.5e-4) & (normal[:, 2] > 0.7 * np.linalg.norm(normal, axis=1))
    axis = centre[base].mean(axis=0)
    # From a point low on the axis the endocardium of a cup faces inwards everywhere.
    towards = centre - [axis[0], axis[1], np.quantile(nodes[:, 2], 0.35)]
    inward = np.einsum("fi,fi->f", normal, towards) < 0
    return facets, np.where(base, 2, np.where(inward, 0, 1))


def depth_gradient(nodes: np.ndarray, cells: np.ndarray, facets: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """Gradient (n_cells, 3) of the relative distance from endo- to epicardium."""
    to = [cKDTree(nodes[facets[sides == side]].mean(axis=1)).query(nodes)[0] for side in (0, 1)]
    depth = to[0] / (to[0] + to[1])
    edges = nodes[cells[:, 1:]] - nodes[cells[:, :1]]
    return np.linalg.solve(edges, (depth[cells[:, 1:]] - depth[cells[:, :1]])[..., None])[..., 0]


def strains(ed: np.ndarray, es: np.ndarray, cells: np.ndarray, radial: np.ndarray) -> dict[str, float]:
    """Means over the volume of the Green-Lagrange strains along R, C and L, with the long axis along z."""
    before, after = (np.swapaxes(x[cells[:, 1:]] - x[cells[:, :1]], 1, 2) for x in (ed, es))
    gradient = after @ np.linalg.inv(before)
    strain = (np.swapaxes(gradient, 1, 2) @ gradient - np.eye(3)) / 2
    r = radial / np.linalg.norm(radial, axis=1, keepdims=True)
    c = np.cross([0, 0, 1.0], r)
    c /= np.linalg.norm(c, axis=1, keepdims=True)
    axes = {"R": r, "C": c, "L": np.cross(r, c)}
    volume = np.linalg.det(before)
    return {
        a + b: float(np.einsum("ci,cij,cj,c->", axes[a], strain, axes[b], volume) / volume.sum())
        for a, b in ("RR", "CC", "LL", "RC", "RL", "CL")
    }


def rotation(before: np.ndarray, after: np.ndarray) -> float:
    """Least-squares rotation about z of nodes (n, 3), deg, counter-clockwise seen from the apex."""
    a, b = (x[:, :2] - x[:, :2].mean(axis=0) for x in (before, after))
    return -float(np.degrees(np.arctan2(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), np.sum(a * b))))


def cavity(nodes: np.ndarray, facets: np.ndarray, sides: np.ndarray) -> float:
    """Volume, uL, between the endocardium and a cone to the middle of its rim."""
    endo = facets[sides == 0]
    edges = np.sort(endo[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    rim, count = np.unique(edges, axis=0, return_counts=True)
    corner = nodes[endo] - nodes[np.unique(rim[count == 1])].mean(axis=0)
    return -1e9 * float(np.sum(corner[:, 0] * np.cross(corner[:, 1], corner[:, 2]))) / 6


def of_files(folder: Path) -> dict[str, float]:
    """Measures of the files."""
    ed, cells = read(folder, ED)
    es, _ = read(folder, ES)
    facets, sides = surfaces(ed, cells)
    found = strains(ed, es, cells, depth_gradient(ed, cells, facets, sides))
    base, apex = ed[facets[sides == 2]][..., 2].mean(), ed[facets[sides == 0]][..., 2].min()
    height = (ed[:, 2] - base) / (apex - base)
    slices = [np.abs(height - centre) <= 0.1 for centre in (0.8, 0.2)]
    twist = [rotation(ed[nodes], es[nodes]) for nodes in slices]
    volumes = {f"{name} (uL)": cavity(x, facets, sides) for name, x in (("EDV", ed), ("ESV", es))}
    return {f"E_{name}": value for name, value in found.items()} | {"twist (deg)": twist[0] - twist[1]} | volumes


def of_store(repository: Path) -> dict[str, float]:
    """The same of the groups kinematics, physiology and mechanics."""
    read, case = et.Repository(repository).read, "heart"
    es = int(read("mechanics/es_frame", case))
    mean, volume = read("kinematics/strain_mean", case, None, es), 1e9 * read("mechanics/volume", case)
    found = {f"E_{name}": float(value) for name, value in zip(("RR", "CC", "LL", "RC", "RL", "CL"), mean, strict=True)}
    twist = float(np.degrees(read("physiology/twist", case, None, es)))
    return found | {"twist (deg)": twist, "EDV (uL)": float(volume[0]), "ESV (uL)": float(volume[es])}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("repository", type=Path)
    parser.add_argument("files", type=Path)
    arguments = parser.parse_args()
    files, store = of_files(arguments.files), of_store(arguments.repository)
    print("| | files | store | difference |\n|---|---|---|---|")
    for name, value in files.items():
        print(f"| {name} | {value:.4g} | {store[name]:.4g} | {100 * (store[name] / value - 1):+.1f} % |")


if __name__ == "__main__":
    main()
