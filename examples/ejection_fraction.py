"""Beat a mouse heart and measure its ejection fraction, on a mesh coarse enough for seconds."""

import echotruth as et

heart = et.beat(
    {
        "geometry": {"circumferential_elements": 12, "longitudinal_elements": 6, "transmural_elements": 1},
        "loop": {"frames": 10},
    }
)
volume = heart.arrays["mechanics"]["volume"]  # m3, one a frame; frame 0 is end-diastole
ejection_fraction = 1 - volume.min() / volume[0]
print(f"{1e9 * volume[0]:.1f} uL at end-diastole, ejection fraction {100 * ejection_fraction:.1f} %")
