"""Arrays of the tracked displacement, of its scores, and of the true motion to which it is compared.

Every tracker has a group of its own at every image size, so that one that is added leaves the others as they are. All
sizes are tracked at the same points.
"""

from __future__ import annotations

from echotruth.repository.array import array
from echotruth.repository.packing import Pack
from echotruth.repository.rounding import LENGTH, QUALITY, STRAIN

_TRACKED = "case view"
_CCW = "about its centroid since ED, counter-clockwise seen from the apex; of short-axis views"
TRACKING = (
    array(
        *("displacement", f"{_TRACKED} frame axial lateral plane", "float32", "m"),
        "tracked displacement from ED",
        LENGTH,
    ),
    array(
        *("quality", f"{_TRACKED} frame axial lateral", "float32", "1"),
        "probability of an error within 1/256 of the side of the image, as the tracker sees it",
        QUALITY,
    ),
)

_LIMITS = (
    array("through_plane_rms", "case view", "float64", "m", "RMS of the displacement out of the plane at ES"),
    array(
        *("operator_bias", "case view reference region wall_component", "float64", "1"),
        "mean strain of the operator on the true displacement minus the reference at ES",
    ),
    array(
        *("operator_rms", "case view reference region wall_component", "float64", "1"),
        "RMS strain of the operator on the true displacement minus the reference at ES",
    ),
)

_BY_REFERENCE = f"{_TRACKED} reference region wall_component"
_SCORES = (
    array("rms_error", f"{_TRACKED} region component", "float64", "m", "RMS error of displacement at ES"),
    array("nrmse", f"{_TRACKED} region component", "float64", "1", "RMS error over RMS of the true one at ES"),
    array("nrmse_all", _TRACKED, "float64", "1", "NRMSE of the whole wall, displacement 0 where not estimated"),
    array("nrmse_cycle", _TRACKED, "float64", "1", "NRMSE of the whole wall and cycle"),
    array("segment_rms_error", f"{_TRACKED} aha component", "float64", "m", "RMS error of displacement at ES"),
    array("segment_nrmse", f"{_TRACKED} aha component", "float64", "1", "NRMSE of a segment at ES"),
    array("end_point_error", f"{_TRACKED} region statistic", "float64", "m", "length of the error at ES"),
    array("drift", _TRACKED, "float64", "m", "RMS error of displacement in the last frame"),
    array("through_plane_correlation", _TRACKED, "float64", "1", "correlation of error and through-plane motion"),
    array("tracked_displacement_sd", f"{_TRACKED} region polar", "float64", "m", "SD of tracked displacement at ES"),
    array("true_displacement_sd", f"{_TRACKED} region polar", "float64", "m", "SD of true displacement at ES"),
    array("tracked_transmural_gradient", _TRACKED, "float64", "percent", "fall of tracked tangential SD, to epi"),
    array("true_transmural_gradient", _TRACKED, "float64", "percent", "fall of true tangential SD, to epi"),
    array("tracked_segment_displacement", f"{_TRACKED} aha polar", "float64", "m", "mean tracked one at ES"),
    array("true_segment_displacement", f"{_TRACKED} aha polar", "float64", "m", "mean true displacement at ES"),
    array("strain_bias", _BY_REFERENCE, "float64", "1", "mean error of strain at ES"),
    array("strain_rms", _BY_REFERENCE, "float64", "1", "RMS error of strain at ES"),
    array("strain_correlation", _BY_REFERENCE, "float64", "1", "correlation of tracked with true strain at ES"),
    array(
        *("segment_strain_error", f"{_TRACKED} reference wall_component", "float64", "1"),
        "mean absolute error of the strain of a segment at ES",
    ),
    array(
        *("segment_agreement", f"{_TRACKED} reference agreement wall_component", "float64", "1"),
        "agreement of the strain of segments at ES",
    ),
    array("coverage", _TRACKED, "float64", "1", "fraction of the wall's points with an estimate"),
    array("line_strain_error", f"{_TRACKED} contour", "float64", "1", "error of the line strain at ES"),
    array("peak_line_strain_error", f"{_TRACKED} contour", "float64", "1", "error of the peak of the line strain"),
    array("time_to_peak_error", f"{_TRACKED} contour", "float64", "s", "error of the time of that peak"),
    array("rotation_error", _TRACKED, "float64", "rad", "error of the rotation of the wall at ES"),
)

_COURSES = (
    array("frame_rms_error", f"{_TRACKED} frame component", "float32", "m", "RMS error of displacement"),
    array("frame_nrmse", f"{_TRACKED} frame component", "float32", "1", "NRMSE of the whole wall"),
    array("frame_strain_rms", f"{_TRACKED} reference frame wall_component", "float32", "1", "RMS error of strain"),
    array(
        *("tracked_region_strain", f"{_TRACKED} frame measure region wall_component", "float32", "1"),
        "tracked mean strain of a region (engineering RT: rad)",
    ),
    array(
        *("tracked_segment_strain", f"{_TRACKED} frame measure aha wall_component", "float32", "1"),
        "tracked mean strain of a segment (engineering RT: rad)",
    ),
    array("tracked_line_strain", f"{_TRACKED} frame contour", "float32", "1", "tracked strain of a contour's length"),
    array("tracked_rotation", f"{_TRACKED} frame", "float32", "rad", f"tracked rotation of the wall, {_CCW}"),
)

_TRUE_COURSES = (
    array(
        *("true_region_strain", "case view reference frame measure region wall_component", "float32", "1"),
        "true mean strain of a region, by each reference (engineering RT: rad)",
    ),
    array(
        *("true_segment_strain", "case view reference frame measure aha wall_component", "float32", "1"),
        "true mean strain of a segment, by each reference (engineering RT: rad)",
    ),
    array("true_line_strain", "case view frame contour", "float32", "1", "true strain of a contour's length"),
    array("true_rotation", "case view frame", "float32", "rad", f"true rotation of the wall, {_CCW}"),
)

REFERENCE_PACKS = (
    Pack(array("limits", "case view limit", "float64", "mixed", "what no tracker can do better than, at ES"), _LIMITS),
    Pack(
        array("true_courses", "case view frame true_course", "float32", "mixed", "true strains over time"),
        _TRUE_COURSES,
    ),
)
EVALUATION_PACKS = (
    Pack(array("scores", "case view score", "float64", "mixed", "scores of a tracker on a clip"), _SCORES),
    Pack(array("courses", "case view frame course", "float32", "mixed", "its errors and strains over time"), _COURSES),
)
REFERENCE = (
    array(
        *("true_displacement", "case view frame axial lateral vector", "float32", "m"),
        "true displacement from ED",
        LENGTH,
    ),
    array(
        *("true_strain", "case view reference frame axial lateral wall_component", "float32", "1"),
        "strain from ED: of the heart, of its motion in the plane, of the operator on the true displacement",
        STRAIN,
    ),
    array("wall_axes", "case view axial lateral polar plane", "float32", "1", "the wall's axes in the image at ED"),
    *(pack.array for pack in REFERENCE_PACKS),
)
"""True motion at the points that are tracked."""
EVALUATION = tuple(pack.array for pack in EVALUATION_PACKS)
"""Scores of one tracker."""
