"""Infarct two mid segments: at end-systole the dead wall is stretched along its fibres while the rest shortens."""

import echotruth as et

heart = et.beat(
    {
        "geometry": {"circumferential_elements": 12, "longitudinal_elements": 6, "transmural_elements": 1},
        "loop": {"kind": "circulation", "frames": 10},
        "pathology": {"infarct": {"segments": [7, 12]}},
    }
)
strain = et.kinematics(heart).fibre_strain.isel(frame=heart.es).sel(fibre_component="ff")  # Green-Lagrange, since ED
infarct, remote = (float(strain[heart.region == region].mean()) for region in (1, 0))
print(f"fibre strain at end-systole: infarct {100 * infarct:+.1f} %, remote {100 * remote:+.1f} %")
