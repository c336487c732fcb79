"""One set of processor instructions for all jobs, so that machines of several kinds give the same bytes.

OpenBLAS, NumPy and OpenCV choose their code by the processor. With other vectors, sums are taken in another order, and
the last bits of a result change. The jobs of the workflow therefore use the instructions of x86-64-v3, AVX2 and FMA (a
level of the System V ABI, AMD64 supplement), and no others. MKL is set in :mod:`echotruth.fem.sparse`; it has that
branch on Intel's processors only. docs/determinism.md says what was measured.
"""

from pathlib import Path
from shlex import quote

LEVEL = "x86-64-v3"

_FLAGS = {"abm", "avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "movbe"}
"""Flags of the level by their names in Linux; older levels are implied."""

_CPUINFO = Path("/proc/cpuinfo")


def environment() -> dict[str, str]:
    """Environment variables with which libraries use the instructions of `LEVEL`.

    They must be set before the libraries are loaded, on the machine that runs the job.

    Returns
    -------
    dict
        Name -> value; empty if the processor lacks these instructions.
    """
    flags = _processor_flags()
    if not flags >= _FLAGS:
        return {}
    variables = {
        # Numba's bytes do not depend on it, but the keys of its cache do: one serves all machines.
        "NUMBA_CPU_NAME": LEVEL,
        "NUMBA_CPU_FEATURES": "",
        "NUMBA_DISABLE_INTEL_SVML": "1",
        "OPENBLAS_CORETYPE": "Haswell",
        "NPY_DISABLE_CPU_FEATURES": " ".join(_numpy_features_beyond()),
        "OPENCV_IPP": "avx2",
    }
    # OpenCV prints a warning about features that the processor does not have.
    return variables | ({"OPENCV_CPU_DISABLE": "AVX512-SKX"} if "avx512f" in flags else {})


def exports() -> str:
    """Shell command that exports :func:`environment`; empty if there is nothing to set."""
    variables = environment()
    return f"export {' '.join(f'{name}={quote(value)}' for name, value in variables.items())}; " if variables else ""


def _processor_flags() -> set[str]:
    """Flags of the processor; of Linux and not of LLVM, which takes 40 MB of every process that plans a sweep."""
    if not _CPUINFO.is_file():
        return set()
    lines = _CPUINFO.read_text().splitlines()
    return set(next((line.partition(":")[2] for line in lines if line.startswith("flags")), "").split())


def _numpy_features_beyond() -> list[str]:
    """NumPy's names of the instructions beyond the level for which it has code."""
    from numpy._core._multiarray_umath import __cpu_dispatch__

    return [name for name in __cpu_dispatch__ if name.startswith("AVX512") or name == "X86_V4"]
