"""Dense inverse search of OpenCV, unmodified (Kroeger et al. 2016, ECCV, LNCS 9908:471)."""

from functools import partial

import cv2
import numpy as np

from echotruth.config.tracking import Dis
from echotruth.tracking.accumulation import Path
from echotruth.tracking.flow import track_by_flow
from echotruth.tracking.tracker_input import TrackerInput

MIN_IMAGE_SIDE = 32
"""Smallest side of an image, px; for flat ones of 24 px OpenCV 5.0 reads beyond its memory."""
PRESETS = {
    "ultrafast": cv2.DISOPTICAL_FLOW_PRESET_ULTRAFAST,
    "fast": cv2.DISOPTICAL_FLOW_PRESET_FAST,
    "medium": cv2.DISOPTICAL_FLOW_PRESET_MEDIUM,
}
"""Presets of the library, which take the images at half their size or less as the finest scale."""
FINE_PATCH, FINE_STRIDE = 16, 6
"""Side of a patch and distance of patches, px, of the setting `fine`; the library's preset `medium` has 8 and 3."""


def track(clip: TrackerInput, settings: Dis) -> Path:
    """Path of the points of a clip by the flow of the library, which has no quality: it follows from the images."""
    return track_by_flow(partial(optical_flow, preset=settings.preset), clip, settings.reference)


def optical_flow(first: np.ndarray, second: np.ndarray, preset: str = "medium") -> np.ndarray:
    """Motion of every pixel from one image to another.

    Parameters
    ----------
    first, second : ndarray of shape (axial, lateral)
        Grey values from 0 to 1, all finite.
    preset : {"ultrafast", "fast", "medium", "fine"}
        Preset of OpenCV; `fine` is its `medium` at the full size of the images, with larger patches.

    Returns
    -------
    ndarray of shape (axial, lateral, 2), float32
        Lateral, axial, px.

    Raises
    ------
    ValueError
        If the image is smaller than OpenCV can process.
    """
    if min(first.shape) < MIN_IMAGE_SIDE:
        raise ValueError(f"Dense inverse search needs images of {MIN_IMAGE_SIDE} px or more, not {first.shape}.")
    # The library cuts the image into as many stripes as there are threads, and their seams show in the motion.
    cv2.setNumThreads(1)
    before, after = ((255 * image).round().astype(np.uint8) for image in (first, second))
    # OpenCV takes None for a flow that it is to allocate.
    return _search(preset).calc(before, after, None)  # type: ignore[call-overload]


def _search(preset: str) -> cv2.DISOpticalFlow:
    """Search of the library with a preset or with the fine setting."""
    search = cv2.DISOpticalFlow.create(PRESETS.get(preset, PRESETS["medium"]))
    if preset == "fine":
        search.setFinestScale(0)
        search.setPatchSize(FINE_PATCH)
        search.setPatchStride(FINE_STRIDE)
    return search
