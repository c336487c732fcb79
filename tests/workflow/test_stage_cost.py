"""The cost of a stage contains only what that stage used."""

import numba
import numpy as np
import pytest

from echotruth.workflow.stage_cost import Cost, cpu_seconds


def work(seconds):
    end = cpu_seconds() + seconds
    while cpu_seconds() < end:
        sum(range(1000))


def test_seconds_of_a_stage_are_its_own():
    cost = Cost()
    work(0.2)
    cost.start()
    work(0.4)
    first = cost.stop()
    assert first["cpu_seconds"] == pytest.approx(0.4, abs=0.1)
    assert first["start_seconds"] > 0.2, "the first bears the start of the process"
    work(0.3)
    cost.start()
    second = cost.stop()
    assert second["start_seconds"] == pytest.approx(0.3, abs=0.1)
    assert second["cpu_seconds"] < 0.1 and second["seconds"] < second["start_seconds"]


@pytest.mark.slow
def test_compiling_counts_once_however_deep():
    inner = numba.njit(lambda x: np.sort(x).sum())
    outer = numba.njit(lambda x: inner(x) + 1)
    cost = Cost()
    outer(np.ones(3))
    spent = cost.stop()
    assert 0 < spent["compile_seconds"] <= spent["cpu_seconds"]
    cost.start()
    outer(np.ones(3))
    assert cost.stop()["compile_seconds"] == 0


def test_greatest_memory_is_that_of_the_stage():
    cost = Cost()
    kept = np.ones(2**25)  # 268 MB
    high = cost.stop()["memory_MB"]
    del kept
    cost.start()
    assert high > 268
    assert cost.stop()["memory_MB"] <= high
