"""Types of values in compiled functions, and the C functions that implement Python operations.

Compiled functions (:mod:`asperity.core.compiled`) use numbers, tuples and records of numbers,
arrays of a constant shape, and constants: the records of texture and law with their arrays, which
an exported program holds as data.

Operations have the semantics of Numba: ``math.floor`` and ``int`` return a 64-bit integer, ``min``
and ``max`` compare from left to right, a remainder has the sign of the divisor, and a constant
power is a product by repeated squaring.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from asperity.core.errors import ParameterError


class NotExportableError(ParameterError):
    """A compiled function that cannot be exported to C, with the construct and the function."""

    def __init__(self, function: str, construct: str) -> None:
        super().__init__("law", f"cannot be exported: the function {function!r} {construct}")


@dataclass(frozen=True)
class ScalarType:
    """Type of a scalar.

    Attributes:
        name: name of the type in Numba: ``float64``, ``float32``, ``int64`` or ``bool``.
        rank: the common type of two scalars is the one of higher rank.
    """

    name: str
    rank: int


BOOL, INT, SINGLE, FLOAT = (
    ScalarType(name, rank) for rank, name in enumerate(("bool", "int64", "float32", "float64"))
)


@dataclass(frozen=True)
class TupleType:
    """Type of a tuple, or of a record: a tuple with named items.

    Attributes:
        items: types of the items.
        names: names of the items; empty for a plain tuple.
    """

    items: tuple[ValueType, ...]
    names: tuple[str, ...] = ()

    @property
    def is_uniform(self) -> bool:
        """Whether all items have one type, so that an index may be computed."""
        return len(set(self.items)) == 1


@dataclass(frozen=True)
class WorkArray:
    """Type of a float64 work array on the stack.

    Attributes:
        shape: shape of the array.
    """

    shape: tuple[int, ...]


@dataclass(frozen=True)
class ConstantArray:
    """A constant array, which is data of the program.

    Attributes:
        c_name: name in the program.
        shape: shape of the array.
        element: type of the elements.
    """

    c_name: str
    shape: tuple[int, ...]
    element: ScalarType


@dataclass(frozen=True)
class ConstantRecord:
    """A constant record of numbers and arrays, which is data of the program.

    Attributes:
        c_name: name in the program.
        fields: names and types of the fields.
        read_macro: macro that hides the value of a real number from the compiler; empty for none.
    """

    c_name: str
    fields: tuple[tuple[str, ValueType], ...]
    read_macro: str = ""

    def field_expression(self, name: str) -> str:
        """Return the C expression of a field."""
        place = f"{self.c_name}.{name}"
        return f"{self.read_macro}({place})" if self.read_macro else place


@dataclass(frozen=True)
class VoidType:
    """Result type of a function without a result."""


VOID = VoidType()

ValueType = ScalarType | TupleType | WorkArray | ConstantArray | ConstantRecord | VoidType


def is_constant(value_type: ValueType) -> bool:
    """Return whether a type is a constant, which is not passed to C functions."""
    return isinstance(value_type, (ConstantArray, ConstantRecord))


def common_type(first: ValueType, second: ValueType) -> ValueType | None:
    """Return the type of a variable that holds values of both types, ``None`` if there is none.

    Example:
        >>> common_type(INT, FLOAT).name, common_type(INT, WorkArray((3,)))
        ('float64', None)
    """
    if first == second:
        return first
    if isinstance(first, ScalarType) and isinstance(second, ScalarType):
        return max(first, second, key=lambda number: number.rank)
    if isinstance(first, TupleType) and isinstance(second, TupleType):
        items = [common_type(a, b) for a, b in zip(first.items, second.items, strict=False)]
        if len(first.items) == len(second.items) and first.names == second.names:
            known = tuple(item for item in items if item is not None)
            return TupleType(known, first.names) if len(known) == len(items) else None
    return None


def c_scalar_type(value_type: ValueType, real: str) -> str:
    """Return the C type of a number.

    Example:
        >>> c_scalar_type(INT, "double"), c_scalar_type(FLOAT, "double")
        ('int64_t', 'double')
    """
    known: dict[ValueType, str] = {BOOL: "int", INT: "int64_t", SINGLE: "float"}
    return known.get(value_type, real)


_RENAMED_FUNCTIONS = {"arccos": "acos", "arcsin": "asin", "arctan": "atan", "arctan2": "atan2"}

REAL_FUNCTIONS = frozenset(_RENAMED_FUNCTIONS) | frozenset(
    [
        "acos",
        "acosh",
        "asin",
        "asinh",
        "atan",
        "atan2",
        "atanh",
        "cbrt",
        "copysign",
        "cos",
        "cosh",
        "exp",
        "exp2",
        "expm1",
        "fabs",
        "hypot",
        "log",
        "log10",
        "log1p",
        "log2",
        "pow",
        "sin",
        "sinh",
        "sqrt",
        "tan",
        "tanh",
    ]
)
"""Functions of ``math`` and ``numpy`` from real numbers to a real number."""

REAL_CONSTANTS = {name: float(getattr(math, name)) for name in ("e", "inf", "nan", "pi", "tau")}
"""Constants of ``math`` and ``numpy``."""

MODULE_ALIASES = ("math", "np", "numpy")
"""Names of ``math`` and ``numpy`` in compiled functions."""


def c_function_name(name: str) -> str:
    """Return the C name of a function from real numbers to a real number."""
    return _RENAMED_FUNCTIONS.get(name, name)


@dataclass(frozen=True)
class HelperFunction:
    """A C function that implements an operator or a built-in function of Python.

    Attributes:
        name: name in C, after the prefix.
        result_type: type of the result.
        definition: C code; ``@`` stands for the prefix, ``real`` for the type of real
            numbers, and a call like ``fmod!(`` for a library function in its precision.
    """

    name: str
    result_type: ScalarType
    definition: str


def _make_helper(
    name: str, parameters: str, body: str, result_type: ScalarType = FLOAT
) -> HelperFunction:
    kind = "real" if result_type == FLOAT else "int64_t"
    lines = "".join(f"    {line}\n" for line in body.strip().splitlines())
    return HelperFunction(
        name, result_type, f"static inline {kind} @{name}({parameters})\n{{\n{lines}}}\n"
    )


_DIVMOD_BODY = """real rest = fmod!(a, b);
real whole = (a - rest) / b;
real below;
if (rest != 0) {
    if ((b < 0) != (rest < 0)) {
        rest += b;
        whole -= 1;
    }
} else {
    rest = copysign!(0, b);
}
below = floor!(whole);
if (whole - below > (real)0.5) {
    below += 1;
}
"""

HELPERS = {
    helper.name: helper
    for helper in (
        _make_helper("max", "real a, real b", "return b > a ? b : a;"),
        _make_helper("min", "real a, real b", "return b < a ? b : a;"),
        _make_helper("max_int", "int64_t a, int64_t b", "return b > a ? b : a;", INT),
        _make_helper("min_int", "int64_t a, int64_t b", "return b < a ? b : a;", INT),
        _make_helper("abs_int", "int64_t a", "return a < 0 ? -a : a;", INT),
        _make_helper(
            "floor", "real x",
            "const int64_t whole = (int64_t)x;\nreturn whole - (x < (real)whole);", INT,
        ),
        _make_helper(
            "ceil", "real x",
            "const int64_t whole = (int64_t)x;\nreturn whole + (x > (real)whole);", INT,
        ),
        _make_helper("round", "real x", "return (int64_t)rint!(x);", INT),
        _make_helper(
            "quotient_int", "int64_t a, int64_t b",
            "if (b == 0) {\n    return 0;\n}\n"
            "return a / b - (a % b != 0 && (a < 0) != (b < 0));", INT,
        ),
        _make_helper(
            "rest_int", "int64_t a, int64_t b",
            "if (b == 0) {\n    return 0;\n}\n"
            "return a % b + (a % b != 0 && (a < 0) != (b < 0) ? b : 0);", INT,
        ),
        _make_helper("quotient", "real a, real b", _DIVMOD_BODY + "(void)rest;\nreturn below;"),
        _make_helper("rest", "real a, real b", _DIVMOD_BODY + "(void)below;\nreturn rest;"),
        _make_helper(
            "power", "real a, int64_t n",
            "real result = 1;\nint64_t left = n < 0 ? -n : n;\n"
            "while (left != 0) {\n    if (left & 1) {\n        result *= a;\n    }\n"
            "    left >>= 1;\n    a *= a;\n}\nreturn n < 0 ? 1 / result : result;",
        ),
    )
}  # fmt: skip
"""C functions for operators and built-in functions of Python, by name."""


def power_helper(exponent: int, base: ScalarType) -> HelperFunction:
    """Return the C function of a constant power by repeated squaring, as in Numba.

    Example:
        >>> print(power_helper(3, FLOAT).definition)
        static inline real @power_3(real a)
        {
            const real a2 = a * a;
            return a * a2;
        }
        <BLANKLINE>
    """
    kind = "real" if base == FLOAT else "int64_t"
    lines, factors, left, name, step = [], [], abs(exponent), "a", 1
    while left:
        if left & 1:
            factors.append(name)
        left >>= 1
        if left:
            step *= 2
            lines.append(f"const {kind} a{step} = {name} * {name};")
            name = f"a{step}"
    product = " * ".join(factors) or "1"
    lines.append(f"return 1 / ({product});" if exponent < 0 else f"return {product};")
    sign = "minus_" if exponent < 0 else ""
    suffix = "" if base == FLOAT else "_int"
    whole = f"power{suffix}_{sign}{abs(exponent)}"
    return _make_helper(whole, f"{kind} a", "\n".join(lines), base)
