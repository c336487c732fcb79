"""Score two trackers on a heart that comes with the package: one of echotruth, and a function of one's own."""

import numpy as np

import echotruth as et

heart, clip = et.sample().heart("healthy"), et.sample().clip("healthy", "long_axis")


def at_rest(frames, points, mask, spacing, frame_time, seed):
    """Displacement (frame, n, 2), px, of a tracker that sees no motion."""
    return np.zeros((len(frames), len(points), 2))


errors = {tracker: et.evaluate(et.track(clip, tracker), heart)["nrmse_all_percent"] for tracker in ("dis", at_rest)}
for tracker, error in errors.items():
    print(f"{getattr(tracker, '__name__', tracker)}: {error:.1f} % of the motion missed")
