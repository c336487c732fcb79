"""What a tracker saw of a heart at end-systole, with the errors of it, and the loop of the heart."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from echotruth.aha import APEX_SEGMENT
from echotruth.arrays import Floats
from echotruth.cases import Case
from echotruth.cases.labels import heart_of
from echotruth.evaluation.segment_strain import SHOWN
from echotruth.inference import tracker_errors
from echotruth.inference.imaged_wall import ROTATION, quantity
from echotruth.inference.tracker_errors import TrackerError
from echotruth.repository.choice import image_size
from echotruth.repository.estimates import NotEvaluated
from echotruth.repository.reader import Repository

FOLLOWED = 0.5
"""Share of the points of a segment that a tracker must have followed to end-systole, below which it was not seen."""

MODEL_SD = {"circumferential": 0.004, "longitudinal": 0.004, ROTATION: 0.01}
"""Standard deviation of what the coarse mesh of the model does to an observation: strain, and rad."""


class ObservationError(ValueError):
    """Raised if nothing can be inferred from what was seen."""


class Seen(NamedTuple):
    """What one view shows of one quantity.

    Attributes
    ----------
    quantity : {"circumferential", "longitudinal", "rotation"}
    view : str
    segments : list of int
        AHA segments that are seen; 0 for the whole view.
    tracked, true : ndarray of shape (n,)
        At end-systole: engineering strain of the segments, or rotation, rad.
    """

    quantity: str
    view: str
    segments: list[int]
    tracked: Floats
    true: Floats


def observe(
    repository: Repository,
    tracker: str | None = None,
    case: str | None = None,
    size: int | None = None,
    errors: str | Path | None = None,
) -> xr.Dataset:
    """Read what a tracker saw of a heart at end-systole.

    Parameters
    ----------
    repository : Repository
    tracker, case : str, optional
        As of :class:`Repository`.
    size : int, optional
        Pixels along a side of the images.
    errors : str or Path, optional
        Table of the errors of trackers (docs/inference.md). Default: that of the package. Errors of the heart itself
        in it do not count; trackers are distinguished by their names.

    Returns
    -------
    Dataset
        `value` (observation), at end-systole since end-diastole, less the tracker's bias and with the contrast that it
        loses: engineering strain along the wall of an AHA segment, or rotation, rad; `covariance` (observation, other)
        of its errors; of each observation `quantity` (circumferential, longitudinal or rotation), `view` and `aha`, 0
        for rotation; and the loop of the heart, `pressure` (frame), Pa, and `volume` (frame), m3. Segments of which the
        tracker lost half the points, and those of which the view shows only a corner, are left out, and so is segment
        17.

    Raises
    ------
    ValueError
        If there is no such case, tracker or size, or it was not evaluated; if the error of the tracker is not known; or
        if it saw no segment; or if a short axis rocks, which adds to the rotation of the heart.

    Examples
    --------
    >>> import echotruth as et
    >>> seen = et.observe(et.sample(), "bspline_dic", "infarct")
    >>> strain = seen["value"][(seen["view"] == "mid") & (seen["quantity"] == "circumferential")]
    >>> strain.sizes["observation"], bool(strain.min() > -0.5)
    (6, True)
    """
    if not isinstance(repository, Repository):
        raise TypeError(f"repository = {repository!r:.80}: must be a Repository: echotruth.Repository opens one.")
    found, size = repository.case(case), image_size(repository.config, size)
    tracker = tracker or list(repository.config.tracking.trackers)[-1]
    table = tracker_errors.read(None if errors is None else Path(errors))
    kind, heart = tracker_errors.acoustics(found.config), heart_name(repository, found)
    rows = [
        (seen, tracker_errors.error_of(table, tracker, size, kind, seen.quantity, heart))
        for seen in seen_of(repository, found, tracker, size)
        if seen.segments
    ]
    about = {"case": found.id, "tracker": tracker, "size_px": size, "acoustics": kind}
    if not rows:
        raise ObservationError(f"{found.id}: {tracker} saw no segment at {size} px: nothing can be inferred from it")
    return dataset(rows, found.config.model_dump_json(), loop_of(repository, found), about)


def heart_name(repository: Repository, case: Case) -> str:
    """Name of the heart of a case that no other repository has."""
    return f"{repository.config.name}/{heart_of(case)}"


def seen_of(repository: Repository, case: Case, tracker: str, size: int) -> Iterator[Seen]:
    """What each view shows that a tracker was evaluated on.

    Raises
    ------
    ValueError
        If it was evaluated on none, or a short axis rocks.
    """
    problems, count = [], 0
    for view in repository.views:
        if problem := repository.problem(case.id, view, "truth", "points"):
            problems.append(problem)
            continue
        _check_rotation(case, view)
        try:
            yield from _seen_in(repository, case.id, view, tracker, size)
        except NotEvaluated as error:
            problems.append(str(error))
            continue
        count += 1
    if not count:
        raise ObservationError(problems[0] if problems else f"{case.id}: the repository has no view")


def _check_rotation(case: Case, name: str) -> None:
    """Raise an :class:`ObservationError` if a view adds to the rotation of the heart, which a short axis observes."""
    view = case.config.views[name]
    if view.plane == "short_axis" and view.motion.rocking_deg != 0:
        key = f"views.{name}.motion.rocking_deg = {view.motion.rocking_deg:g}"
        raise ObservationError(f"{case.id}: {key} adds to the rotation of the heart: infer from a view where it is 0")


def _seen_in(repository: Repository, case: str, view: str, tracker: str, size: int) -> Iterator[Seen]:
    """Strain along the wall, and rotation in a short axis."""
    curves = repository.curves(case, view, tracker, size)
    points, es = repository.tracks(case, view, size, [tracker]), curves.attrs["es_frame"]
    followed = np.isfinite(points["displacement"].isel(tracker=0, frame=es).values).all(-1)
    inside, segment = points["layer"].values > 0, points["segment"].values
    along = curves.isel(frame=es).sel(measure="engineering", wall_component="TT")
    tracked, true = (along[f"{name}_segment_strain"].values for name in ("tracked", "true"))
    number = np.array([np.sum(inside & (segment == aha)) for aha in range(1, APEX_SEGMENT)])
    kept = np.array([np.sum(inside & followed & (segment == aha)) for aha in range(1, APEX_SEGMENT)])
    seen = (number >= max(SHOWN * number.max(), 1)) & (kept >= FOLLOWED * number)
    seen &= np.isfinite(tracked[: APEX_SEGMENT - 1] + true[: APEX_SEGMENT - 1])
    at = np.flatnonzero(seen)
    yield Seen(quantity(curves.attrs["plane"]), view, (at + 1).tolist(), tracked[at], true[at])
    turned = [float(curves[f"{name}_rotation"].isel(frame=es)) for name in ("tracked", "true")]
    if np.isfinite(turned).all() and np.sum(kept) >= FOLLOWED * np.sum(number):
        yield Seen(ROTATION, view, [0], np.array(turned[:1]), np.array(turned[1:]))


def loop_of(repository: Repository, case: Case) -> dict[str, Any]:
    """Pressure, Pa, and volume, m^3, of the frames of a heart, by name."""
    if case.config.motion.kind != "beat":
        motion = f"motion.kind = {case.config.motion.kind}"
        raise ObservationError(
            f"{case.id}: {motion} has no loop of pressure and volume, without which nothing is known"
        )
    return repository.arrays("mechanics", case.id, None, "pressure", "volume")


def dataset(
    rows: list[tuple[Seen, TrackerError]], config: str, loop: dict[str, Any], about: dict[str, Any]
) -> xr.Dataset:
    """Observations with the errors of each quantity, in the form that :func:`observe` returns."""
    sizes = [len(seen.segments) for seen, _ in rows]
    covariance, start = np.zeros((sum(sizes), sum(sizes))), 0
    for (seen, error), size in zip(rows, sizes, strict=True):
        block = slice(start, start + size)
        covariance[block, block] = error.covariance(seen.tracked) + MODEL_SD[seen.quantity] ** 2 * np.eye(size)
        start += size
    labels = {
        "quantity": np.repeat([seen.quantity for seen, _ in rows], sizes),
        "view": np.repeat([seen.view for seen, _ in rows], sizes),
        "aha": np.concatenate([seen.segments for seen, _ in rows]),
    }
    value = np.concatenate([error.corrected(seen.tracked) for seen, error in rows])
    arrays: dict[str, Any] = {
        "value": ("observation", value, {"units": "1", "long_name": "engineering strain, or rotation in rad"}),
        "covariance": (("observation", "other"), covariance, {"long_name": "of the errors of the values"}),
        "pressure": ("frame", np.asarray(loop["pressure"], float), {"units": "Pa"}),
        "volume": ("frame", np.asarray(loop["volume"], float), {"units": "m3"}),
    }
    coordinates = {name: ("observation", values) for name, values in labels.items()}
    return xr.Dataset(arrays, coordinates, {**about, "config": config})
