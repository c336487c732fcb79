"""Motion from files: the arrays of a heart that moves as a series of meshes does."""

import logging

import numpy as np

from echotruth.arrays import Floats
from echotruth.config import Config
from echotruth.loop import phases
from echotruth.mechanics.motion_file.cycle import periodic_weights
from echotruth.mechanics.motion_file.wall import MovingWall, moving_wall
from echotruth.mechanics.outputs import Arrays, collect_outputs
from echotruth.mechanics.prescribed import MotionError, unsolved
from echotruth.mechanics.solver.wall import wall

logger = logging.getLogger("echotruth.mechanics")


def motion_from_file(config: Config) -> dict[str, Arrays]:
    """Move the heart of a configuration as its files do.

    Parameters
    ----------
    config : Config
        Only the seed, the sections geometry, fibres, pathology, loop and motion, and the transmit focus are used.

    Returns
    -------
    dict of dict of ndarray
        As of :func:`echotruth.mechanics.beat.beat`. The unloaded state is that of end-diastole. The volume is that of
        the cavity up to its rim, end-systole the frame of the smallest, and the phase follows from it; pressure,
        targets, tension, stiffness and residual are not a number.

    Raises
    ------
    GeometryError, FibreError, PathologyError, LoopError, MotionError
        With one sentence, if the files hold no heart or no cycle of it, or the heart would move into the array.
    """
    moving = moving_wall(config)
    frames = config.loop.frames
    weights = periodic_weights(moving.cycle.phase, frames)
    positions = np.tensordot(weights, moving.positions, 1)
    _check_clearance(config, moving, positions)
    volume = moving.cavity_volumes(positions)
    # With a constant for the pressure, end-systole is the frame of the smallest volume.
    no_pressure = np.ones(frames)
    es = phases.es_frame(no_pressure, volume)
    logger.info("%s", _summary(config, moving, volume, es))
    phase = phases.phases(no_pressure, volume)
    mechanics = unsolved(config, positions - moving.mesh.nodes, len(moving.mesh.cells), es, phase) | {"volume": volume}
    arrays = collect_outputs(config, wall(config, moving.mesh), mechanics)
    _check_interpolated(config, arrays["kinematics"]["volume_ratio_min"])
    return arrays


def _summary(config: Config, moving: MovingWall, volume: Floats, es: int) -> str:
    frames, name = config.loop.frames, moving.cycle.names[0]
    exact = np.isin(np.arange(frames) / frames, moving.cycle.phase).sum()
    return (
        f"{config.motion.file.path}: a cycle of {len(moving.positions)} frames, end-diastole is {name}; {exact} of "
        f"{frames} frames are frames of the files, the others interpolated in time; the cavity holds "
        f"{volume[0] * 1e9:.4g} uL, and {volume[es] * 1e9:.4g} uL at end-systole, frame {es}"
    )


def _check_clearance(config: Config, moving: MovingWall, positions: Floats) -> None:
    """Refuse a wall that could reach an array, which stands at the distance of the focus in all views."""
    apex = moving.mesh.nodes[moving.mesh.endo, 2].min()
    across, along = np.hypot(positions[..., 0], positions[..., 1]).max(), np.abs(positions[..., 2] - apex / 2).max()
    reach, focus = 1e3 * max(across, along), config.rf.focus_mm
    if reach >= focus:
        raise MotionError(
            f"{config.motion.file.path}: the wall reaches {reach:.3g} mm from the middle of the heart, and the array "
            f"is at rf.focus_mm = {focus:g}: raise that and bmode.field_of_view_mm, choose another probe, or mend the "
            f"unit of the files (geometry.unit = {config.geometry.unit}, geometry.scale = {config.geometry.scale:g})."
        )


def _check_interpolated(config: Config, volume_ratio: Floats) -> None:
    """Refuse frames in which the interpolation in time inverts a tetrahedron."""
    if not (volume_ratio > 0).all():
        frame = int(np.argmin(volume_ratio))
        raise MotionError(
            f"{config.motion.file.path}: between its frames the interpolation inverts tetrahedra, in frame {frame} of "
            f"{len(volume_ratio)}: set loop.frames to the number of its frames, or give more of them."
        )
