"""Prescribed motions: hearts and tubes that move by a formula, so that their motion is known exactly."""

import numpy as np
from numpy.typing import NDArray

from echotruth.config import Config
from echotruth.config.motion import Affine, Rigid, TimeCourse, TubeMotion
from echotruth.fem.tetrahedra import Floats, Mesh
from echotruth.heart import SHORT_AXIS
from echotruth.loop.cycle import frame_times
from echotruth.loop.phases import FILLING
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.geometry.lattice import Tube, tube_dimensions
from echotruth.mechanics.outputs import Arrays, collect_outputs
from echotruth.mechanics.pathology import thinned
from echotruth.mechanics.solver.wall import wall
from echotruth.units import deg, mm, um


class MotionError(ValueError):
    """Raised if a motion cannot be imaged."""


def prescribed_motion(config: Config) -> dict[str, Arrays]:
    """Move the heart of a configuration by its formula.

    Parameters
    ----------
    config : Config
        Only the seed, the sections geometry, fibres, pathology, loop and motion, and the transmit focus are used.

    Returns
    -------
    dict of dict of ndarray
        As of :func:`echotruth.mechanics.beat.beat`. The unloaded state is that of end-diastole, and end-systole the
        frame of the largest motion; pressure, volume, tension, stiffness and residual are not a number.

    Raises
    ------
    GeometryError, FibreError, PathologyError, LoopError, MotionError
        With one sentence, if the heart or the period is invalid, or the heart would move into the array.
    """
    mesh = thinned(left_ventricle(config.geometry), config.pathology.infarct)
    amplitude = motion_amplitude(config.motion.time_course, config.loop.frames)
    displacement = np.stack([displacement_at(config, mesh, mesh.nodes, a) for a in amplitude])
    _check_clearance(config, mesh, displacement)
    phase = np.full(len(amplitude), FILLING, np.uint8)
    mechanics = unsolved(config, displacement, len(mesh.cells), int(np.argmax(amplitude)), phase)
    return collect_outputs(config, wall(config, mesh), mechanics)


def unsolved(config: Config, displacement: Floats, n_cells: int, es: int, phase: NDArray[np.uint8]) -> Arrays:
    """The group `mechanics` of a motion that is not solved: what a solution alone has is not a number.

    Parameters
    ----------
    config : Config
        Only the section loop is used.
    displacement : ndarray of shape (n_frames, n_nodes, 3), m
    n_cells : int
    es : int
        Frame of end-systole.
    phase : ndarray of shape (n_frames,)
    """
    frames = len(displacement)
    undefined = (
        "pressure",
        "volume",
        "pressure_target",
        "volume_target",
        "active_tension",
        "residual",
        "arterial_pressure",
    )
    return {
        "time": frame_times(config.loop),
        **dict.fromkeys(undefined, np.full(frames, np.nan)),
        "compartment_pressure": np.full((frames, 8), np.nan),
        "compartment_volume": np.full((frames, 8), np.nan),
        "cell_tension": np.full((frames, n_cells), np.nan, np.float32),
        "displacement": displacement,
        "stiffness": np.array(np.nan),
        "es_frame": np.array(es),
        "phase": phase,
        "newton_steps": np.zeros(frames, np.int32),
    }


def motion_amplitude(name: TimeCourse, frames: int) -> Floats:
    """Amplitude a of the motion in every frame, from 0 at rest to 1 for the whole motion.

    Parameters
    ----------
    name : {"cosine", "triangle", "ramp"}
    frames : int
        Of one cycle.

    Returns
    -------
    ndarray of shape (frames,)
        0 in the first; 1 in the last (`ramp`) or the middle one, from which it falls to what would be the first frame
        of the next cycle.
    """
    frame, middle = np.arange(frames), frames // 2
    if name == "ramp":
        return frame / (frames - 1)
    straight = np.interp(frame, [0, middle, frames], [0.0, 1.0, 0.0])
    return straight if name == "triangle" else np.sin(np.pi / 2 * straight) ** 2


def displacement_at(config: Config, mesh: Mesh, positions: Floats, amplitude: float) -> Floats:
    """Displacement of positions by the formula of a configuration.

    Parameters
    ----------
    config : Config
    mesh : Mesh
        The heart, of which the endocardial apex is used.
    positions : ndarray of shape (..., 3), m
        At end-diastole, in the heart frame.
    amplitude : float
        Amplitude a of the motion.

    Returns
    -------
    ndarray of shape (..., 3), m
    """
    motion = config.motion
    if motion.kind == "rigid":
        return rigid(motion.rigid, positions, amplitude)
    if motion.kind == "affine":
        fixed_point = np.array([0, 0, motion.affine.position * mesh.nodes[mesh.endo, 2].min()])
        return affine(motion.affine, positions - fixed_point, amplitude)
    return tube_motion(motion.tube, tube_dimensions(config.geometry), positions, amplitude)


def rigid(section: Rigid, positions: Floats, amplitude: float) -> Floats:
    """Displacement (Q(a angle) - I) x + a shift of positions x (..., 3), m, with a rotation Q about the long axis."""
    shift = np.array([section.lateral_um, section.axial_um, section.elevation_um]) * um @ SHORT_AXIS
    # The long axis points to the base: seen from the apex, rotation about it is clockwise.
    return positions @ (_rotation_about_z(-amplitude * (section.rotation_deg * deg)) - np.eye(3)).T + amplitude * shift


def affine(section: Affine, offsets: Floats, amplitude: float) -> Floats:
    """Displacement a (A - I) x of offsets x (..., 3), m, from the fixed point."""
    gradient = SHORT_AXIS.T @ np.array(section.gradient) @ SHORT_AXIS
    return amplitude * offsets @ (gradient - np.eye(3)).T


def tube_motion(section: TubeMotion, tube: Tube, positions: Floats, amplitude: float) -> Floats:
    """Displacement in a tube that contracts, shortens and twists.

    With capitals at end-diastole, r^2 = r_i^2 + (R^2 - R_i^2) / lambda, theta = Theta + gamma Z + omega(R) and
    z = lambda Z: inflation, extension and torsion of a tube that keeps its volume (Rivlin, Phil Trans R Soc Lond A 242
    (1949) 173), and a rotation of its shells against one another, which keeps it as well. In the directions R, C, L

        F = [[R / (lambda r), 0, 0], [r omega', r / R, r gamma], [0, 0, lambda]].

    Parameters
    ----------
    section : TubeMotion
    tube : Tube
        At end-diastole, its base in z = 0.
    positions : ndarray of shape (..., 3), m
        Not on the axis.
    amplitude : float
        Of the contraction, the shortening and both rotations.

    Returns
    -------
    ndarray of shape (..., 3), m
    """
    x, y, z = np.moveaxis(positions, -1, 0)
    inner, stretch = tube.inner * (1 - amplitude * section.contraction), 1 - amplitude * section.shortening
    square = x**2 + y**2
    # r^2 - R^2, so that r is R to the last bit where nothing moves.
    difference = inner**2 - tube.inner**2 + (square - tube.inner**2) * (1 / stretch - 1)
    r_over_R = np.sqrt(1 + difference / square)
    from_outside = (tube.outer - np.sqrt(square)) / (tube.outer - tube.inner)
    torsion, endo_rotation = section.torsion_deg * deg, section.endo_rotation_deg * deg
    angle = amplitude * (torsion * z / tube.length - endo_rotation * from_outside)
    cos, sin = r_over_R * np.cos(angle), r_over_R * np.sin(angle)
    return np.stack([(cos - 1) * x - sin * y, sin * x + (cos - 1) * y, (stretch - 1) * z], axis=-1)


def _rotation_about_z(angle: float) -> Floats:
    """Rotation about the long axis, (3, 3), counter-clockwise seen from the base."""
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])


def _check_clearance(config: Config, mesh: Mesh, displacement: Floats) -> None:
    """Refuse a motion that could bring the wall to an array, which stands at the distance of the focus in all views."""
    apex = mesh.nodes[mesh.endo, 2].min()
    extent = max(np.hypot(*mesh.nodes[:, :2].T).max(), np.abs(mesh.nodes[:, 2] - apex / 2).max())
    clearance, largest = config.rf.focus_mm * mm - extent, np.linalg.norm(displacement, axis=-1).max()
    if largest >= clearance:
        raise MotionError(
            f"motion.{config.motion.kind} moves the wall by up to {largest * 1e3:.3g} mm, and it is "
            f"{clearance * 1e3:.3g} mm from the array: make the motion smaller, or raise rf.focus_mm."
        )
