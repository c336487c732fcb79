"""Motion found in B-mode clips, and how far it is from the truth.

Points and in-plane vectors are in the order lateral, axial throughout; images are stored (axial, lateral).
"""

from echotruth.tracking.evaluation import Wall, evaluate
from echotruth.tracking.tracker import TrackerFailed, track
from echotruth.tracking.windows import grid

__all__ = ["TrackerFailed", "Wall", "evaluate", "grid", "track"]
