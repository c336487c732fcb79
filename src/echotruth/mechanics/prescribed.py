"""Prescribed motions: hearts and tubes that move by a formula, so that their motion is known exactly."""

from __future__ import annotations

import numpy as np

from echotruth.config import Config
from echotruth.config.motion import Affine, Course, Cylinder, Rigid
from echotruth.fem.tetrahedra import Floats, Mesh
from echotruth.heart import SHORT_AXIS
from echotruth.loop.cycle import read_loop
from echotruth.loop.phases import FILLING
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.geometry.tube import Tube, lengths
from echotruth.mechanics.history import Arrays, history
from echotruth.mechanics.solver.wall import wall


class MotionError(ValueError):
    """A motion that cannot be imaged."""


def prescribed(config: Config) -> dict[str, Arrays]:
    """Move the heart of a configuration by its formula.

    Parameters
    ----------
    config : Config
        Of which the seed, the sections geometry, fibres, pathology, loop and motion, and the transmit focus are used.

    Returns
    -------
    dict of dict of ndarray
        As of :func:`echotruth.mechanics.beat.beat`. The unloaded state is that of end-diastole, and end-systole the
        frame of the largest motion; pressure, volume, tension, stiffness and residual are not a number.

    Raises
    ------
    GeometryError, FibreError, PathologyError, LoopError, MotionError
        With one sentence, if there is no such heart, no such period, or the heart would move into the array.
    """
    mesh = left_ventricle(config.geometry)
    shares = course(config.motion.course, config.loop.frames)
    displacement = np.stack([move(config, mesh, mesh.nodes, share) for share in shares])
    _check_room(config, mesh, displacement)
    none = np.full(len(shares), np.nan)
    unknown = ("pressure", "volume", "pressure_asked", "volume_asked", "active_tension", "residual")
    mechanics = {
        "time": read_loop(config.loop).time,
        **dict.fromkeys(unknown, none),
        "displacement": displacement,
        "stiffness": np.array(np.nan),
        "es_frame": np.array(np.argmax(shares)),
        "phase": np.full(len(shares), FILLING, np.uint8),
        "newton_steps": np.zeros(len(shares), np.int32),
    }
    return history(config, wall(config, mesh), mechanics)


def course(name: Course, frames: int) -> Floats:
    """Share of the whole motion in every frame.

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


def move(config: Config, mesh: Mesh, places: Floats, share: float) -> Floats:
    """Displacement of any places by the formula of a configuration.

    Parameters
    ----------
    config : Config
    mesh : Mesh
        The heart, of which the endocardial apex is used.
    places : ndarray of shape (..., 3), m
        At end-diastole, in the heart frame.
    share : float
        Of the whole motion.

    Returns
    -------
    ndarray of shape (..., 3), m
    """
    motion = config.motion
    if motion.kind == "rigid":
        return rigid(motion.rigid, places, share)
    if motion.kind == "affine":
        centre = np.array([0, 0, motion.affine.position * mesh.nodes[mesh.endo, 2].min()])
        return affine(motion.affine, places - centre, share)
    return cylinder(motion.cylinder, lengths(config.geometry), places, share)


def rigid(section: Rigid, places: Floats, share: float) -> Floats:
    """Displacement (..., 3), m, of places (..., 3), m, by a share of a shift and of a turn about the long axis."""
    si = section.si()
    shift = np.array([si.lateral, si.axial, si.elevation]) @ SHORT_AXIS
    # The long axis points to the base: seen from the apex, turning about it is clockwise.
    return places @ (_turn(-share * si.turn) - np.eye(3)).T + share * shift


def affine(section: Affine, arms: Floats, share: float) -> Floats:
    """Displacement (..., 3), m, by F = I + share (A - I); arms (..., 3), m, are those from the place that stays."""
    gradient = SHORT_AXIS.T @ np.array(section.gradient) @ SHORT_AXIS
    return share * arms @ (gradient - np.eye(3)).T


def cylinder(section: Cylinder, tube: Tube, places: Floats, share: float) -> Floats:
    """Displacement of places in a tube that contracts, shortens and twists.

    With capitals at end-diastole, r^2 = r_i^2 + (R^2 - R_i^2) / lambda, theta = Theta + gamma Z + omega(R) and
    z = lambda Z: inflation, extension and torsion of a tube that keeps its volume (Rivlin, Phil Trans R Soc Lond A 242
    (1949) 173), and a turn of its shells against one another, which keeps it as well. In the directions R, C, L

        F = [[R / (lambda r), 0, 0], [r omega', r / R, r gamma], [0, 0, lambda]].

    Parameters
    ----------
    section : Cylinder
    tube : Tube
        At end-diastole, its base in z = 0.
    places : ndarray of shape (..., 3), m
        Not on the axis.
    share : float
        Of the contraction, the shortening and both turns.

    Returns
    -------
    ndarray of shape (..., 3), m
    """
    si, (x, y, z) = section.si(), np.moveaxis(places, -1, 0)
    inner, stretch = tube.inner * (1 - share * si.contraction), 1 - share * si.shortening
    square = x**2 + y**2
    # r^2 as R^2 and what is added to it: nothing, to the last bit, where nothing moves.
    added = inner**2 - tube.inner**2 + (square - tube.inner**2) * (1 / stretch - 1)
    growth = np.sqrt(1 + added / square)
    outside = (tube.outer - np.sqrt(square)) / (tube.outer - tube.inner)
    turn = share * (si.torsion * z / tube.length - si.endo_turn * outside)
    cos, sin = growth * np.cos(turn), growth * np.sin(turn)
    return np.stack([(cos - 1) * x - sin * y, sin * x + (cos - 1) * y, (stretch - 1) * z], axis=-1)


def _turn(angle: float) -> Floats:
    """Rotation about the long axis, (3, 3), counter-clockwise seen from the base."""
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])


def _check_room(config: Config, mesh: Mesh, displacement: Floats) -> None:
    """Refuse a motion that could bring the wall to an array, which stands at the distance of the focus in all views."""
    apex = mesh.nodes[mesh.endo, 2].min()
    reach = max(np.hypot(*mesh.nodes[:, :2].T).max(), np.abs(mesh.nodes[:, 2] - apex / 2).max())
    room, moved = config.rf.si().focus - reach, np.linalg.norm(displacement, axis=-1).max()
    if moved >= room:
        raise MotionError(
            f"motion.{config.motion.kind} moves the wall by up to {moved * 1e3:.3g} mm, and it is {room * 1e3:.3g} mm "
            "from the array: make the motion smaller, or raise rf.focus_mm."
        )
