"""True values of what is inferred."""

import numpy as np
import pytest

import echotruth as et
from echotruth.inference.truth import truth
from echotruth.units import mmHg


def test_true_contractility_of_an_infarct_is_none_there_and_one_in_the_mean_of_the_wall():
    true, heart = truth(et.sample(), "infarct"), et.sample().heart("infarct")
    assert true["contractility.7"] == true["contractility.8"] == 0
    assert true["contractility.11"] > true["contractility.10"] > 0
    volume = np.bincount(heart.arrays["fibres"]["segment"], minlength=18)[1:]  # cells of about one size
    assert np.average([true[f"contractility.{n}"] for n in range(1, 18)], weights=volume) == pytest.approx(1, abs=0.1)
    # A segment that is a fresh scar of twice the stiffness while the heart fills, over another that is healthy.
    assert true["stiffness.7"] / true["stiffness.11"] == pytest.approx(2, rel=1e-6)
    pressure = heart.arrays["mechanics"]["pressure"]
    assert true["loop.esp_mmHg"] == pytest.approx(pressure[heart.es] / mmHg)


def test_true_values_of_a_healthy_heart_are_its_configuration():
    true = truth(et.sample(), "healthy")
    config = et.sample().case("healthy").config
    assert true["fibres.endo_deg"] == config.fibres.endo_deg
    assert true["mechanics.active.sheet_share"] == config.mechanics.active.sheet_share
    stiffness = float(et.sample().heart("healthy").arrays["mechanics"]["stiffness"])
    assert true["mechanics.material.stiffness_kPa"] == pytest.approx(stiffness / 1e3, rel=1e-6)
