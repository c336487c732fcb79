"""Arrays of the tracked displacement and of its scores."""

from __future__ import annotations

from echotruth.repository.array import array
from echotruth.repository.rounding import LENGTH, QUALITY

TRACKING = (
    array(
        *("displacement", "case view tracker frame axial lateral plane", "float32", "m"),
        "tracked displacement from ED",
        LENGTH,
    ),
    array(
        *("quality", "case view tracker frame axial lateral", "float32", "1"),
        "confidence of the tracker, 0 to 1",
        QUALITY,
    ),
)

_POINT = "case view frame axial lateral"
_TRACKED = "case view tracker"
EVALUATION = (
    array("true_displacement", f"{_POINT} plane", "float32", "m", "true displacement from ED"),
    array("through_plane", _POINT, "float32", "m", "true displacement out of the plane"),
    array(
        *("true_strain", "case view reference frame axial lateral wall_component", "float32", "1"),
        "strain from ED: of the heart, of its motion in the plane, of the operator on the true displacement",
    ),
    array("wall_axes", "case view axial lateral polar plane", "float32", "1", "the wall's axes in the image at ED"),
    array("layer", "case view axial lateral", "uint8", "1", "transmural layer of the point at ED, 0 outside"),
    array("segment", "case view axial lateral", "uint8", "1", "AHA segment of the point at ED, 0 outside"),
    array("through_plane_rms", "case view", "float64", "m", "RMS of the displacement out of the plane at ES"),
    array(
        *("operator_bias", "case view reference region wall_component", "float64", "1"),
        "mean strain of the operator on the true displacement minus the reference at ES",
    ),
    array(
        *("operator_rms", "case view reference region wall_component", "float64", "1"),
        "RMS strain of the operator on the true displacement minus the reference at ES",
    ),
    array(
        *("tracked_strain", f"{_TRACKED} frame axial lateral wall_component", "float32", "1"),
        "strain from ED of the tracked displacement, by the operator",
    ),
    array("rms_error", f"{_TRACKED} region component", "float64", "m", "RMS error of displacement at ES"),
    array("nrmse", f"{_TRACKED} region component", "float64", "1", "RMS error over RMS of the true displacement at ES"),
    array("nrmse_all", _TRACKED, "float64", "1", "NRMSE of the whole wall, displacement 0 where there is no estimate"),
    array("nrmse_cycle", _TRACKED, "float64", "1", "NRMSE of the whole wall and cycle"),
    array("segment_rms_error", f"{_TRACKED} aha component", "float64", "m", "RMS error of displacement at ES"),
    array("segment_nrmse", f"{_TRACKED} aha component", "float64", "1", "NRMSE of a segment at ES"),
    array("frame_rms_error", f"{_TRACKED} frame component", "float64", "m", "RMS error of displacement"),
    array("frame_nrmse", f"{_TRACKED} frame component", "float64", "1", "NRMSE of the whole wall"),
    array("end_point_error", f"{_TRACKED} region statistic", "float64", "m", "length of the error at ES"),
    array("drift", _TRACKED, "float64", "m", "RMS error of displacement in the last frame"),
    array("through_plane_correlation", _TRACKED, "float64", "1", "correlation of error and through-plane motion"),
    array("tracked_displacement_sd", f"{_TRACKED} region polar", "float64", "m", "SD of tracked displacement at ES"),
    array("true_displacement_sd", f"{_TRACKED} region polar", "float64", "m", "SD of true displacement at ES"),
    array("tracked_transmural_gradient", _TRACKED, "float64", "percent", "fall of tracked tangential SD, endo to epi"),
    array("true_transmural_gradient", _TRACKED, "float64", "percent", "fall of true tangential SD, endo to epi"),
    array("tracked_segment_displacement", f"{_TRACKED} aha polar", "float64", "m", "mean tracked displacement at ES"),
    array("true_segment_displacement", f"{_TRACKED} aha polar", "float64", "m", "mean true displacement at ES"),
    array("strain_bias", f"{_TRACKED} reference region wall_component", "float64", "1", "mean error of strain at ES"),
    array("strain_rms", f"{_TRACKED} reference region wall_component", "float64", "1", "RMS error of strain at ES"),
    array(
        *("strain_correlation", f"{_TRACKED} reference region wall_component", "float64", "1"),
        "correlation of tracked with true strain at ES",
    ),
    array("frame_strain_rms", f"{_TRACKED} reference frame wall_component", "float64", "1", "RMS error of strain"),
    array("tracked_global_strain", f"{_TRACKED} frame wall_component", "float64", "1", "tracked mean strain of wall"),
    array(
        *("true_global_strain", f"{_TRACKED} reference frame wall_component", "float64", "1"),
        "true mean strain of the wall, by each reference",
    ),
    array("tracked_segment_strain", f"{_TRACKED} frame aha wall_component", "float64", "1", "tracked mean strain"),
    array(
        *("true_segment_strain", f"{_TRACKED} reference frame aha wall_component", "float64", "1"),
        "true mean strain of a segment, by each reference",
    ),
    array(
        *("segment_strain_error", f"{_TRACKED} reference wall_component", "float64", "1"),
        "mean absolute error of the strain of a segment at ES",
    ),
    array(
        *("segment_agreement", f"{_TRACKED} reference agreement wall_component", "float64", "1"),
        "agreement of the strain of segments at ES",
    ),
    array("coverage", _TRACKED, "float64", "1", "fraction of the wall's points with an estimate"),
)
