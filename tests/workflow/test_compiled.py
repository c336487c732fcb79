"""Compiled functions on disk."""

import os
import subprocess
import sys
from pathlib import Path

from echotruth.workflow.compiled import GROUPS, folder

SCRIPTS = Path(__file__).parents[2] / "workflow/scripts"
FORMS = """\
import sys
import numba
from echotruth.workflow.compiled import share

@numba.njit(cache=True)
def twice(x):
    return (x, x)

share()
forms = {"1": (1, 2.5), "2": (1j, (1, 2))}[sys.argv[1]] if len(sys.argv) > 1 else (1, 2.5, 1j, (1, 2))
print([twice(form) for form in forms], sum(twice.stats.cache_hits.values()))
"""


def test_processes_that_compile_forms_of_a_function_at_once_keep_them_all(tmp_path):
    """Saved at once they would get the same number, and one of them the code of the other."""
    (tmp_path / "forms.py").write_text(FORMS)
    surroundings = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}

    def start(*which):
        command = [sys.executable, str(tmp_path / "forms.py"), *which]
        return subprocess.Popen(command, env=surroundings, stdout=subprocess.PIPE, text=True)

    for process in [start("1"), start("2")]:
        assert process.wait() == 0
    assert start().communicate()[0] == "[(1, 1), (2.5, 2.5), (1j, 1j), ((1, 2), (1, 2))] 4\n"


def test_every_stage_has_a_cache():
    stages = {stage for group in GROUPS.values() for stage in group}
    assert stages == {"mechanics", "physiology", "phantom", "truth", "rf", "bmode", "tracking", "evaluation", "report"}
    assert len({folder(group, SCRIPTS) for group in GROUPS}) == len(GROUPS)
