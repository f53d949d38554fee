"""Types of the expressions of a compiled function."""

from __future__ import annotations

import ast
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Protocol

from asperity.export import c_language as c
from asperity.export.c_language import NotExportableError, ValueType


class UnknownTypeError(NotExportableError):
    """A name whose type is not known yet, or that never has a value."""


class ProgramContext(Protocol):
    """Interface of a program for the conversion of its functions.

    Attributes:
        prefix: prefix of all names.
        numbers: numbers of the modules, by name.
        records: field names of the records, by name.
        signatures: argument names of the compiled functions, by name.
        single: whether real numbers are of single precision.
    """

    prefix: str
    single: bool
    signatures: Mapping[str, tuple[str, ...]]
    numbers: Mapping[str, float]
    records: Mapping[str, tuple[str, ...]]

    def infer_types(self, name: str, argument_types: tuple[ValueType, ...]) -> ExpressionTypes:
        """Return the types of a compiled function for given argument types."""

    def helper_name(self, helper: c.HelperFunction) -> str:
        """Return the name of a helper function, which is added to the program."""

    def function_name(self, name: str, argument_types: tuple[ValueType, ...]) -> str:
        """Return the name of a compiled function, which is added to the program."""

    def c_type(self, value_type: ValueType) -> str:
        """Return the C type of a number or a tuple."""

    def constructor_name(self, value_type: c.TupleType) -> str:
        """Return the name of the constructor of a tuple."""


class ExpressionTypes(ast.NodeVisitor):
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
        self.node = node
        self.types = types
        self.program = program
        self._conditions = set(_iterate_conditions(node))

    def not_exportable(self, construct: str, node: ast.AST | None = None) -> NotExportableError:
        """Return the error for a construct of this function that cannot be exported."""
        if node is not None:
            construct += f" ({ast.unparse(node).splitlines()[0]})"
        return NotExportableError(self.node.name, construct)

    def infer(self, node: ast.expr) -> ValueType:
        """Return the type of an expression.

        Raises:
            UnknownTypeError: for a name whose type is not known yet.
            NotExportableError: for a construct that cannot be exported.
        """
        kind: ValueType = self.visit(node)
        return kind

    def generic_visit(self, node: ast.AST) -> ValueType:
        """Refuse an expression without an equivalent in C."""
        raise self.not_exportable(f"uses {type(node).__name__}", node)

    def infer_scalar(self, node: ast.expr) -> c.ScalarType:
        """Return the type of an expression that must be a number.

        Raises:
            NotExportableError: for another type.
        """
        kind = self.infer(node)
        if not isinstance(kind, c.ScalarType):
            raise self.not_exportable("computes with a value that is not a number", node)
        return kind

    def infer_tuple(self, node: ast.expr) -> c.TupleType:
        """Return the type of an expression that must be a tuple or a record.

        Raises:
            NotExportableError: for another type.
        """
        kind = self.infer(node)
        if not isinstance(kind, c.TupleType):
            raise self.not_exportable("unpacks a value that is not a tuple", node)
        return kind

    def constant_integer(self, node: ast.expr) -> int | None:
        """Return the value of an integer literal or of a length of an array, else ``None``."""
        if isinstance(node, ast.Constant) and type(node.value) is int:
            return node.value
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            value = self.constant_integer(node.operand)
            return None if value is None else -value
        if isinstance(node, ast.Attribute) and node.attr in {"size", "ndim"}:
            shape = self._constant_shape(node.value)
            if shape is not None:
                return {"size": math.prod(shape), "ndim": len(shape)}[node.attr]
        if isinstance(node, ast.Subscript) and getattr(node.value, "attr", "") == "shape":
            assert isinstance(node.value, ast.Attribute)  # only that has an attribute
            index = self.constant_integer(node.slice)
            shape = self._constant_shape(node.value.value)
            if index is not None and shape is not None and -len(shape) <= index < len(shape):
                return shape[index]
        return None

    def _constant_shape(self, node: ast.expr) -> tuple[int, ...] | None:
        """Return the shape of an array unless it is loaded at run time."""
        kind = self.infer(node)
        if isinstance(kind, c.ArrayType) and not kind.lengths:
            return kind.shape
        return None

    def visit_Name(self, node: ast.Name) -> ValueType:
        """Return the type of a variable or a number of a module."""
        if node.id in self.types:
            return self.types[node.id]
        if node.id in self.program.numbers:
            return _type_of_value(self.program.numbers[node.id])
        construct = f"uses a name before it has a value ({node.id})"
        raise UnknownTypeError(self.node.name, construct)

    def visit_Constant(self, node: ast.Constant) -> ValueType:
        """Return the type of a literal."""
        if isinstance(node.value, (bool, int, float)):
            return _type_of_value(node.value)
        raise self.not_exportable("uses a value that is not a number", node)

    def visit_Tuple(self, node: ast.Tuple) -> ValueType:
        """Return the type of a tuple."""
        items = tuple(map(self.infer, node.elts))
        for item in items:
            if not isinstance(item, (c.ScalarType, c.TupleType)) or c.is_constant(item):
                raise self.not_exportable("puts an array or a record into a tuple", node)
        return c.TupleType(items)

    def visit_Attribute(self, node: ast.Attribute) -> ValueType:
        """Return the type of a field, a constant of a module, or the shape of an array."""
        if isinstance(node.value, ast.Name) and node.value.id in c.MODULE_ALIASES:
            if node.attr in c.REAL_CONSTANTS:
                return c.FLOAT
            raise self.not_exportable("uses a name without an equivalent in C", node)
        if self.constant_integer(node) is not None:
            return c.INT
        kind = self.infer(node.value)
        if isinstance(kind, c.ArrayType) and node.attr == "shape":
            return c.TupleType((c.INT,) * len(kind.shape))
        if not isinstance(kind, c.TupleType) or node.attr not in kind.names:
            raise self.not_exportable("uses an unknown attribute", node)
        return kind.items[kind.names.index(node.attr)]

    def visit_Subscript(self, node: ast.Subscript) -> ValueType:
        """Return the type of an item of a tuple or an element of an array."""
        if self.constant_integer(node) is not None:
            return c.INT
        kind = self.infer(node.value)
        if isinstance(kind, c.TupleType):
            return self._item(node, kind)
        if not isinstance(kind, c.ArrayType):
            raise self.not_exportable("indexes a value that is not a tuple or an array", node)
        indices = indices_of(node)
        if len(indices) != len(kind.shape):
            raise self.not_exportable("takes a part of an array", node)
        if not {self.infer_scalar(index) for index in indices} <= {c.INT, c.BOOL}:
            raise self.not_exportable("has an index that is not an integer", node)
        return kind.element

    def _item(self, node: ast.Subscript, tuple_type: c.TupleType) -> ValueType:
        index = self.constant_integer(node.slice)
        if index is None:
            if not tuple_type.is_uniform:
                raise self.not_exportable("computes an index into a tuple of different types", node)
            return tuple_type.items[0]
        if not -len(tuple_type.items) <= index < len(tuple_type.items):
            raise self.not_exportable("has an index beyond the end of a tuple", node)
        return tuple_type.items[index]

    def visit_BinOp(self, node: ast.BinOp) -> ValueType:
        """Return the type of a binary operation."""
        left = self.infer_scalar(node.left)
        right = self.infer_scalar(node.right)
        both = max(left, right)
        if left == right == c.SINGLE:
            construct = "computes with two numbers of single precision: use float()"
            raise self.not_exportable(construct, node)
        if isinstance(node.op, ast.Div):
            return c.FLOAT
        if isinstance(node.op, ast.Pow):
            return self._power(node, left)
        if isinstance(node.op, (ast.MatMult, *c.BIT_OPERATORS)):
            if isinstance(node.op, ast.MatMult) or both not in {c.BOOL, c.INT}:
                construct = "has an operator that is not defined for its operands"
                raise self.not_exportable(construct, node)
            if isinstance(node.op, (ast.LShift, ast.RShift)):
                return c.INT
            return both
        if both == c.SINGLE:
            return c.FLOAT
        return max(both, c.INT)

    def _power(self, node: ast.BinOp, base: c.ScalarType) -> ValueType:
        exponent = self.constant_integer(node.right)
        if base not in {c.INT, c.BOOL}:
            return c.FLOAT
        if exponent is None or exponent < 0:
            raise self.not_exportable("raises an integer to a power that is not a literal", node)
        return c.INT

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ValueType:
        """Return the type of a unary operation."""
        kind = self.infer_scalar(node.operand)
        if isinstance(node.op, ast.Not):
            return c.BOOL
        if isinstance(node.op, ast.Invert) and kind != c.INT:
            raise self.not_exportable("has an operator that is not defined for its operand", node)
        return max(kind, c.INT)

    def visit_Compare(self, node: ast.Compare) -> ValueType:
        """Return the type of a comparison."""
        for operator in node.ops:
            if isinstance(operator, (ast.Is, ast.IsNot, ast.In, ast.NotIn)):
                raise self.not_exportable("compares by 'is' or 'in'", node)
        for side in node.comparators[:-1]:
            if not isinstance(side, (ast.Name, ast.Constant)):
                construct = "chains comparisons of an expression that is not a name"
                raise self.not_exportable(construct, node)
        for side in (node.left, *node.comparators):
            self.infer_scalar(side)
        return c.BOOL

    def visit_BoolOp(self, node: ast.BoolOp) -> ValueType:
        """Return the type of a conjunction or a disjunction."""
        kinds = {self.infer(part) for part in node.values}
        if kinds != {c.BOOL} and node not in self._conditions:
            raise self.not_exportable("uses 'and' or 'or' for values that are not booleans", node)
        return c.BOOL

    def visit_IfExp(self, node: ast.IfExp) -> ValueType:
        """Return the type of a conditional expression."""
        both = c.common_type(self.infer(node.body), self.infer(node.orelse))
        if both is None:
            raise self.not_exportable("chooses between values of different types", node)
        return both

    def visit_Call(self, node: ast.Call) -> ValueType:
        """Return the type of a call."""
        name = called_name(node)
        if self.is_compiled_call(node):
            kinds = tuple(map(self.infer, self.call_arguments(node)))
            return self.program.infer_types(name, kinds).result_type
        if name in self.program.records:
            names = self.program.records[name]
            return c.TupleType(tuple(map(self.infer, self.match_arguments(node, names))), names)
        if node.keywords:
            raise self.not_exportable("calls a built-in function with keyword arguments", node)
        return self._builtin(node, name)

    def match_arguments(self, node: ast.Call, names: Sequence[str]) -> list[ast.expr]:
        """Return the arguments of a call in the order of the names.

        Raises:
            NotExportableError: unless each argument is given once, in order.
        """
        arguments: dict[str | None, ast.expr] = dict(zip(names, node.args, strict=False))
        arguments |= {keyword.arg: keyword.value for keyword in node.keywords}
        stars = [argument for argument in node.args if isinstance(argument, ast.Starred)]
        if stars or tuple(arguments) != tuple(names):
            raise self.not_exportable("does not pass every argument once, in order", node)
        return list(arguments.values())

    def call_arguments(self, node: ast.Call) -> list[ast.expr]:
        """Return the arguments of a call of a compiled function, in order.

        Raises:
            NotExportableError: unless each argument is given once, in order.
        """
        return self.match_arguments(node, self.program.signatures[called_name(node)])

    def is_compiled_call(self, node: ast.Call) -> bool:
        """Return whether a compiled function is called."""
        return isinstance(node.func, ast.Name) and node.func.id in self.program.signatures

    def _builtin(self, node: ast.Call, name: str) -> ValueType:
        if name == "local_array":
            return c.ArrayType(self._work_array_shape(node))
        kinds = [self.infer_scalar(argument) for argument in node.args]
        whole = ast.unparse(node.func)
        if name in _CONVERSIONS:
            return _CONVERSIONS[name]
        if whole != name and name in c.REAL_FUNCTIONS:
            return c.FLOAT
        if whole in {"math.floor", "math.ceil"} or (name == "round" and len(kinds) == 1):
            return c.INT
        if whole in {"abs", "min", "max"}:
            top = max(kinds)
            return {c.BOOL: c.INT, c.SINGLE: c.FLOAT}.get(top, top)
        raise self.not_exportable("calls a function without an equivalent in C", node)

    def _work_array_shape(self, node: ast.Call) -> tuple[int, ...]:
        if len(node.args) == 1 and isinstance(node.args[0], ast.Tuple):
            lengths = [self.constant_integer(length) for length in node.args[0].elts]
            shape = tuple([length for length in lengths if length is not None])
            if shape and len(shape) == len(lengths):
                return shape
        raise self.not_exportable("makes a work array without a constant shape", node)


_CONVERSIONS = {"bool": c.BOOL} | dict.fromkeys(("pow", "float", "float64"), c.FLOAT)
_CONVERSIONS |= dict.fromkeys(("int", "int64"), c.INT)


def called_name(node: ast.Call) -> str:
    """Return the name of the called function, without its module."""
    if isinstance(node.func, ast.Attribute):
        return node.func.attr
    return str(getattr(node.func, "id", ""))


def indices_of(node: ast.Subscript) -> list[ast.expr]:
    """Return the indices of an array element."""
    if isinstance(node.slice, ast.Tuple):
        return list(node.slice.elts)
    return [node.slice]


def _iterate_conditions(function: ast.FunctionDef) -> Iterator[ast.expr]:
    """Yield the expressions that are used as conditions only."""
    for node in ast.walk(function):
        pending = []
        if isinstance(node, (ast.If, ast.While, ast.IfExp)):
            pending.append(node.test)
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            pending.append(node.operand)
        while pending:
            test = pending.pop()
            yield test
            pending += getattr(test, "values", ())


def _type_of_value(value: float) -> c.ScalarType:
    if isinstance(value, bool):
        return c.BOOL
    return c.INT if isinstance(value, int) else c.FLOAT
