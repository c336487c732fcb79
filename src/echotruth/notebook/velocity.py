"""Tissue Doppler of a clip, beside the true velocity."""

import logging
from functools import partial
from math import ceil, floor, log10

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from echotruth.arrays import Floats
from echotruth.config import Config
from echotruth.heart import Heart
from echotruth.imaging.beamforming.scan import Scan, scan_lines
from echotruth.imaging.bmode import ScanConversion, pixel_centres
from echotruth.imaging.doppler import Estimator, along_beam, velocity_images
from echotruth.imaging.packet import MovingHeart, PacketSequence
from echotruth.notebook.arguments import check_clip, check_heart, check_whole
from echotruth.notebook.simulation import progress_line
from echotruth.repository.datasets import case_of, imaged_heart
from echotruth.seeds import generator
from echotruth.units import MHz, mm

HEADROOM = 1.25
"""Default of the Nyquist velocity over the greatest true velocity in the cycle."""
GRID_PX = 64
"""Pixels along a side of the grid on which that is searched."""
VARIABLES = {
    name: {"units": "m/s", "long_name": long_name}
    for name, long_name in {
        "velocity": "velocity towards the probe, by Doppler",
        "nyquist": "velocity beyond which there is aliasing",
        "true_velocity": "true velocity towards the probe of the tissue",
    }.items()
}

logger = logging.getLogger("echotruth")


def velocity(
    heart: Heart,
    clip: xr.Dataset,
    frames: ArrayLike | None = None,
    *,
    packet: int = 5,
    prf_Hz: float | None = None,
    progress: bool = True,
) -> xr.Dataset:
    """Measure tissue velocity along the beam by pulsed Doppler, beside the true one.

    The scatterers of the clip are imaged anew, by a packet of pulses around each frame, and the 2-D autocorrelator of
    Loupas et al. 1995 finds the velocity. A packet takes the time of as many frames of :func:`echotruth.image`.

    Parameters
    ----------
    heart : Heart
        The heart that was imaged.
    clip : Dataset
        As :func:`echotruth.image` or :meth:`echotruth.Repository.clip` returns it, with any variables.
    frames : array_like of int, optional
        Frames in which velocities are measured. Default: all.
    packet : int
        Pulses, the middle of which is at the time of the frame.
    prf_Hz : float, optional
        Pulse repetition frequency. Velocities beyond c prf / (4 f) are aliased. Default: one with which that, at the
        centre frequency, is a quarter more than the greatest velocity of the wall along the beam in the cycle.
    progress : bool
        Whether a line on stderr says how far it is, where a person watches.

    Returns
    -------
    Dataset
        `velocity` and `true_velocity` (frame, axial, lateral), m/s, positive towards the probe: the measured one of all
        that echoes in the scan, and that of the tissue at the pixel at the time of the frame, NaN outside the wall.
        `nyquist` (frame, axial, lateral), m/s: the velocity beyond which there is aliasing, by twice as much, at the
        local frequency of the echoes. Beside the attributes of the clip there are `packet` and `prf_Hz`.

    Raises
    ------
    ValueError
        If it is another heart, a frame, the packet or the frequency is not possible, or the clip is not whole or has
        lost its attributes.

    Examples
    --------
    >>> import echotruth as et
    >>> demo = et.Repository("out/demo")
    >>> heart, clip = demo.heart(), demo.clip(view="mid", size=128)
    >>> found = et.velocity(heart, clip, frames=[1], packet=2)
    >>> error = (found["velocity"] - found["true_velocity"]) / found["nyquist"]
    >>> bool(abs(error.mean()) < 0.02)
    True
    """
    check_heart(heart)
    check_clip(clip)
    case, (_, plane), view = case_of(clip), imaged_heart(clip, heart), clip.attrs["view"]
    check_whole(clip, case.config)
    config, size = case.config, clip.sizes["axial"]
    chosen, images = _chosen(frames, len(heart.displacement)), []
    moving, scan = MovingHeart(heart, config, plane, view), scan_lines(config.probe, config.rf)
    with progress_line("velocity", progress):
        prf = _prf(config, packet, moving, scan, prf_Hz)
        sequence = PacketSequence(config, moving, plane, partial(generator, case, view), packet, 1 / prf)
        convert = ScanConversion(scan, sequence.scanner.range, config.bmode.model_copy(update={"size_px": size}))
        estimator, pixels = Estimator.of(config.probe, sequence.scanner, 1 / prf), pixel_centres(config.bmode, size)
        for number, frame in enumerate(chosen):
            measured = velocity_images(estimator, sequence.lines(frame), convert)
            images.append((*measured, true_velocity(moving, scan, frame, *pixels)))
            logger.info("frame %d of %d", number + 1, len(chosen))
    return xr.Dataset(
        {
            name: (("frame", "axial", "lateral"), np.stack(each).astype(np.float32), about)
            for (name, about), each in zip(VARIABLES.items(), zip(*images, strict=True), strict=True)
        },
        {"frame": chosen, "axial": clip["axial"], "lateral": clip["lateral"]},
        clip.attrs | {"packet": int(packet), "prf_Hz": prf},
    ).assign_coords(time=clip["time"].sel(frame=chosen))


def true_velocity(moving: MovingHeart, scan: Scan, frame: int, axial: Floats, lateral: Floats) -> Floats:
    """Velocity towards the probe (axial, lateral), m/s, of the tissue at pixels in a frame; NaN outside the wall."""
    position = np.stack(np.broadcast_arrays(lateral, axial[:, None], 0.0), axis=-1).reshape(-1, 3)
    return along_beam(scan, position, moving.velocity(frame, position)).reshape(len(axial), len(lateral))


def _chosen(frames: ArrayLike | None, count: int) -> NDArray[np.int64]:
    """Frames that are asked for, (n,)."""
    chosen = np.arange(count) if frames is None else np.atleast_1d(np.asarray(frames))
    if chosen.ndim != 1 or not len(chosen) or chosen.dtype.kind not in "iu":
        raise ValueError(f"frames = {frames!r:.80}: give whole numbers, from 0 to {count - 1}.")
    if chosen.min() < 0 or chosen.max() >= count:
        raise ValueError(f"frames: give numbers from 0 to {count - 1}, not {chosen.min()} to {chosen.max()}.")
    return chosen.astype(np.int64)


def _prf(config: Config, packet: int, moving: MovingHeart, scan: Scan, given: float | None) -> float:
    """Pulse repetition frequency, Hz: the one given, or the default, once it and the packet are possible."""
    if not isinstance(packet, (int, np.integer)) or packet < 2:
        raise ValueError(f"packet = {packet!r}: give a whole number of pulses, two or more.")
    p, depth = config.probe, config.depth_mm * mm
    lowest, highest = packet / moving.period, p.sound_speed_m_per_s / (2 * depth)
    if lowest > highest:
        most = f"give at most {floor(highest * moving.period)}, which fit into a cycle at {floor(highest)} Hz"
        raise ValueError(f"packet = {packet}: {most}.")
    if given is not None:
        if isinstance(given, bool) or not isinstance(given, (int, float, np.number)):
            raise ValueError(f"prf_Hz = {given!r}: give a number.")
        if not lowest <= given <= highest:
            limits = f"give {lowest:.4g} to {floor(highest)}"
            why = "so that the packet ends within a cycle and the echoes of a pulse before the next one"
            raise ValueError(f"prf_Hz = {given}: {limits}, {why}.")
        return float(given)
    axial, lateral = pixel_centres(config.bmode, GRID_PX)
    speed = np.stack([np.abs(true_velocity(moving, scan, k, axial, lateral)) for k in range(len(moving.time))])
    fastest = float(np.max(speed, initial=0.0, where=np.isfinite(speed)))
    if not fastest > 0:
        raise ValueError("No wall in this view moves along the beam, to which prf_Hz would be fitted: give prf_Hz.")
    least = 4 * (p.frequency_MHz * MHz) / p.sound_speed_m_per_s * HEADROOM * fastest
    digit = 10.0 ** (floor(log10(least)) - 1)
    return min(max(ceil(least / digit) * digit, lowest), highest)
