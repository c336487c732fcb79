"""Motion of the tissue from one frame to the next and to the one before, and the slice of tissue that is imaged."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from echotruth.arrays import Floats
from echotruth.config import Config, Probe
from echotruth.fem.tetrahedra import MaterialPoints, interpolate
from echotruth.heart import Heart
from echotruth.imaging.rf.probe import element_centres
from echotruth.units import MHz, mm

STEPS = {"previous": -1, "next": 1}
"""Frames that flow leads to, in their order along the dimension `to`, and their distance in frames."""

_RANGES = 64
"""Ranges at which the thickness of the slice is computed; it is interpolated between them."""
_ELEVATIONS = 256
"""Elevations at which the beam is computed, from the plane outwards."""


def flow(heart: Heart, frame: int, points: MaterialPoints) -> Floats:
    """Displacement of material points from their position in a frame to those in the previous and in the next frame.

    Parameters
    ----------
    heart : Heart
    frame : int
    points : MaterialPoints of length n

    Returns
    -------
    ndarray of shape (2, n, 3), m
        In the heart frame: to the previous and to the next frame; NaN where there is none.
    """
    displacement = np.full((len(STEPS), len(points), 3), np.nan)
    for row, step in zip(displacement, STEPS.values(), strict=True):
        if 0 <= frame + step < len(heart.displacement):
            row[:] = interpolate(heart.displacement[frame + step] - heart.displacement[frame], heart.cells, points)
    return displacement


def out_of_slice(elevation: NDArray[np.floating], thickness: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Whether tissue is beside the slice: farther from the plane than half the thickness.

    Parameters
    ----------
    elevation : ndarray, m
        NaN where there is no tissue, which is nowhere.
    thickness : ndarray, m
        Of a shape that broadcasts to that of `elevation`.
    """
    return np.abs(elevation) > thickness / 2


def slice_thickness(config: Config, range_: Floats) -> Floats:
    """Thickness of the slice of tissue that an image shows: the two-way -6 dB width of the beam in elevation.

    It is infinite where scatterers echo alike at any elevation, or do not leave the plane: with `rf.elevation_beam:
    false` and with `phantom.in_plane_only`. Nearer than the height of an element, where no heart is, and beyond the
    field of view it is as there.

    Parameters
    ----------
    config : Config
    range_ : ndarray of any shape, m
        Along the lines of the scan: in a sector the distance from the centre of the array.

    Returns
    -------
    ndarray of the same shape, m
    """
    if config.phantom.in_plane_only or not config.rf.elevation_beam:
        return np.full(np.shape(range_), np.inf)
    return np.interp(range_, *_table(config.probe, config.depth_mm * mm, config.rf.harmonic))


@lru_cache(maxsize=64)
def _table(probe: Probe, farthest: float, harmonic: bool) -> tuple[Floats, Floats]:
    """Ranges up to the farthest, m, and the thickness of the beam there, m."""
    nearest = probe.height_mm * mm
    range_ = np.linspace(nearest, max(nearest, farthest), _RANGES)
    return range_, beam_thickness(probe, range_, harmonic)


def beam_thickness(probe: Probe, range_: Floats, harmonic: bool = False) -> Floats:
    """Two-way -6 dB width of the beam in elevation at the centre frequency.

    The lens has the same response E on transmit and on receive (:func:`fresnel`), so that an
    echo has the amplitude |E|^2. In the focus that is sinc^2(H y / (lambda F)), half its maximum at 0.443 lambda F / H.
    A harmonic is sent with the square of E at half the frequency: sinc(u) sinc^2(u / 2), half its maximum at u = 0.511.

    Parameters
    ----------
    probe : Probe
    range_ : ndarray of shape (n,), m
        From the centre of the array.
    harmonic : bool
        Whether the wave is sent at half of the frequency.

    Returns
    -------
    ndarray of shape (n,), m
        Twice the greatest elevation at which an echo is at least half of the greatest at that range.
    """
    height, one = probe.height_mm * mm, probe.model_copy(update={"elements": 1})
    focus, frequency = probe.elevation_focus_mm * mm, probe.frequency_MHz * MHz
    # Beyond the shadow of the element, a beam falls within a wavelength over its height.
    greatest = height / 2 * np.abs(1 - range_ / focus) + range_ * probe.sound_speed_m_per_s / frequency / height
    elevation = np.linspace(0, greatest, _ELEVATIONS, axis=-1)
    position = np.stack(np.broadcast_arrays(0.0, range_[:, None], elevation), axis=-1).reshape(-1, 3)
    received = np.abs(fresnel(one, position, frequency)[0])
    sent = np.abs(fresnel(one, position, frequency / 2)[0]) ** 2 if harmonic else received
    echo = (received * sent).reshape(elevation.shape)
    over = echo - echo.max(axis=1, keepdims=True) / 2
    rows, last = np.arange(len(over)), _ELEVATIONS - 1 - np.argmax(over[:, ::-1] >= 0, axis=1)
    inner, outer = over[rows, last], over[rows, last + 1]
    thickness: Floats = 2 * (elevation[rows, last] + elevation[:, 1] * inner / (inner - outer))
    return thickness


def fresnel(probe: Probe, position: Floats, frequency: float) -> NDArray[np.complex128]:
    """Response E of the lens of every element to every scatterer.

    It is E(f) = 1/H int exp(-i k [h^2/2 (1/r' - 1/F) - h y/r']) dh, k = 2 pi f / c, of scatterers at elevation y and
    range r' in the plane of the image, with height H and elevation focus F of the elements.

    Parameters
    ----------
    probe : Probe
    position : ndarray of shape (scatterers, 3), m
        Lateral, axial, elevation.
    frequency : float, Hz

    Returns
    -------
    ndarray of shape (elements, scatterers), complex
    """
    height = probe.height_mm * mm
    range_ = np.hypot(position[:, 0] - element_centres(probe)[:, None], position[:, 1])
    defocus, slope = 1 / range_ - 1 / (probe.elevation_focus_mm * mm), position[:, 2] / range_
    wavenumber = 2 * np.pi * frequency / probe.sound_speed_m_per_s
    phase = wavenumber * height / 2 * (np.abs(slope).max() + np.abs(defocus).max() * height / 4)
    node, weight = np.polynomial.legendre.leggauss(32 + int(phase))
    response = np.zeros(range_.shape, complex)
    for h, part in zip(node * height / 2, weight / 2, strict=True):
        response += part * np.exp(-1j * wavenumber * (h**2 / 2 * defocus - h * slope))
    return response
