"""Plan a large sweep in less time and memory: what Snakemake computes for every job anew is computed once."""

from __future__ import annotations

import gc
from collections.abc import Iterable, Iterator
from contextlib import suppress
from inspect import signature
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from snakemake.rules import Rule

OBJECTS_BETWEEN_COLLECTIONS = 200_000
"""Objects made before Python looks for garbage. A plan only grows, and each search goes over all of it."""


def hasten(rules: Iterable[Rule]) -> None:
    """Remember the parameters of all functions in rules, for which Snakemake asks several times a job.

    Nothing of this is part of Snakemake's interface: a version that has changed it plans as it does without.

    Parameters
    ----------
    rules : iterable of Rule
        All rules of a workflow, once they are defined.
    """
    gc.freeze()
    gc.set_threshold(OBJECTS_BETWEEN_COLLECTIONS, 20, 100)
    with suppress(ImportError, AttributeError):
        from snakemake.common import overwrite_function_params
        from snakemake.resources import Resource

        functions = [Resource.evaluate, *(function for rule in rules for function in _functions(rule))]
        for function in functions:
            overwrite_function_params(function, signature(function).parameters)


def _functions(rule: Rule) -> Iterator[Any]:
    """Functions from which the input, the params and the resources of a rule follow."""
    resources = [resource._evaluator for resource in rule.resources.values()]
    for item in (*rule.input, *rule.params, rule.group, *resources):
        function = getattr(getattr(item, "_file", item), "callable", item)
        if callable(function) and hasattr(function, "__code__"):
            yield function
