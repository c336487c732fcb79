"""Derivatives of a beating heart by keys of its configuration."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from echotruth.arrays import Floats
from echotruth.config import Config
from echotruth.loop.cycle import heart_cycle
from echotruth.mechanics import fibres, kinematics
from echotruth.mechanics.beat import check_frames, outputs, unloaded_wall
from echotruth.mechanics.hold import held
from echotruth.mechanics.outputs import Arrays
from echotruth.mechanics.pathology import tissue
from echotruth.mechanics.solver.cycle import filled_to_end_diastole, solved_cycle, solved_frames
from echotruth.mechanics.solver.newton import Step
from echotruth.mechanics.solver.sensitivity import Derivative, Variant, derivatives
from echotruth.mechanics.solver.surroundings import surroundings
from echotruth.mechanics.solver.wall import Wall, equilibrium, wall_law


def sensitivities(
    config: Config, changed: Mapping[str, tuple[Config, float]], frames: Sequence[int]
) -> tuple[dict[str, Arrays], dict[str, Arrays]]:
    """Beat a heart, and take the derivatives of its motion.

    Where C is not given it is that with which the heart fills to the volume of its loop, its scar included.

    Parameters
    ----------
    config : Config
        In a measured loop.
    changed : mapping
        Name of a parameter to the configuration in which it is changed by a little, and that change, in its unit.
    frames : sequence of int
        As :func:`.beat.beat` takes them.

    Returns
    -------
    heart : dict of dict of ndarray
        As :func:`.beat.beat` returns it, but for C of a heart with a scar.
    derivatives : dict of dict of ndarray
        Of each parameter: `node_position` (node, 3) of the unloaded wall, `displacement` (frame, node, 3), m, `strain`
        (frame, cell, 6) since ED, `volume` (frame,), m^3, `active_tension` (frame,) and `stiffness`, Pa; each per unit
        of the parameter.

    Raises
    ------
    GeometryError, FibreError, PathologyError, LoopError, Diverged
        As :func:`.beat.beat`.
    """
    check_frames(config, frames)
    whole, stiffness = heart_cycle(config), config.mechanics.material.stiffness
    cycle = whole.at(frames)
    unloaded, steps = unloaded_wall(config, cycle), list[Step]()
    equations, exact = equilibrium(config, unloaded), equilibrium(config, unloaded, exact=True)
    try:
        stepper = filled_to_end_diastole(equations, cycle, stiffness)
        stepper.on_step = steps.append
        # A heart of given C keeps the ejection fraction of its loop.
        loop = cycle if stiffness is None else cycle.scaled(stepper.load.volume / cycle.edv)
        solved = solved_cycle(equations, loop, list(solved_frames(stepper, loop, unloaded.tissue.tension_scale)))
        heart = _Heart(config, unloaded, solved.displacement, Variant(exact, cycle, unloaded.tissue.tension_scale))
        walls = [heart.wall(other) for other, _ in changed.values()]
        pairs = zip(walls, changed.values(), strict=True)
        variants = [heart.variant(other, wall, change, frames) for wall, (other, change) in pairs]
        found = derivatives(heart.variant_0, steps, "stiffness" if stiffness is None else None, variants)
    finally:
        equations.close()
        exact.close()
    arrays = outputs(config, unloaded, solved, whole, frames)
    parts = zip(changed, walls, found, (change for _, change in changed.values()), strict=True)
    return arrays, {name: heart.arrays(wall, derivative, change) for name, wall, derivative, change in parts}


@dataclass(frozen=True)
class _Heart:
    """A heart, from which others differ by a little.

    Attributes
    ----------
    config : Config
    unloaded : Wall
    displacement : ndarray of shape (n_frames, n_nodes, 3), m
        As it was solved.
    variant_0 : Variant
        The heart itself.
    """

    config: Config
    unloaded: Wall
    displacement: Floats
    variant_0: Variant

    def wall(self, other: Config) -> Wall:
        """Wall of another configuration; it has the mesh of this one if the geometry is the same."""
        is_thin = [one.pathology.infarct.scar()["thickness_scale"] != 1 for one in (self.config, other)]
        if other.geometry != self.config.geometry or any(is_thin):
            return unloaded_wall(other, heart_cycle(other))
        mesh, depth = self.unloaded.mesh, self.unloaded.depth
        return Wall(mesh, depth, tissue(mesh, depth, other.pathology, other.mechanics.regional))

    def variant(self, other: Config, wall: Wall, change: float, frames: Sequence[int]) -> Variant:
        """The heart of another configuration."""
        same = wall.mesh is self.unloaded.mesh and other.fibres == self.config.fibres
        section, scale, taut = other.mechanics, wall.tissue.stiffness_scale, wall.tissue.taut_stiffness
        equations = (
            self.variant_0.equations.changed(wall_law(section), scale, surroundings(wall.mesh, section), taut)
            if same
            else equilibrium(other, wall)
        )
        cycle, given = heart_cycle(other).at(frames), section.material.stiffness
        return Variant(equations, cycle, wall.tissue.tension_scale, change, given)

    def arrays(self, wall: Wall, derivative: Derivative, change: float) -> Arrays:
        """Derivatives of the arrays of this heart, of which another wall is changed by so much."""
        free = self.variant_0.equations.assembly.displacement
        moved = self.displacement + change * np.array([free(state.solution) for state in derivative.states])
        motions = (self.unloaded, self.displacement), (wall, moved)
        strains = [_strain(body, motion) for body, motion in motions]
        kept = [held(body.mesh, motion, self.config.mechanics.hold) for body, motion in motions]
        return {
            "node_position": (wall.mesh.nodes - self.unloaded.mesh.nodes) / change,
            "displacement": (kept[1] - kept[0]) / change,
            "strain": (strains[1] - strains[0]) / change,
            "volume": derivative.volume,
            "active_tension": np.array([state.tension for state in derivative.states]),
            "stiffness": np.array(derivative.states[0].stiffness),
        }


def _strain(wall: Wall, displacement: Floats) -> Floats:
    """Strain since ED of the centroids of the cells, (frame, cell, 6)."""
    axes = fibres.wall_axes(wall.mesh, wall.depth, fibres.CENTROID)[:, 0]
    gradient = kinematics.deformation_gradient(wall.mesh, displacement)[:, :, 0]
    return kinematics.strain_since_ed(gradient, axes)
