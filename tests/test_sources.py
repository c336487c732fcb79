"""What no source of the package may hold."""

import ast
from pathlib import Path

import echotruth


def test_no_module_imports_what_runs_the_code_of_a_file_that_it_reads():
    banned, package = {"pickle", "marshal", "shelve", "dill", "joblib", "cloudpickle"}, Path(echotruth.__file__).parent
    for path in package.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, (ast.Import, ast.ImportFrom)) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert not {name.partition(".")[0] for name in names} & banned, path
            assert not (isinstance(node, ast.keyword) and node.arg == "allow_pickle" and node.value.value), path
