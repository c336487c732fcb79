"""Units: what the configuration calls by the unit in its key is SI inside."""

from math import pi

import pytest

from echotruth.config import Fibres, Loop, Material, Probe


def test_values_become_si_and_lose_the_unit_in_their_name():
    probe = Probe().si()
    assert probe.pitch == pytest.approx(46e-6)
    assert probe.frequency == pytest.approx(25e6)
    assert probe.sound_speed == 1540
    assert Fibres().si().endo == pytest.approx(84 * pi / 180)
    assert Loop(edv_uL=50.0).si().edv == pytest.approx(50e-9)
    assert Material(stiffness_kPa=1.1).si().stiffness == pytest.approx(1100)


def test_a_value_left_open_stays_open():
    assert Material().si().stiffness is None
