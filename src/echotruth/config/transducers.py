"""Presets of phased arrays; a new one also needs its name in :mod:`.probe` and its scan in :mod:`.defaults`.

mouse_25MHz
    Pitch 0.75 wavelengths: steered by 20 degrees, the highest lobe is 36 dB below the main one. Beam and pulse (-6 dB,
    at the focus) measure 0.20 x 0.06 mm.
mouse_30MHz
    Pitch of the 64-element array for mouse hearts of Zhang et al., IEEE Trans Ultrason Ferroelectr Freq
    Control 57 (2010) 1548 (PMC2908919), whose two-way beams were 0.165 to 0.26 mm wide at 5 to 10 mm. One wavelength:
    a beam steered by 32 degrees has a grating lobe at -30 degrees.
mouse_40MHz
    Frequency, elements and pitch of the phased array of Bezanson, Adamson and Brown, IEEE Trans Ultrason Ferroelectr
    Freq Control 61 (2014) 33. The pitch is also one wavelength.
rat_15MHz
    mouse_25MHz with all lengths multiplied by 5/3, the relative size of the rat's heart.
human_2_7MHz
    Frequency, bandwidth, elements and lengths of the cardiac phased array P4-2v, as the simulator PyMUST gives them
    (Garcia, Comput Methods Programs Biomed 218 (2022) 106726).

Element width and height and elevation focus of the arrays for rodents are our choice; a bandwidth of one half is usual
at these frequencies.
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
ARRAY_PRESETS: dict[str, dict[str, Any]] = {name: dict(zip(_KEYS, row, strict=True)) for name, row in _ARRAYS.items()}
"""Name of an array -> values of the section `probe`."""

PRESET_KEYS = (*_KEYS, "sampling_MHz")
"""Keys of the section `probe` whose defaults follow from the preset."""


def sampling_frequency(frequency: float, bandwidth: float) -> float:
    """Default sampling frequency, in the unit of the centre frequency f: max(4 f, 2.2 f (1 + 1.29 B)).

    The bandwidth B is relative to f. A Gaussian spectrum that falls to 1/2 at B / 2 falls to 1 % at
    sqrt(ln 100 / ln 2) / 2 B = 1.29 B.
    """
    return round(frequency * max(4, 2.2 * (1 + 1.29 * bandwidth)), 3)
