"""Images of the tissue at every pixel around the wall: what scatterers in the imaging plane are there in each frame.

What is around the heart is labelled at end-diastole, and looked up in each frame where the tissue at the pixel was
then. Its motion u(X) is that of the scatterers, :class:`.surroundings.SurroundingsMotion`; it is known at knots of the
image, between which it is interpolated, and x = X + u(X) is solved for X by iteration. Tissues that move by rules of
their own are looked up one after the other: atria over the rest, the chest wall over both.
"""

from collections.abc import Callable
from functools import cached_property

import numba
import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.config import Config
from echotruth.fem.location import locate
from echotruth.heart import Heart
from echotruth.imaging.beamforming.scan import scan_lines
from echotruth.imaging.labels import TissueLabel
from echotruth.imaging.medium.anatomy import FOLLOWING_BASE, above_lid
from echotruth.imaging.medium.aortic_valve import AorticValve
from echotruth.imaging.medium.blood import Cavity
from echotruth.imaging.medium.mitral_valve import MitralValve
from echotruth.imaging.medium.papillary_muscles import AZIMUTHS, PapillaryMuscle
from echotruth.imaging.medium.surroundings import SurroundingsMotion, tissues
from echotruth.imaging.medium.tricuspid_valve import TricuspidValve
from echotruth.imaging.view import Plane
from echotruth.units import mm

Labels = NDArray[np.uint8]
CavityPart = MitralValve | AorticValve | TricuspidValve | PapillaryMuscle

KNOTS = 65
"""Points along each side of the image at which the motion of what is around the heart is computed."""
ITERATIONS = 12
"""Of X <- x - u(X). Where u changes by less than half of any distance, 12 of them leave 1/4000 of it."""


class TissueImages:
    """Labels of what is around the wall, frame by frame.

    Parameters
    ----------
    config : Config
    heart : Heart
        With the facets of its epicardium, in `arrays`.
    plane : Plane
    axial, lateral : ndarray of shape (n_axial,), (n_lateral,), m
        Pixel centres, evenly spaced.
    """

    def __init__(self, config: Config, heart: Heart, plane: Plane, axial: Floats, lateral: Floats) -> None:
        self._config, self._heart, self._plane = config, heart, plane
        self._axial, self._lateral = axial, lateral
        self._position = self._in_heart_frame(axial, lateral)
        around = config.realism.neighbours.around.values()
        self._has_around = any(level is not None for level in around)

    def __call__(self, frame: int) -> Labels:
        """Labels of the pixels in a frame, (n_axial, n_lateral), of :class:`echotruth.imaging.labels.TissueLabel`.

        Where the wall is they mean nothing.
        """
        shape = len(self._axial), len(self._lateral)
        found = self._around(frame) if self._has_around else np.zeros(shape, np.uint8)
        flat = found.reshape(-1)
        self._set_cavity(frame, flat)
        self._set_right_wall(frame, flat)
        for label, body, pixels in self._bodies:
            flat[pixels[body.contains(frame, self._position[pixels])]] = label
        return found

    def _in_heart_frame(self, axial: Floats, lateral: Floats) -> Floats:
        """Points of the image in the heart frame, (n_axial n_lateral, 3), m."""
        in_image = np.stack(np.broadcast_arrays(lateral, axial[:, None], 0.0), axis=-1)
        return self._plane.to_heart(in_image.reshape(-1, 3))

    @cached_property
    def _at_ed(self) -> Labels:
        """What is around the heart at end-diastole, (n_axial, n_lateral)."""
        found = tissues(self._config, self._heart, self._plane, self._position)[0]
        return found.reshape(len(self._axial), len(self._lateral))

    @cached_property
    def _hidden(self) -> NDArray[np.bool_]:
        """Pixels outside the scan, or nearer than the tissue begins, (n_axial, n_lateral)."""
        scan = scan_lines(self._config.probe, self._config.rf)
        line, range_ = scan.to_scan_coordinates(self._lateral, self._axial[:, None])
        begins = self._config.realism.surroundings.start_mm * mm
        beyond = (range_ < begins) | (range_ > self._config.depth_mm * mm)
        return (line < 0) | (line > len(scan.angle) - 1) | beyond

    @cached_property
    def _motions(self) -> list[Callable[[int], Floats]]:
        """Positions of the knots, (n, 3), m, if there is tissue of an atrium, or any other that is not at rest."""
        knots = self._in_heart_frame(*(np.linspace(at[0], at[-1], KNOTS) for at in (self._axial, self._lateral)))
        decay = self._config.realism.surroundings.motion_decay_mm * mm
        kinds = (TissueLabel.LEFT_ATRIUM, TissueLabel.RIGHT_VENTRICLE)
        return [SurroundingsMotion(self._heart, knots, decay, np.full(len(knots), kind, np.uint8)) for kind in kinds]

    @cached_property
    def _layers(self) -> tuple[Labels, Labels, Labels]:
        """What is around the heart at end-diastole: atria, the chest wall, and the rest; 0 elsewhere."""
        of_atria, of_chest = np.isin(self._at_ed, FOLLOWING_BASE), self._at_ed == TissueLabel.CHEST_WALL
        atria, chest = (np.where(mask, self._at_ed, 0).astype(np.uint8) for mask in (of_atria, of_chest))
        return atria, chest, np.where(of_atria | of_chest, 0, self._at_ed).astype(np.uint8)

    def _around(self, frame: int) -> Labels:
        (atria, chest, rest), (of_atria, of_rest) = self._layers, self._motions
        found = self._moved(rest, of_rest, frame)
        if atria.any():
            moved = self._moved(atria, of_atria, frame)
            np.copyto(found, moved, where=moved > 0)
        np.copyto(found, chest, where=chest > 0)
        if self._config.realism.neighbours.chambers_dB is None:
            found[self._above_lid(frame)] = TissueLabel.OTHER
        found[self._hidden] = TissueLabel.OTHER
        return found

    def _moved(self, at_ed: Labels, motion: Callable[[int], Floats], frame: int) -> Labels:
        """Labels (n_axial, n_lateral) carried from end-diastole to a frame by the motion of the knots."""
        moved = self._plane.to_image(motion(frame)) - self._plane.to_image(motion(0))
        spacing = self._axial[1] - self._axial[0], self._lateral[1] - self._lateral[0]
        in_pixels = (moved[:, 1::-1] / spacing).reshape(KNOTS, KNOTS, 2)
        return _carried(at_ed, _starts(in_pixels, *at_ed.shape))

    def _above_lid(self, frame: int) -> NDArray[np.bool_]:
        """Pixels above the lid of the cavity, (n_axial, n_lateral), where no tissue is around the heart."""
        nodes = self._heart.positions(frame)
        return above_lid(nodes, self._heart.endo, self._position).reshape(len(self._axial), -1)

    def _set_cavity(self, frame: int, flat: Labels) -> None:
        if self._config.geometry.shape == "tube":
            return
        nodes, near = self._cavity.positions(self._heart.positions(frame)), self._near_cavity
        flat[near[locate(nodes, self._cavity.cells, self._position[near]).cell >= 0]] = TissueLabel.CAVITY

    def _set_right_wall(self, frame: int, flat: Labels) -> None:
        cells = self._heart.cells[self._heart.right_wall]
        if len(cells):
            flat[locate(self._heart.positions(frame), cells, self._position).cell >= 0] = TissueLabel.RIGHT_FREE_WALL

    @cached_property
    def _cavity(self) -> Cavity:
        return Cavity(self._heart.endo)

    @cached_property
    def _near_cavity(self) -> NDArray[np.int64]:
        """Indices of the pixels that may be in the cavity in any frame."""
        endo = np.unique(self._heart.endo)
        nodes = np.stack([self._heart.positions(frame)[endo] for frame in range(len(self._heart.displacement))])
        return self._within(nodes.min(axis=(0, 1)), nodes.max(axis=(0, 1)))

    def _within(self, low: Floats, high: Floats) -> NDArray[np.int64]:
        """Indices of the pixels in a box of the heart frame, (3,), m, to (3,), m."""
        return np.flatnonzero(((self._position >= low) & (self._position <= high)).all(axis=1))

    @cached_property
    def _bodies(self) -> list[tuple[TissueLabel, CavityPart, NDArray[np.int64]]]:
        """Bodies in the cavity, and the indices of the pixels that may be in each in any frame."""
        levels = self._config.realism.neighbours
        bodies: list[tuple[TissueLabel, CavityPart]] = []
        if levels.leaflets_dB is not None:
            bodies.append((TissueLabel.MITRAL_LEAFLET, MitralValve(self._heart)))
        if levels.chambers_dB is not None:
            bodies.append((TissueLabel.AORTIC_CUSP, AorticValve(self._heart)))
            bodies.append((TissueLabel.TRICUSPID_LEAFLET, TricuspidValve(self._heart)))
        if levels.papillary_muscles_dB is not None:
            muscles = [PapillaryMuscle(self._heart, azimuth) for azimuth in AZIMUTHS]
            bodies += [(TissueLabel.PAPILLARY_MUSCLE, muscle) for muscle in muscles]
        return [(label, body, self._within(*body.box)) for label, body in bodies]


@numba.njit(cache=True)
def _interpolated(field, row, column):
    """Both components of a field (n, n, 2) at fractional indices, linear, constant beyond its sides."""
    rows, columns = field.shape[0] - 1, field.shape[1] - 1
    row, column = min(max(row, 0.0), float(rows)), min(max(column, 0.0), float(columns))
    i, j = min(int(row), rows - 1), min(int(column), columns - 1)
    r, c = row - i, column - j
    a, b, d, e = (1 - r) * (1 - c), (1 - r) * c, r * (1 - c), r * c
    first = a * field[i, j, 0] + b * field[i, j + 1, 0] + d * field[i + 1, j, 0] + e * field[i + 1, j + 1, 0]
    second = a * field[i, j, 1] + b * field[i, j + 1, 1] + d * field[i + 1, j, 1] + e * field[i + 1, j + 1, 1]
    return first, second


@numba.njit(cache=True)
def _starts(displacement, rows, columns):
    """Where the tissue at each knot of an image was, (knot, knot, 2), px: X of x = X + u(X), u (knot, knot, 2), px."""
    down, right = (rows - 1) / (displacement.shape[0] - 1), (columns - 1) / (displacement.shape[1] - 1)
    starts = np.empty_like(displacement)
    for i in range(displacement.shape[0]):
        for j in range(displacement.shape[1]):
            row, column = i * down, j * right
            for _ in range(ITERATIONS):
                u, v = _interpolated(displacement, row / down, column / right)
                row, column = i * down - u, j * right - v
            starts[i, j, 0], starts[i, j, 1] = row, column
    return starts


@numba.njit(cache=True)
def _carried(labels, starts):
    """Labels (n, m) of the pixels nearest to where the tissue of each pixel was, given for the knots of an image."""
    rows, columns = labels.shape
    up, left = (starts.shape[0] - 1) / (rows - 1), (starts.shape[1] - 1) / (columns - 1)
    carried = np.empty_like(labels)
    for i in range(rows):
        for j in range(columns):
            row, column = _interpolated(starts, i * up, j * left)
            nearest, beside = min(max(row, 0.0), rows - 1.0), min(max(column, 0.0), columns - 1.0)
            carried[i, j] = labels[int(nearest + 0.5), int(beside + 0.5)]
    return carried
