"""Expressions of compiled functions as C: the same operations in the same order."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

from asperity.export.kinds import called, indices_of
from asperity.export.known import (
    HELPERS,
    LIBRARIES,
    REAL_CONSTANTS,
    Helper,
    power_helper,
    real_function,
)
from asperity.export.scope import Scope
from asperity.export.subset import (
    BOOL,
    FLOAT,
    INT,
    SINGLE,
    Constants,
    Data,
    Group,
    Kind,
    Number,
    Work,
    is_constant,
)


class Text(NamedTuple):
    """A C expression, and how tightly its outermost operator binds."""

    text: str
    rank: int


_PRIMARY, _UNARY, _PRODUCT, _SUM, _SHIFT, _ORDER, _EQUAL, _AND, _OR, _CHOICE = (
    12, 11, 10, 9, 8, 7, 6, 3, 2, 1,
)  # fmt: skip

# Sign and rank of binary operators; what binds less than a sum is put in parentheses by C's own
# compilers, so operands of bit operators are, too.
_BINARY: dict[type[ast.operator], tuple[str, int]] = {
    ast.Add: ("+", _SUM),
    ast.Sub: ("-", _SUM),
    ast.Mult: ("*", _PRODUCT),
    ast.Div: ("/", _PRODUCT),
}
_BITS: dict[type[ast.operator], str] = {
    ast.LShift: "<<",
    ast.RShift: ">>",
    ast.BitAnd: "&",
    ast.BitOr: "|",
    ast.BitXor: "^",
}
_COMPARE: dict[type[ast.cmpop], tuple[str, int]] = {
    ast.Lt: ("<", _ORDER),
    ast.LtE: ("<=", _ORDER),
    ast.Gt: (">", _ORDER),
    ast.GtE: (">=", _ORDER),
    ast.Eq: ("==", _EQUAL),
    ast.NotEq: ("!=", _EQUAL),
}


class Printing(Protocol):
    """What the printer of a function asks of the program that it is printed into.

    Attributes:
        prefix: of every name.
    """

    prefix: str

    def real(self, value: float) -> str:
        """Return a real number as a literal."""

    def library(self, name: str) -> str:
        """Return the name of a function of C's library, in the precision of the program."""

    def helper(self, helper: Helper) -> str:
        """Return the name of a small C function, which is printed with the program."""

    def function(self, name: str, kinds: tuple[Kind, ...]) -> str:
        """Return the name of a compiled function, which is printed with the program."""

    def type_of(self, kind: Kind) -> str:
        """Return the C type of a number or a tuple."""

    def make(self, kind: Group) -> str:
        """Return the name of the C function that makes a tuple."""


class Expressions:
    """The expressions of one function.

    Args:
        scope: the kinds of its names.
        program: the program.
        names: of its variables in C, by those in Python.
    """

    def __init__(self, scope: Scope, program: Printing, names: dict[str, str]) -> None:
        self.scope, self.program, self.names = scope, program, names

    def text(self, node: ast.expr, least: int = 0) -> str:
        """Return an expression, in parentheses if it binds less than it must."""
        value = self.value(node)
        return value.text if value.rank >= least else f"({value.text})"

    def value(self, node: ast.expr) -> Text:
        """Return an expression."""
        length = self.scope.length(node)
        if length is not None:
            return Text(str(length), _PRIMARY if length >= 0 else _UNARY)
        return _PRINTERS[type(node)](self, node)

    def as_kind(self, node: ast.expr, kind: Kind, least: int = 0) -> str:
        """Return an expression converted to a kind."""
        own = self.scope.sure(node)
        if own == kind or (own == BOOL and kind == INT):
            return self.text(node, least)
        if isinstance(kind, Group):
            return self._group(node, kind)
        if kind == FLOAT:
            length = self.scope.length(node)
            if length is not None:
                return self.program.real(float(length))
            cast = f"({self.program.type_of(FLOAT)}){self.text(node, _UNARY)}"
            return cast if least <= _UNARY else f"({cast})"
        if kind == BOOL and isinstance(own, Number):
            return f"{self.text(node, _EQUAL + 1)} != 0"
        raise self.scope.refuse("turns a value into another kind", node)

    def truth(self, node: ast.expr, least: int = 0) -> str:
        """Return a condition."""
        text = self.as_kind(node, BOOL)
        rank = self.value(node).rank if self.scope.kind(node) == BOOL else _EQUAL
        return text if rank >= least else f"({text})"

    # --- names and literals ----------------------------------------------------------------------

    def _name(self, node: ast.Name) -> Text:
        if node.id not in self.scope.kinds:
            value = self.scope.callees.numbers[node.id]
            return self._constant(ast.Constant(value))
        return Text(self.names[node.id], _PRIMARY)

    def _constant(self, node: ast.Constant) -> Text:
        if isinstance(node.value, float):
            text = self.program.real(node.value)
        elif isinstance(node.value, int):
            text = str(int(node.value))
        return Text(text, _UNARY if text.startswith("-") else _PRIMARY)

    def _attribute(self, node: ast.Attribute) -> Text:
        if isinstance(node.value, ast.Name) and node.value.id in LIBRARIES:
            return self._constant(ast.Constant(REAL_CONSTANTS[node.attr]))
        kind = self.scope.sure(node.value)
        if isinstance(kind, Constants):
            return Text(kind.read(node.attr), _PRIMARY)
        if isinstance(kind, (Work, Data)):
            return self._make(Group((INT,) * len(kind.shape)), [str(n) for n in kind.shape])
        assert isinstance(kind, Group)  # nothing else has attributes in compiled functions
        place = field(kind, kind.names.index(node.attr))
        return Text(f"{self.text(node.value, _PRIMARY)}{place}", _PRIMARY)

    def _tuple(self, node: ast.Tuple) -> Text:
        kind = self.scope.sure(node)
        assert isinstance(kind, Group)  # a tuple is nothing else
        return Text(self._group(node, kind), _PRIMARY)

    def _group(self, node: ast.expr, kind: Group) -> str:
        """Return a tuple whose items are converted to the kinds of another."""
        if not isinstance(node, ast.Tuple):
            raise self.scope.refuse("uses a tuple where one with other kinds of items is", node)
        pairs = zip(node.elts, kind.items, strict=True)
        return self._make(kind, [self.as_kind(item, one) for item, one in pairs]).text

    def _make(self, kind: Group, items: list[str]) -> Text:
        return Text(f"{self.program.make(kind)}({', '.join(items)})", _PRIMARY)

    def _subscript(self, node: ast.Subscript) -> Text:
        kind = self.scope.sure(node.value)
        if isinstance(kind, Group):
            index = self.scope.length(node.slice)
            base = self.text(node.value, _PRIMARY)
            if index is None:
                return Text(f"{base}.v[{self.text(node.slice)}]", _PRIMARY)
            return Text(f"{base}{field(kind, index % len(kind.items))}", _PRIMARY)
        assert isinstance(kind, (Work, Data))  # the scope let nothing else through
        parts = []
        for index_node, length in zip(indices_of(node), kind.shape, strict=True):
            fixed = self.scope.length(index_node)
            parts.append(self.text(index_node) if fixed is None else str(fixed % max(length, 1)))
        place = kind.place if isinstance(kind, Data) else self.text(node.value, _PRIMARY)
        return Text(place + "".join(f"[{part}]" for part in parts), _PRIMARY)

    # --- operators -------------------------------------------------------------------------------

    def _binary(self, node: ast.BinOp) -> Text:
        kind = self.scope.sure(node)
        if isinstance(node.op, ast.Pow):
            return self._power(node, kind)
        if type(node.op) in _BITS:
            # A literal alone would be calculated in 32 bits.
            left = self.text(node.left, _UNARY)
            if self.scope.length(node.left) is not None:
                left = f"(int64_t){left}"
            return Text(
                f"{left} {_BITS[type(node.op)]} {self.text(node.right, _UNARY)}", _SHIFT - 4
            )
        if type(node.op) not in _BINARY:
            return self._divided(node, kind)
        sign, rank = _BINARY[type(node.op)]
        left, right = self.as_kind(node.left, kind, rank), self.as_kind(node.right, kind, rank + 1)
        return Text(f"{left} {sign} {right}", rank)

    def _divided(self, node: ast.BinOp, kind: Kind) -> Text:
        name = "quotient" if isinstance(node.op, ast.FloorDiv) else "rest"
        helper = HELPERS[name if kind == FLOAT else f"{name}_int"]
        return self._helped(helper, [node.left, node.right], kind)

    def _power(self, node: ast.BinOp, kind: Kind) -> Text:
        exponent = self.scope.length(node.right)
        if exponent is not None and isinstance(kind, Number):
            return self._helped(power_helper(exponent, kind), [node.left], kind)
        if self.scope.sure(node.right) == INT:
            name = self.program.helper(HELPERS["power"])
            base = self.as_kind(node.left, FLOAT)
            return Text(f"{name}({base}, {self.text(node.right)})", _PRIMARY)
        return self._library("pow", [node.left, node.right])

    def _unary(self, node: ast.UnaryOp) -> Text:
        if isinstance(node.op, ast.Not):
            return Text(f"!{self._negatable(node.operand)}", _UNARY)
        sign = {ast.USub: "-", ast.UAdd: "", ast.Invert: "~"}[type(node.op)]
        text = self.text(node.operand, _UNARY)
        # Two minus signs would be one of C's operators.
        return Text(f"{sign}({text})" if text.startswith("-") else f"{sign}{text}", _UNARY)

    def _negatable(self, node: ast.expr) -> str:
        return self.truth(node, _UNARY)

    def _compare(self, node: ast.Compare) -> Text:
        sides = [node.left, *node.comparators]
        parts = []
        for left, op, right in zip(sides[:-1], node.ops, sides[1:], strict=True):
            first, second = self.scope.number(left), self.scope.number(right)
            real = FLOAT in {first, second} or SINGLE in {first, second}
            kind = FLOAT if real else INT
            sign, rank = _COMPARE[type(op)]
            parts.append(
                f"{self.as_kind(left, kind, _SHIFT)} {sign} {self.as_kind(right, kind, _SHIFT)}"
            )
        return Text(" && ".join(parts), rank if len(parts) == 1 else _AND)

    def _logic(self, node: ast.BoolOp) -> Text:
        sign, rank = ("&&", _AND) if isinstance(node.op, ast.And) else ("||", _OR)
        # Compilers ask for parentheses where one of them stands in the other.
        parts = [self.truth(part, rank if sign == "&&" else _AND + 1) for part in node.values]
        return Text(f" {sign} ".join(parts), rank)

    def _choice(self, node: ast.IfExp) -> Text:
        kind = self.scope.sure(node)
        first, second = (self.as_kind(one, kind, _OR) for one in (node.body, node.orelse))
        return Text(f"{self.truth(node.test, _OR)} ? {first} : {second}", _CHOICE)

    # --- calls -----------------------------------------------------------------------------------

    def _call(self, node: ast.Call) -> Text:
        name = called(node)
        if self.scope.own(node):
            return self._own(node, name)
        if name in self.scope.callees.records:
            kind = self.scope.sure(node)
            assert isinstance(kind, Group)  # a record is one
            pairs = zip(self.scope.fields(node, kind.names), kind.items, strict=True)
            return self._make(kind, [self.as_kind(item, one) for item, one in pairs])
        printer = _BUILTINS.get(name)
        return printer(self, node) if printer else self._library(real_function(name), node.args)

    def _own(self, node: ast.Call, name: str) -> Text:
        arguments = self.scope.ordered(node)
        kinds = tuple(self.scope.sure(argument) for argument in arguments)
        callee = self.program.function(name, kinds)
        given = [
            self.text(argument)
            for argument, kind in zip(arguments, kinds, strict=True)
            if not is_constant(kind)
        ]
        return Text(f"{callee}({', '.join(given)})", _PRIMARY)

    def _folded(self, node: ast.Call) -> Text:
        name, kind = called(node), self.scope.sure(node)
        helper = self.program.helper(HELPERS[name if kind == FLOAT else f"{name}_int"])
        text = self.as_kind(node.args[0], kind)
        for argument in node.args[1:]:
            text = f"{helper}({text}, {self.as_kind(argument, kind)})"
        return Text(text, _PRIMARY)

    def _size(self, node: ast.Call) -> Text:
        if self.scope.sure(node) == FLOAT:
            return self._library("fabs", node.args)
        return self._helped(HELPERS["abs_int"], node.args, INT)

    def _rounded(self, node: ast.Call) -> Text:
        if self.scope.number(node.args[0]) in {INT, BOOL}:
            return self.value(node.args[0])
        return self._helped(HELPERS[called(node)], node.args, FLOAT)

    def _whole(self, node: ast.Call) -> Text:
        if self.scope.number(node.args[0]) in {INT, BOOL}:
            return self.value(node.args[0])
        return Text(f"(int64_t){self.text(node.args[0], _UNARY)}", _UNARY)

    def _as_real(self, node: ast.Call) -> Text:
        return Text(self.as_kind(node.args[0], FLOAT, _UNARY), _UNARY)

    def _as_truth(self, node: ast.Call) -> Text:
        return Text(self.truth(node.args[0], _PRIMARY), _PRIMARY)

    def _helped(self, helper: Helper, arguments: list[ast.expr], kind: Kind) -> Text:
        given = ", ".join(self.as_kind(argument, kind) for argument in arguments)
        return Text(f"{self.program.helper(helper)}({given})", _PRIMARY)

    def _library(self, name: str, arguments: list[ast.expr]) -> Text:
        given = ", ".join(self.as_kind(argument, FLOAT) for argument in arguments)
        return Text(f"{self.program.library(name)}({given})", _PRIMARY)


_PRINTERS: dict[type[ast.expr], Callable[[Expressions, Any], Text]] = {
    ast.Name: Expressions._name,
    ast.Constant: Expressions._constant,
    ast.Tuple: Expressions._tuple,
    ast.Attribute: Expressions._attribute,
    ast.Subscript: Expressions._subscript,
    ast.BinOp: Expressions._binary,
    ast.UnaryOp: Expressions._unary,
    ast.Compare: Expressions._compare,
    ast.BoolOp: Expressions._logic,
    ast.IfExp: Expressions._choice,
    ast.Call: Expressions._call,
}


_BUILTINS: dict[str, Callable[[Expressions, ast.Call], Text]] = {
    "abs": Expressions._size,
    "bool": Expressions._as_truth,
    "ceil": Expressions._rounded,
    "float": Expressions._as_real,
    "float64": Expressions._as_real,
    "floor": Expressions._rounded,
    "int": Expressions._whole,
    "int64": Expressions._whole,
    "max": Expressions._folded,
    "min": Expressions._folded,
    "round": Expressions._rounded,
}


def field(kind: Group, index: int) -> str:
    """Return how C reads an item of a tuple.

    Example:
        >>> field(Group((FLOAT, FLOAT)), 1), field(Group((FLOAT, INT)), 1)
        ('.v[1]', '.f1')
    """
    return f".v[{index}]" if kind.alike else f".f{index}"


def real_literal(value: float, single: bool) -> str:
    """Return a real number as a literal of C.

    In single precision what is too small for it becomes the least normal number, so that nothing
    is divided by zero that was guarded by a tiny number.

    Example:
        >>> real_literal(0.1, False), real_literal(2 / 3, True), real_literal(1e-300, True)
        ('0.1', '0.6666667f', '1.1754944e-38f')
    """
    import numpy as np

    if math.isnan(value):
        return "NAN"
    if single and 0.0 < abs(value) < float(np.finfo(np.float32).tiny):
        value = math.copysign(float(np.finfo(np.float32).tiny), value)
    if math.isinf(value) or (single and abs(value) > float(np.finfo(np.float32).max)):
        sign, size = "-" if value < 0 else "", "INFINITY" if single else "HUGE_VAL"
        return f"{sign}{size}"
    return f"{np.float32(value)!s}f" if single else repr(float(value))
