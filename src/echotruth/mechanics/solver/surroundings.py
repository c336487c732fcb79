"""Springs and dashpots between the surfaces of the heart and its surroundings.

The pericardium acts along the normal of the epicardium (Strocchi et al., J Biomech 101 (2020) 109645), and a base that
is elastically held acts along and around the long axis. The law is linear in the displacement, along directions of the
unloaded surface, so that each is a constant matrix of a facet, in residual and tangent (:mod:`.equilibrium`).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from echotruth.arrays import Floats
from echotruth.config import Mechanics
from echotruth.fem.quadrature import triangle
from echotruth.fem.tetrahedra import Integers, Mesh, shape, shape_gradient
from echotruth.mechanics.solver.assembly import BASE, EPI
from echotruth.units import kPa_per_mm, kPa_s_per_mm

Direction = Callable[[Floats, Floats], Floats]


@dataclass(frozen=True, eq=False)
class Springs:
    """Springs and dashpots on one surface.

    Attributes
    ----------
    group : EPI or BASE
    facets : ndarray of shape (n_facets, 6)
    spring : ndarray of shape (n_facets, 18, 18), N/m
        Stiffness of each facet; rows and columns run over node and axis.
    dashpot : ndarray of shape (n_facets, 18, 18), N s/m
        Damping of each facet.
    rest_at_end_diastole : bool
        Whether they act from end-diastole on, where they are at rest; else from the unloaded state.
    """

    group: int
    facets: Integers
    spring: Floats
    dashpot: Floats
    rest_at_end_diastole: bool


def surroundings(mesh: Mesh, section: Mechanics) -> tuple[Springs, ...]:
    """Springs of a configuration: of the pericardium, and of an elastic base."""
    springs, pericardium = [], section.pericardium
    spring, dashpot = pericardium.spring_kPa_per_mm * kPa_per_mm, pericardium.dashpot_kPa_s_per_mm * kPa_s_per_mm
    if spring or dashpot:
        unit = surface_matrix(mesh, mesh.epi, normal)
        springs.append(Springs(EPI, mesh.epi, spring * unit, dashpot * unit, True))
    if section.base == "elastic":
        base = section.elastic_base
        stiffness = base.axial_spring_kPa_per_mm * kPa_per_mm * surface_matrix(mesh, mesh.base, axial)
        stiffness += (
            base.circumferential_spring_kPa_per_mm * kPa_per_mm * surface_matrix(mesh, mesh.base, circumferential)
        )
        springs.append(Springs(BASE, mesh.base, stiffness, np.zeros_like(stiffness), False))
    return tuple(springs)


def surface_matrix(mesh: Mesh, facets: Integers, direction: Direction) -> Floats:
    """Matrices int N_a N_b d d^T dA over unloaded facets, for a direction d.

    Parameters
    ----------
    mesh : Mesh
    facets : ndarray of shape (n_facets, 6)
    direction : callable
        Maps points (n_facets, n_points, 3), m, and unit normals of the same shape to d, of the same shape.

    Returns
    -------
    ndarray of shape (n_facets, 18, 18), m^2
        Rows and columns run over node and axis.
    """
    xi, weight = triangle()
    value, dN_dxi = shape(xi), shape_gradient(xi)
    nodes = mesh.nodes[facets]
    first, second = (np.einsum("qa,fai->fqi", dN_dxi[..., k], nodes) for k in (0, 1))
    area = np.cross(first, second)
    measure = np.linalg.norm(area, axis=-1)
    d = direction(np.einsum("qa,fai->fqi", value, nodes), area / measure[..., None])
    along = np.einsum("qa,fqi->fqai", value, d).reshape(*d.shape[:2], 18)
    return np.einsum("fqr,fqs,fq->frs", along, along, weight * measure)


def normal(points: Floats, normals: Floats) -> Floats:
    """The unit normals themselves."""
    return normals


def axial(points: Floats, normals: Floats) -> Floats:
    """The long axis, at points of shape (..., 3)."""
    return np.broadcast_to([0.0, 0.0, 1.0], points.shape)


def circumferential(points: Floats, normals: Floats) -> Floats:
    """Unit vectors around the long axis, at points of shape (..., 3) that are not on it."""
    around = np.stack([-points[..., 1], points[..., 0], np.zeros(points.shape[:-1])], axis=-1)
    return around / np.linalg.norm(around, axis=-1, keepdims=True)
