"""Planning in less time and memory plans what Snakemake does without."""

import asyncio
import copy
import gc
import pickle
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from inspect import signature
from pathlib import Path
from types import SimpleNamespace

import pytest
import snakemake.api  # noqa: F401 - first, as its modules import one another
from snakemake.common import get_function_params, get_input_function_aux_params
from snakemake.dag import DAG
from snakemake.exceptions import ChildIOException, WorkflowError
from snakemake.io import directory
from snakemake.iocontainers import AttributeGuard, Namedlist, Wildcards
from snakemake.resources import Resource
from snakemake.scheduling.job_scheduler import JobScheduler
from snakemake.settings.types import Batch

from echotruth.workflow import planning
from echotruth.workflow.planning import SmallTaskGroup, hasten, in_batch


@pytest.fixture(autouse=True)
def collector():
    """The collector of garbage as it was."""
    before = gc.get_threshold()
    yield
    gc.unfreeze()
    gc.set_threshold(*before)


def test_functions_of_rules_keep_their_parameters_and_are_asked_for_them_once(monkeypatch):
    functions = [lambda wildcards: "", lambda wildcards, output: "", lambda wildcards, attempt: 3]
    group = lambda wildcards: "heart"  # noqa: E731
    resources = {"runtime": Resource("runtime", functions[2]), "mem_mb": Resource("mem_mb", 700)}
    hasten(
        [SimpleNamespace(input=[functions[0], "a.json"], params=[functions[1], 3], group=group, resources=resources)]
    )
    monkeypatch.setattr("inspect.signature", None)  # is not asked again
    candidates = {"output": 1, "attempt": 2}
    kept = [get_input_function_aux_params(function, candidates) for function in (*functions, group)]
    assert kept == [{}, {"output": 1}, {"attempt": 2}, {}]
    assert get_input_function_aux_params(resources["runtime"].evaluate, candidates) == candidates


def test_parameters_are_those_of_the_function():
    function = lambda wildcards, output: ""  # noqa: E731
    hasten([SimpleNamespace(input=[], params=[function], group=None, resources={})])
    assert get_function_params(function) == signature(function).parameters
    assert gc.get_threshold()[0] == planning.OBJECTS_BETWEEN_COLLECTIONS


def test_lists_of_jobs_share_guards_and_refused_names_and_still_act_on_them():
    hasten([])
    one, other = Namedlist(fromdict={"a": 1}), Namedlist()
    assert one.index is other.index and one.index is not one.sort
    assert isinstance(one.index, AttributeGuard)
    assert one.get("index") is None and one.get("a") == 1
    with pytest.raises(AttributeError, match=r"index\(\) cannot be used"):
        one.index(1)
    named = Namedlist(fromdict={"index": 2})
    assert named.index == 2 and isinstance(other.index, AttributeGuard)
    assert "_allowed_overrides" not in vars(one)
    with pytest.raises(AttributeError, match="keys is reserved"):
        Namedlist(fromdict={"keys": 3})
    assert copy.deepcopy(one).a == pickle.loads(pickle.dumps(one)).a == 1


@pytest.mark.parametrize("fails", [False, True])
def test_small_task_group_runs_all_in_few_tasks_and_raises_what_one_raises(monkeypatch, fails):
    monkeypatch.setattr(SmallTaskGroup, "SIZE", 3)
    done, most = [], []

    async def work(number):
        most.append(len(asyncio.all_tasks()))
        await asyncio.sleep(0)
        if fails and number == 5:
            raise ValueError("five")
        done.append(number)

    async def run():
        async with SmallTaskGroup() as group:
            for number in range(10):
                group.create_task(work(number))

    with ThreadPoolExecutor(1) as thread:  # the loop of a browser may run in this one
        result = thread.submit(asyncio.run, run())
    if fails:
        assert [str(error) for error in result.exception().exceptions] == ["five"]
        assert max(done) < 6
    else:
        assert result.exception() is None
        assert done == list(range(10))
    assert max(most) <= 4  # with that of the group


@pytest.mark.parametrize("has_directory", [False, True])
def test_paths_are_sorted_to_look_inside_directories_only_if_an_output_is_one(
    monkeypatch, has_directory, check=DAG.check_directory_outputs
):
    monkeypatch.setattr(DAG, "check_directory_outputs", check)
    output = [directory("out/folder")] if has_directory else ["out/folder"]
    hasten([SimpleNamespace(input=[], output=output, params=[], group=None, resources={})])
    jobs = [Wildcards(["out/folder"]), Wildcards(["out/folder/file"])]  # can be hashed and sorted, as jobs are
    for job in jobs:
        job.output = list(job)
    look = partial(DAG.check_directory_outputs, SimpleNamespace(jobs=jobs))
    if has_directory:
        with pytest.raises(ChildIOException):
            look()
    else:
        look()


def test_scheduler_looks_for_jobs_with_one_timer_at_a_time_and_again_after_each():
    hasten([])
    looks = []
    scheduler = SimpleNamespace(_open_jobs=SimpleNamespace(release=lambda: looks.append(threading.current_thread())))
    wait = partial(JobScheduler._schedule_reevalutation, scheduler, 0.2)
    for rounds in (1, 2):
        timers = threading.active_count()
        for _ in range(5):  # jobs that end
            wait()
        assert threading.active_count() == timers + 1
        deadline = time.monotonic() + 10
        while len(looks) < rounds and time.monotonic() < deadline:
            time.sleep(0.01)
        assert len(looks) == rounds
        looks[-1].join()


FILES = [Path(f"ledger/evaluation/{name}.json") for name in "gbdface"]


@pytest.mark.parametrize("number", [1, 2])
def test_batch_has_the_files_that_snakemake_would_choose_from_all_and_chooses_once(number):
    batch = Batch("repository", number, 3)
    expected = Batch("repository", number, 3).get_batch([str(path) for path in FILES])
    for _ in range(2):  # Snakemake may ask again
        files = in_batch(FILES, "repository", batch)
        assert files == expected
        assert batch.get_batch(files) == expected


def test_last_batch_and_other_rules_keep_all_files():
    paths = [str(path) for path in FILES]
    last = Batch("repository", 3, 3)
    assert in_batch(FILES, "repository", last) == paths
    assert last.get_batch(paths) == sorted(paths)[5:]
    assert in_batch(FILES, "repository", Batch("report", 1, 3)) == in_batch(FILES, "repository", None) == paths


def test_more_batches_than_files_are_left_to_snakemake_to_refuse():
    batch = Batch("repository", 1, 8)
    with pytest.raises(WorkflowError, match="less input files than batches"):
        batch.get_batch(in_batch(FILES, "repository", batch))
