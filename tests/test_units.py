"""Units of the configuration against the constants of SciPy."""

from math import log

import pytest
from scipy.constants import centi, degree, g, gram, kilo, litre, mega, micro, milli, minute, nano

from echotruth.units import UNITS, unit_of

EXPECTED = {
    "um": micro,
    "mm": milli,
    "per_mm3": milli**-3,
    "uL": micro * litre,
    "mL": milli * litre,
    "m3": 1,
    "ns": nano,
    "ms": milli,
    "s": 1,
    "per_min": 1 / minute,
    "MHz": mega,
    "m_per_s": 1,
    "mmHg": 13595.1 * g * milli,  # of mercury under standard gravity
    "kPa": kilo,
    "Pa": 1,
    "kPa_per_mm": kilo / milli,
    "kPa_s_per_mm": kilo / milli,
    "Pa_s": 1,
    "g": gram,
    "mL_per_g": milli * litre / gram,
    "mL_per_min_per_g": milli * litre / minute / gram,
    "deg": degree,
    "dB": 1,
    "dB_per_cm_MHz": log(10) / 20 / centi / mega,
}


def test_factors_are_those_to_si():
    assert pytest.approx(EXPECTED, rel=1e-12) == UNITS


@pytest.mark.parametrize(
    ("key", "unit"),
    [
        ("pitch_um", "um"),
        ("spring_kPa_per_mm", "kPa_per_mm"),
        ("attenuation_dB_per_cm_MHz", "dB_per_cm_MHz"),
        ("shortening_velocity_max_per_s", "s"),
        ("elements", ""),
    ],
)
def test_the_longest_suffix_is_the_unit_of_a_key(key, unit):
    assert unit_of(key) == unit
