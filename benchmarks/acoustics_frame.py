"""Whole frames of ours: transmits made from the matrix, and from scatterers to an 8-bit image."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from acoustics_arrays import ARRAYS, SECTOR, Array
from worker import Clock, medians

from echotruth.config import Bmode, Rf
from echotruth.imaging.beamforming.scan import scan_lines
from echotruth.imaging.beamforming.scanner import Scanner
from echotruth.imaging.beamforming.synthesis import TransmitSynthesis
from echotruth.imaging.beamforming.transmit import TRANSMIT_SEQUENCES
from echotruth.imaging.bmode import bmode_clip
from echotruth.imaging.rf.full_matrix import FullMatrix
from echotruth.units import MHz, mm

Seconds = dict[str, dict[str, float]]


def scan(array: Array, **changes: Any) -> tuple[Rf, Bmode]:
    """Lines of one focus and an image that suit an array."""
    rf = Rf(focus_mm=1e3 * array.focus, focal_zones=1, sector_deg=np.rad2deg(SECTOR), **changes)
    return rf, Bmode(field_of_view_mm=1e3 * array.far)


def frame(
    array: str, scatterers: int, repeats: int, probe: dict[str, Any] | None = None, **changes: Any
) -> dict[str, Any]:
    """Seconds of the parts of a frame, from scatterers to uint8; medians; `probe` and `changes` replace keys."""
    setup = ARRAYS[array]
    array_, (rf, bmode) = setup.probe(**(probe or {})), scan(setup, **changes)
    scanner = Scanner(array_, rf, bmode.field_of_view_mm * mm)
    channels = TransmitSynthesis(
        scanner.matrix, array_.frequency_MHz * MHz, TRANSMIT_SEQUENCES[rf.transmit](array_, rf, scanner.scan)
    )
    phantom = setup.scatterers(scatterers, thick=True)
    turns = [_parts(scanner, channels, phantom, bmode).seconds for _ in range(repeats + 1)][1:]
    return {"seconds": medians(turns), "threads": numba.get_num_threads(), "size_px": bmode.size_px}


def lines(array: str, scatterers: int, probe: dict[str, Any], **changes: Any) -> int:
    """Image a frame as a user does, and give the number of its lines."""
    setup = ARRAYS[array]
    rf, bmode = scan(setup, **changes)
    return len(
        Scanner(setup.probe(**probe), rf, bmode.field_of_view_mm * mm).lines(*setup.scatterers(scatterers, thick=True))
    )


def _parts(
    scanner: Scanner, channels: TransmitSynthesis, phantom: tuple[np.ndarray, np.ndarray], bmode: Bmode
) -> Clock:
    """One frame; the channels are made twice, once alone, as beamforming takes them block by block."""
    clock = Clock()
    with clock("matrix"):
        matrix = scanner.matrix(*phantom)
    with clock("channels"):
        for _ in channels(matrix):
            pass
    with clock("channels and receive focus"):
        lines = scanner.beamform(matrix)
    with clock("image"):
        images = bmode_clip(lines[None], scanner.scan, scanner.range, bmode)
    if images[bmode.size_px].dtype != np.uint8:
        raise TypeError("The image must have eight bits.")
    return clock


def transmits(array: str, scatterers: int, number: int, repeats: int) -> Seconds:
    """Seconds of the matrix and of the channel data of a number of diverging waves made from it; medians."""
    setup = ARRAYS[array]
    probe, rf = setup.probe(), scan(setup, transmit="diverging", transmits=number)[0]
    waves = TRANSMIT_SEQUENCES[rf.transmit](probe, rf, scan_lines(probe, rf))
    full = FullMatrix(probe, setup.far, np.abs(waves.delay).max(), elevation=False)
    phantom, turns = setup.scatterers(scatterers), []
    channels = TransmitSynthesis(full, probe.frequency_MHz * MHz, waves)
    for _ in range(repeats + 1):
        clock = Clock()
        with clock("matrix"):
            matrix = full(*phantom)
        with clock("channels"):
            for _ in channels(matrix):
                pass
        turns.append(clock.seconds)
    return medians(turns[1:])
