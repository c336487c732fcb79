"""NIfTI-1 (https://nifti.nimh.nih.gov/nifti-1): a plane or volume over time, placed in the frame of the heart."""

import gzip
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from echotruth.extras import optional
from echotruth.sharing.export.clip import ExportedClip
from echotruth.sharing.export.error import ExportError

MM = 1e3
"""Millimetres in a metre."""

ALIGNED = 2
"""`NIFTI_XFORM_ALIGNED_ANAT`: the world is neither that of a scanner nor a template."""


def write(clip: ExportedClip, path: Path) -> None:
    """Write grey levels, (lateral, axial, elevation, frame), with the affine to the frame of the heart.

    A plane is given the thickness of a pixel, since the format needs one. The frame of the heart stands in place of
    the patient's (right, anterior, superior): x is septal, y anterior, and z points from apex to base.

    Parameters
    ----------
    clip : ExportedClip
    path : Path

    Raises
    ------
    ExportError
        If nibabel is not installed.
    """
    nibabel = optional("nibabel", "clinical", ExportError)
    grey = clip.image if clip.image.ndim == 4 else clip.image[:, :, None]
    image = nibabel.Nifti1Image(np.ascontiguousarray(grey.transpose(3, 1, 2, 0)), None)
    image.header.set_xyzt_units("mm", "sec")
    image.set_sform(affine(clip), ALIGNED)
    image.set_qform(affine(clip), ALIGNED)
    image.header.set_zooms((*MM * clip.sides, clip.frame_time))
    image.header["descrip"] = f"echotruth, synthetic: {clip.name}".encode()[:79]
    # The compressed file has neither name nor date, so that it is the same twice.
    with path.open("wb") as file, gzip.GzipFile("", "wb", 6, file, mtime=0) as packed:
        packed.write(image.to_bytes())


def affine(clip: ExportedClip) -> NDArray[np.float64]:
    """Matrix from voxel (lateral, axial, elevation, 1) to the frame of the heart at end-diastole, mm, (4, 4)."""
    matrix = np.eye(4)
    matrix[:3, :3] = MM * clip.plane.axes.T * clip.sides
    matrix[:3, 3] = MM * clip.plane.to_heart(clip.corner)
    return matrix
