"""What of a solved heart stays in place, `mechanics.hold`.

The equations hold the base in its plane and keep it from turning. A heart in the chest is held otherwise: its apex
stays, and what surrounds it resists its turning. Since a rigid motion changes neither strain nor pressure, the solved
heart is moved as a whole, frame by frame:

- tilted so that the line from the centre of the base to the apex of the epicardium keeps its direction since
  end-diastole; where one wall shortens more than another, the base tilts;
- turned about that line so that springs of one stiffness all over the epicardium, along its motion around the line,
  would bear no torque: int (x_ED x x) . a dA = 0; where the apex turns one way, the base turns the other;
- shifted so that the apex of the epicardium stays.
"""

from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from echotruth.arrays import Floats
from echotruth.fem.tetrahedra import Integers, Mesh
from echotruth.mechanics.geometry import epicardial_apex
from echotruth.mechanics.geometry.boundary import area_vectors


def held(mesh: Mesh, displacement: Floats, hold: Literal["apex", "base"]) -> Floats:
    """The motion of a solved heart with its apex in place, or with its base, as it was solved.

    Parameters
    ----------
    mesh : Mesh
        Unloaded.
    displacement : ndarray of shape (n_frames, n_nodes, 3), m
        From the unloaded nodes; the first frame is end-diastole.
    hold : "apex" or "base"

    Returns
    -------
    ndarray of shape (n_frames, n_nodes, 3), m
    """
    if hold == "base":
        return displacement
    positions = mesh.nodes + displacement
    apex = epicardial_apex(mesh)
    arms = positions - positions[:, None, apex]
    axis = -np.einsum("tpi,p->ti", *_points(mesh, mesh.base, arms))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    tilt = np.cross(axis, axis[0])
    sine = np.linalg.norm(tilt, axis=1, keepdims=True)
    upright = Rotation.from_rotvec(np.divide(np.arcsin(sine) * tilt, sine, out=np.zeros_like(tilt), where=sine > 0))
    turned = np.einsum("tij,tpj->tpi", upright.as_matrix(), arms)
    turn = _turn(*_points(mesh, mesh.epi, turned), axis[0])
    back = Rotation.from_rotvec(-turn[:, None] * axis[0])
    return positions[0, apex] + np.einsum("tij,tpj->tpi", back.as_matrix(), turned) - mesh.nodes


def _turn(points: Floats, weight: Floats, axis: Floats) -> Floats:
    """Turn (n_frames,), rad, of points (n_frames, n, 3) about an axis through the origin since the first frame."""
    across = points - (points @ axis)[..., None] * axis
    sine = np.einsum("pi,tpi,p->t", np.cross(axis, across[0]), across, weight)
    cosine = np.einsum("pi,tpi,p->t", across[0], across, weight)
    return np.arctan2(sine, cosine)


def _points(mesh: Mesh, facets: Integers, positions: Floats) -> tuple[Floats, Floats]:
    """Positions (n_frames, n, 3) of the middles of the edges of facets, and their shares (n,) of the unloaded area."""
    area = np.linalg.norm(area_vectors(mesh.nodes, facets), axis=1)
    return positions[:, facets[:, 3:].ravel()], np.repeat(area, 3) / (3 * area.sum())
