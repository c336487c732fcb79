"""Deformation and strain of the wall.

Strains are Green-Lagrange, in the axes of the wall or of the fibre, relative to the
unloaded state or to end-diastole (F_rel = F F_ED^-1, along axes carried to ED).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from echotruth.fem.quadrature import tetrahedron
from echotruth.fem.tetrahedra import Floats, Mesh
from echotruth.mechanics.fibres import CENTROID, axes_about, gradients, unit
from echotruth.mechanics.solver import element

RCL = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
"""Components RR, CC, LL, RC, RL, CL."""

FIBRE = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (2, 1))
"""Components ff, ss, nn, fs, fn, sn of axes in the order f, s, n."""

IMAGE = ((0, 0), (1, 1), (0, 1))
"""Components RR, TT, RT of axes in the order radial, tangential."""


def deformation_gradient(mesh: Mesh, displacement: Floats, xi: Floats = CENTROID) -> Floats:
    """F from the unloaded state.

    Parameters
    ----------
    mesh : Mesh
    displacement : ndarray of shape (..., n_nodes, 3), m
    xi : ndarray of shape (n_points, 3), optional
        Local coordinates, the same in every tetrahedron; the centroid if not given.

    Returns
    -------
    ndarray of shape (..., n_cells, n_points, 3, 3)
    """
    slope, _ = gradients(mesh, xi)
    return np.eye(3) + np.einsum("...cai,cqaj->...cqij", displacement[..., mesh.cells, :], slope)


def carried_axes(axes: Floats, gradient: Floats) -> Floats:
    """Wall axes carried along.

    Parameters
    ----------
    axes, gradient : ndarray of shape (..., 3, 3)
        Rows R, C, L of the unloaded wall, and F.

    Returns
    -------
    ndarray of shape (..., 3, 3)
        R along F^-T R, the normal of the deformed surfaces of equal depth; C and L as in the unloaded wall.
    """
    return axes_about(np.einsum("...ji,...j->...i", np.linalg.inv(gradient), axes[..., 0, :]))


def carried_fibres(frames: Floats, gradient: Floats) -> Floats:
    """Fibre axes carried along.

    Parameters
    ----------
    frames, gradient : ndarray of shape (..., 3, 3)
        Rows f, s, n of the unloaded wall, and F.

    Returns
    -------
    ndarray of shape (..., 3, 3)
        f along F f, n along F^-T n (the two stay orthogonal) and s = n x f.
    """
    fibre = unit(np.einsum("...ij,...j->...i", gradient, frames[..., 0, :]))
    normal = unit(np.einsum("...ji,...j->...i", np.linalg.inv(gradient), frames[..., 2, :]))
    return np.stack([fibre, np.cross(normal, fibre), normal], axis=-2)


def strain(gradient: Floats, axes: Floats, components: tuple[tuple[int, int], ...]) -> Floats:
    """Green-Lagrange strain E = (F^T F - I) / 2 along axes.

    Parameters
    ----------
    gradient, axes : ndarray of shape (..., 3, 3), or (..., 2, 2) in a plane
        F, and rows of the axes.
    components : pairs of axes

    Returns
    -------
    ndarray of shape (..., len(components))
    """
    # Component by component: on matrices this small, Numpy's loops over the points are the faster ones.
    f, a = (np.ascontiguousarray(np.moveaxis(each, (-2, -1), (0, 1))) for each in (gradient, axes))
    size = range(len(a))
    along = [[sum(f[k, j] * a[i, j] for j in size) for k in size] for i in size]
    return np.stack([(sum(along[i][k] * along[j][k] for k in size) - (i == j)) / 2 for i, j in components], axis=-1)


def wall_strain(mesh: Mesh, displacement: Floats, axes: Floats) -> Floats:
    """Strain since ED (frame 0) at the quadrature points.

    Parameters
    ----------
    mesh : Mesh
    displacement : ndarray of shape (n_frames, n_nodes, 3), m
    axes : ndarray of shape (n_cells, n_points, 3, 3)
        Rows R, C, L of the unloaded wall; the strain is along these, carried to ED.

    Returns
    -------
    ndarray of shape (n_frames, n_cells, n_points, 6)
        RR, CC, LL, RC, RL, CL.
    """
    carried = carried_axes(axes, deformation_gradient(mesh, displacement[0], tetrahedron()[0]))
    # The wall at ED takes the place of the unloaded one: F F_ED^-1 is the gradient by its positions.
    wall = element.elements(replace(mesh, nodes=mesh.nodes + displacement[0]), carried)
    stretch = np.empty((len(displacement), *wall.weight.shape, 6))
    for moved, c in zip(displacement, stretch, strict=True):
        element.stretch(mesh.nodes + moved, wall, c)
    return (stretch - [1, 1, 1, 0, 0, 0]) / 2


def volume_ratios(mesh: Mesh, displacement: Floats) -> tuple[Floats, Floats]:
    """J at the quadrature points.

    Parameters
    ----------
    mesh : Mesh
    displacement : ndarray of shape (n_frames, n_nodes, 3), m

    Returns
    -------
    smallest, mean : ndarray of shape (n_frames,)
        The mean is weighted by unloaded volume.
    """
    wall = element.elements(mesh)
    volume, c = wall.weight, np.empty((*wall.weight.shape, 6))
    ratio = np.empty((2, len(displacement)))
    for frame, moved in enumerate(displacement):
        j = element.stretch(mesh.nodes + moved, wall, c)
        ratio[:, frame] = j.min(), np.sum(j * volume) / np.sum(volume)
    return ratio[0], ratio[1]


def weighted(values: Floats, weight: Floats) -> tuple[Floats, Floats]:
    """Mean and standard deviation over cells.

    Parameters
    ----------
    values : ndarray of shape (n_frames, n_cells, n_components)
    weight : ndarray of shape (n_cells,)
        Their volumes.

    Returns
    -------
    mean, sd : ndarray of shape (n_frames, n_components)
    """
    share = weight / np.sum(weight)
    mean = np.einsum("fci,c->fi", values, share)
    return mean, np.sqrt(np.einsum("fci,c->fi", (values - mean[:, None]) ** 2, share))


def motion(mesh: Mesh, displacement: Floats, axes: Floats, frames: Floats) -> dict[str, NDArray]:
    """Deformation and strain at the centroids, relative to the unloaded state and to ED (frame 0).

    Parameters
    ----------
    mesh : Mesh
    displacement : ndarray of shape (n_frames, n_nodes, 3), m
    axes, frames : ndarray of shape (n_cells, 3, 3)
        Rows R, C, L and rows f, s, n of the unloaded wall at the centroids.

    Returns
    -------
    dict
        `deformation_gradient` (frame, cell, 3, 3) from the unloaded state; `strain_unloaded` and
        `strain` (frame, cell, 6: RR, CC, LL, RC, RL, CL); `fibre_strain_unloaded` and `fibre_strain`
        (frame, cell, 6: ff, ss, nn, fs, fn, sn).
    """
    gradient = deformation_gradient(mesh, displacement)[:, :, 0]
    relative = gradient @ np.linalg.inv(gradient[0])
    return {
        "deformation_gradient": gradient,
        "strain_unloaded": strain(gradient, axes, RCL),
        "strain": strain(relative, carried_axes(axes, gradient[0]), RCL),
        "fibre_strain_unloaded": strain(gradient, frames, FIBRE),
        "fibre_strain": strain(relative, carried_fibres(frames, gradient[0]), FIBRE),
    }


def layer_strain(strains: Floats, weight: Floats, layer: NDArray[np.integer], layers: int) -> Floats:
    """Mean strain of each layer.

    Parameters
    ----------
    strains : ndarray of shape (n_frames, n_cells, 6)
    weight : ndarray of shape (n_cells,)
    layer : ndarray of shape (n_cells,)
        1 to `layers`.
    layers : int

    Returns
    -------
    ndarray of shape (n_frames, layers, 6)
        Not a number for a layer in which no cell has its centroid.
    """
    means = np.full((len(strains), layers, strains.shape[-1]), np.nan)
    for number in np.unique(layer):
        share = np.where(layer == number, weight, 0.0)
        means[:, number - 1] = np.einsum("fci,c->fi", strains, share / np.sum(share))
    return means
