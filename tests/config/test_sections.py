"""Conversion of values to SI units."""

from math import pi

import pytest

from echotruth.config import Fibres, Loop, Mechanics, Probe


def test_values_become_si_and_lose_the_unit_in_their_name():
    probe = Probe().si()
    assert probe.pitch == pytest.approx(46e-6)
    assert probe.frequency == pytest.approx(25e6)
    assert probe.sound_speed == 1540
    assert Fibres(endo_deg=84.0).si().endo == pytest.approx(84 * pi / 180)
    assert Loop(edv_uL=50.0).si().edv == pytest.approx(50e-9)
    assert Mechanics(bulk_modulus_kPa=2e3).si().bulk_modulus == pytest.approx(2e6)
    pericardium = Mechanics(pericardium={"spring_kPa_per_mm": 1.0, "dashpot_kPa_s_per_mm": 0.005}).si().pericardium
    assert (pericardium.spring, pericardium.dashpot) == pytest.approx((1e6, 5e3))


def test_a_value_left_open_stays_open():
    assert Loop().si().edv is None
