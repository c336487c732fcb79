"""Passive laws of the wall, one module each.

A module here is a law if it has two names. `Law` is its section of the configuration, a `Material`
with a key `law` that is the name of the module. `energy(e, constants, stress, tangent)` is a plain
function that Numba can compile: given the isochoric Green-Lagrange strain e, shape (6,), in the
order ff, ss, nn, fs, fn, sn (tensor components), and the numbers of `Law.constants`, it returns
W / C, and fills `stress`, dW/dE / C of shape (6,), and `tangent`, d2W/dE2 / C of shape (6, 6), which turns a
strain with doubled shear into a stress. To add a law, add such a file and nothing else
(and for the tests its energy in validation/energies.py).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING

from echotruth.materials.material import Material
from echotruth.section import tagged

DEFAULT = "fung"
"""Name of the default law."""


_NAMES = sorted(module.name for module in iter_modules(__path__) if module.name != "material")
LAWS = {name: import_module(f"{__name__}.{name}") for name in _NAMES}
"""Name to module of each law."""


if TYPE_CHECKING:

    class AnyLaw(Material):
        law: str

else:
    AnyLaw = tagged("law", DEFAULT, {name: module.Law for name, module in LAWS.items()})
"""Section of the configuration of any law."""


@cache
def compiled(name: str) -> Callable:
    """The energy of a law as a function for compiled code.

    Parameters
    ----------
    name : str

    Returns
    -------
    numba CFunc
        Its type is the same for all laws, so that the element is compiled once.
    """
    from numba import cfunc, float64

    signature = float64(float64[::1], float64[::1], float64[::1], float64[:, ::1])
    return cfunc(signature, cache=True, error_model="numpy")(LAWS[name].energy)


__all__ = ["DEFAULT", "LAWS", "AnyLaw", "Material", "compiled"]
