"""What kind of value each expression of a compiled function has."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Protocol

from asperity.export.known import LIBRARIES, REAL_CONSTANTS, REAL_FUNCTIONS
from asperity.export.subset import (
    BOOL,
    FLOAT,
    INT,
    SINGLE,
    Constants,
    Data,
    Group,
    Kind,
    NotExportableError,
    Number,
    Work,
    common,
)

WORDS = {
    "Raise": "raises an error",
    "Try": "catches an error",
    "With": "uses 'with'",
    "ListComp": "makes a list",
    "List": "makes a list",
    "Dict": "makes a dictionary",
    "DictComp": "makes a dictionary",
    "Set": "makes a set",
    "GeneratorExp": "makes a generator",
    "Lambda": "makes a function",
    "FunctionDef": "defines a function in a function",
    "Global": "uses a global variable",
    "Nonlocal": "uses an outer variable",
    "JoinedStr": "makes a text",
    "Slice": "takes a slice of an array",
    "Starred": "uses a star",
    "Assert": "asserts",
    "Delete": "deletes a name",
    "Import": "imports a module",
    "ImportFrom": "imports a module",
    "NamedExpr": "assigns inside an expression",
    "Match": "uses 'match'",
    "Yield": "yields",
}


class Callee(Protocol):
    """A compiled function that is called."""

    @property
    def arguments(self) -> tuple[str, ...]:
        """The names of its arguments."""

    @property
    def result(self) -> Kind:
        """The kind of what it returns."""

    @property
    def written(self) -> frozenset[str]:
        """Its arguments that are work arrays and that it writes to."""


class Callees(Protocol):
    """What a function knows of the others, and of the module that it is in."""

    numbers: Mapping[str, float]
    records: Mapping[str, tuple[str, ...]]

    def parameters(self, name: str) -> tuple[str, ...] | None:
        """Return the arguments' names of a compiled function, ``None`` if there is none."""

    def scope(self, name: str, kinds: tuple[Kind, ...]) -> Callee:
        """Return a compiled function as it is called with arguments of these kinds."""


class ExpressionKinds:
    """The kinds of a function's expressions, from those of its names.

    Args:
        node: the function.
        kinds: of its names that are known.
        callees: the other functions.
    """

    def __init__(self, node: ast.FunctionDef, kinds: dict[str, Kind], callees: Callees) -> None:
        self.node, self.kinds, self.callees = node, kinds, callees
        self._tests = set(_tests(node))

    def refuse(self, construct: str, node: ast.AST | None = None) -> NotExportableError:
        """Return the error that says what of this function C does not know."""
        text = "" if node is None else f" ({ast.unparse(node).splitlines()[0]})"
        return NotExportableError(self.node.name, construct + text)

    def kind(self, node: ast.expr) -> Kind | None:
        """Return the kind of an expression, ``None`` if it is not known yet.

        Raises:
            NotExportableError: for what C does not know.
        """
        find = _KINDS.get(type(node))
        if find is None:
            name = type(node).__name__
            raise self.refuse(WORDS.get(name, f"uses {name}"), node)
        return find(self, node)

    def sure(self, node: ast.expr) -> Kind:
        """Return the kind of an expression, once all names are known.

        Raises:
            NotExportableError: for an expression of which nothing is known.
        """
        kind = self.kind(node)
        if kind is None:
            raise self.refuse("uses a name before it has a value", node)
        return kind

    def length(self, node: ast.expr) -> int | None:
        """Return the value of an integer that is known from the kinds: literals and lengths."""
        if isinstance(node, ast.Constant) and type(node.value) is int:
            return node.value
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            value = self.length(node.operand)
            return None if value is None else -value
        if isinstance(node, ast.Attribute) and node.attr in {"size", "ndim"}:
            shape = self._shape(node.value)
            if shape is None:
                return None
            size = 1
            for one in shape:
                size *= one
            return size if node.attr == "size" else len(shape)
        if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Attribute):
            index, shape = self.length(node.slice), None
            if node.value.attr == "shape" and index is not None:
                shape = self._shape(node.value.value)
            if shape is not None and index is not None and -len(shape) <= index < len(shape):
                return shape[index]
        return None

    def _shape(self, node: ast.expr) -> tuple[int, ...] | None:
        kind = self.kind(node)
        return kind.shape if isinstance(kind, (Work, Data)) else None

    def number(self, node: ast.expr) -> Number | None:
        """Return the kind of an expression that must be a number.

        Raises:
            NotExportableError: for another one.
        """
        kind = self.kind(node)
        if kind is not None and not isinstance(kind, Number):
            raise self.refuse("calculates with what is no number", node)
        return kind

    def _name(self, node: ast.Name) -> Kind | None:
        if node.id in self.kinds:
            return self.kinds[node.id]
        if node.id in self.callees.numbers:
            return _of_value(self.callees.numbers[node.id])
        return None

    def _constant(self, node: ast.Constant) -> Kind | None:
        if isinstance(node.value, (bool, int, float)):
            return _of_value(node.value)
        raise self.refuse("uses a value that is no number", node)

    def _tuple(self, node: ast.Tuple) -> Kind | None:
        items = [self.kind(item) for item in node.elts]
        known = tuple(item for item in items if item is not None)
        if any(not isinstance(item, (Number, Group)) for item in known):
            raise self.refuse("puts an array or a record into a tuple", node)
        return Group(known) if len(known) == len(items) else None

    def _attribute(self, node: ast.Attribute) -> Kind | None:
        if isinstance(node.value, ast.Name) and node.value.id in LIBRARIES:
            if node.attr in REAL_CONSTANTS:
                return FLOAT
            raise self.refuse("uses what C does not know", node)
        if self.length(node) is not None:
            return INT
        kind = self.kind(node.value)
        if isinstance(kind, (Work, Data)) and node.attr == "shape":
            return Group((INT,) * len(kind.shape))
        fields = dict(kind.fields) if isinstance(kind, Constants) else {}
        if isinstance(kind, Group):
            fields = dict(zip(kind.names, kind.items, strict=False))
        if kind is not None and node.attr not in fields:
            raise self.refuse("uses an attribute that C does not know", node)
        return fields.get(node.attr)

    def _subscript(self, node: ast.Subscript) -> Kind | None:
        if self.length(node) is not None:
            return INT
        kind = self.kind(node.value)
        if kind is None:
            return None
        if isinstance(kind, Group):
            return self._item(node, kind)
        if not isinstance(kind, (Work, Data)):
            raise self.refuse("takes a part of what is no tuple or array", node)
        indices = indices_of(node)
        if len(indices) != len(kind.shape):
            raise self.refuse("takes a part of an array", node)
        for index in indices:
            if self.number(index) not in {INT, BOOL, None}:
                raise self.refuse("has an index that is no integer", node)
        return FLOAT if isinstance(kind, Work) else kind.element

    def _item(self, node: ast.Subscript, kind: Group) -> Kind:
        index = self.length(node.slice)
        if index is None:
            if not kind.alike:
                raise self.refuse("computes an index into a tuple of different kinds", node)
            return kind.items[0]
        if not -len(kind.items) <= index < len(kind.items):
            raise self.refuse("has an index beyond the end of a tuple", node)
        return kind.items[index]

    def _binary(self, node: ast.BinOp) -> Kind | None:
        left, right = self.number(node.left), self.number(node.right)
        if left is None or right is None:
            return None
        if left == right == SINGLE:
            raise self.refuse("calculates with two numbers of single precision: use float()", node)
        if isinstance(node.op, ast.Div):
            return FLOAT
        both = max(left, right, key=lambda number: number.rank)
        if isinstance(node.op, (ast.BitAnd, ast.BitOr, ast.BitXor)) and both in {BOOL, INT}:
            return both
        if isinstance(node.op, ast.Pow):
            return self._power(node, left)
        integral = isinstance(node.op, (ast.LShift, ast.RShift, ast.BitAnd, ast.BitOr, ast.BitXor))
        if (integral and both not in {BOOL, INT}) or isinstance(node.op, ast.MatMult):
            raise self.refuse("has an operator that its values do not know", node)
        return FLOAT if both == SINGLE else max(both, INT, key=lambda number: number.rank)

    def _power(self, node: ast.BinOp, base: Number) -> Kind:
        exponent = self.length(node.right)
        if base not in {INT, BOOL}:
            return FLOAT
        if exponent is None or exponent < 0:
            raise self.refuse("raises an integer to a power that is no literal", node)
        return INT

    def _unary(self, node: ast.UnaryOp) -> Kind | None:
        kind = self.number(node.operand)
        if isinstance(node.op, ast.Not):
            return BOOL
        if isinstance(node.op, ast.Invert) and kind not in {INT, None}:
            raise self.refuse("has an operator that its value does not know", node)
        return INT if kind == BOOL else kind

    def _compare(self, node: ast.Compare) -> Kind | None:
        if any(isinstance(op, (ast.Is, ast.IsNot, ast.In, ast.NotIn)) for op in node.ops):
            raise self.refuse("asks whether something is, or is in, something", node)
        for middle in node.comparators[:-1]:
            if not isinstance(middle, (ast.Name, ast.Constant)):
                raise self.refuse("compares on both sides with what has no name", node)
        for side in (node.left, *node.comparators):
            self.number(side)
        return BOOL

    def _logic(self, node: ast.BoolOp) -> Kind | None:
        for part in node.values:
            if self.kind(part) not in {BOOL, None} and node not in self._tests:
                raise self.refuse("uses 'and' or 'or' for other values than truth values", node)
        return BOOL

    def _choice(self, node: ast.IfExp) -> Kind | None:
        first, second = self.kind(node.body), self.kind(node.orelse)
        if first is None or second is None:
            return first or second
        both = common(first, second)
        if both is None:
            raise self.refuse("chooses between values of different kinds", node)
        return both

    def _call(self, node: ast.Call) -> Kind | None:
        name = called(node)
        if self.own(node):
            kinds = [self.kind(argument) for argument in self.ordered(node)]
            known = tuple(kind for kind in kinds if kind is not None)
            if len(known) < len(kinds):
                return None
            return self.callees.scope(name, known).result
        if node.keywords and name not in self.callees.records:
            raise self.refuse("calls a builtin with named arguments", node)
        if name in self.callees.records:
            return self._record(node, name)
        return self._builtin(node, name)

    def _record(self, node: ast.Call, name: str) -> Kind | None:
        names = self.callees.records[name]
        items = [self.kind(item) for item in self.fields(node, names)]
        known = tuple(item for item in items if item is not None)
        return Group(known, names) if len(known) == len(items) else None

    def fields(self, node: ast.Call, names: Sequence[str]) -> list[ast.expr]:
        """Return the arguments of a call in the order of these names.

        Raises:
            NotExportableError: unless each is given once.
        """
        by_name = {key.arg: key.value for key in node.keywords}
        given = dict(zip(names, node.args, strict=False)) | by_name
        stars = any(isinstance(argument, ast.Starred) for argument in node.args)
        if stars or list(given) != [n for n in names if n in given] or len(given) != len(names):
            raise self.refuse("does not give every argument in its order", node)
        return [given[name] for name in names]

    def ordered(self, node: ast.Call) -> list[ast.expr]:
        """Return the arguments of a call of a compiled function, in its order.

        Raises:
            NotExportableError: unless each is given once.
        """
        return self.fields(node, self.callees.parameters(called(node)) or ())

    def own(self, node: ast.Call) -> bool:
        """Return whether a call is one of a compiled function."""
        plain = isinstance(node.func, ast.Name)
        return plain and self.callees.parameters(called(node)) is not None

    def _builtin(self, node: ast.Call, name: str) -> Kind | None:
        if name == "local_array":
            return Work(self._work_shape(node))
        library = isinstance(node.func, ast.Attribute)
        kinds = [self.number(argument) for argument in node.args if name != "len"]
        if library and name in REAL_FUNCTIONS:
            return FLOAT
        if (
            name in {"floor", "ceil"}
            and getattr(getattr(node.func, "value", 0), "id", "") == "math"
        ):
            return INT
        fixed: dict[str, Kind] = {"int": INT, "int64": INT, "float": FLOAT, "float64": FLOAT}
        fixed |= {"bool": BOOL, "len": INT, "pow": FLOAT}
        if name in fixed or (name == "round" and len(node.args) == 1):
            return fixed.get(name, INT)
        if name in {"abs", "min", "max"} and not library:
            if any(kind is None for kind in kinds):
                return None
            top = max((kind for kind in kinds if kind), key=lambda number: number.rank)
            return {BOOL: INT, SINGLE: FLOAT}.get(top, top)
        raise self.refuse("calls what C does not know", node)

    def _work_shape(self, node: ast.Call) -> tuple[int, ...]:
        if len(node.args) == 1 and isinstance(node.args[0], ast.Tuple):
            lengths = [self.length(one) for one in node.args[0].elts]
            known = tuple(one for one in lengths if one is not None)
            if known and len(known) == len(lengths):
                return known
        raise self.refuse("makes a work array without a constant shape", node)


_KINDS: dict[type[ast.expr], Callable[[ExpressionKinds, Any], Kind | None]] = {
    ast.Name: ExpressionKinds._name,
    ast.Constant: ExpressionKinds._constant,
    ast.Tuple: ExpressionKinds._tuple,
    ast.Attribute: ExpressionKinds._attribute,
    ast.Subscript: ExpressionKinds._subscript,
    ast.BinOp: ExpressionKinds._binary,
    ast.UnaryOp: ExpressionKinds._unary,
    ast.Compare: ExpressionKinds._compare,
    ast.BoolOp: ExpressionKinds._logic,
    ast.IfExp: ExpressionKinds._choice,
    ast.Call: ExpressionKinds._call,
}


def called(node: ast.Call) -> str:
    """Return the name of what is called, without its module."""
    return node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")


def indices_of(node: ast.Subscript) -> list[ast.expr]:
    """Return the indices of an item of an array."""
    return list(node.slice.elts) if isinstance(node.slice, ast.Tuple) else [node.slice]


def _tests(function: ast.FunctionDef) -> Iterator[ast.expr]:
    """Yield the expressions of which only the truth counts."""
    for node in ast.walk(function):
        waiting = [node.test] if isinstance(node, (ast.If, ast.While, ast.IfExp)) else []
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            waiting = [node.operand]
        while waiting:
            test = waiting.pop()
            yield test
            waiting += test.values if isinstance(test, ast.BoolOp) else []


def _of_value(value: float) -> Number:
    if isinstance(value, bool):
        return BOOL
    return INT if isinstance(value, int) else FLOAT
