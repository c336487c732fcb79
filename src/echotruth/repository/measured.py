"""Arrays of the measures of a heart."""

from __future__ import annotations

from echotruth.repository.array import array
from echotruth.repository.packing import Pack

_CCW = "counter-clockwise seen from the apex"
_IVC = "at the end of isovolumic contraction"
_MEAN_STRAIN = "case strain_component"

_SCALARS = (
    array("twist_ivc", "case", "float64", "rad", f"twist {_IVC}"),
    array("twist_es", "case", "float64", "rad", "twist at ES"),
    array(
        "twist_peak", "case", "float64", "rad", "twist of largest magnitude from ED to the opening of the mitral valve"
    ),
    array("twist_peak_delay", "case", "float64", "s", "time of the peak of twist less that of ES"),
    array("strain_ivc", _MEAN_STRAIN, "float64", "1", f"wall mean of the strain from ED {_IVC}"),
    array("strain_es", _MEAN_STRAIN, "float64", "1", "wall mean of the strain from ED at ES"),
    array(
        "layer_strain_ivc", "case layer strain_component", "float64", "1", f"mean strain from ED of each layer {_IVC}"
    ),
    array("layer_strain_es", "case layer strain_component", "float64", "1", "mean strain from ED of each layer at ES"),
    array("wall_thickening", "case", "float64", "1", "relative increase of the wall thickness in the mid slice to ES"),
    array("gls", "case", "float64", "1", "global longitudinal strain, that of the length of the mid-wall line at ES"),
    array("ivc_time", "case", "float64", "s", "duration of isovolumic contraction"),
    array("ejection_time", "case", "float64", "s", "duration of ejection"),
    array("ivr_time", "case", "float64", "s", "duration of isovolumic relaxation"),
    array("tei_index", "case", "float64", "1", "isovolumic times over the ejection time"),
    array("dpdt_max", "case", "float64", "Pa s-1", "largest rate of the cavity pressure"),
    array("dpdt_min", "case", "float64", "Pa s-1", "smallest rate of the cavity pressure"),
    array("tau", "case", "float64", "s", "time constant of the pressure in relaxation, with the asymptote zero"),
    array("longitudinal_strain", "case", "float64", "1", "wall mean of the longitudinal strain from ED at ES"),
    array("circumferential_strain", "case", "float64", "1", "wall mean of the circumferential strain from ED at ES"),
    array("ejection_fraction", "case", "float64", "1", "ejection fraction"),
    array("volume_ratio_min", "case", "float64", "1", "smallest det F of all quadrature points and frames"),
    array("loop_error", "case", "float64", "1", "largest relative error of the prescribed pressure or volume"),
    array("tension_min", "case", "float64", "Pa", "smallest active tension of all frames"),
    array("tension_es", "case", "float64", "Pa", "active tension at ES"),
)

_COURSES = (
    array("rotation_base", "case frame", "float64", "rad", f"rotation of the basal slice since ED, {_CCW}"),
    array("rotation_apex", "case frame", "float64", "rad", f"rotation of the apical slice since ED, {_CCW}"),
    array("twist", "case frame", "float64", "rad", f"rotation of apex less base since ED, {_CCW}"),
    array("apex_motion", "case frame", "float64", "m", "displacement along z of the epicardial apex since ED"),
    array("base_motion", "case frame", "float64", "m", "displacement along z of the base since ED, mean over its area"),
)

PHYSIOLOGY_PACKS = (
    Pack(array("scalars", "case scalar", "float64", "mixed", "measures of a heart"), _SCALARS),
    Pack(array("courses", "case frame course", "float64", "mixed", "measures of a heart over the cycle"), _COURSES),
)
PHYSIOLOGY = tuple(pack.array for pack in PHYSIOLOGY_PACKS)
