"""What a picture or video says of itself: scale, orientation and time, which its format has no place for."""

from __future__ import annotations

import json

from echotruth.export.clip import Clip


def note(clip: Clip) -> str:
    """JSON with the scale, orientation and frame time of a clip, for the comment of a file.

    Parameters
    ----------
    clip : Clip
    """
    return json.dumps(
        {
            "case": clip.case.id,
            "view": clip.view,
            "spacing_m": clip.spacing,
            "frame_time_s": clip.frame_time,
            "first_pixel_lateral_m": float(clip.lateral[0]),
            "first_pixel_axial_m": float(clip.axial[0]),
            "synthetic": True,
            "source": "echotruth",
        }
    )
