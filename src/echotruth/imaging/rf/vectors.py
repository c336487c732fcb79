"""LLVM code for vectors of single-precision numbers, where a compiler would not vectorise the loop by itself."""

from llvmlite import ir
from numba import types
from numba.core.cgutils import get_or_insert_function
from numba.extending import intrinsic

LANES = 8
"""Numbers in a vector, if nothing else is said."""


class Vectors:
    """Instructions of a builder on vectors of some lanes and on numba's arrays.

    Where the processor has no vectors so long, the compiler takes several; the numbers are the same.
    """

    def __init__(self, context, builder, lanes=LANES):
        self._context, self._builder, self.kind = context, builder, ir.VectorType(ir.FloatType(), lanes)

    def address(self, kind, array, index):
        """Address of neighbours in an array of one dimension, as a vector."""
        data = self._context.make_array(kind)(self._context, self._builder, array).data
        return self._builder.bitcast(self._builder.gep(data, [index]), self.kind.as_pointer())

    def load(self, address, offset=0):
        """The vector that lies so many vectors after an address."""
        return self._builder.load(self._builder.gep(address, [_integer(64, offset)]), align=4)

    def store(self, value, address, offset=0):
        """Store a vector so many vectors after an address."""
        self._builder.store(value, self._builder.gep(address, [_integer(64, offset)]), align=4)

    def element_address(self, kind, array, row, column):
        """Address of an element of a matrix."""
        matrix = self._context.make_array(kind)(self._context, self._builder, array)
        width = self._builder.extract_value(matrix.shape, 1)
        row = ir.Constant(width.type, row) if isinstance(row, int) else row
        return self._builder.gep(matrix.data, [self._builder.add(self._builder.mul(width, row), column)])

    def row_address(self, kind, array, row, column):
        """Address of neighbours in a row of a matrix, as a vector."""
        address = self.element_address(kind, array, row, column)
        return self._builder.bitcast(address, ir.VectorType(address.type.pointee, self.kind.count).as_pointer())

    def broadcast(self, scalar):
        """A vector of a scalar of any type, repeated."""
        undefined = ir.Constant(ir.VectorType(scalar.type, self.kind.count), ir.Undefined)
        one = self._builder.insert_element(undefined, scalar, _integer(32, 0))
        return self._builder.shuffle_vector(
            one, undefined, ir.Constant(ir.VectorType(ir.IntType(32), self.kind.count), [0] * self.kind.count)
        )

    def fma(self, a, b, c):
        """a b + c, rounded once: the result must not depend on how a compiler joins sums and products."""
        function = ir.FunctionType(self.kind, [self.kind] * 3)
        fma = get_or_insert_function(self._builder.module, function, f"llvm.fma.v{self.kind.count}f32")
        return self._builder.call(fma, [a, b, c])

    def polynomial(self, address, first, count, variable):
        """Value of a polynomial whose coefficients, the highest power first, are vectors from the `first`-th on."""
        value = self.load(address, first)
        for power in range(1, count):
            value = self.fma(value, variable, self.load(address, first + power))
        return value


def _integer(bits, value):
    return ir.Constant(ir.IntType(bits), value)


@intrinsic
def fma(typing_context, a, b, c):
    """a b + c of float32, rounded once."""

    def generate(context, builder, signature, arguments):
        kind = ir.FloatType()
        function = ir.FunctionType(kind, [kind] * 3)
        return builder.call(get_or_insert_function(builder.module, function, "llvm.fma.f32"), arguments)

    return types.float32(types.float32, types.float32, types.float32), generate
