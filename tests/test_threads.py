"""Loops that threads share."""

import multiprocessing

import numba
import numpy as np
import pytest

from echotruth.threads import share


@numba.njit(nogil=True)
def count(turns, part):
    for turn in range(*part):
        turns[turn] += 1


def counted(length):
    turns = np.zeros(length, int)
    share(lambda part: count(turns, part), length)
    return turns


@pytest.fixture(params=[1, 2])
def threads(request):
    before = numba.get_num_threads()
    numba.set_num_threads(min(request.param, before))
    yield
    numba.set_num_threads(before)


@pytest.mark.parametrize("length", [0, 1, 2, 7, 1000])
def test_every_turn_is_carried_out_once(threads, length):
    assert (counted(length) == 1).all()


def test_error_in_a_thread_is_raised():
    def fail(part):
        raise ValueError("no")

    with pytest.raises(ValueError, match="no"):
        share(fail, 4)


@pytest.mark.filterwarnings("ignore:.*multi-threaded:DeprecationWarning")
def test_a_forked_process_has_threads_of_its_own():
    counted(8)  # threads of this process
    with multiprocessing.get_context("fork").Pool(1) as pool:
        assert pool.apply_async(counted, (8,)).get(timeout=60).tolist() == [1] * 8
