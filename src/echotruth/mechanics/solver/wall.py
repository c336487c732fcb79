"""The wall of a heart - mesh, depth and tissue - and its equations."""

from dataclasses import dataclass

import numpy as np

from echotruth.arrays import Floats
from echotruth.config import Active, Config, Mechanics
from echotruth.fem.quadrature import tetrahedron
from echotruth.fem.tetrahedra import Mesh
from echotruth.materials import compiled
from echotruth.mechanics import fibres
from echotruth.mechanics.activation_map import activated
from echotruth.mechanics.pathology import Tissue, tissue
from echotruth.mechanics.solver import element
from echotruth.mechanics.solver.active_stress import ActiveLaw
from echotruth.mechanics.solver.equilibrium import Equilibrium
from echotruth.mechanics.solver.stress import relative_stiffness
from echotruth.mechanics.solver.support import base_support
from echotruth.mechanics.solver.surroundings import surroundings
from echotruth.units import kPa


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
    """Wall of a mesh with the tissue of a configuration.

    Raises
    ------
    PathologyError
        If no cell of the mesh has the pathology, or a site of activation does not lie in it.
    """
    depth = fibres.wall_depth(mesh)
    found = tissue(mesh, depth, config.pathology, config.mechanics.regional)
    return Wall(mesh, depth, activated(found, mesh, depth, config))


def equilibrium(config: Config, wall: Wall, exact: bool = False) -> Equilibrium:
    """Equations of a wall, with the fibres, laws and support of a configuration; `exact` as of :class:`Equilibrium`.

    Raises
    ------
    FibreError
        If the fibres are to come with the mesh and do not.
    """
    section = config.mechanics
    frames = fibres.fibre_frames(wall.mesh, wall.depth, config.fibres, tetrahedron()[0], config.seed)
    support = base_support(wall.mesh, section.base)
    springs = surroundings(wall.mesh, section)
    law = wall_law(section)
    tissue = wall.tissue
    scale, taut = tissue.stiffness_scale, tissue.taut_stiffness
    equations = Equilibrium(wall.mesh, frames, law, support, scale, springs, exact, taut)
    equations.right_pressure_ratio = config.loop.right_pressure_ratio
    return equations


def wall_law(section: Mechanics) -> element.WallLaw:
    """Laws of the wall, SI, from their section of the configuration."""
    active = active_law(section.active)
    passive = compiled(section.material.law), section.material.constants()
    pointwise_bulk_ratio = section.pointwise_bulk_ratio * relative_stiffness(*passive)
    volumetric = section.bulk_modulus_kPa * kPa, pointwise_bulk_ratio
    cross_fibre = np.array([section.active.sheet_share, section.active.normal_share])
    return element.WallLaw(*passive, active, *volumetric, section.viscosity_Pa_s, cross_fibre)


def active_law(section: Active) -> ActiveLaw:
    """Constants of the active stress, SI, from their section of the configuration."""
    velocity = section.shortening_velocity_max_per_s
    return ActiveLaw(
        section.length_dependence,
        2.0 if section.stress == "cauchy" else 0.0,
        np.inf if velocity is None else velocity,
        section.hill_curvature,
        section.eccentric_max,
    )
