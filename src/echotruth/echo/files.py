"""Recorded clips in files of other kinds than DICOM: video, animation, folder of images, NIfTI, NumPy."""

from collections.abc import Callable
from pathlib import Path
from tokenize import TokenError

import imageio_ffmpeg
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageSequence

from echotruth.echo import dicom
from echotruth.echo.failure import EchoError, one_line, optional
from echotruth.echo.recording import Recording, grey

IMAGES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
"""Endings of the images of a folder, of which each is a frame, in the order of their names."""
UNREADABLE = (OSError, ValueError, SyntaxError, EOFError, LookupError, TokenError, Image.DecompressionBombError)
"""What Pillow and NumPy raise for files that are damaged, hold something else, or images of an impossible size."""


def read(path: Path) -> Recording:
    """Read a clip by the ending of its name.

    Parameters
    ----------
    path : Path

    Returns
    -------
    Recording

    Raises
    ------
    EchoError
        If there is no such file, or it holds no clip.
    """
    if not path.exists():
        raise EchoError(f"{path}: is not there: give the path of a clip")
    if path.is_dir():
        return _folder(path)
    suffix = ".nii.gz" if path.name.lower().endswith(".nii.gz") else path.suffix.lower()
    if suffix not in READERS:
        raise EchoError(f"{path}: use a file of {', '.join(name for name in READERS if name)}, or a folder of images")
    return READERS[suffix](path)


def _folder(path: Path) -> Recording:
    """Frames of a folder of images."""
    files = sorted(file for file in path.iterdir() if file.suffix.lower() in IMAGES)
    if len(files) < 2:
        raise EchoError(f"{path}: has {len(files)} images: a clip needs two or more ({', '.join(IMAGES)})")
    images = []
    for file in files:
        try:
            images.append(np.asarray(Image.open(file).convert("RGB")))
        except UNREADABLE:
            raise EchoError(f"{file}: is no image that can be read") from None
        if images[-1].shape != images[0].shape:
            sizes = "{1} x {0}".format(*images[-1].shape), "{1} x {0}".format(*images[0].shape)
            raise EchoError(f"{file}: has {sizes[0]} px, and {files[0].name} {sizes[1]}: frames must be of one size")
    return Recording(grey(np.stack(images)))


def _animation(path: Path) -> Recording:
    """Frames of a GIF."""
    try:
        with Image.open(path) as file:
            frames = [np.asarray(frame.convert("RGB")) for frame in ImageSequence.Iterator(file)]
    except UNREADABLE:
        raise EchoError(f"{path}: is no animation that can be read") from None
    return Recording(grey(np.stack(frames)))


def _video(path: Path) -> Recording:
    """Frames of a video."""
    try:
        reader = imageio_ffmpeg.read_frames(str(path), pix_fmt="gray", bits_per_pixel=8)
        width, height = next(reader)["size"]
        frames = [np.frombuffer(frame, np.uint8).reshape(height, width) for frame in reader]
    except (OSError, RuntimeError, StopIteration, ValueError):
        frames = []
    if not frames:
        raise EchoError(f"{path}: is no video that can be read")
    return Recording(np.stack(frames))


def _nifti(path: Path) -> Recording:
    """Frames of (lateral, axial, 1, frame) or (lateral, axial, frame), with their scale."""
    nibabel = optional("nibabel", path)
    try:
        image = nibabel.load(path)
        pixels = np.asarray(image.dataobj)
    except Exception as error:  # nibabel has no common type for what is wrong with a file
        raise EchoError(f"{path}: is no NIfTI file that can be read: {one_line(error)}") from None
    sizes, units = [float(size) for size in image.header.get_zooms()], image.header.get_xyzt_units()
    if pixels.ndim == 4 and pixels.shape[2] == 1:
        pixels, sizes = pixels[:, :, 0], [*sizes[:2], *sizes[3:]]
    if pixels.ndim != 3:
        raise EchoError(f"{path}: has the shape {pixels.shape}: give (lateral, axial, frame), or with 1 before frame")
    length = {"mm": 1e-3, "micron": 1e-6, "meter": 1.0}.get(units[0], 1e-3)
    second = {"sec": 1.0, "msec": 1e-3, "usec": 1e-6}.get(units[1])
    times = np.arange(pixels.shape[2], dtype=float) * sizes[2] * second if second and sizes[2] > 0 else np.empty(0)
    return Recording(grey(pixels.transpose(2, 1, 0)), (sizes[1] * length, sizes[0] * length), times)


def _array(path: Path) -> Recording:
    """Frames of a NumPy file, (frame, axial, lateral)."""
    try:
        pixels = np.load(path, allow_pickle=False)
    except UNREADABLE:
        raise EchoError(f"{path}: is no array that numpy.load reads") from None
    return of_array(pixels, str(path))


def of_image(path: Path) -> NDArray[np.bool_]:
    """Pixels of an image or a NumPy file that are not 0, (axial, lateral).

    Raises
    ------
    EchoError
        If it holds no image.
    """
    try:
        is_array = path.suffix.lower() == ".npy"
        pixels = np.load(path, allow_pickle=False) if is_array else np.asarray(Image.open(path).convert("L"))
    except UNREADABLE:
        raise EchoError(f"{path}: is no image that can be read: give a .csv, an image or a .npy") from None
    if pixels.ndim != 2:
        raise EchoError(f"{path}: has the shape {pixels.shape}: give one image (axial, lateral)")
    return pixels != 0


def of_array(pixels: object, name: str = "array") -> Recording:
    """Recording of an array (frame, axial, lateral), or with colours last.

    Raises
    ------
    EchoError
        If it has another shape, or values that are not finite.
    """
    given = np.asarray(pixels)
    if given.ndim not in (3, 4) or (given.ndim == 4 and given.shape[-1] > 4) or given.dtype.kind not in "uifb":
        raise EchoError(f"{name}: has the shape {given.shape}: give numbers (frame, axial, lateral), or colours last")
    if not np.isfinite(given).all():
        raise EchoError(f"{name}: has values that are not finite: give grey levels")
    return Recording(grey(given))


READERS: dict[str, Callable[[Path], Recording]] = {
    **dict.fromkeys((".dcm", ".dicom", ""), dicom.read),
    **dict.fromkeys((".mp4", ".avi", ".mov", ".mkv"), _video),
    ".gif": _animation,
    **dict.fromkeys((".nii", ".nii.gz"), _nifti),
    ".npy": _array,
}
"""Ending of a name -> function that reads such a file."""
