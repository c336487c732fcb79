"""The unloaded state of a heart that was imaged at end-diastole.

The state is sought whose inflation gives back the imaged one: the displacement that a
guess takes on under end-diastolic pressure is subtracted from the image (inverse
displacement method; Bols et al., J Comput Appl Math 246 (2013) 10).
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from echotruth.fem.tetrahedra import Floats, Mesh
from echotruth.mechanics.geometry.mesh_quality import jacobians
from echotruth.mechanics.solver.equilibrium import Equilibrium, Load, State
from echotruth.mechanics.solver.newton import Diverged, Walk

logger = logging.getLogger("echotruth.mechanics")

CLOSE = 1e-6
"""Largest distance between the inflated and the imaged nodes, over the size of the heart."""

_MOST_ROUNDS = 60
_LEAST_SHARE = 1 / 64


def unloaded(image: Mesh, equations: Callable[[Mesh], Equilibrium], pressure: float, stiffness: float) -> Mesh:
    """Unload an imaged heart.

    Parameters
    ----------
    image : Mesh
        At end-diastole.
    equations : callable
        Gives the equations of an unloaded mesh; fibres and tissue follow it.
    pressure : float, Pa
        At end-diastole.
    stiffness : float, Pa
        C of the passive law.

    Returns
    -------
    Mesh
        Inflated to that pressure, its nodes are those of the image to `CLOSE`.

    Raises
    ------
    Diverged
        If no such state is found.
    """
    size = float(np.ptp(image.nodes, axis=0).max())
    guess, state, far = image, None, np.inf
    for number in range(_MOST_ROUNDS):
        reached, state = _inflated(guess, equations, pressure, stiffness, state)
        rest = image.nodes - reached
        before, far = far, float(np.abs(rest).max()) / size
        logger.info("unloading, round %d: %.2g of the heart's size from the image", number + 1, far)
        if far < CLOSE:
            return guess
        if far > 10 * before:
            break
        guess = _moved(guess, rest)
    raise Diverged(
        f"no unloaded state was found that fills to the image at {pressure / 1e3:.3g} kPa: raise stiffness_kPa, or "
        "lower the end-diastolic pressure of the loop."
    )


def _inflated(
    mesh: Mesh, equations: Callable[[Mesh], Equilibrium], pressure: float, stiffness: float, near: State | None
) -> tuple[Floats, State]:
    """Nodes (n_nodes, 3), m, and state of a mesh under a pressure."""
    heart = equations(mesh)
    try:
        walk = Walk(heart, stiffness)
        state = walk.to(Load(pressure, 1.0, 0.0), None, () if near is None else (near,))
        return heart.positions(state), state
    finally:
        heart.close()


def _moved(mesh: Mesh, rest: Floats) -> Mesh:
    """The mesh with as much of a displacement added as leaves no tetrahedron inside out."""
    share = 1.0
    while share >= _LEAST_SHARE:
        nodes = mesh.nodes + share * rest
        if jacobians(nodes, mesh.cells).min() > 0:
            return replace(mesh, nodes=nodes)
        share /= 2
    raise Diverged("unloading turns the wall inside out: raise stiffness_kPa, or mend the mesh where it is thin.")
