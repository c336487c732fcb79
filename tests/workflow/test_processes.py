"""What every process of a stage is started with, and caches of compiled functions that processes share."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from echotruth.workflow.processes import cache_name, prefix

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


def shell(code, root=ROOT, **options):
    return subprocess.run(
        ["bash", "-c", prefix(root).format() + code], capture_output=True, text=True, check=False, **options
    )


def test_working_folder_may_have_braces_which_snakemake_takes_for_names(tmp_path, monkeypatch):
    (tmp_path / "{case}").mkdir()
    monkeypatch.chdir(tmp_path / "{case}")
    assert f"{tmp_path}/{{case}}/.snakemake/numba" in prefix(ROOT).format()


def test_shell_of_a_job_knows_its_scripts_its_package_and_the_python_of_this_process():
    code = 'echo "$SCRIPTS"; command -v python; echo "$NUMBA_CACHE_DIR"; echo "$PYTHONPATH"'
    scripts, python, cache, path = shell(code).stdout.splitlines()
    assert Path(scripts) == ROOT / "workflow/scripts" and Path(python).parent == Path(sys.executable).parent
    assert Path(cache).is_absolute() and Path(cache).parts[-3:] == (".snakemake", "numba", cache_name())
    assert path.split(":")[0] == str(ROOT / "src")


def test_shell_of_an_installed_package_leaves_the_path_of_python_alone(tmp_path):
    assert "PYTHONPATH" not in prefix(tmp_path)


@pytest.mark.parametrize("code", ["false; true", "false | true", 'echo "$no_such_variable"'])
def test_shell_of_a_job_ends_with_the_first_command_that_fails(code):
    assert shell(code).returncode
