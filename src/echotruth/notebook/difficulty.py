"""How difficult a clip of a repository is to track, whatever the tracker."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from echotruth.evaluation.choice import job_of
from echotruth.evaluation.difficulty.table import difficulties
from echotruth.repository.ledger import repository_folder

if TYPE_CHECKING:
    import pandas as pd


def difficulty(repository: str | Path, case: str = "heart", view: str = "mid") -> pd.DataFrame:
    """Determine with what error a clip can be tracked at best (docs/difficulty.md).

    Parameters
    ----------
    repository : str or Path
        `out/NAME`; what is found is kept there.
    case : str
        Case id, as in `cases.csv`.
    view : str

    Returns
    -------
    DataFrame
        A row of each image size: case, view, size_px; `floor_plane_percent`, the NRMSE at end-systole of a perfect
        tracker of the plane, whose points go from frame to frame with the tissue that is in the plane where they are
        (forwards and backwards as trackers combine it, and `_forward` and `_backward` alone), and
        `floor_plane_coverage`, the fraction of the points that it keeps in the wall; `floor_crb_percent`, the
        Cramer-Rao bound of the error at end-systole over the RMS displacement, for a smooth motion of `crb_parameters`
        parameters for each component (and each way alone); `floor_percent`, the root of the sum of the squares of
        both; `crb_step_um`, the bound of a step, RMS over the cycle; and the correlation of echo amplitudes in the wall
        along the path of that tracker: `correlation_median` and `_least` of consecutive frames, `_closing` of the last
        with the first, `_es` of end-systole with end-diastole. NaN where images hold no information.

    Raises
    ------
    FileNotFoundError, ValueError
        If there is no such repository, case or view, or the clip has no images or truth.

    Examples
    --------
    >>> import echotruth as et
    >>> floors = et.difficulty("out/demo", "heart", "mid")
    >>> list(floors.columns[:4])
    ['case', 'view', 'size_px', 'floor_percent']
    """
    job_of(repository, case, view)
    found = difficulties(repository_folder(repository), [case], [view])
    if found.empty:
        raise ValueError(f"case = {case!r}, view = {view!r}: has no images and truth: run the repository to its end.")
    return found
