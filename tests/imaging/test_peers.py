"""The RF, and the sum that it is measured by, against other simulators where they are installed.

`pip install -e .[peers,zea] FastSIMUS` installs them.
"""

from functools import partialmethod
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
ARRAYS = ["mouse, 25 MHz", "human, 2.72 MHz"]


@pytest.fixture
def agreement(monkeypatch):
    monkeypatch.syspath_prepend(BENCHMARKS)
    import acoustics_agreement

    return acoustics_agreement


@pytest.fixture
def exact(agreement):
    import acoustics_exact

    return acoustics_exact


@pytest.mark.parametrize("array", ARRAYS)
@pytest.mark.parametrize("setting", ["the same settings", "the same, with attenuation"])
def test_one_transmit_of_the_matrix_is_that_of_pymust(agreement, array, setting):
    pytest.importorskip("pymust")
    found = agreement.to_pymust(agreement.ARRAYS[array], **agreement.PYMUST[setting])
    assert found["correlation"] > 0.9999999
    assert found["error"] < 2e-4
    assert found["factor"] == pytest.approx(1, rel=1e-3)


@pytest.mark.parametrize("setting", ["rigid baffle", "directivity of the centre frequency"])
def test_settings_of_pymust_that_are_not_ours_show(agreement, setting):
    pytest.importorskip("pymust")
    found = agreement.to_pymust(agreement.ARRAYS["mouse, 25 MHz"], **agreement.PYMUST[setting])
    assert found["error"] > 5e-3


@pytest.mark.parametrize("array", ARRAYS)
def test_the_matrix_is_that_of_esdiva(agreement, array, monkeypatch):
    pytest.importorskip("esdiva")
    monkeypatch.setattr(agreement, "FEW", 5)
    monkeypatch.setattr(agreement.Array, "thin", partialmethod(agreement.Array.thin, elements=32))
    found = agreement.to_esdiva(agreement.ARRAYS[array])
    assert found["correlation"] > 0.9999999
    assert found["error"] < 2e-4
    assert found["factor"] == pytest.approx(1, rel=1e-3)


@pytest.mark.parametrize("array", ARRAYS)
def test_the_exact_sum_is_that_of_zea_but_for_the_baffle(exact, array):
    pytest.importorskip("zea")
    pytest.importorskip("jax")
    assert exact.transmit(exact.Zea, exact.ARRAYS[array], law=exact.rigid_baffle) < 2e-4
    assert exact.transmit(exact.Zea, exact.ARRAYS[array]) > 1e-2


@pytest.mark.parametrize("array", ARRAYS)
def test_the_exact_sum_is_that_of_fastsimus_but_for_the_loss_over_distance(exact, array):
    pytest.importorskip("fast_simus")
    options = {"fine": True, "widest": True}
    assert exact.transmit(exact.FastSimus, exact.ARRAYS[array], law=exact.two_dimensions, **options) < 2e-4
    assert exact.transmit(exact.FastSimus, exact.ARRAYS[array], **options) > 1e-1
