"""Presets of arrays, and of the scan, the density of scatterers and the image that suit each.

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
human_3MHz
    80 elements at half a wavelength, as cardiac phased arrays of clinics have some 64 to 128; all numbers are ours.
mouse_linear_40MHz
    256 elements at 1.4 wavelengths, as linear arrays of scanners for mice are; all numbers are ours. Its lines are not
    steered, and an F-number of two keeps the elements that see a point far from their axis out of its line.

Element width and height and elevation focus of the arrays for rodents are our choice; a bandwidth of one half is usual
at these frequencies.

The heart lies at the transmit focus and entirely in the field of view. A resolution cell (beam width x pulse length x
slice thickness) contains at least ten scatterers; with the 2800 per mm^3 of mouse_25MHz the speckle SNR is 1.816, and
1.913 for fully developed speckle, and tracker error shows no consistent trend with density in a heart
with the fibres of config/paper.yaml (benchmarks/density.py of 02d7c8a). Focal zones are about half a depth of field
apart, which is 7 wavelength (focus / aperture)^2, and their foci extend over most of the heart.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

_PROBE = ("elements", "frequency_MHz", "bandwidth", "pitch_um", "width_um", "height_mm", "elevation_focus_mm")
_SCAN = (
    "phantom.density_per_mm3",
    "rf.focus_mm",
    "rf.focal_zones",
    "rf.focal_spacing_mm",
    "rf.sector_deg",
    "bmode.field_of_view_mm",
)
_ARRAYS = {
    "mouse_25MHz": (64, 25.0, 0.5, 46.0, 41.0, 1.0, 6.5, 2800.0, 6.5, 5, 1.0, 64.0, 12.0),
    "mouse_30MHz": (64, 30.0, 0.5, 50.0, 45.0, 1.0, 6.5, 5300.0, 6.5, 5, 1.0, 64.0, 12.0),
    "mouse_40MHz": (64, 40.0, 0.5, 38.0, 34.0, 1.0, 6.5, 9500.0, 6.5, 5, 1.0, 64.0, 12.0),
    "rat_15MHz": (64, 15.0, 0.5, 77.0, 68.0, 1.67, 10.8, 620.0, 10.8, 5, 1.7, 64.0, 20.0),
    "human_2_7MHz": (64, 2.72, 0.74, 300.0, 250.0, 14.0, 60.0, 5.0, 70.0, 3, 25.0, 75.0, 150.0),
    "human_3MHz": (80, 3.0, 0.8, 254.0, 224.0, 13.0, 70.0, 7.0, 70.0, 3, 21.0, 75.0, 150.0),
    "mouse_linear_40MHz": (256, 40.0, 0.5, 55.0, 50.0, 1.0, 6.5, 13000.0, 6.5, 5, 0.8, 64.0, 12.0),
}
_LINEAR = {"mouse_linear_40MHz": {"rf.scan": "linear", "rf.f_number": 2.0}}
"""Arrays whose lines are parallel."""


def _columns(keys: tuple[str, ...]) -> dict[str, dict[str, Any]]:
    arrays = {name: dict(zip((*_PROBE, *_SCAN), row, strict=True)) for name, row in _ARRAYS.items()}
    return {name: {key: row[key] for key in keys} for name, row in arrays.items()}


ARRAY_PRESETS = _columns(_PROBE)
"""Name of an array -> values of the section `probe`."""
ARRAY_DEFAULTS = {name: values | _LINEAR.get(name, {}) for name, values in _columns(_SCAN).items()}
"""Name of an array -> default of dotted keys."""
if TYPE_CHECKING:
    ArrayName = str
else:
    ArrayName = Literal[tuple(_ARRAYS)]
"""What `probe.preset` may be; a type checker cannot read names from a table."""

PRESET_KEYS = (*_PROBE, "sampling_MHz")
"""Keys of the section `probe` whose defaults follow from the preset."""


def sampling_frequency(frequency: float, bandwidth: float) -> float:
    """Default sampling frequency, in the unit of the centre frequency f: max(4 f, 2.2 f (1 + 1.29 B)).

    The bandwidth B is relative to f. A Gaussian spectrum that falls to 1/2 at B / 2 falls to 1 % at
    sqrt(ln 100 / ln 2) / 2 B = 1.29 B.
    """
    return round(frequency * max(4, 2.2 * (1 + 1.29 * bandwidth)), 3)
