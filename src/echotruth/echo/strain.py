"""Speckle tracking of one's own echo: displacement of the wall, its strain, its segments and its global strain."""

from collections.abc import Callable
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from echotruth.aha import SEGMENT_NAMES
from echotruth.arrays import Floats
from echotruth.config.building import configure, tracker_section
from echotruth.config.defaults import REFERENCE_FIELD_OF_VIEW_MM
from echotruth.echo.doubts import doubts
from echotruth.echo.failure import EchoError
from echotruth.echo.wall import LAYERS, Wall
from echotruth.echo.wall_file import part
from echotruth.evaluation.contours import Contours
from echotruth.evaluation.courses import motion_courses, strain_courses
from echotruth.evaluation.displacement_error import WallPoints
from echotruth.evaluation.strain import RADIUS, StrainOperator
from echotruth.repository.schema import LABELS
from echotruth.tracking import plausibility
from echotruth.tracking.periodicity import rms_length
from echotruth.tracking.plausibility import REFERENCE_WALL_MM
from echotruth.tracking.tracker import track

GRID_PX, IMAGE_PX = 5, 512
"""Spacing of the points in a mouse's clip, and the side of that clip, which shows 12 mm."""

MIN_WALL_PX = 6.0
"""Thickness of the wall below which its strain cannot be measured, px."""
WALLS_MM = 0.5, 50.0
"""Thickness of the thinnest and of the thickest wall that is tracked: beyond, the side of a pixel is wrong."""

Tracker = str | Callable[..., Any]


def speckle_tracking(clip: xr.Dataset, wall: Wall, tracker: Tracker = "bspline_dic", **options: Any) -> xr.Dataset:
    """Track the wall of a recorded clip, and take its strain.

    Parameters
    ----------
    clip : Dataset
        As :func:`echotruth.read_clip` returns it: one cycle, of which frame 0 is end-diastole.
    wall : Wall
        Drawn in frame 0.
    tracker : str or callable
        A method of config/README.md (`tracking.trackers`), `package.module:function`, or a function of six arguments
        as `et.track` takes it.
    **options
        Settings of the method, or keyword arguments of the function. Lengths are by default those of the method for a
        mouse, scaled by the thickness of the wall.

    Returns
    -------
    Dataset
        `displacement` (frame, point, plane), m, since frame 0, and `quality` (frame, point) at `position`
        (point, plane), m; `strain` (frame, point, wall_component), Green-Lagrange; `region_strain` of the wall and its
        three layers and `segment_strain` of AHA segments, in two measures; `line_strain` (frame, contour), the global
        strain of endocardial, middle and epicardial line, circumferential (GCS) or longitudinal (GLS) as the view has
        it; `rotation` (frame,), rad; `cavity_area` (frame,), m2. Attributes: `es_frame`, the frame of the smallest
        cavity, and `end_systole`, s; `gcs_percent` or `gls_percent`, of the middle line at end-systole;
        `drift_percent`, the displacement left in the last frame over the largest; `notes`, what should make one doubt,
        a line each; `tracker`, `view`. NaN where there is no estimate, as everywhere in noise.

    Raises
    ------
    EchoError
        If the wall is not within the clip, is too thin or too thick to be tracked, or was drawn on other frames or
        pixels.
    ConfigError
        If there is no such method or setting.
    TrackerFailed
        If the tracker finds no motion.

    Examples
    --------
    >>> import numpy as np
    >>> import echotruth as et
    >>> speckle = np.random.default_rng(0).integers(0, 255, (1, 128, 128), np.uint8)
    >>> clip = et.read_clip(np.tile(speckle, (4, 1, 1)), spacing_mm=0.1, frame_time_ms=5)  # nothing moves
    >>> angle = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    >>> circle = np.column_stack([np.cos(angle), np.sin(angle)])
    >>> strain = et.speckle_tracking(clip, et.Wall(64 + 20 * circle, 64 + 35 * circle, "mid"), "dis")
    >>> bool(abs(strain.attrs["gcs_percent"]) < 0.1)
    True

    Notes
    -----
    Strain is that of :mod:`echotruth.evaluation.strain`, the operator by which tracked and true strain of a repository
    are compared.
    """
    frames, spacing = _frames(clip)
    _check_part(clip, wall)
    wall.check_within(frames.shape[1:])
    mask = wall.mask(frames.shape[1:])
    scale = _scale(wall, spacing)
    points = _points(mask, spacing, scale)
    settings = _settings(tracker, options, scale)
    displacement, quality = track(frames, points, mask, spacing, clip["time"].values, 0, settings)
    notes = plausibility.doubts(frames, mask, spacing, settings)
    if plausibility.NOISE in notes:
        displacement[:], quality[:] = np.nan, np.nan
    position, moved = points * spacing, displacement * spacing
    depth, normal = wall.depth(points)
    tissue = _tissue(wall, points, depth, position)
    operator = StrainOperator(position, _axes(normal), RADIUS * REFERENCE_FIELD_OF_VIEW_MM * 1e-3 * scale)
    strain = operator.strain(moved)
    lines = _contours(wall, spacing)
    pieces = operator.at(lines.position.reshape(-1, 2))(moved)[:, :, 0].reshape(len(frames), -1, 2, 2)
    curves = strain_courses(strain, tissue) | motion_courses(moved, pieces, tissue, lines)
    place = (lines.position + pieces)[:, :, 0]
    curves["cavity_area"] = _area(place[:, lines.contour == 0])
    values = {"displacement": moved, "quality": quality, "strain": strain, "line_position": place} | curves
    data = _dataset(values, position, tissue, clip)
    data["line_contour"] = ("line_point", lines.contour, {"long_name": "index of the contour of a point of a line"})
    data = data.assign_attrs(
        _summary(curves, moved, clip["time"].values, wall),
        tracker=tracker if isinstance(tracker, str) else getattr(tracker, "__name__", type(tracker).__name__),
        view=wall.view,
        source=clip.attrs.get("source", ""),
        spacing=spacing,
    )
    notes += doubts(data, wall.thickness() * spacing)
    return data.assign_attrs(notes="\n".join(notes))


def _frames(clip: xr.Dataset) -> tuple[NDArray[np.uint8], float]:
    """Grey levels (frame, axial, lateral), and the side of a pixel, m."""
    if not isinstance(clip, xr.Dataset) or "image" not in clip or "spacing" not in clip.attrs:
        raise EchoError("clip: must be what echotruth.read_clip returns, with image, time and the attribute spacing")
    return clip["image"].transpose("frame", "axial", "lateral").values, float(clip.attrs["spacing"])


def _check_part(clip: xr.Dataset, wall: Wall) -> None:
    drawn, shown = part(wall.part), part(clip.attrs.get("part", ""))
    if drawn and shown and drawn.start != shown.start:
        raise EchoError(
            f"the wall was drawn in a clip of {drawn}, and this clip is {shown}: let both begin at the same frame and "
            "pixel"
        )


def _scale(wall: Wall, spacing: float) -> float:
    """Thickness of the wall over that of a mouse's."""
    thickness = wall.thickness()
    if thickness < MIN_WALL_PX:
        raise EchoError(
            f"the wall is {thickness:.1f} px thick: a clip of which it has {MIN_WALL_PX:g} px or more is needed"
        )
    length = thickness * spacing * 1e3
    if not WALLS_MM[0] <= length <= WALLS_MM[1]:
        raise EchoError(
            f"the wall is {length:.2g} mm thick, with pixels of {1e3 * spacing:.2g} mm: walls of {WALLS_MM[0]:g} to "
            f"{WALLS_MM[1]:g} mm can be tracked: is the side of a pixel (spacing_mm) right?"
        )
    return length / REFERENCE_WALL_MM


def _points(mask: NDArray[np.bool_], spacing: float, scale: float) -> Floats:
    """Pixels of the wall on a square grid, (n, 2): lateral, axial, px."""
    wanted = GRID_PX * REFERENCE_FIELD_OF_VIEW_MM * 1e-3 / IMAGE_PX * scale / spacing
    step = max(1, int(wanted))
    rows, columns = np.nonzero(mask)
    chosen = (rows % step == step // 2) & (columns % step == step // 2)
    return np.column_stack([columns[chosen], rows[chosen]]).astype(float)


def _settings(tracker: Tracker, options: dict[str, Any], scale: float) -> Any:
    """Section of a tracker, with the lengths of a method scaled."""
    side = REFERENCE_FIELD_OF_VIEW_MM * scale
    # The focus, of which a tracker makes nothing, must lie in the image.
    given = {"bmode": {"field_of_view_mm": side}, "rf": {"focal_zones": 1, "focus_mm": side / 2}}
    return tracker_section(configure(**given), tracker, options)


def _tissue(wall: Wall, points: Floats, depth: Floats, position: Floats) -> WallPoints:
    """Layers and segments of the points."""
    layer = np.clip(np.floor(LAYERS * depth).astype(int) + 1, 1, LAYERS)
    return WallPoints(position, layer, wall.segment(points), position.mean(axis=0), wall.plane, LAYERS)


def _axes(normal: Floats) -> Floats:
    """Radial and tangential directions (point, 2, 2); the tangential one turns counter-clockwise in the image."""
    return np.stack([normal, np.column_stack([normal[:, 1], -normal[:, 0]])], axis=1)


def _contours(wall: Wall, spacing: float) -> Contours:
    """The three lines as pieces, without a true motion."""
    ends = [np.stack([line[:-1], line[1:]], axis=1) * spacing for line in wall.contours()]
    index = np.repeat(np.arange(len(ends)), [len(part) for part in ends])
    return Contours(np.concatenate(ends), np.empty((0, len(index), 2, 2)), index)


def _area(line: Floats) -> Floats:
    """Area (frame,), m2, inside a line (frame, n, 2) whose ends are joined; NaN where less than half of it is known."""
    area = np.full(len(line), np.nan)
    for frame, points in enumerate(line):
        known = points[np.isfinite(points).all(axis=1)]
        if len(known) >= 0.5 * len(points):
            x, y = known.T
            area[frame] = 0.5 * abs(x @ np.roll(y, -1) - y @ np.roll(x, -1))
    return area


def _summary(curves: dict[str, Floats], moved: Floats, time: Floats, wall: Wall) -> dict[str, Any]:
    """End-systole, global strain of the middle line there, and drift."""
    area, length = curves["cavity_area"], rms_length(moved)
    es = int(np.nanargmin(area)) if np.isfinite(area).any() else 0
    largest = float(np.nanmax(length)) if np.isfinite(length).any() else np.nan
    name = "gcs_percent" if wall.plane == "short_axis" else "gls_percent"
    return {
        "es_frame": es,
        "end_systole": float(time[es]),
        name: 100 * float(curves["line_strain"][es, 1]),
        "drift_percent": 100 * float(length[-1]) / largest if largest != 0 else 0.0,
    }


DIMENSIONS = {
    "displacement": ("frame point plane", "m", "displacement since the first frame"),
    "quality": ("frame point", "1", "probability, 0 to 1, of an error below 1/256 of the side of the image"),
    "strain": ("frame point wall_component", "1", "Green-Lagrange strain since the first frame"),
    "region_strain": ("frame measure region wall_component", "1", "mean strain of the wall and of its layers"),
    "segment_strain": ("frame measure aha wall_component", "1", "mean strain of AHA segments"),
    "line_strain": ("frame contour", "1", "relative change of the length of a line since the first frame"),
    "line_position": ("frame line_point plane", "m", "points of the endocardial, middle and epicardial line"),
    "rotation": ("frame", "rad", "rotation of the wall, counter-clockwise in the image"),
    "cavity_area": ("frame", "m2", "area inside the endocardium"),
}
"""Name of an array of the result: its dimensions, unit and meaning."""


def _dataset(values: dict[str, Floats], position: Floats, tissue: WallPoints, clip: xr.Dataset) -> xr.Dataset:
    """The result, with its dimensions, coordinates and units."""
    found: dict[str, Any] = {
        name: (dims.split(), values[name], {"units": units, "long_name": text})
        for name, (dims, units, text) in DIMENSIONS.items()
    }
    found["position"] = (["point", "plane"], position, {"units": "m", "long_name": "position in the first frame"})
    found["layer"] = ("point", tissue.layer, {"long_name": "layer of the wall, 1 at the endocardium"})
    found["segment"] = ("point", tissue.segment, {"long_name": "AHA segment, 0 where unknown"})
    return xr.Dataset(
        found,
        coords={
            "frame": clip["frame"],
            "time": clip["time"],
            "plane": ["lateral", "axial"],
            "region": ["wall", "endocardial", "middle", "epicardial"],
            "aha": np.arange(1, 18),
            "aha_name": ("aha", list(SEGMENT_NAMES)),
            **{name: list(LABELS[name]) for name in ("measure", "wall_component", "contour")},
        },
    )
