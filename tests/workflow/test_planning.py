"""Planning remembers the parameters of the functions in rules, and they are those that they have."""

import gc
from inspect import signature
from types import SimpleNamespace

import pytest
from snakemake.common import get_function_params, get_input_function_aux_params
from snakemake.resources import Resource

from echotruth.workflow import planning
from echotruth.workflow.planning import hasten


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
