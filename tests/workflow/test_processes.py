"""What every process of a stage is started with, and caches of compiled functions that processes share."""

import ast
import os
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import numba
import pytest

from echotruth.files import user_cache
from echotruth.repository import code
from echotruth.repository.code import PACKAGE, PASSING, compiled_files
from echotruth.workflow.processes import cache, cache_name, prefix

ROOT = Path(__file__).parents[2]
FORMS = """\
import sys
import numba
from echotruth.workflow.processes import guard_cache

@numba.njit(cache=True)
def twice(x):
    return (x, x)

guard_cache()
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


@pytest.mark.parametrize("name", ["*.nbi", "*.nbc"])
@pytest.mark.parametrize("kept", [0, -1], ids=["emptied", "cut"])
def test_damaged_cache_is_no_cache(tmp_path, monkeypatch, name, kept):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "cache"))
    (tmp_path / "double.py").write_text("import numba\n@numba.njit(cache=True)\ndef double(x):\n    return 2 * x\n")

    def was_cached():
        double = runpy.run_path(str(tmp_path / "double.py"))["double"]
        assert double(4) == 8
        return bool(double.stats.cache_hits)

    assert [was_cached(), was_cached()] == [False, True]
    (file,) = (tmp_path / "cache").rglob(name)
    file.write_bytes(file.read_bytes()[:kept])
    assert [was_cached(), was_cached()] == [False, True]


def test_cache_to_which_others_can_write_is_not_used(tmp_path, monkeypatch):
    """What is read there is executed."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    home, here = tmp_path / "echotruth", tmp_path / ".snakemake/numba"
    assert cache().parent == home and home.stat().st_mode & 0o777 == 0o700
    for mode in (0o770, 0o707):
        home.chmod(mode)
        assert cache().parent == here and here.stat().st_mode & 0o777 == 0o700
    here.chmod(0o770)
    assert tmp_path not in cache().parents and cache().parent.stat().st_mode & 0o777 == 0o700


def test_cache_of_another_user_is_not_used(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    assert cache().parent == tmp_path / "echotruth"
    monkeypatch.setattr(os, "getuid", lambda: tmp_path.stat().st_uid + 1)
    assert tmp_path not in cache().parents


def test_cache_is_that_of_the_home_unless_its_variable_is_an_absolute_path(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    assert user_cache() == tmp_path / ".cache/echotruth"


def test_files_of_which_the_cache_depends_are_all_that_use_numba():
    counted = set(compiled_files())
    using = {file for file in PACKAGE.rglob("*.py") if {"numba"} & {name.split(".")[0] for name in imports(file)}}
    assert {file.relative_to(PACKAGE).as_posix() for file in using - counted} == {
        "workflow/job.py",
        "workflow/processes.py",
    }
    assert PACKAGE / "fem/location.py" in counted, "imported by a file with compiled functions"
    assert PACKAGE / "materials/guccione.py" in counted, "compiled by its name"
    assert PACKAGE / "report/style.py" not in counted


def imports(file):
    """Names of the modules that a file imports, and what it imports from each."""
    found = {}
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name: {alias.asname or alias.name} for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found.setdefault(node.module, set()).update(alias.asname or alias.name for alias in node.names)
    return found


def test_compiled_functions_use_nothing_of_the_modules_that_do_not_count():
    """A constant of the configuration would be compiled into them unseen."""
    for file in compiled_files():
        passing = set().union(*(names for module, names in imports(file).items() if module.startswith(PASSING)))
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.FunctionDef) and any("jit" in ast.unparse(one) for one in node.decorator_list):
                assert not passing & {one.id for one in ast.walk(node) if isinstance(one, ast.Name)}, (file, node.name)


def test_edit_of_the_report_keeps_the_cache_and_that_of_a_constant_of_a_compiled_function_makes_another(
    tmp_path, monkeypatch
):
    package = shutil.copytree(PACKAGE, tmp_path / "echotruth", ignore=shutil.ignore_patterns("shipped"))
    before = cache_name()
    monkeypatch.setattr(code, "PACKAGE", package)
    monkeypatch.setattr(code, "_file", code._file.__wrapped__)  # it remembers where modules are

    def edited(name):
        (package / name).write_text((package / name).read_text() + "# edited\n")
        return cache_name()

    assert edited("report/style.py") == before != edited("fem/location.py")


def shell(command, root=ROOT, **options):
    return subprocess.run(
        ["bash", "-c", prefix(root).format() + command], capture_output=True, text=True, check=False, **options
    )


def test_working_folder_may_have_braces_which_snakemake_takes_for_names(tmp_path, monkeypatch):
    (tmp_path / "{case}").mkdir()
    monkeypatch.chdir(tmp_path / "{case}")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "{case}"))
    assert f"{tmp_path}/{{case}}/echotruth/{cache_name()}" in prefix(ROOT).format()


def test_shell_of_a_job_knows_its_scripts_its_package_and_the_python_of_this_process():
    command = 'echo "$SCRIPTS"; command -v python; echo "$NUMBA_CACHE_DIR"; echo "$PYTHONPATH"'
    scripts, python, folder, path = shell(command).stdout.splitlines()
    assert Path(scripts) == ROOT / "workflow/scripts" and Path(python).parent == Path(sys.executable).parent
    assert Path(folder) == user_cache() / cache_name()
    assert path.split(":")[0] == str(ROOT / "src")


@pytest.mark.parametrize("command", ["false; true", "false | true", 'echo "$no_such_variable"'])
def test_shell_of_a_job_ends_with_the_first_command_that_fails(command):
    assert shell(command).returncode
