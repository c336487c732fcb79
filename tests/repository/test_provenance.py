"""Versions: code is known by what it does, settings by what they say."""

import sys
from importlib.metadata import version
from pathlib import Path
from types import SimpleNamespace

import pytest

from echotruth.config import Bmode, PhaseCorrelation
from echotruth.repository.provenance import _dependencies, _source, code_version, packages, settings_version
from echotruth.workflow.processes import SCRIPTS_THAT_COMPILE, cache_name, script

ROOT = Path(__file__).parents[2]


def _forget():
    """As a new process would start."""
    for cached in (code_version, _source):
        cached.cache_clear()


def _version(tmp_path, text):
    script = tmp_path / "script.py"
    script.write_text(text)
    _forget()
    return code_version(str(script))


def test_comments_layout_and_docstrings_do_not_change_the_version(tmp_path):
    plain = _version(tmp_path, "def f(x):\n    return x + 1\n")
    dressed = _version(tmp_path, '"""Says."""\n\ndef f(x):\n    """Does."""\n    # adds\n    return (x   + 1)\n')
    assert plain == dressed


def test_another_statement_changes_the_version(tmp_path):
    assert _version(tmp_path, "x = 1\n") != _version(tmp_path, "x = 2\n")


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("f(1, 2)", "f((1, 2))"),
        ("x = None", "x = 'None'"),
        ("x = 1", "x = True"),
        ("x = 1", "x = 1.0"),
        ("f(*x)", "f(**x)"),
        ("{**x}", "{None: x}"),
        ("if x:\n    a()\nb()", "if x:\n    a()\n    b()"),
        ("if x:\n    a()\nelse:\n    b()", "if x:\n    a()\n    b()"),
        ("def f(a, /, b): ...", "def f(a, b): ..."),
        ("def f(*, a): ...", "def f(a): ..."),
        ("x[1:]", "x[:1]"),
    ],
)
def test_statements_that_mean_something_else_have_another_version(tmp_path, one, other):
    assert _version(tmp_path, f"{one}\n") != _version(tmp_path, f"{other}\n")


def test_version_follows_imports_into_the_package_and_not_into_other_stages(tmp_path):
    def dependencies(stage):
        return _dependencies((script(stage),))

    assert "echotruth.mechanics.solver.newton" in dependencies("mechanics")
    assert "echotruth.materials.neo_hooke" in dependencies("mechanics"), "found in its folder, not by an import"
    assert "echotruth.mechanics.solver.newton" not in dependencies("tracking")
    assert "echotruth.tracking.trackers.dis" in dependencies("tracking")
    assert "echotruth.tracking.trackers.phase_correlation" not in dependencies("mechanics") | dependencies("rf")


def test_import_that_is_left_out_is_not_followed_from_there_but_from_elsewhere(tmp_path):
    script, other = tmp_path / "script.py", tmp_path / "other.py"
    script.write_text("import echotruth.tracking.trackers.dis\n")
    other.write_text("from echotruth.tracking import closure\n")
    dis = "echotruth.tracking.trackers.dis"
    unless = frozenset({(str(script), dis)})
    assert dis in _dependencies((str(script),)) and dis not in _dependencies((str(script),), unless)
    assert dis in _dependencies((str(script), str(other)), unless), "closure imports it"
    assert code_version(str(script)) != code_version(str(script), unless=unless)


def test_cache_of_compiled_functions_has_the_version_of_all_modules_that_compile():
    scripts = tuple(map(script, SCRIPTS_THAT_COMPILE))
    texts = {path: path.read_text() for path in (ROOT / "src").rglob("*.py")}
    files = [path.relative_to(ROOT / "src") for path, text in texts.items() if "njit(" in text or "intrinsic" in text]
    compiled = {".".join(file.with_suffix("").parts).removesuffix(".__init__") for file in files}
    assert len(compiled) > 20
    assert compiled <= _dependencies(scripts)
    assert cache_name() == code_version(*scripts)


def test_settings_version_depends_on_values_alone():
    assert settings_version(Bmode(), 1) == settings_version(Bmode(), 1)
    assert settings_version(PhaseCorrelation()) != settings_version(PhaseCorrelation(taper="hann"))


def test_versions_of_packages_are_those_of_their_distributions():
    found = packages()
    for name in ("numpy", "scikit-image", "echotruth"):
        assert found[name] == version(name)
    assert "opencv" in found


def test_opencv_is_told_under_whatever_name_it_is_installed_and_missed_where_it_is_not(monkeypatch):
    monkeypatch.setitem(sys.modules, "cv2", SimpleNamespace(__version__="4.10.0"))
    assert packages()["opencv"] == "4.10.0"
    monkeypatch.setitem(sys.modules, "cv2", None)
    assert "opencv" not in packages()
