"""Work that threads share."""

import multiprocessing
import threading

import numba
import numpy as np
import pytest

from echotruth.threads import each, share


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
    numba.set_num_threads(min(request.param, numba.config.NUMBA_NUM_THREADS))
    yield
    numba.set_num_threads(1)


@pytest.mark.parametrize("length", [0, 1, 2, 7, 1000])
def test_every_turn_is_carried_out_once(threads, length):
    assert (counted(length) == 1).all()


def test_results_come_in_the_order_of_the_items_from_as_many_threads_as_numba_uses(threads):
    allowed, together = numba.get_num_threads(), threading.Barrier(numba.get_num_threads())

    def result(item):
        together.wait(timeout=60)  # for as many others as may run at a time
        return item, threading.get_ident()

    items, idents = zip(*each(result, range(2 * allowed)), strict=True)
    assert items == tuple(range(2 * allowed))
    assert len(set(idents)) == allowed
    assert (threading.get_ident() in idents) == (allowed == 1)


def test_error_in_a_thread_is_raised(threads):
    def fail(part):
        raise ValueError("no")

    with pytest.raises(ValueError, match="no"):
        share(fail, 4)


@pytest.mark.filterwarnings("ignore:.*multi-threaded:DeprecationWarning")
def test_a_forked_process_has_threads_of_its_own(threads):
    counted(8)  # threads of this process
    with multiprocessing.get_context("fork").Pool(1) as pool:
        assert pool.apply_async(counted, (8,)).get(timeout=60).tolist() == [1] * 8
