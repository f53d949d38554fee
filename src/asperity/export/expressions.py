"""Conversion of expressions of compiled functions to C, with the same order of operations."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

from asperity.export import c_language as c
from asperity.export.c_language import ValueType
from asperity.export.expression_types import ProgramContext, called_name, indices_of
from asperity.export.function_analysis import FunctionTypes

if TYPE_CHECKING:
    from numpy.typing import NDArray

_PRIMARY = 12
_UNARY = 11
_PRODUCT = 10
_SUM = 9
_SHIFT = 8
_ORDER = 7
_EQUAL = 6
_AND = 3
_OR = 2
_CHOICE = 1


class CExpression(NamedTuple):
    """A C expression and the precedence of its outermost operator."""

    text: str
    precedence: int = _PRIMARY


# Operator and precedence of binary operators. Compilers warn about operands of bit operators
# without parentheses.
BINARY_OPERATORS: dict[type[ast.operator], tuple[str, int]] = {
    ast.Add: ("+", _SUM),
    ast.Sub: ("-", _SUM),
    ast.Mult: ("*", _PRODUCT),
    ast.Div: ("/", _PRODUCT),
}
_COMPARE: dict[type[ast.cmpop], tuple[str, int]] = {
    ast.Lt: ("<", _ORDER),
    ast.LtE: ("<=", _ORDER),
    ast.Gt: (">", _ORDER),
    ast.GtE: (">=", _ORDER),
    ast.Eq: ("==", _EQUAL),
    ast.NotEq: ("!=", _EQUAL),
}


class ExpressionPrinter(ast.NodeVisitor):
    """Converter of the expressions of one function.

    Args:
        types: types of the variables.
        program: the program.
        names: names of the variables in C, by the names in Python.
    """

    def __init__(
        self, types: FunctionTypes, program: ProgramContext, names: dict[str, str]
    ) -> None:
        self.types = types
        self.program = program
        self.names = names

    def text(self, node: ast.expr, min_precedence: int = 0) -> str:
        """Return an expression, in parentheses if its precedence is below a minimum."""
        return _enclose(*self.to_c(node), min_precedence)

    def to_c(self, node: ast.expr) -> CExpression:
        """Return an expression with its precedence."""
        length = self.types.constant_integer(node)
        if length is not None:
            return _literal(str(length))
        value: CExpression = self.visit(node)
        return value

    def as_type(self, node: ast.expr, value_type: ValueType, min_precedence: int = 0) -> str:
        """Return an expression converted to a type."""
        own = self.types.infer(node)
        if own == value_type or (own == c.BOOL and value_type == c.INT):
            return self.text(node, min_precedence)
        if isinstance(value_type, c.TupleType):
            return self._tuple_of(node, value_type).text
        if value_type == c.FLOAT:
            length = self.types.constant_integer(node)
            if length is not None:
                return real_literal(float(length), self.program.single)
            cast = f"({self.program.c_type(c.FLOAT)}){self.text(node, _UNARY)}"
            return _enclose(cast, _UNARY, min_precedence)
        if value_type == c.BOOL and isinstance(own, c.ScalarType):
            return f"{self.text(node, _EQUAL + 1)} != 0"
        raise self.types.not_exportable("converts a value to another type", node)

    def condition(self, node: ast.expr, min_precedence: int = 0) -> str:
        """Return a condition."""
        text = self.as_type(node, c.BOOL)
        if self.types.infer(node) == c.BOOL:
            return _enclose(text, self.to_c(node).precedence, min_precedence)
        return _enclose(text, _EQUAL, min_precedence)

    # --- names and literals ----------------------------------------------------------------------

    def visit_Name(self, node: ast.Name) -> CExpression:
        """Return the C expression of a variable or a number of a module."""
        if node.id not in self.types.types:
            value = self.program.numbers[node.id]
            return self.visit_Constant(ast.Constant(value))
        return CExpression(self.names[node.id])

    def visit_Constant(self, node: ast.Constant) -> CExpression:
        """Return the C expression of a literal."""
        if isinstance(node.value, float):
            return _literal(real_literal(node.value, self.program.single))
        assert isinstance(node.value, int)  # checked by the type inference
        return _literal(str(int(node.value)))

    def visit_Attribute(self, node: ast.Attribute) -> CExpression:
        """Return the C expression of a field, a constant of a module, or the shape of an array."""
        if isinstance(node.value, ast.Name) and node.value.id in c.MODULE_ALIASES:
            return self.visit_Constant(ast.Constant(c.REAL_CONSTANTS[node.attr]))
        kind = self.types.infer(node.value)
        if isinstance(kind, c.ArrayType):
            lengths = c.TupleType((c.INT,) * len(kind.shape))
            return self._constructor_call(lengths, list(kind.lengths or map(str, kind.shape)))
        assert isinstance(kind, c.TupleType)  # no other type has attributes
        return self._item(node.value, kind, kind.names.index(node.attr))

    def _item(self, value: ast.expr, kind: c.TupleType, index: int) -> CExpression:
        return CExpression(kind.item_expression(self.text(value, _PRIMARY), index))

    def visit_Tuple(self, node: ast.Tuple) -> CExpression:
        """Return the C expression of a tuple."""
        return self._tuple_of(node, self.types.infer_tuple(node))

    def _tuple_of(self, node: ast.expr, value_type: c.TupleType) -> CExpression:
        """Return a tuple or a record with its items converted to other types."""
        if isinstance(node, ast.Tuple):
            items = node.elts
        elif isinstance(node, ast.Call) and called_name(node) in self.program.records:
            items = self.types.match_arguments(node, value_type.names)
        else:
            raise self.types.not_exportable(
                "uses a tuple in place of one with other item types", node
            )
        return self._constructor_call(value_type, list(map(self.as_type, items, value_type.items)))

    def _constructor_call(self, value_type: c.TupleType, items: list[str]) -> CExpression:
        return CExpression(f"{self.program.constructor_name(value_type)}({', '.join(items)})")

    def visit_Subscript(self, node: ast.Subscript) -> CExpression:
        """Return the C expression of an item of a tuple or an element of an array."""
        kind = self.types.infer(node.value)
        if isinstance(kind, c.TupleType):
            index = self.types.constant_integer(node.slice)
            if index is not None:
                return self._item(node.value, kind, index % len(kind.items))
            base = self.text(node.value, _PRIMARY)
            return CExpression(f"{base}.v[{self.text(node.slice)}]")
        assert isinstance(kind, c.ArrayType)  # checked by the type inference
        text = c.constant_name(kind) or self.text(node.value, _PRIMARY)
        if kind.lengths:  # stored without gaps
            place, *others = [self.text(index, _SUM) for index in indices_of(node)]
            for other, size in zip(others, kind.lengths[1:], strict=True):
                place = f"({place}) * {size} + {other}"
            return CExpression(f"{text}[{place}]")
        for index_node, length in zip(indices_of(node), kind.shape, strict=True):
            fixed = self.types.constant_integer(index_node)
            if fixed is None:
                text += f"[{self.text(index_node)}]"
            else:
                text += f"[{fixed % max(length, 1)}]"
        return CExpression(text)

    # --- operators -------------------------------------------------------------------------------

    def visit_BinOp(self, node: ast.BinOp) -> CExpression:
        """Return the C expression of a binary operation."""
        kind = self.types.infer(node)
        if isinstance(node.op, ast.Pow):
            return self._power(node, kind)
        if type(node.op) in c.BIT_OPERATORS:
            # An expression of literals would have 32 bits.
            left = self.text(node.left, _UNARY)
            if self.types.constant_integer(node.left) is not None:
                left = f"(int64_t){left}"
            text = f"{left} {c.BIT_OPERATORS[type(node.op)]} {self.text(node.right, _UNARY)}"
            return CExpression(text, _SHIFT - 4)
        if type(node.op) not in BINARY_OPERATORS:
            return self._floor_division(node, kind)
        sign, rank = BINARY_OPERATORS[type(node.op)]
        left = self.as_type(node.left, kind, rank)
        right = self.as_type(node.right, kind, rank + 1)
        return CExpression(f"{left} {sign} {right}", rank)

    def _floor_division(self, node: ast.BinOp, value_type: ValueType) -> CExpression:
        name = "rest"
        if isinstance(node.op, ast.FloorDiv):
            name = "quotient"
        helper = _find_typed_helper(name, value_type)
        return self._helper_call(helper, [node.left, node.right], value_type)

    def _power(self, node: ast.BinOp, value_type: ValueType) -> CExpression:
        exponent = self.types.constant_integer(node.right)
        if exponent is not None and isinstance(value_type, c.ScalarType):
            return self._helper_call(c.power_helper(exponent, value_type), [node.left], value_type)
        if self.types.infer(node.right) == c.INT:
            name = self.program.helper_name(c.find_helper("power"))
            base = self.as_type(node.left, c.FLOAT)
            return CExpression(f"{name}({base}, {self.text(node.right)})")
        return self._library_call("pow", [node.left, node.right])

    def visit_UnaryOp(self, node: ast.UnaryOp) -> CExpression:
        """Return the C expression of a unary operation."""
        if isinstance(node.op, ast.Not):
            return CExpression(f"!{self.condition(node.operand, _UNARY)}", _UNARY)
        sign = {ast.USub: "-", ast.UAdd: "", ast.Invert: "~"}[type(node.op)]
        text = self.text(node.operand, _UNARY)
        if text.startswith("-"):  # two minus signs would be a decrement
            text = f"({text})"
        return CExpression(f"{sign}{text}", _UNARY)

    def visit_Compare(self, node: ast.Compare) -> CExpression:
        """Return the C expression of a comparison."""
        sides = [node.left, *node.comparators]
        parts = []
        for left, op, right in zip(sides[:-1], node.ops, sides[1:], strict=True):
            kind = c.INT
            if {self.types.infer(left), self.types.infer(right)} & {c.FLOAT, c.SINGLE}:
                kind = c.FLOAT
            sign, precedence = _COMPARE[type(op)]
            parts.append(
                f"{self.as_type(left, kind, _SHIFT)} {sign} {self.as_type(right, kind, _SHIFT)}"
            )
        if len(parts) > 1:
            precedence = _AND
        return CExpression(" && ".join(parts), precedence)

    def visit_BoolOp(self, node: ast.BoolOp) -> CExpression:
        """Return the C expression of a conjunction or a disjunction."""
        if isinstance(node.op, ast.And):
            parts = [self.condition(part, _AND) for part in node.values]
            return CExpression(" && ".join(parts), _AND)
        # Compilers warn about mixed && and || without parentheses.
        parts = [self.condition(part, _AND + 1) for part in node.values]
        return CExpression(" || ".join(parts), _OR)

    def visit_IfExp(self, node: ast.IfExp) -> CExpression:
        """Return the C expression of a conditional expression."""
        kind = self.types.infer(node)
        first = self.as_type(node.body, kind, _OR)
        second = self.as_type(node.orelse, kind, _OR)
        return CExpression(f"{self.condition(node.test, _OR)} ? {first} : {second}", _CHOICE)

    # --- calls -----------------------------------------------------------------------------------

    def visit_Call(self, node: ast.Call) -> CExpression:
        """Return the C expression of a call."""
        name = called_name(node)
        if self.types.is_compiled_call(node):
            return self._compiled_call(node, name)
        if name in self.program.records:
            return self._tuple_of(node, self.types.infer_tuple(node))
        if name in _BUILTINS:
            return _BUILTINS[name](self, node)
        return self._library_call(c.REAL_FUNCTIONS[name], node.args)

    def _compiled_call(self, node: ast.Call, name: str) -> CExpression:
        arguments = self.types.call_arguments(node)
        kinds = tuple(map(self.types.infer, arguments))
        callee = self.program.function_name(name, kinds)
        passed = [
            self.text(argument)
            for argument, kind in zip(arguments, kinds, strict=True)
            if not c.is_constant(kind)
        ]
        return CExpression(f"{callee}({', '.join(passed)})")

    def _minimum_or_maximum(self, node: ast.Call) -> CExpression:
        kind = self.types.infer(node)
        helper = self.program.helper_name(_find_typed_helper(called_name(node), kind))
        text = self.as_type(node.args[0], kind)
        for argument in node.args[1:]:
            text = f"{helper}({text}, {self.as_type(argument, kind)})"
        return CExpression(text)

    def _absolute(self, node: ast.Call) -> CExpression:
        if self.types.infer(node) == c.FLOAT:
            return self._library_call("fabs", node.args)
        return self._helper_call(c.find_helper("abs_int"), node.args, c.INT)

    def _to_integer(self, node: ast.Call) -> CExpression:
        argument = node.args[0]
        if self.types.infer_scalar(argument) in {c.INT, c.BOOL}:
            return self.to_c(argument)
        if called_name(node) in {"int", "int64"}:
            return CExpression(f"(int64_t){self.text(argument, _UNARY)}", _UNARY)
        return self._helper_call(c.find_helper(called_name(node)), node.args, c.FLOAT)

    def _to_real(self, node: ast.Call) -> CExpression:
        return CExpression(self.as_type(node.args[0], c.FLOAT, _UNARY), _UNARY)

    def _helper_call(
        self, helper: c.HelperFunction, arguments: list[ast.expr], value_type: ValueType
    ) -> CExpression:
        passed = [self.as_type(argument, value_type) for argument in arguments]
        return CExpression(f"{self.program.helper_name(helper)}({', '.join(passed)})")

    def _library_call(self, name: str, arguments: list[ast.expr]) -> CExpression:
        passed = [self.as_type(argument, c.FLOAT) for argument in arguments]
        if self.program.single:
            name += "f"
        return CExpression(f"{name}({', '.join(passed)})")


def _enclose(text: str, precedence: int, min_precedence: int) -> str:
    """Return an expression, in parentheses if its precedence is below a minimum."""
    return text if precedence >= min_precedence else f"({text})"


def _literal(text: str) -> CExpression:
    return CExpression(text, _UNARY if text.startswith("-") else _PRIMARY)


def _find_typed_helper(name: str, value_type: ValueType) -> c.HelperFunction:
    """Return the helper function of real numbers, or its like for integers."""
    return c.find_helper(name if value_type == c.FLOAT else f"{name}_int")


_BUILTINS: dict[str, Callable[[ExpressionPrinter, ast.Call], CExpression]] = {
    "abs": ExpressionPrinter._absolute,
    "bool": lambda printer, node: CExpression(printer.condition(node.args[0], _PRIMARY)),
    **dict.fromkeys(("float", "float64"), ExpressionPrinter._to_real),
    **dict.fromkeys(("max", "min"), ExpressionPrinter._minimum_or_maximum),
    **dict.fromkeys(("ceil", "floor", "int", "int64", "round"), ExpressionPrinter._to_integer),
}


def real_literal(value: float, single: bool) -> str:
    """Return a real number as a C literal.

    In single precision a smaller number becomes the least normal number, so that a tiny constant
    still prevents a division by zero.

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
        size = "INFINITY" if single else "HUGE_VAL"
        return f"-{size}" if value < 0 else size
    if single:
        return f"{np.float32(value)!s}f"
    return repr(float(value))


def real_literals(values: NDArray[Any], single: bool) -> list[str]:
    """Return real numbers, shape (n,), as C literals; see :func:`real_literal`."""
    import numpy as np

    if not single:
        return [real_literal(value, single) for value in values.tolist()]
    with np.errstate(over="ignore"):  # of numbers that become infinite
        rounded = values.astype(np.float32)
    # Nine digits determine a number of single precision; whole ones lack a point, others a rule.
    is_normal = np.isfinite(rounded) & (np.abs(values) >= np.finfo(np.float32).tiny)
    texts = ("%.9gf " * len(rounded) % tuple(rounded.tolist())).split()
    for index in np.flatnonzero(~is_normal | (rounded == np.floor(rounded))).tolist():
        texts[index] = real_literal(float(values[index]), single)
    return texts
