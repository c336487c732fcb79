"""Contours of the wall in an image, and the strain of their length.

Voigt et al., Eur Heart J Cardiovasc Imaging 16 (2015) 1, doi 10.1093/ehjci/jeu184: global strain is the relative change
of the length of a line of tissue, e(t) = (L(t) - L(ED)) / L(ED), along the endocardium, the middle of the wall or the
epicardium, and the line has to be named. In a short axis it is global circumferential strain (GCS), in a long axis,
where the line leads from the base to the apex and back, global longitudinal strain (GLS). The line is that of the
tissue which lies in the plane at end-diastole, and its length is that of its picture in the plane, which is what an
image shows. It is that of one image, tracked and true; GLS of the heart in 3-D, the mean over six planes, is
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

        It is the relative change of the length of the contour since end-diastole.

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
        ends = self.position + displacement
        length = np.linalg.norm(ends[..., 1, :] - ends[..., 0, :], axis=-1)
        at_ed = np.linalg.norm(self.position[:, 1] - self.position[:, 0], axis=-1)
        known = np.isfinite(length)
        strains = np.full((len(length), len(DEPTHS)), np.nan)
        for k in range(len(DEPTHS)):
            of_contour = self.contour == k
            initial = known[:, of_contour] @ at_ed[of_contour]
            strain = ratio(np.nansum(length[:, of_contour], axis=1), initial) - 1
            strains[:, k] = np.where(initial >= MIN_KNOWN * at_ed[of_contour].sum(), strain, np.nan)
        return strains


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
