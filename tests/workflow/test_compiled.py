"""Caches of compiled functions."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from echotruth.workflow.compiled import CACHE_GROUPS, cache_folder

SCRIPTS = Path(__file__).parents[2] / "src/echotruth/workflow/scripts"
FORMS = """\
import sys
import numba
from echotruth.workflow.compiled import lock_cache_writes

@numba.njit(cache=True)
def twice(x):
    return (x, x)

lock_cache_writes()
forms = {"1": (1, 2.5), "2": (1j, (1, 2))}[sys.argv[1]] if len(sys.argv) > 1 else (1, 2.5, 1j, (1, 2))
print([twice(form) for form in forms], sum(twice.stats.cache_hits.values()))
"""


@pytest.mark.slow
def test_processes_that_compile_forms_of_a_function_at_once_keep_them_all(tmp_path):
    """Without a lock both would get the same number, and one of them the code of the other."""
    (tmp_path / "forms.py").write_text(FORMS)
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}

    def start(*which):
        command = [sys.executable, str(tmp_path / "forms.py"), *which]
        return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)

    for process in [start("1"), start("2")]:
        assert process.wait() == 0
    assert start().communicate()[0] == "[(1, 1), (2.5, 2.5), (1j, 1j), ((1, 2), (1, 2))] 4\n"


def test_every_stage_has_a_cache():
    stages = {stage for group in CACHE_GROUPS.values() for stage in group}
    assert stages == {"mechanics", "physiology", "phantom", "truth", "rf", "bmode", "tracking", "evaluation", "report"}
    assert len({cache_folder(group, SCRIPTS) for group in CACHE_GROUPS}) == len(CACHE_GROUPS)
