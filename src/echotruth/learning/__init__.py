"""Training sets from a repository: a table of its cases, splits by heart, and sequences of dicts of NumPy arrays."""

from echotruth.learning.clips import Clips
from echotruth.learning.flow_pairs import FlowPairs
from echotruth.learning.items import Item, Items
from echotruth.learning.point_tracks import PointTracks
from echotruth.learning.segmentation import Segmentation
from echotruth.learning.splitting import split
from echotruth.learning.table import cases
from echotruth.learning.volume_pairs import VolumePairs

__all__ = ["Clips", "FlowPairs", "Item", "Items", "PointTracks", "Segmentation", "VolumePairs", "cases", "split"]
