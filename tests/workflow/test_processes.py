"""What every process of a stage is started with, and caches of compiled functions that processes share."""

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from echotruth.workflow.processes import SCRIPTS_THAT_COMPILE, cache_name, prefix, script

ROOT = Path(__file__).parents[2]
FORMS = """\
import sys
import numba
from echotruth.workflow.processes import lock_cache_writes

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


def test_shell_of_a_job_knows_its_scripts_and_repository_and_the_python_of_this_process(tmp_path):
    folder = tmp_path / "out/it's $mine"
    code = 'echo "$SCRIPTS"; echo "$REPOSITORY"; command -v python; echo "$NUMBA_CACHE_DIR"'
    done = subprocess.run(["bash", "-c", prefix(folder) + code], capture_output=True, text=True, check=True)
    scripts, repository, python, cache = done.stdout.splitlines()
    assert {path.stem for path in Path(scripts).glob("*.py")} >= set(SCRIPTS_THAT_COMPILE)
    assert repository == str(folder) and Path(python).parent == Path(sys.executable).parent
    assert Path(cache).is_absolute() and Path(cache).parts[-3:] == (".snakemake", "numba", cache_name())


def test_shell_of_a_job_ends_with_the_first_command_that_fails(tmp_path):
    for commands in ("false; true", "false | true", 'echo "$no_such_variable"'):
        assert subprocess.run(["bash", "-c", prefix(tmp_path) + commands], capture_output=True, check=False).returncode


def test_every_stage_has_a_script_that_is_part_of_the_name_of_the_cache(monkeypatch):
    assert all(Path(script(stage)).is_file() for stage in SCRIPTS_THAT_COMPILE)
    read = []
    monkeypatch.setattr("echotruth.workflow.processes.code_version", lambda *paths: read.extend(paths) or "0")
    assert cache_name() == "0" and read == [script(stage) for stage in SCRIPTS_THAT_COMPILE]
    assert shlex.quote(str(ROOT / "workflow/scripts")) in prefix(Path("out/tiny"))
