"""Strain, rotation and twist of the clips of a repository, tracked beside true."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from echotruth.evaluation import curves, summary
from echotruth.notebook.repositories import job_of
from echotruth.repository.ledger import repository_folder

if TYPE_CHECKING:
    import pandas as pd
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


def strain_peaks(strain: xr.Dataset) -> xr.Dataset:
    """Read end-systolic strain, peak strain, time to peak and the largest rate of systole off curves.

    Parameters
    ----------
    strain : Dataset
        As :func:`strain_curves` or :func:`twist_curves` returns it.

    Returns
    -------
    Dataset
        For every curve NAME, without the dimension frame: `NAME_es`, its value at end-systole; `NAME_peak`, its value
        of largest magnitude over the cycle; `NAME_time_to_peak`, s since end-diastole; and `NAME_systolic_rate`, the
        largest rate from end-diastole to end-systole in the direction of the end-systolic value (of shortening the
        most negative one).

    Raises
    ------
    ValueError
        If the data set has lost its attributes.

    Examples
    --------
    >>> import echotruth as et
    >>> peaks = et.strain_peaks(et.strain_curves("out/demo", view="mid"))
    >>> peaks["tracked_segment_strain_es"].sel(measure="engineering", wall_component="TT").dims
    ('aha',)
    """
    return curves.strain_peaks(strain)


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
    return curves.twist_curves(job_of(repository, case), tracker, size)


def strain_summary(
    repository: str | Path,
    cases: Sequence[str] | None = None,
    views: Sequence[str] | None = None,
    sizes: Sequence[int] | None = None,
    trackers: Sequence[str] | None = None,
) -> pd.DataFrame:
    """Read GLS, GCS, radial strain, rotation and twist of clips into a table, tracked and true.

    Parameters
    ----------
    repository : str or Path
    cases, views, sizes, trackers : sequence, optional
        Those to include. Default: all that was evaluated, at the largest size.

    Returns
    -------
    DataFrame
        One row per case, view, size_px, tracker and `quantity`: gls and gls_endocardial (long axis), gcs and
        gcs_endocardial (short axis), radial (engineering, mean of the wall, in the plane), all in %, and rotation
        (short axis), in degrees. Rows of the view "all" are those of the heart: gls as the mean over its long-axis
        views, gcs and radial over its short-axis views, if all of these are included, and twist. Columns `tracked_`
        and `true_` each: `es` and `peak`, in the `unit`; `time_to_peak_ms`; and `systolic_rate`, in the `rate_unit`.

    Raises
    ------
    FileNotFoundError, ValueError
        If there is no such repository, case, view, size or tracker.

    Examples
    --------
    >>> import echotruth as et
    >>> table = et.strain_summary("out/demo", trackers=["bspline_dic"])
    >>> gls = table.query("quantity == 'gls' and view == 'long_axis'")[["tracked_es", "true_es", "unit"]]
    >>> list(gls["unit"])
    ['percent']
    """
    folder = repository_folder(repository)
    return summary.strain_summary(folder, cases, views, sizes, trackers)
