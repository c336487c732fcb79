"""Jobs use one set of instructions, so that machines of several kinds give the same bytes."""

import json
import os
import subprocess
import sys

import pytest

from echotruth.workflow import instructions
from echotruth.workflow.instructions import LEVEL, environment, exports

needs_level = pytest.mark.skipif(not environment(), reason=f"this processor has no {LEVEL}")


def clean_environment():
    names = [*environment(), "OPENCV_CPU_DISABLE", "PYTEST_CURRENT_TEST"]
    return {name: value for name, value in os.environ.items() if name not in names}


def in_job(code):
    """Output of Python code in a shell that begins as those of the rules do."""
    command = ["bash", "-c", f'set -euo pipefail; {exports()}"$0" -W error -c "$1"', sys.executable, code]
    result = subprocess.run(command, env=clean_environment(), check=True, capture_output=True, text=True)
    assert result.stderr == ""
    return result.stdout.strip()


@needs_level
def test_numba_compiles_for_the_level_and_keys_its_cache_by_it():
    code = "from numba.core.registry import cpu_target as t; print(*t.target_context.codegen().magic_tuple()[1:])"
    assert in_job(code) == LEVEL


@needs_level
def test_numpy_openblas_and_opencv_have_no_code_beyond_the_level():
    code = (
        "import numpy, cv2, json; from numpy._core import _multiarray_umath as numpy_core;"
        "from threadpoolctl import threadpool_info;"
        "print(json.dumps([[n for n in numpy_core.__cpu_dispatch__ if numpy_core.__cpu_features__[n]],"
        " [i['architecture'] for i in threadpool_info() if i['internal_api'] == 'openblas'],"
        " cv2.getCPUFeaturesLine(), cv2.ipp.getIppVersion()]))"
    )
    numpy_features, cores, opencv_features, ipp = json.loads(in_job(code))
    # Only those that NumPy has code for: it knows others of the processor that cannot be switched off.
    assert {"AVX2", "X86_V3"} & set(numpy_features)
    assert not [name for name in numpy_features if name == "X86_V4" or name.startswith("AVX512")]
    assert set(cores) == {"Haswell"}
    assert "*AVX512-SKX " not in f"{opencv_features} "
    assert "AVX2" in ipp


@pytest.mark.parametrize("cpuinfo", ["", "flags\t: fpu avx fma abm f16c\n", "Features\t: fp asimd\n"])
def test_processor_without_the_level_keeps_its_own_instructions(monkeypatch, tmp_path, cpuinfo):
    (tmp_path / "cpuinfo").write_text(f"processor\t: 0\n{cpuinfo}")
    monkeypatch.setattr(instructions, "_CPUINFO", tmp_path / "cpuinfo")
    assert environment() == {}
    assert exports() == ""


def test_wider_vectors_of_opencv_are_disabled_only_where_there_are_some(monkeypatch):
    monkeypatch.setattr(instructions, "_processor_flags", lambda: instructions._FLAGS)
    assert "OPENCV_CPU_DISABLE" not in environment()
    monkeypatch.setattr(instructions, "_processor_flags", lambda: instructions._FLAGS | {"avx512f"})
    assert environment()["OPENCV_CPU_DISABLE"] == "AVX512-SKX"


@pytest.mark.skipif(not instructions._CPUINFO.is_file(), reason="needs Linux")
def test_flags_of_the_processor_are_those_that_llvm_sees():
    import llvmlite.binding

    names = {"abm": "lzcnt", "bmi1": "bmi"}
    seen = llvmlite.binding.get_host_cpu_features()
    assert {flag for flag in instructions._FLAGS if seen.get(names.get(flag, flag))} == (
        instructions._FLAGS & instructions._processor_flags()
    )
