"""A folder of PNG images, one a frame."""

from collections.abc import Sequence
from pathlib import Path

from PIL import Image
from PIL.PngImagePlugin import PngInfo

from echotruth.sharing.export.clip import ExportedClip
from echotruth.sharing.export.overlay import pictures

INCH = 0.0254
"""m"""


def write(clip: ExportedClip, path: Path, overlay: Sequence[str]) -> None:
    """Write frame_000.png and so on: grey levels as they are, or RGB with an overlay.

    Each has its pixels per metre, and the scale and frame time as JSON in the text "Comment".

    Parameters
    ----------
    clip : ExportedClip
    path : Path
        Folder.
    overlay : sequence of str
        As :func:`echotruth.sharing.export.overlay.pictures` takes them.
    """
    path.mkdir()
    about, dpi = PngInfo(), INCH / clip.spacing
    about.add_text("Comment", clip.note)
    for number, frame in enumerate(pictures(clip, overlay)):
        Image.fromarray(frame).save(path / f"frame_{number:03d}.png", pnginfo=about, dpi=(dpi, dpi))
