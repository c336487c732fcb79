"""The wall that a series moves: its tetrahedra, its sides and its cavity, in the heart frame of end-diastole."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from echotruth.arrays import Floats
from echotruth.config import Config, Geometry
from echotruth.fem.tetrahedra import Integers, Mesh
from echotruth.fem.volume import jacobians
from echotruth.mechanics.geometry.boundary import boundary, quadratic_cells, with_midpoints
from echotruth.mechanics.geometry.boundary_labels import BoundarySurface, label_boundary
from echotruth.mechanics.geometry.cut import extract_wall
from echotruth.mechanics.geometry.file import labelled_mesh, map_fibres, septum_point
from echotruth.mechanics.geometry.frame import heart_frame, rim_centroid
from echotruth.mechanics.geometry.imported_mesh import METRES, ImportedMesh, merge_points, read_file
from echotruth.mechanics.geometry.mesh_quality import (
    check_cavity,
    check_flat,
    format_volume,
    straight_volumes,
)
from echotruth.mechanics.motion_file.cycle import RecordedCycle, one_cycle
from echotruth.mechanics.motion_file.series import MeshSeries, is_series, read_series
from echotruth.mechanics.prescribed import MotionError
from echotruth.mechanics.solver.cavity import cavity_volume

WALL_VOLUMES = (1e-9, 1e-3)
"""Smallest and largest volume of a wall, m^3: a hundredth of a mouse's, and several times a human's."""

SAME_VOLUME = 1e-4
"""Difference of cavity volumes over the stroke volume below which they are the same."""

_POINT = "echotruth:point"
"""Array over the points of an imported mesh: their numbers in the file, which merging and cutting keep."""


@dataclass(frozen=True)
class MovingWall:
    """A wall at end-diastole and its recorded motion.

    Attributes
    ----------
    mesh : Mesh
        At end-diastole, in the heart frame.
    surface : BoundarySurface
        Its boundary, of the cells of the file.
    positions : ndarray of shape (n_frames, n_nodes, 3), m
        Of the nodes of the mesh, in the heart frame; the first frame is end-diastole.
    cycle : RecordedCycle
        Beginning at end-diastole.
    """

    mesh: Mesh
    surface: BoundarySurface
    positions: Floats
    cycle: RecordedCycle

    def cavity_volumes(self, positions: Floats) -> Floats:
        """Volumes (n_frames,), m^3, between the endocardium and its rim, at positions (n_frames, n_nodes, 3), m."""
        return _cavity_volumes(positions, self.mesh, self.surface)


def moving_wall(config: Config) -> MovingWall:
    """Read the wall of a configuration and its motion.

    Parameters
    ----------
    config : Config
        Only the sections geometry and motion are used.

    Returns
    -------
    MovingWall

    Raises
    ------
    GeometryError, MotionError
        In one sentence, if the files hold no left ventricle, or no cycle of it.
    """
    geometry, section = config.geometry, config.motion.file
    mesh, series = _mesh_and_series(config)
    wall = extract_wall(_in_metres(mesh, geometry), geometry.wall_cells)
    point = wall.node_arrays[_POINT]
    recorded = one_cycle(series, section)
    unit = METRES[geometry.unit] * geometry.scale
    cycle = replace(recorded, positions=recorded.positions[:, point] * unit)
    _check_size(wall, cycle, geometry)
    edges, cells = quadratic_cells(wall.cells, len(wall.nodes))
    _check_inverted(cycle, wall, edges, cells)
    cycle, wall, surface = _at_end_diastole(config, wall, cycle, edges, cells)
    frame = heart_frame(surface, septum_point(wall, geometry, surface))
    positions = with_midpoints((cycle.positions - frame.origin) @ frame.axes.T, edges)
    rest = labelled_mesh(positions[0], cells, surface)
    check_flat(rest, cycle.names[0], "mesh the wall again where its motion is solved")
    check_cavity(rest, cycle.names[0], f"set geometry.unit, now {geometry.unit}, to one of {', '.join(METRES)}")
    rest = map_fibres(rest, wall, frame, geometry)
    return MovingWall(rest, replace(surface, nodes=frame.transform_points(surface.nodes)), positions, cycle)


def _mesh_and_series(config: Config) -> tuple[ImportedMesh, MeshSeries]:
    """Mesh with the arrays and labels, and the series of the same points."""
    file, path = str(config.geometry.file), str(config.motion.file.path)
    if file == path:
        series = read_series(config.motion.file)
        assert series.mesh is not None
        return series.mesh, series
    if not is_series(file) and not Path(file).is_file():
        raise MotionError(f"geometry.file = {file!r}: there is no such file: give the mesh whose points move.")
    if is_series(file):
        mesh = read_series(config.motion.file.model_copy(update={"path": file})).mesh
        assert mesh is not None
    else:
        mesh = read_file(file)
    series = read_series(config.motion.file, mesh.nodes)
    if series.mesh is not None and not np.array_equal(series.mesh.cells, mesh.cells):
        raise MotionError(f"{path}: its tetrahedra are not those of geometry.file = {file}: give the same mesh.")
    return mesh, series


def _in_metres(mesh: ImportedMesh, geometry: Geometry) -> ImportedMesh:
    nodes = mesh.nodes * METRES[geometry.unit] * geometry.scale
    if not np.isfinite(nodes).all():
        raise MotionError(f"{mesh.source}: has points that are not finite numbers: write the file again.")
    if not len(mesh.cells):
        raise MotionError(f"{mesh.source}: holds no tetrahedra: write those of the wall.")
    return merge_points(replace(mesh, nodes=nodes, node_arrays=mesh.node_arrays | {_POINT: np.arange(len(nodes))}))


def _check_size(wall: ImportedMesh, cycle: RecordedCycle, geometry: Geometry) -> None:
    """Refuse a wall of a volume that no heart has, and name the units in which it would have one."""
    volume = float(np.abs(straight_volumes(cycle.positions[0], wall.cells)).sum())
    low, high = WALL_VOLUMES
    if low <= volume <= high:
        return
    in_metres = volume / METRES[geometry.unit] ** 3
    units = [name for name, metres in METRES.items() if low <= in_metres * metres**3 <= high]
    remedy = f"set geometry.unit to {' or '.join(units)}" if units else "give their length by unit and scale"
    raise MotionError(
        f"{cycle.names[0]}: its wall has {format_volume(volume)} with geometry.unit = {geometry.unit} and "
        f"geometry.scale = {geometry.scale:g}, and a heart's has 1 uL to 1 L: {remedy}."
    )


def _check_inverted(cycle: RecordedCycle, wall: ImportedMesh, edges: Integers, cells: Integers) -> None:
    for number, (positions, name) in enumerate(zip(cycle.positions, cycle.names, strict=True)):
        # Straight tetrahedra have one Jacobian each.
        volume = straight_volumes(positions, wall.cells) if len(edges) else jacobians(positions, cells).min(axis=1)
        inverted = np.count_nonzero(volume <= 0)
        if inverted:
            raise MotionError(
                f"{name}: {inverted} of {len(cells)} tetrahedra are inverted in frame {cycle.first + number} of "
                "motion.file.path: leave that frame out, or solve the motion on a better mesh."
            )


def _at_frame(wall: ImportedMesh, cycle: RecordedCycle, geometry: Geometry) -> tuple[ImportedMesh, BoundarySurface]:
    """The wall in the first frame of a cycle, and its labelled boundary."""
    wall = replace(wall, source=cycle.names[0], nodes=cycle.positions[0])
    return wall, label_boundary(wall, boundary(wall.cells)[0], geometry.surface_labels)


def _at_end_diastole(
    config: Config, wall: ImportedMesh, cycle: RecordedCycle, edges: Integers, cells: Integers
) -> tuple[RecordedCycle, ImportedMesh, BoundarySurface]:
    """The cycle from the frame on that is named, or has the largest cavity; the wall there, and its boundary."""
    named = config.motion.file.ed_frame
    if named is None:
        first, surface = _at_frame(wall, cycle, config.geometry)
        positions = with_midpoints(cycle.positions, edges)
        frame = first_of_largest(_cavity_volumes(positions, labelled_mesh(positions[0], cells, surface), surface))
        if frame == 0:
            return cycle.beginning_at(0), first, surface
    else:
        # The last frame is the first one again where it is left out.
        frame = (named - cycle.first) % len(cycle.positions)
    cycle = cycle.beginning_at(frame)
    return cycle, *_at_frame(wall, cycle, config.geometry)


def first_of_largest(volume: Floats) -> int:
    """First of the successive frames with the largest volume, (n_frames,), of a cycle.

    The volume stays while the valves are closed, and end-diastole is the beginning of that: later ones are contracted.
    """
    frame, least = int(np.argmax(volume)), volume.max() - SAME_VOLUME * np.ptp(volume)
    while volume[frame - 1] >= least > volume.min():
        frame = (frame - 1) % len(volume)
    return frame


def _cavity_volumes(positions: Floats, mesh: Mesh, surface: BoundarySurface) -> Floats:
    """Volumes (n_frames,), m^3; the cavity is closed by the cone from its rim to the centroid of that."""
    rim = [rim_centroid(replace(surface, nodes=nodes)) for nodes in positions]
    return np.array([cavity_volume(x - c, mesh.endo) for x, c in zip(positions, rim, strict=True)])
