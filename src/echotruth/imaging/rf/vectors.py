"""Vectors of single-precision numbers in LLVM's language, for what no compiler would make of a loop."""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.core.cgutils import get_or_insert_function
from numba.extending import intrinsic

LANES = 8
"""Numbers in a vector."""
VECTOR = ir.VectorType(ir.FloatType(), LANES)


class Vectors:
    """What a builder is told, in terms of vectors and of numba's arrays."""

    def __init__(self, context, builder):
        self._context, self._builder = context, builder

    def address(self, kind, array, index):
        """Address of LANES neighbours in an array of one dimension, as a vector."""
        data = self._context.make_array(kind)(self._context, self._builder, array).data
        return self._builder.bitcast(self._builder.gep(data, [index]), VECTOR.as_pointer())

    def load(self, address, place=0):
        return self._builder.load(self._builder.gep(address, [_number(64, place)]), align=4)

    def store(self, value, address, place=0):
        self._builder.store(value, self._builder.gep(address, [_number(64, place)]), align=4)

    def place(self, kind, array, row, column):
        """Address of an element of a matrix."""
        found = self._context.make_array(kind)(self._context, self._builder, array)
        width = self._builder.extract_value(found.shape, 1)
        row = ir.Constant(width.type, row) if isinstance(row, int) else row
        return self._builder.gep(found.data, [self._builder.add(self._builder.mul(width, row), column)])

    def lanes(self, kind, array, row, column):
        """Address of LANES neighbours in a row of a matrix, as a vector."""
        place = self.place(kind, array, row, column)
        return self._builder.bitcast(place, ir.VectorType(place.type.pointee, LANES).as_pointer())

    def filled(self, scalar):
        """A vector of LANES times a scalar of any type."""
        nothing = ir.Constant(ir.VectorType(scalar.type, LANES), ir.Undefined)
        one = self._builder.insert_element(nothing, scalar, _number(32, 0))
        return self._builder.shuffle_vector(
            one, nothing, ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
        )

    def fused(self, a, b, c):
        """a b + c, rounded once: what comes out must not hang on how a compiler joins sums and products."""
        function = ir.FunctionType(VECTOR, [VECTOR] * 3)
        fused = get_or_insert_function(self._builder.module, function, f"llvm.fma.v{LANES}f32")
        return self._builder.call(fused, [a, b, c])

    def polynomial(self, address, first, count, variable):
        """Value of a polynomial whose coefficients, the highest power first, are vectors from the `first`-th on."""
        value = self.load(address, first)
        for power in range(1, count):
            value = self.fused(value, variable, self.load(address, first + power))
        return value


def _number(bits, value):
    return ir.Constant(ir.IntType(bits), value)


@intrinsic
def fused(typing_context, a, b, c):
    """a b + c of float32, rounded once."""

    def generate(context, builder, signature, arguments):
        kind = ir.FloatType()
        function = ir.FunctionType(kind, [kind] * 3)
        return builder.call(get_or_insert_function(builder.module, function, "llvm.fma.f32"), arguments)

    return types.float32(types.float32, types.float32, types.float32), generate
