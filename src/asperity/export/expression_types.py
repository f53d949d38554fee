"""Types of the expressions of a compiled function."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Protocol

from asperity.export import c_language as c
from asperity.export.c_language import NotExportableError, ValueType


class ProgramContext(Protocol):
    """Interface of a program for the conversion of its functions.

    Attributes:
        prefix: prefix of all names.
        numbers: numbers of the modules, by name.
        records: field names of the records, by name.
    """

    prefix: str
    numbers: Mapping[str, float]
    records: Mapping[str, tuple[str, ...]]

    def parameter_names(self, name: str) -> tuple[str, ...] | None:
        """Return the argument names of a compiled function, ``None`` if there is none."""

    def infer_types(self, name: str, argument_types: tuple[ValueType, ...]) -> ExpressionTypes:
        """Return the types of a compiled function for given argument types."""

    def real_text(self, value: float) -> str:
        """Return a real number as a C literal."""

    def library_name(self, name: str) -> str:
        """Return the name of a C library function in the precision of the program."""

    def helper_name(self, helper: c.HelperFunction) -> str:
        """Return the name of a helper function, which is added to the program."""

    def function_name(self, name: str, argument_types: tuple[ValueType, ...]) -> str:
        """Return the name of a compiled function, which is added to the program."""

    def c_type(self, value_type: ValueType) -> str:
        """Return the C type of a number or a tuple."""

    def constructor_name(self, value_type: c.TupleType) -> str:
        """Return the name of the constructor of a tuple."""


class ExpressionTypes:
    """Types of the expressions of a function, derived from those of its variables.

    Args:
        node: the function.
        types: types of its variables, as far as they are known.
        program: the program, which types the other functions.

    Attributes:
        argument_names: names of the arguments.
        result_type: type of the result.
        written_arguments: arguments that are work arrays and that the function writes to.
    """

    argument_names: tuple[str, ...]
    result_type: ValueType
    written_arguments: frozenset[str]

    def __init__(
        self, node: ast.FunctionDef, types: dict[str, ValueType], program: ProgramContext
    ) -> None:
        self.node, self.types, self.program = node, types, program
        self._conditions = set(_iterate_conditions(node))

    def not_exportable(self, construct: str, node: ast.AST | None = None) -> NotExportableError:
        """Return the error for a construct of this function that cannot be exported."""
        text = "" if node is None else f" ({ast.unparse(node).splitlines()[0]})"
        return NotExportableError(self.node.name, construct + text)

    def infer(self, node: ast.expr) -> ValueType | None:
        """Return the type of an expression, ``None`` if it is not known yet.

        Raises:
            NotExportableError: for a construct that cannot be exported.
        """
        find = _INFERENCE_RULES.get(type(node))
        if find is None:
            raise self.not_exportable(f"uses {type(node).__name__}", node)
        return find(self, node)

    def require_type(self, node: ast.expr) -> ValueType:
        """Return the type of an expression after the type inference.

        Raises:
            NotExportableError: for an expression of unknown type.
        """
        kind = self.infer(node)
        if kind is None:
            raise self.not_exportable("uses a name before it has a value", node)
        return kind

    def constant_integer(self, node: ast.expr) -> int | None:
        """Return the value of an integer literal or of a length of an array, else ``None``."""
        if isinstance(node, ast.Constant) and type(node.value) is int:
            return node.value
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            value = self.constant_integer(node.operand)
            return None if value is None else -value
        if isinstance(node, ast.Attribute) and node.attr in {"size", "ndim"}:
            shape = self._shape_of(node.value)
            if shape is None:
                return None
            return math.prod(shape) if node.attr == "size" else len(shape)
        if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Attribute):
            index, shape = self.constant_integer(node.slice), None
            if node.value.attr == "shape" and index is not None:
                shape = self._shape_of(node.value.value)
            if shape is not None and index is not None and -len(shape) <= index < len(shape):
                return shape[index]
        return None

    def _shape_of(self, node: ast.expr) -> tuple[int, ...] | None:
        kind = self.infer(node)
        return kind.shape if isinstance(kind, (c.WorkArray, c.ConstantArray)) else None

    def infer_scalar(self, node: ast.expr) -> c.ScalarType | None:
        """Return the type of an expression that must be a number.

        Raises:
            NotExportableError: for another type.
        """
        kind = self.infer(node)
        if kind is not None and not isinstance(kind, c.ScalarType):
            raise self.not_exportable("computes with a value that is not a number", node)
        return kind

    def _name(self, node: ast.Name) -> ValueType | None:
        if node.id in self.types:
            return self.types[node.id]
        if node.id in self.program.numbers:
            return _type_of_value(self.program.numbers[node.id])
        return None

    def _constant(self, node: ast.Constant) -> ValueType | None:
        if isinstance(node.value, (bool, int, float)):
            return _type_of_value(node.value)
        raise self.not_exportable("uses a value that is not a number", node)

    def _tuple(self, node: ast.Tuple) -> ValueType | None:
        items = [self.infer(item) for item in node.elts]
        known = tuple(item for item in items if item is not None)
        if any(not isinstance(item, (c.ScalarType, c.TupleType)) for item in known):
            raise self.not_exportable("puts an array or a record into a tuple", node)
        return c.TupleType(known) if len(known) == len(items) else None

    def _attribute(self, node: ast.Attribute) -> ValueType | None:
        if isinstance(node.value, ast.Name) and node.value.id in c.MODULE_ALIASES:
            if node.attr in c.REAL_CONSTANTS:
                return c.FLOAT
            raise self.not_exportable("uses a name without an equivalent in C", node)
        if self.constant_integer(node) is not None:
            return c.INT
        kind = self.infer(node.value)
        if isinstance(kind, (c.WorkArray, c.ConstantArray)) and node.attr == "shape":
            return c.TupleType((c.INT,) * len(kind.shape))
        fields = dict(kind.fields) if isinstance(kind, c.ConstantRecord) else {}
        if isinstance(kind, c.TupleType):
            fields = dict(zip(kind.names, kind.items, strict=False))
        if kind is not None and node.attr not in fields:
            raise self.not_exportable("uses an unknown attribute", node)
        return fields.get(node.attr)

    def _subscript(self, node: ast.Subscript) -> ValueType | None:
        if self.constant_integer(node) is not None:
            return c.INT
        kind = self.infer(node.value)
        if kind is None:
            return None
        if isinstance(kind, c.TupleType):
            return self._item(node, kind)
        if not isinstance(kind, (c.WorkArray, c.ConstantArray)):
            raise self.not_exportable("indexes a value that is not a tuple or an array", node)
        indices = indices_of(node)
        if len(indices) != len(kind.shape):
            raise self.not_exportable("takes a part of an array", node)
        for index in indices:
            if self.infer_scalar(index) not in {c.INT, c.BOOL, None}:
                raise self.not_exportable("has an index that is not an integer", node)
        return c.FLOAT if isinstance(kind, c.WorkArray) else kind.element

    def _item(self, node: ast.Subscript, tuple_type: c.TupleType) -> ValueType:
        index = self.constant_integer(node.slice)
        if index is None:
            if not tuple_type.is_uniform:
                raise self.not_exportable("computes an index into a tuple of different types", node)
            return tuple_type.items[0]
        if not -len(tuple_type.items) <= index < len(tuple_type.items):
            raise self.not_exportable("has an index beyond the end of a tuple", node)
        return tuple_type.items[index]

    def _binary(self, node: ast.BinOp) -> ValueType | None:
        left, right = self.infer_scalar(node.left), self.infer_scalar(node.right)
        if left is None or right is None:
            return None
        if left == right == c.SINGLE:
            raise self.not_exportable(
                "computes with two numbers of single precision: use float()", node
            )
        if isinstance(node.op, ast.Div):
            return c.FLOAT
        both = max(left, right, key=lambda number: number.rank)
        if isinstance(node.op, (ast.BitAnd, ast.BitOr, ast.BitXor)) and both in {c.BOOL, c.INT}:
            return both
        if isinstance(node.op, ast.Pow):
            return self._power(node, left)
        integral = isinstance(node.op, (ast.LShift, ast.RShift, ast.BitAnd, ast.BitOr, ast.BitXor))
        if (integral and both not in {c.BOOL, c.INT}) or isinstance(node.op, ast.MatMult):
            raise self.not_exportable("has an operator that is not defined for its operands", node)
        return c.FLOAT if both == c.SINGLE else max(both, c.INT, key=lambda number: number.rank)

    def _power(self, node: ast.BinOp, base: c.ScalarType) -> ValueType:
        exponent = self.constant_integer(node.right)
        if base not in {c.INT, c.BOOL}:
            return c.FLOAT
        if exponent is None or exponent < 0:
            raise self.not_exportable("raises an integer to a power that is not a literal", node)
        return c.INT

    def _unary(self, node: ast.UnaryOp) -> ValueType | None:
        kind = self.infer_scalar(node.operand)
        if isinstance(node.op, ast.Not):
            return c.BOOL
        if isinstance(node.op, ast.Invert) and kind not in {c.INT, None}:
            raise self.not_exportable("has an operator that is not defined for its operand", node)
        return c.INT if kind == c.BOOL else kind

    def _compare(self, node: ast.Compare) -> ValueType | None:
        if any(isinstance(op, (ast.Is, ast.IsNot, ast.In, ast.NotIn)) for op in node.ops):
            raise self.not_exportable("compares by 'is' or 'in'", node)
        for middle in node.comparators[:-1]:
            if not isinstance(middle, (ast.Name, ast.Constant)):
                raise self.not_exportable(
                    "chains comparisons of an expression that is not a name", node
                )
        for side in (node.left, *node.comparators):
            self.infer_scalar(side)
        return c.BOOL

    def _boolean(self, node: ast.BoolOp) -> ValueType | None:
        for part in node.values:
            if self.infer(part) not in {c.BOOL, None} and node not in self._conditions:
                raise self.not_exportable(
                    "uses 'and' or 'or' for values that are not booleans", node
                )
        return c.BOOL

    def _conditional(self, node: ast.IfExp) -> ValueType | None:
        first, second = self.infer(node.body), self.infer(node.orelse)
        if first is None or second is None:
            return first or second
        both = c.common_type(first, second)
        if both is None:
            raise self.not_exportable("chooses between values of different types", node)
        return both

    def _call(self, node: ast.Call) -> ValueType | None:
        name = called_name(node)
        if self.is_compiled_call(node):
            kinds = [self.infer(argument) for argument in self.call_arguments(node)]
            known = tuple(kind for kind in kinds if kind is not None)
            if len(known) < len(kinds):
                return None
            return self.program.infer_types(name, known).result_type
        if node.keywords and name not in self.program.records:
            raise self.not_exportable("calls a built-in function with keyword arguments", node)
        if name in self.program.records:
            return self._record(node, name)
        return self._builtin(node, name)

    def _record(self, node: ast.Call, name: str) -> ValueType | None:
        names = self.program.records[name]
        items = [self.infer(item) for item in self.match_arguments(node, names)]
        known = tuple(item for item in items if item is not None)
        return c.TupleType(known, names) if len(known) == len(items) else None

    def match_arguments(self, node: ast.Call, names: Sequence[str]) -> list[ast.expr]:
        """Return the arguments of a call in the order of the names.

        Raises:
            NotExportableError: unless each argument is given once, in order.
        """
        by_name = {key.arg: key.value for key in node.keywords}
        given = dict(zip(names, node.args, strict=False)) | by_name
        stars = any(isinstance(argument, ast.Starred) for argument in node.args)
        if stars or list(given) != [n for n in names if n in given] or len(given) != len(names):
            raise self.not_exportable("does not pass every argument once, in order", node)
        return [given[name] for name in names]

    def call_arguments(self, node: ast.Call) -> list[ast.expr]:
        """Return the arguments of a call of a compiled function, in order.

        Raises:
            NotExportableError: unless each argument is given once, in order.
        """
        return self.match_arguments(node, self.program.parameter_names(called_name(node)) or ())

    def is_compiled_call(self, node: ast.Call) -> bool:
        """Return whether a compiled function is called."""
        plain = isinstance(node.func, ast.Name)
        return plain and self.program.parameter_names(called_name(node)) is not None

    def _builtin(self, node: ast.Call, name: str) -> ValueType | None:
        if name == "local_array":
            return c.WorkArray(self._work_array_shape(node))
        library = isinstance(node.func, ast.Attribute)
        kinds = [self.infer_scalar(argument) for argument in node.args if name != "len"]
        if library and name in c.REAL_FUNCTIONS:
            return c.FLOAT
        if (
            name in {"floor", "ceil"}
            and getattr(getattr(node.func, "value", 0), "id", "") == "math"
        ):
            return c.INT
        fixed: dict[str, ValueType] = {
            "int": c.INT,
            "int64": c.INT,
            "float": c.FLOAT,
            "float64": c.FLOAT,
        }
        fixed |= {"bool": c.BOOL, "len": c.INT, "pow": c.FLOAT}
        if name in fixed or (name == "round" and len(node.args) == 1):
            return fixed.get(name, c.INT)
        if name in {"abs", "min", "max"} and not library:
            if any(kind is None for kind in kinds):
                return None
            top = max((kind for kind in kinds if kind), key=lambda number: number.rank)
            return {c.BOOL: c.INT, c.SINGLE: c.FLOAT}.get(top, top)
        raise self.not_exportable("calls a function without an equivalent in C", node)

    def _work_array_shape(self, node: ast.Call) -> tuple[int, ...]:
        if len(node.args) == 1 and isinstance(node.args[0], ast.Tuple):
            lengths = [self.constant_integer(one) for one in node.args[0].elts]
            known = tuple(one for one in lengths if one is not None)
            if known and len(known) == len(lengths):
                return known
        raise self.not_exportable("makes a work array without a constant shape", node)


_INFERENCE_RULES: dict[type[ast.expr], Callable[[ExpressionTypes, Any], ValueType | None]] = {
    ast.Name: ExpressionTypes._name,
    ast.Constant: ExpressionTypes._constant,
    ast.Tuple: ExpressionTypes._tuple,
    ast.Attribute: ExpressionTypes._attribute,
    ast.Subscript: ExpressionTypes._subscript,
    ast.BinOp: ExpressionTypes._binary,
    ast.UnaryOp: ExpressionTypes._unary,
    ast.Compare: ExpressionTypes._compare,
    ast.BoolOp: ExpressionTypes._boolean,
    ast.IfExp: ExpressionTypes._conditional,
    ast.Call: ExpressionTypes._call,
}


def called_name(node: ast.Call) -> str:
    """Return the name of the called function, without its module."""
    return node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")


def to_load(target: ast.expr) -> ast.expr:
    """Return the target of an assignment as an expression of its value."""
    return ast.parse(ast.unparse(target), mode="eval").body


def indices_of(node: ast.Subscript) -> list[ast.expr]:
    """Return the indices of an array element."""
    return list(node.slice.elts) if isinstance(node.slice, ast.Tuple) else [node.slice]


def _iterate_conditions(function: ast.FunctionDef) -> Iterator[ast.expr]:
    """Yield the expressions that are used as conditions only."""
    for node in ast.walk(function):
        pending = [node.test] if isinstance(node, (ast.If, ast.While, ast.IfExp)) else []
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            pending = [node.operand]
        while pending:
            test = pending.pop()
            yield test
            pending += test.values if isinstance(test, ast.BoolOp) else []


def _type_of_value(value: float) -> c.ScalarType:
    if isinstance(value, bool):
        return c.BOOL
    return c.INT if isinstance(value, int) else c.FLOAT
