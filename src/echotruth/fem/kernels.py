"""The loops over material points: compiled where Numba is installed, of NumPy where it is not.

Their results are the same to the last bit. Whoever only reads has few points, and needs no Numba, which takes 200 MB.
"""

from functools import cache
from importlib.util import find_spec
from types import ModuleType


@cache
def kernels() -> ModuleType:
    """The module with the functions `interpolate`, `gradient` and `locate`; imported when it is first asked for."""
    if find_spec("numba"):
        from echotruth.fem import compiled

        return compiled
    from echotruth.fem import vectorised

    return vectorised
