"""Strain, rotation and twist of the clips of a repository, tracked beside true."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from echotruth.evaluation import curves
from echotruth.evaluation.choice import job_of
from echotruth.workflow.job import Job

if TYPE_CHECKING:
    import xarray as xr


def strain_curves(
    repository: str | Path,
    case: str = "heart",
    view: str = "mid",
    tracker: str = "bspline_dic",
    size: int | None = None,
    reference: str = curves.REFERENCE,
) -> xr.Dataset:
    """Read strain and rotation over the cycle, as a tracker found them and as they are (docs/strain.md).

    Parameters
    ----------
    repository : str or Path
        `out/NAME`.
    case : str
        Case id, as in `cases.csv`.
    view : str
    tracker : str
        A tracker of the repository, or one that `echotruth evaluate --keep` stored.
    size : int, optional
        Pixels along a side of the clip. Default: the largest.
    reference : {"plane", "heart", "operator"}
        What the true strain of regions and segments is: that of the motion in the plane, which an image can show; that
        of the heart in space; or that of the operator for tracked strain, applied to the true displacement.

    Returns
    -------
    Dataset
        Of `tracked_` and `true_` each, from end-diastole (frame 0): `region_strain` (measure, frame, region,
        wall_component), mean over the points of the whole wall (region 0) or of a layer (1 at the endocardium);
        `segment_strain` (measure, frame, aha, wall_component), NaN where the view does not show a segment;
        `line_strain` (frame, contour), the relative change of a contour's length, which is circumferential (GCS) in a
        short axis and longitudinal (GLS) in a long axis; `rotation` (frame), rad, counter-clockwise seen from the
        apex, NaN in a long axis; and of each its `_rate`, per second. Measures are `engineering` and
        `green_lagrange`, components RR (radial), TT (circumferential or longitudinal) and RT (shear; engineering: rad).
        `time` (frame) is in s, and the attributes tell es_frame and end_systole (s). The true curves do not depend on
        the tracker.

    Raises
    ------
    FileNotFoundError, ValueError
        If there is no such repository, case, view, tracker, size or reference.

    Examples
    --------
    >>> import echotruth as et
    >>> curves = et.strain_curves("out/demo", view="mid")
    >>> gcs = curves[["tracked_line_strain", "true_line_strain"]].sel(contour="middle")
    >>> gcs["tracked_line_strain"].dims, gcs["tracked_line_strain"].units
    (('frame',), '1')
    """
    return curves.strain_curves(job_of(repository, case, view), tracker, size, reference)


def twist_curves(
    repository: str | Path, case: str = "heart", tracker: str = "bspline_dic", size: int | None = None
) -> xr.Dataset:
    """Read the twist over the cycle: the rotation of the most apical less that of the most basal short-axis view.

    Parameters
    ----------
    repository : str or Path
    case : str
    tracker : str
    size : int, optional
        Pixels along a side of the clips. Default: the largest.

    Returns
    -------
    Dataset
        `tracked_twist` and `true_twist` (frame), rad, counter-clockwise seen from the apex, their `_rate`, rad/s, and
        `heart_twist`, that of the slices of tissue in the group physiology; the attributes basal_view and apical_view.

    Raises
    ------
    FileNotFoundError, ValueError
        If there is no such repository, case, tracker or size, or there are fewer than two short-axis views.

    Examples
    --------
    >>> import echotruth as et
    >>> twist = et.twist_curves("out/demo")
    >>> twist.attrs["apical_view"], twist.attrs["basal_view"], twist["tracked_twist"].units
    ('apex', 'base', 'rad')
    """
    job = job_of(repository, case)
    views = curves.twist_views(job.case.config)
    if views is None:
        raise ValueError("Twist needs two short-axis views at different positions, and the repository has not.")
    jobs = (Job(job.folder, "tracking", job.case, view, code="read") for view in views)
    base, apex = (curves.strain_curves(of_view, tracker, size) for of_view in jobs)
    return curves.twist_of(base, apex, job.store.read("physiology", job.row, names=("twist",))["twist"])
