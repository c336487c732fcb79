"""Conditions that leave out cases: comparisons of dotted keys, as Python writes them, and nothing else of Python."""

import ast
import operator
from collections.abc import Callable
from typing import Any

from echotruth.config.limits import MAX_CONDITION

Lookup = Callable[[str], Any]
"""Dotted key -> its value in a case."""
Evaluation = Callable[[Lookup], Any]
"""Value of an expression in a case."""

_ARITHMETIC: dict[type, Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Mod: operator.mod,
    ast.Pow: operator.pow,
}
_ORDER: dict[type, Callable[[Any, Any], bool]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}
_CONSTANTS = {"true": True, "false": False, "null": None}
WHOLE = "write comparisons of keys and numbers, joined by and, or and not"


class ConditionError(ValueError):
    """Raised if a condition cannot be read or has no value; the message says what would be right."""


class Condition:
    """A condition on the values of dotted keys.

    It knows numbers, text, lists, `true`, `false`, `null`, comparisons, `in`, `and`, `or`, `not`, + - * / % and **.

    Parameters
    ----------
    text : str

    Attributes
    ----------
    text : str
    keys : set of str
        Dotted keys in it.

    Raises
    ------
    ConditionError
        If it has anything else.
    """

    def __init__(self, text: str) -> None:
        self.text = text
        if len(text) > MAX_CONDITION:
            raise ConditionError(f"has {len(text)} characters: write at most {MAX_CONDITION}, or several conditions")
        try:
            tree = ast.parse(text.strip(), mode="eval").body
            compiler = _Compiler()
            self._holds: Evaluation = compiler.visit(tree)
            self.keys = compiler.keys
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            if isinstance(error, ConditionError):
                raise
            raise ConditionError(f"cannot be read: {WHOLE}, such as loop.edv_uL > 40 and seed < 3") from None

    def holds(self, lookup: Lookup) -> bool:
        """Whether a case meets the condition.

        Parameters
        ----------
        lookup : callable
            From a dotted key to its value in the case.

        Raises
        ------
        ConditionError
            If what is compared cannot be, or the result is neither true nor false.
        """
        try:
            found = self._holds(lookup)
        except (ZeroDivisionError, OverflowError):
            raise ConditionError("divides by zero or exceeds all numbers") from None
        except RecursionError:
            raise ConditionError("is nested too deeply: write several conditions") from None
        if not isinstance(found, bool):
            raise ConditionError(f"is {found!r:.80} and neither true nor false: compare it with a value")
        return found


class _Compiler(ast.NodeVisitor):
    """Turns a syntax tree into an evaluation, if it has nothing that a condition may not contain."""

    def __init__(self) -> None:
        self.keys: set[str] = set()

    def generic_visit(self, node: ast.AST) -> Evaluation:
        raise ConditionError(f"has {_name(node)}: {WHOLE}")

    def visit_Constant(self, node: ast.Constant) -> Evaluation:
        value = node.value
        if value is not None and not isinstance(value, bool | int | float | str):
            raise ConditionError(f"has {value!r:.40}: {WHOLE}")
        return lambda lookup: value

    def visit_Name(self, node: ast.Name | ast.Attribute) -> Evaluation:
        key = _dotted(node)
        if key in _CONSTANTS:
            constant = _CONSTANTS[key]
            return lambda lookup: constant
        self.keys.add(key)
        return lambda lookup: lookup(key)

    visit_Attribute = visit_Name

    def visit_List(self, node: ast.List | ast.Tuple) -> Evaluation:
        items = [self.visit(item) for item in node.elts]
        return lambda lookup: [item(lookup) for item in items]

    visit_Tuple = visit_List

    def visit_UnaryOp(self, node: ast.UnaryOp) -> Evaluation:
        operand = self.visit(node.operand)
        if isinstance(node.op, ast.Not):
            return lambda lookup: not _truth(operand(lookup))
        if isinstance(node.op, ast.Invert):
            raise ConditionError(f"has ~: {WHOLE}")
        sign = -1 if isinstance(node.op, ast.USub) else 1
        return lambda lookup: sign * _number(operand(lookup))

    def visit_BinOp(self, node: ast.BinOp) -> Evaluation:
        operation = _ARITHMETIC.get(type(node.op))
        if operation is None:
            raise ConditionError(f"has {_name(node.op)}: {WHOLE}")
        left, right = self.visit(node.left), self.visit(node.right)
        return lambda lookup: _real(operation(_number(left(lookup)), _number(right(lookup))))

    def visit_BoolOp(self, node: ast.BoolOp) -> Evaluation:
        parts, joined = [self.visit(value) for value in node.values], all if isinstance(node.op, ast.And) else any
        return lambda lookup: joined(_truth(part(lookup)) for part in parts)

    def visit_Compare(self, node: ast.Compare) -> Evaluation:
        values = [self.visit(value) for value in (node.left, *node.comparators)]
        tests = [_test(kind) for kind in node.ops]
        steps = list(zip(tests, values, values[1:], strict=False))
        return lambda lookup: all(test(left(lookup), right(lookup)) for test, left, right in steps)


def _dotted(node: ast.AST) -> str:
    """The dotted key that Python would read as a name and its attributes."""
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute):
        return f"{_dotted(node.value)}.{node.attr}"
    raise ConditionError(f"has a dot after {_name(node)}: dots only join the parts of keys, such as loop.edv_uL")


def _test(kind: ast.cmpop) -> Callable[[Any, Any], bool]:
    match kind:
        case ast.Eq() | ast.Is():
            return _equal
        case ast.NotEq() | ast.IsNot():
            return lambda left, right: not _equal(left, right)
        case ast.In():
            return _contains
        case ast.NotIn():
            return lambda left, right: not _contains(left, right)
        case _:
            compare = _ORDER[type(kind)]
            return lambda left, right: compare(_number(left), _number(right))


def _equal(left: Any, right: Any) -> bool:
    """Whether two values are the same; true is not 1."""
    return isinstance(left, bool) == isinstance(right, bool) and bool(left == right)


def _contains(item: Any, items: Any) -> bool:
    if not isinstance(items, list):
        raise ConditionError(f"looks for a value in {items!r:.80}, which is not a list: write a list, such as [1, 2]")
    return any(_equal(item, other) for other in items)


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        shown = "null, a key without a value" if value is None else f"{value!r:.80}"
        raise ConditionError(f"needs a number in place of {shown}")
    return float(value)  # of which no power is too long to compute


def _real(value: Any) -> float:
    """The result of arithmetic, of which a root of a negative number is none."""
    if isinstance(value, complex):
        raise ConditionError("takes a root of a negative number")
    return value


def _truth(value: Any) -> bool:
    if not isinstance(value, bool):
        raise ConditionError(f"joins {value!r:.80}, which is neither true nor false: compare it with a value")
    return value


def _name(node: ast.AST) -> str:
    names = {ast.Call: "a call of a function", ast.Subscript: "square brackets after a value", ast.Lambda: "lambda"}
    return names.get(type(node), f"what is not allowed ({type(node).__name__})")
