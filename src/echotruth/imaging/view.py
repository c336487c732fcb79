"""Views: the pose of the probe and the plane it images."""

from dataclasses import dataclass, replace

import numpy as np

from echotruth.arrays import Floats
from echotruth.config import Config, Loop, Rf, View
from echotruth.config.imaging import Breathing, Excursion, ViewMotion
from echotruth.heart import SHORT_AXIS, Heart, RigidMotion
from echotruth.loop.cycle import frame_times, period
from echotruth.units import deg, mm, per_min

BEATS_PER_BREATH = 4.5
"""Heart rate 241 M^-0.25 over respiratory rate 53.5 M^-0.26, M the mass of a mammal (Stahl 1967)."""


class NoWall(ValueError):
    """Raised if a view does not show the wall."""


@dataclass(frozen=True)
class Plane:
    """An imaging plane in the heart frame.

    Attributes
    ----------
    origin : ndarray of shape (3,), m
        Centre of the array.
    axes : ndarray of shape (3, 3)
        Rows: unit vectors lateral, axial and elevation.
    is_volume : bool
        Whether a volume is imaged, of which it is the middle.
    """

    origin: Floats
    axes: Floats
    is_volume: bool = False

    def to_image(self, positions: Floats) -> Floats:
        """Transform positions in the heart frame to lateral, axial, elevation; (..., 3) to (..., 3), m."""
        return (positions - self.origin) @ self.axes.T

    def to_heart(self, positions: Floats) -> Floats:
        """Transform lateral, axial, elevation to positions in the heart frame; (..., 3) to (..., 3), m."""
        return positions @ self.axes + self.origin


def imaging_plane(view: View, rf: Rf, endo_ed: Floats) -> Plane:
    """Plane of a view at end-diastole.

    Unless the probe has an offset, the heart is at the transmit focus, where the beam is narrowest.

    Parameters
    ----------
    view : View
    rf : Rf
    endo_ed : ndarray of shape (n, 3), m
        Endocardial nodes at end-diastole.

    Returns
    -------
    Plane
    """
    apex, tilt, offset = endo_ed[:, 2].min(), view.tilt_deg * deg, view.offset
    if view.plane != "long_axis":
        axes = tilted(SHORT_AXIS, tilt)
        centre = np.array([0, 0, view.position * apex])
    else:
        cos, sin = np.cos(view.rotation_deg * deg), np.sin(view.rotation_deg * deg)
        axes = tilted(np.array([[-cos, -sin, 0], [0, 0, 1.0], [-sin, cos, 0]]), tilt)
        # Half the length of the cavity from the middle of the base, which is the origin of the heart frame.
        centre = apex / 2 * axes[1] + 0.0  # no -0.0
    axes = turned(axes, view.angle_deg * deg)
    depth = rf.focus_mm * mm - offset.axial_mm * mm
    origin = centre + offset.lateral_mm * mm * axes[0] - depth * axes[1]
    return Plane(origin, axes, is_volume=view.plane == "volume")


def tilted(axes: Floats, angle: float) -> Floats:
    """Axes of a plane that is tilted about its lateral axis, so that its upper edge moves along the elevation axis.

    Parameters
    ----------
    axes : ndarray of shape (3, 3)
        Rows: unit vectors lateral, axial and elevation.
    angle : float, rad

    Returns
    -------
    ndarray of shape (3, 3)
    """
    if angle == 0:
        return axes
    lateral, axial, elevation = axes
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack([lateral, cos * axial - sin * elevation, cos * elevation + sin * axial])


def turned(axes: Floats, angle: float) -> Floats:
    """Axes of a probe that is turned in its plane, clockwise in the image; parameters as of :func:`tilted`."""
    return axes if angle == 0 else rotation_in_image(angle) @ axes


def rotation_in_image(angle: float) -> Floats:
    """Rotation of lateral, axial and elevation by an angle, rad, counter-clockwise in the image, (3, 3).

    Applied to the axes of a probe, it turns the probe clockwise.
    """
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]])


def before_probe(heart: Heart, config: Config, view: str) -> tuple[Heart, Plane]:
    """A heart before the probe of a view.

    Parameters
    ----------
    heart : Heart
    config : Config
        How it is imaged.
    view : str
        Name of the view.

    Returns
    -------
    Heart
        As it moves relative to the probe, which stands still.
    Plane
    """
    plane = imaging_plane(config.views[view], config.rf, heart.endo_at_ed)
    return moved(heart, plane, config.views[view].motion, config.loop), plane


def moved(heart: Heart, plane: Plane, motion: ViewMotion, loop: Loop, time: Floats | None = None) -> Heart:
    """A heart with the rigid motion relative to the probe on top of its own.

    A position x in the image becomes R(t) x + d(t), where R is a rotation about the middle of the array, and d a
    displacement along the axes of the image; both are none at end-diastole.

    Parameters
    ----------
    heart : Heart
    plane : Plane
    motion : ViewMotion
    loop : Loop
    time : ndarray of shape (frame,), s, optional
        Times of the frames of the heart. Default: those of the loop.

    Returns
    -------
    Heart
    """
    if motion == ViewMotion():
        return heart
    beat = period(loop) / len(loop.beats)
    time = frame_times(loop)[: len(heart.displacement)] if time is None else time
    within = raised_cosine(2 * np.pi * time / beat)
    angle = motion.rocking_deg * deg * within
    shift = np.outer(within, _vector(motion.beat)) + np.outer(time / beat, _vector(motion.drift))
    shift += np.outer(inspiration(motion.breathing, time, beat), _vector(motion.breathing))
    rotation = [plane.axes.T @ rotation_in_image(each) @ plane.axes for each in angle]
    rigid = RigidMotion(plane.origin, np.stack(rotation), shift @ plane.axes)
    rigid.rotation[angle == 0] = np.eye(3)  # without rounding
    change = [rigid.displacement(frame, heart.positions(frame)) for frame in range(len(time))]
    return replace(heart, displacement=heart.displacement + np.stack(change), rigid=rigid)


def inspiration(breathing: Breathing, time: Floats, period: float) -> Floats:
    """Share of the excursion of a breath, less that at end-diastole.

    Parameters
    ----------
    breathing : Breathing
    time : ndarray of shape (frame,), s
        Since end-diastole.
    period : float, s
        Of the beat.

    Returns
    -------
    ndarray of shape (frame,)
    """
    per_minute, phase = breathing.rate_per_min, breathing.phase_deg * deg
    rate = 1 / (BEATS_PER_BREATH * period) if per_minute is None else per_minute * per_min
    return raised_cosine(2 * np.pi * rate * time + phase) - raised_cosine(np.array(phase))


def raised_cosine(phase: Floats) -> Floats:
    """(1 - cos(phase)) / 2 of phases, rad."""
    return (1 - np.cos(phase)) / 2


def _vector(excursion: Excursion) -> Floats:
    """Lateral, axial and elevation component, (3,), m."""
    return np.array([excursion.lateral_mm, excursion.axial_mm, excursion.elevation_mm]) * mm
