"""Score two trackers on a body that is shifted: one of echotruth, and a function of one's own."""

import numpy as np

import echotruth as et

heart = et.beat(
    {
        "geometry": {"shape": "tube", "endo_length_mm": 3, "base_mm": 1, "circumferential_elements": 24,
                     "longitudinal_elements": 4, "transmural_elements": 2},
        "motion": {"kind": "rigid", "rigid": {"lateral_um": 60.0, "axial_um": 40.0}},
        "loop": {"frames": 4},
        "bmode": {"size_px": 256, "downsampling": (1,)},
    }
)  # fmt: skip
clip = et.image(heart, "mid")


def at_rest(frames, points, mask, spacing, frame_time, seed):
    """Displacement (frame, n, 2), px, of a tracker that sees no motion."""
    return np.zeros((len(frames), len(points), 2))


errors = {tracker: et.evaluate(et.track(clip, tracker), heart)["nrmse_all_percent"] for tracker in ("dis", at_rest)}
for tracker, error in errors.items():
    print(f"{getattr(tracker, '__name__', tracker)}: {error:.1f} % of the motion missed")
