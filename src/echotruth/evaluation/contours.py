"""Contours of the wall in an image, and the strain of their length.

Voigt et al., Eur Heart J Cardiovasc Imaging 16 (2015) 1, doi 10.1093/ehjci/jeu184: global strain is the relative change
of the length of a line of tissue, e(t) = (L(t) - L(ED)) / L(ED), along the endocardium, the middle of the wall or the
epicardium, and the line has to be named. In a short axis it is global circumferential strain (GCS), in a long axis,
where the line leads from the base to the apex and back, global longitudinal strain (GLS). The line is that of the
tissue which lies in the plane at end-diastole, and its length is that of its picture in the plane, which is what an
image shows. A tracked line is rough: noise across it makes it longer, and the more, the finer it is drawn. So lengths
are those along the direction that the line has on average around each piece (:data:`SMOOTHING`). It is that of one
image, tracked and true; GLS of the heart in 3-D, the mean over six planes, is
:func:`echotruth.mechanics.contours.global_longitudinal_strain`.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.evaluation.statistics import ratio
from echotruth.heart import Heart
from echotruth.imaging.view import Plane
from echotruth.mechanics.contours import Cut, cut_triangles, depth_surface

DEPTHS = (0.001, 0.5, 0.999)
"""Wall depth of the endocardial, middle and epicardial contour; just within the wall, because the surface of the mesh
is not a surface within it."""

SMOOTHING = 1 / 16
"""Distance over which a line's direction is averaged, over its length: 0.8 mm in the short axis of a mouse, twice the
radius over which the displacement is fitted."""

MIN_KNOWN = 0.5
"""Smallest share of a contour that must be known at both ends of its pieces: a shorter part says little of the rest."""


@dataclass(frozen=True)
class Contours:
    """The contours of one view, as short straight pieces.

    Attributes
    ----------
    position : ndarray of shape (piece, 2, 2)
        Both ends at end-diastole: lateral, axial, m.
    displacement : ndarray of shape (frame, piece, 2, 2)
        True displacement of the ends since end-diastole: lateral, axial, m.
    contour : ndarray of shape (piece,)
        Index of the contour in :data:`DEPTHS`.
    """

    position: Floats
    displacement: Floats
    contour: NDArray[np.integer]

    def line_strain(self, displacement: Floats) -> Floats:
        """Global strain of each contour, longitudinal (GLS) in a long axis, circumferential (GCS) in a short axis.

        It is the relative change since end-diastole of the length L = sum_i v_i . D_i / |D_i| of the contour, with the
        vectors v_i from one end of a piece to the other, and their weighted sums D_i = sum_j w_ij v_j around piece i.

        Parameters
        ----------
        displacement : ndarray of shape (frame, piece, 2, 2)
            Of both ends of each piece since end-diastole, m; NaN where unknown. Pieces that are not known do not count,
            neither in the length of the frame nor in that at end-diastole.

        Returns
        -------
        ndarray of shape (frame, 3)
            Endocardial, middle, epicardial; NaN where less than half of the contour is known.
        """
        vectors = self.position[:, 1] - self.position[:, 0]
        moved = vectors + displacement[..., 1, :] - displacement[..., 0, :]
        at_ed, known = np.linalg.norm(vectors, axis=-1), np.asarray(np.isfinite(moved).all(-1))
        strains = np.full((len(moved), len(DEPTHS)), np.nan)
        for k in range(len(DEPTHS)):
            of_contour = self.contour == k
            there, weights = known[:, of_contour], self._weights(of_contour)
            initial, now = (
                _length(np.where(there[..., None], pieces, 0.0), weights)
                for pieces in (vectors[of_contour], moved[:, of_contour])
            )
            enough = there @ at_ed[of_contour] >= MIN_KNOWN * at_ed[of_contour].sum()
            strains[:, k] = np.where(enough, ratio(now, initial) - 1, np.nan)
        return strains

    def _weights(self, chosen: NDArray[np.bool_]) -> Floats:
        """Weights w_ij of the pieces around each piece of a contour, negative for pieces that lead the other way."""
        ends = self.position[chosen]
        vector, middle = ends[:, 1] - ends[:, 0], ends.mean(1)
        radius = SMOOTHING * np.linalg.norm(vector, axis=-1).sum()
        distance = np.linalg.norm(middle[:, None] - middle, axis=-1)
        weight = np.maximum(1 - ratio(distance, np.full_like(distance, radius)) ** 2, 0.0)
        return weight * np.sign(vector @ vector.T)


def _length(vectors: Floats, weights: Floats) -> Floats:
    """Length (frame,) of pieces (frame, piece, 2) along their mean directions, with weights (piece, piece)."""
    direction = weights @ vectors
    size = np.linalg.norm(direction, axis=-1)
    return np.asarray(np.sum(ratio(np.sum(vectors * direction, -1), size), axis=-1, where=size > 0))


def contours(heart: Heart, plane: Plane) -> Contours:
    """Contours of the wall of a heart in an image plane.

    Parameters
    ----------
    heart : Heart
    plane : Plane

    Returns
    -------
    Contours
        Without pieces where the plane does not cut the wall.
    """
    ed = plane.to_image(heart.positions(0))
    motion = np.moveaxis((heart.displacement - heart.displacement[0]) @ plane.axes[:2].T, 0, 1)
    fields = np.concatenate([ed[:, None, :2], motion], axis=1)
    found = [_pieces(depth_surface(heart.wall_depth, heart.cells, depth), ed, fields) for depth in DEPTHS]
    pieces = np.concatenate(found)
    index = np.repeat(np.arange(len(DEPTHS)), [len(part) for part in found])
    return Contours(pieces[:, :, 0], np.moveaxis(pieces[:, :, 1:], 2, 0), index)


def _pieces(surface: Cut, ed: Floats, fields: Floats) -> Floats:
    """Values of fields at the ends of the segments in which the plane of elevation 0 cuts a surface.

    The surface is a cut of shape (triangle, 3), `ed` the positions in the image (node, 3), m, lateral, axial and
    elevation; fields (node, field, 2) give values (segment, 2, field, 2).
    """
    corners = Cut(surface.start.ravel(), surface.end.ravel(), surface.share.ravel())
    triangles = np.arange(len(corners.start)).reshape(-1, 3)
    segments = cut_triangles(triangles, corners.values(ed[:, 2:])[:, 0])
    flat = fields.reshape(len(fields), -1)
    edges = (Cut(corners.start[of], corners.end[of], corners.share[of]) for of in (segments.start, segments.end))
    start, end = (edge.values(flat).reshape(*edge.share.shape, *fields.shape[1:]) for edge in edges)
    share = segments.share[..., None, None]
    return (1 - share) * start + share * end
