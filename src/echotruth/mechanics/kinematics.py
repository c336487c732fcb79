"""Deformation and Green-Lagrange strain of the wall, in wall or fibre axes.

Strains are relative to the unloaded state or to end-diastole (F_rel = F F_ED^-1, along the axes deformed to ED).
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from echotruth.fem.tetrahedra import Floats, Mesh
from echotruth.mechanics.fibres import CENTROID, axes_from_normal, material_gradients, unit

RCL_COMPONENTS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
"""Components RR, CC, LL, RC, RL, CL."""

FIBRE_COMPONENTS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (2, 1))
"""Components ff, ss, nn, fs, fn, sn of axes in the order f, s, n."""

IMAGE_COMPONENTS = ((0, 0), (1, 1), (0, 1))
"""Components RR, TT, RT of axes in the order radial, tangential."""


def deformation_gradient(mesh: Mesh, displacement: Floats, xi: Floats = CENTROID) -> Floats:
    """Deformation gradient F = I + du/dX from the unloaded state.

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
    dN_dX, _ = material_gradients(mesh, xi)
    return np.eye(3) + np.einsum("...cai,cqaj->...cqij", displacement[..., mesh.cells, :], dN_dX)


def deformed_wall_axes(axes: Floats, gradient: Floats) -> Floats:
    """Wall axes of the deformed wall.

    Parameters
    ----------
    axes, gradient : ndarray of shape (..., 3, 3)
        Rows R, C, L of the unloaded wall, and F.

    Returns
    -------
    ndarray of shape (..., 3, 3)
        R along F^-T R, the normal of the deformed surfaces of equal depth; C and L as in the unloaded wall.
    """
    return axes_from_normal(np.einsum("...ji,...j->...i", np.linalg.inv(gradient), axes[..., 0, :]))


def deformed_fibre_frames(frames: Floats, gradient: Floats) -> Floats:
    """Fibre axes of the deformed wall.

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
    # Component by component: on matrices this small, NumPy's loops over the points are faster.
    f, a = (np.ascontiguousarray(np.moveaxis(array, (-2, -1), (0, 1))) for array in (gradient, axes))
    dims = range(len(a))
    f_a = [[sum(f[k, j] * a[i, j] for j in dims) for k in dims] for i in dims]
    return np.stack([(sum(f_a[i][k] * f_a[j][k] for k in dims) - (i == j)) / 2 for i, j in components], axis=-1)


def wall_strain(mesh: Mesh, displacement: Floats, axes: Floats, at_ed: Floats) -> Floats:
    """Strain since ED at the quadrature points.

    Parameters
    ----------
    mesh : Mesh
    displacement : ndarray of shape (n_frames, n_nodes, 3), m
    axes : ndarray of shape (n_cells, n_points, 3, 3)
        Rows: axes of the wall at ED, such as R, C, L.
    at_ed : ndarray of shape (n_nodes, 3), m
        Displacement at ED.

    Returns
    -------
    ndarray of shape (n_frames, n_cells, n_points, 6)
        RR, CC, LL, RC, RL, CL.
    """
    from echotruth.mechanics.solver import element  # compiled; whoever reads a heart needs none

    # With the wall at ED in place of the unloaded one, the gradient by its positions is F F_ED^-1.
    wall = element.build_elements(replace(mesh, nodes=mesh.nodes + at_ed), axes)
    c = np.empty((len(displacement), *wall.weight.shape, 6))
    for u, c_of_frame in zip(displacement, c, strict=True):
        element.right_cauchy_green(mesh.nodes + u, wall, c_of_frame)
    return (c - [1, 1, 1, 0, 0, 0]) / 2


def strain_along(strains: Floats, direction: Floats) -> Floats:
    """Strain a . E a along a direction.

    Parameters
    ----------
    strains : ndarray of shape (..., 6)
        RR, CC, LL, RC, RL, CL.
    direction : ndarray of shape (..., 3)
        Unit vectors a; components along R, C, L.

    Returns
    -------
    ndarray of shape (...)
    """
    products = [(1 if i == j else 2) * direction[..., i] * direction[..., j] for i, j in RCL_COMPONENTS]
    along: Floats = np.sum(strains * np.stack(products, axis=-1), axis=-1)
    return along


def volume_ratios(mesh: Mesh, displacement: Floats) -> tuple[Floats, Floats, Floats]:
    """Volume ratio J = det F at the quadrature points.

    Parameters
    ----------
    mesh : Mesh
    displacement : ndarray of shape (n_frames, n_nodes, 3), m

    Returns
    -------
    smallest, mean, rms_change : ndarray of shape (n_frames,)
        The mean of J and the root mean square of J - 1 are weighted by unloaded volume.
    """
    from echotruth.mechanics.solver import element

    wall = element.build_elements(mesh)
    volume, c = wall.weight, np.empty((*wall.weight.shape, 6))
    ratio = np.empty((3, len(displacement)))
    for frame, u in enumerate(displacement):
        j = element.right_cauchy_green(mesh.nodes + u, wall, c)
        total = np.sum(volume)
        ratio[:, frame] = j.min(), np.sum(j * volume) / total, np.sqrt(np.sum((j - 1) ** 2 * volume) / total)
    return ratio[0], ratio[1], ratio[2]


def weighted_mean_sd(values: Floats, weight: Floats) -> tuple[Floats, Floats]:
    """Mean and standard deviation over cells.

    Parameters
    ----------
    values : ndarray of shape (n_frames, n_cells, n_components)
    weight : ndarray of shape (n_cells,)
        Volumes of the cells.

    Returns
    -------
    mean, sd : ndarray of shape (n_frames, n_components)
    """
    weight = weight / np.sum(weight)
    mean = np.einsum("fci,c->fi", values, weight)
    return mean, np.sqrt(np.einsum("fci,c->fi", (values - mean[:, None]) ** 2, weight))


def centroid_strains(mesh: Mesh, displacement: Floats, axes: Floats, frames: Floats) -> dict[str, NDArray]:
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
        "strain_unloaded": strain(gradient, axes, RCL_COMPONENTS),
        "strain": strain_since_ed(gradient, axes),
        "fibre_strain_unloaded": strain(gradient, frames, FIBRE_COMPONENTS),
        "fibre_strain": strain(relative, deformed_fibre_frames(frames, gradient[0]), FIBRE_COMPONENTS),
    }


def strain_since_ed(gradient: Floats, axes: Floats) -> Floats:
    """Strain since ED along the wall axes deformed to ED.

    Parameters
    ----------
    gradient : ndarray of shape (n_frames, n_cells, 3, 3)
        F from the unloaded state; ED is the first frame.
    axes : ndarray of shape (n_cells, 3, 3)
        Rows R, C, L of the unloaded wall.

    Returns
    -------
    ndarray of shape (n_frames, n_cells, 6)
        RR, CC, LL, RC, RL, CL.
    """
    relative = gradient @ np.linalg.inv(gradient[0])
    return strain(relative, deformed_wall_axes(axes, gradient[0]), RCL_COMPONENTS)


def group_means(strains: Floats, weight: Floats, group: NDArray[np.integer], groups: int) -> Floats:
    """Mean strain of each group of points, such as the layers or the levels of a wall.

    Parameters
    ----------
    strains : ndarray of shape (n_frames, n_points, n_components)
    weight : ndarray of shape (n_points,)
    group : ndarray of shape (n_points,)
        1 to `groups`.
    groups : int

    Returns
    -------
    ndarray of shape (n_frames, groups, n_components)
        Not a number for a group without a point.
    """
    means = np.full((len(strains), groups, strains.shape[-1]), np.nan)
    for number in np.unique(group):
        inside = np.where(group == number, weight, 0.0)
        means[:, number - 1] = np.einsum("fci,c->fi", strains, inside / np.sum(inside))
    return means
