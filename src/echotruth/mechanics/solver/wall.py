"""The wall of a heart: mesh, depth, fibres and tissue, and the equations they make."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echotruth.config import Config, Mechanics
from echotruth.fem.quadrature import tetrahedron
from echotruth.fem.tetrahedra import Floats, Mesh
from echotruth.materials import compiled
from echotruth.mechanics import fibres
from echotruth.mechanics.pathology import Tissue, tissue
from echotruth.mechanics.solver import element
from echotruth.mechanics.solver.equilibrium import Equilibrium
from echotruth.mechanics.solver.support import of_base


@dataclass(frozen=True)
class Wall:
    """An unloaded wall.

    Attributes
    ----------
    mesh : Mesh
    depth : ndarray of shape (n_nodes,)
        Wall depth.
    tissue : Tissue
    """

    mesh: Mesh
    depth: Floats
    tissue: Tissue


def wall(config: Config, mesh: Mesh) -> Wall:
    """The wall that a configuration makes of a mesh.

    Raises
    ------
    PathologyError
        If its disease is nowhere in the mesh.
    """
    depth = fibres.wall_depth(mesh)
    return Wall(mesh, depth, tissue(mesh, depth, config.pathology))


def equilibrium(config: Config, heart: Wall) -> Equilibrium:
    """Equations of a wall, with the fibres, laws and support of a configuration.

    Raises
    ------
    FibreError
        If the fibres are to come with the mesh and do not.
    """
    section = config.mechanics
    frames = fibres.fibre_frames(heart.mesh, heart.depth, config.fibres, tetrahedron()[0], config.seed)
    support = of_base(heart.mesh, section.base, section.si().epicardial_spring)
    return Equilibrium(heart.mesh, frames, law(section), support, heart.tissue.stiffness_scale)


def law(section: Mechanics) -> element.Law:
    """Laws of the wall, SI, from their section of the configuration."""
    power = 2.0 if section.active.stress == "cauchy" else 0.0
    active = np.array([section.active.length_dependence, power])
    material, values = section.material, section.si()
    bulk = values.bulk_modulus, values.local_bulk
    return element.Law(compiled(material.law), material.constants(), active, *bulk, values.viscosity)
