"""Speckle tracking: displacement of the tissue from B-mode clips.

Points and in-plane vectors are in the order lateral, axial throughout, and images are stored (axial, lateral); those of
volumes are in the order lateral, elevation, depth, and volumes are stored (depth, elevation, lateral).
"""

from echotruth.tracking.failure import TrackerFailed
from echotruth.tracking.tracker import track
from echotruth.tracking.windows import grid

__all__ = ["TrackerFailed", "grid", "track"]
