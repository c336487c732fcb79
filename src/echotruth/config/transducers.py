"""Phased arrays by name.

mouse_25MHz
    Pitch 0.75 wavelengths: at 20 degrees the worst lobe is 36 dB below the main one. Beam and pulse (-6 dB, in focus)
    measure 0.20 x 0.06 mm.
mouse_30MHz
    The pitch is that of the 64-element array for mouse hearts of Zhang et al., IEEE Trans Ultrason Ferroelectr Freq
    Control 57 (2010) 1548 (PMC2908919), whose two-way beams were 0.165 to 0.26 mm wide at 5 to 10 mm. One wavelength:
    a beam steered by 32 degrees has a grating lobe at -30 degrees.
mouse_40MHz
    Frequency, elements and pitch of the phased array of Bezanson, Adamson and Brown, IEEE Trans Ultrason Ferroelectr
    Freq Control 61 (2014) 33. One wavelength likewise.
rat_15MHz
    mouse_25MHz with all lengths 5/3 as large, as the rat's heart is.
human_2_7MHz
    Frequency, bandwidth, elements and lengths of the cardiac phased array P4-2v, as the simulator PyMUST gives them
    (Garcia, Comput Methods Programs Biomed 218 (2022) 106726).

Width, height and focus in elevation of the arrays for rodents are ours, and a bandwidth of one half is usual at such
frequencies.
"""

from __future__ import annotations

from typing import Any

_KEYS = ("elements", "frequency_MHz", "bandwidth", "pitch_um", "width_um", "height_mm", "elevation_focus_mm")
_ARRAYS = {
    "mouse_25MHz": (64, 25.0, 0.5, 46.0, 41.0, 1.0, 6.5),
    "mouse_30MHz": (64, 30.0, 0.5, 50.0, 45.0, 1.0, 6.5),
    "mouse_40MHz": (64, 40.0, 0.5, 38.0, 34.0, 1.0, 6.5),
    "rat_15MHz": (64, 15.0, 0.5, 77.0, 68.0, 1.67, 10.8),
    "human_2_7MHz": (64, 2.72, 0.74, 300.0, 250.0, 14.0, 60.0),
}
PRESETS: dict[str, dict[str, Any]] = {name: dict(zip(_KEYS, row, strict=True)) for name, row in _ARRAYS.items()}
"""Name of an array to the keys of the section `probe` that it settles."""

OPEN = (*_KEYS, "sampling_MHz")
"""Keys of the section `probe` that another one settles where they are not given."""


def sampling(frequency: float, bandwidth: float) -> float:
    """Sampling frequency for a pulse, in the unit of its centre frequency.

    Four times the latter, or 2.2 times the highest frequency of the pulse where that is more. A Gaussian spectrum
    that is down to one half at half the bandwidth is down to 1 % at sqrt(ln 100 / ln 2) / 2 = 1.29 of it.
    """
    return round(frequency * max(4, 2.2 * (1 + 1.29 * bandwidth)), 3)
