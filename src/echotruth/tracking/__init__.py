"""Motion found in B-mode clips, and how far it is from the truth.

Points and in-plane vectors are in the order lateral, axial throughout; images are stored (axial, lateral).
"""

from echotruth.tracking.evaluation import Wall, evaluate
from echotruth.tracking.motion import track
from echotruth.tracking.windows import grid

__all__ = ["Wall", "evaluate", "grid", "track"]
