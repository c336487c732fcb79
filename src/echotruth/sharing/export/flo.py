"""Flow from frame to frame as .flo, the format of the Middlebury benchmark.

Baker et al., A Database and Evaluation Methodology for Optical Flow, Int J Comput Vis 92 (2011) 1-31: px to the right
and downwards, larger than 1e9 where it is unknown.
"""

from pathlib import Path

import numpy as np

from echotruth.sharing.export.clip import Clip

UNKNOWN = 1e10
"""Flow where there is no tissue."""

MAGIC = b"PIEH"
"""The number 202021.25 in single precision, then width and height follow."""


def write(clip: Clip, path: Path) -> None:
    """Write forward_000.flo (of frame 0, to frame 1) and so on, and backward_001.flo (of frame 1, to frame 0).

    Parameters
    ----------
    clip : Clip
    path : Path
        Folder.
    """
    path.mkdir()
    flow = clip.truth("flow")["flow"].sel(vector=["lateral", "axial"])
    flow = flow.transpose("to", "frame", "axial", "lateral", "vector")
    last = len(clip.time) - 1
    for to, name, frames in (("next", "forward", range(last)), ("previous", "backward", range(1, last + 1))):
        for frame in frames:
            pixels = flow.sel(to=to).values[frame] / clip.spacing
            known = np.where(np.isnan(pixels), UNKNOWN, pixels).astype("<f4")
            shape = np.array([clip.size, clip.size], "<i4")
            (path / f"{name}_{frame:03d}.flo").write_bytes(MAGIC + shape.tobytes() + known.tobytes())
