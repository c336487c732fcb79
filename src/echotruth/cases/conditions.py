"""Conditions that leave out cases: comparisons of dotted keys, as Python writes them, and nothing else of Python."""

import ast
from collections.abc import Callable
from typing import Any

from echotruth.config.loading import ConfigError

MAX_CONDITION = 1000
"""Longest condition, characters."""

_ALLOWED = (
    *(ast.BoolOp, ast.boolop, ast.Not, ast.USub, ast.UAdd, ast.Add, ast.Sub, ast.Mult, ast.Div, ast.Mod, ast.Pow),
    *(ast.Compare, ast.cmpop, ast.UnaryOp, ast.List, ast.Tuple, ast.Load),
)
_CONSTANTS = {"true": True, "false": False, "null": None}
WHOLE = "write comparisons of keys and numbers, joined by and, or and not"


class Condition:
    """A condition on the values of dotted keys.

    It knows numbers, text, lists, `true`, `false`, `null`, comparisons, `in`, `and`, `or`, `not`, + - * / % and **.

    Parameters
    ----------
    text : str
    source : str
        What errors name.

    Attributes
    ----------
    place : str
        What errors begin with.
    keys : set of str
        Dotted keys in it.

    Raises
    ------
    ConfigError
        If it has anything else.
    """

    def __init__(self, text: str, source: str) -> None:
        self.place = f"{source}: cases.where = {text[:80]!r}"
        if len(text) > MAX_CONDITION:
            remedy = f"write at most {MAX_CONDITION}, or several conditions"
            raise ConfigError(f"{self.place}: has {len(text)} characters: {remedy}")
        checked = _Checked()
        try:
            tree = ast.Expression(checked.visit(ast.parse(text.strip(), mode="eval").body))
            self._code = compile(ast.fix_missing_locations(tree), "condition", "eval")
        except _NotAllowed as error:
            raise ConfigError(f"{self.place}: has {error}: {WHOLE}") from None
        except (SyntaxError, RecursionError, MemoryError, ValueError):
            example = "such as loop.edv_uL > 40 and seed < 3"
            raise ConfigError(f"{self.place}: cannot be read: {WHOLE}, {example}") from None
        self.keys = checked.keys

    def holds(self, lookup: Callable[[str], Any], case: object) -> bool:
        """Whether a case meets the condition.

        Parameters
        ----------
        lookup : callable
            From a dotted key to its value in the case.
        case : object
            What errors call it.

        Raises
        ------
        ConfigError
            If what is compared cannot be, or the result is neither true nor false.
        """
        values = {key: lookup(key) for key in self.keys}
        try:
            found = eval(self._code, {"__builtins__": {}}, values)  # it has what _Checked allows
        except (ZeroDivisionError, OverflowError):
            raise ConfigError(f"{self.place}: in {case}: divides by zero or exceeds all numbers") from None
        except TypeError:
            given = ", ".join(f"{key} = {'null' if value is None else repr(value)}" for key, value in values.items())
            raise ConfigError(f"{self.place}: in {case}: needs numbers to compute or compare: {given:.200}") from None
        if not isinstance(found, bool):
            wrong = f"is {found!r:.80} and neither true nor false: compare it with a value"
            raise ConfigError(f"{self.place}: in {case}: {wrong}")
        return found


class _NotAllowed(Exception):
    """Raised for what a condition may not contain, which the message names."""


class _Checked(ast.NodeTransformer):
    """Makes one name of each dotted key, and refuses what a condition may not contain."""

    def __init__(self) -> None:
        self.keys: set[str] = set()

    def generic_visit(self, node: ast.AST) -> ast.AST:
        if not isinstance(node, _ALLOWED):
            names = {ast.Call: "a call of a function", ast.Subscript: "square brackets after a value"}
            raise _NotAllowed(names.get(type(node), f"what is not allowed ({type(node).__name__})"))
        return super().generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        if node.value is not None and not isinstance(node.value, bool | int | float | str):
            raise _NotAllowed(f"{node.value!r:.40}")
        return node

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        # As a fraction, of which no power takes long; text and lists have none.
        left = ast.BinOp(self.visit(node.left), ast.Mult(), ast.Constant(1.0))
        return ast.BinOp(left, self.visit(node.op), self.visit(node.right))

    def visit_Is(self, node: ast.Is) -> ast.AST:
        return ast.Eq()  # equal numbers need not be the same object

    def visit_IsNot(self, node: ast.IsNot) -> ast.AST:
        return ast.NotEq()

    def visit_Name(self, node: ast.expr) -> ast.AST:
        key = ast.unparse(node)
        if key in _CONSTANTS:
            return ast.Constant(_CONSTANTS[key])
        if not all(part.isidentifier() for part in key.split(".")):
            raise _NotAllowed("a dot after a value, where dots only join the parts of keys")
        self.keys.add(key)
        return ast.Name(key, ast.Load())

    visit_Attribute = visit_Name
