"""The unloaded state of a heart that was imaged at end-diastole.

X_(k+1) = X_k + (x_image - x(X_k)): the misfit of the inflated guess is added to the guess until end-diastolic pressure
inflates it to the image (inverse displacement method; Bols et al., J Comput Appl Math 246 (2013) 10).
"""

import logging
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from echotruth.arrays import Floats
from echotruth.fem.tetrahedra import Mesh
from echotruth.fem.volume import jacobians
from echotruth.mechanics.solver.equilibrium import Equilibrium, Load, State
from echotruth.mechanics.solver.newton import Diverged, LoadStepper

logger = logging.getLogger("echotruth.mechanics")

MAX_MISFIT = 1e-6
"""Largest distance between the inflated and the imaged nodes, over the size of the heart."""

_MAX_ITERATIONS = 60
_MIN_STEP = 1 / 64


def unload(image: Mesh, equations_of: Callable[[Mesh], Equilibrium], pressure: float, stiffness: float) -> Mesh:
    """Unload an imaged heart.

    Parameters
    ----------
    image : Mesh
        At end-diastole.
    equations_of : callable
        Unloaded mesh to its equations; fibres and tissue follow the mesh.
    pressure : float, Pa
        At end-diastole.
    stiffness : float, Pa
        C of the passive law.

    Returns
    -------
    Mesh
        Inflated to that pressure, its nodes are those of the image to `MAX_MISFIT`.

    Raises
    ------
    Diverged
        If no such state is found.
    """
    size = float(np.ptp(image.nodes, axis=0).max())
    guess, state, error = image, None, np.inf
    for number in range(_MAX_ITERATIONS):
        inflated, state = _inflate(guess, equations_of, pressure, stiffness, state)
        misfit = image.nodes - inflated
        previous_error, error = error, float(np.abs(misfit).max()) / size
        logger.info("unloading, iteration %d: misfit of %.2g of the heart's size", number + 1, error)
        if error < MAX_MISFIT:
            return guess
        if error > 10 * previous_error:
            break
        guess = _displaced(guess, misfit)
    raise Diverged(
        f"no unloaded state was found that fills to the image at {pressure / 1e3:.3g} kPa: raise stiffness_kPa, or "
        "lower the end-diastolic pressure of the loop."
    )


def _inflate(
    mesh: Mesh, equations_of: Callable[[Mesh], Equilibrium], pressure: float, stiffness: float, predictor: State | None
) -> tuple[Floats, State]:
    """Nodes (n_nodes, 3), m, and state of a mesh under a pressure."""
    equations = equations_of(mesh)
    try:
        stepper = LoadStepper(equations, stiffness)
        state = stepper.advance(Load(pressure, 1.0, 0.0), None, () if predictor is None else (predictor,))
        return equations.positions(state), state
    finally:
        equations.close()


def _displaced(mesh: Mesh, displacement: Floats) -> Mesh:
    """The mesh displaced by the largest tried fraction that inverts no tetrahedron."""
    step = 1.0
    while step >= _MIN_STEP:
        nodes = mesh.nodes + step * displacement
        if jacobians(nodes, mesh.cells).min() > 0:
            return replace(mesh, nodes=nodes)
        step /= 2
    raise Diverged("unloading turns the wall inside out: raise stiffness_kPa, or mend the mesh where it is thin.")
