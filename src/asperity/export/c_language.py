"""Types of values in compiled functions, and the C functions that implement Python operations.

Compiled functions (:mod:`asperity.core.compiled`) use numbers, tuples and records of numbers,
arrays of a constant shape, and constants: the records of texture and law with their arrays, which
an exported program holds as data.

Operations have the semantics of Numba: ``math.floor`` and ``int`` return a 64-bit integer, ``min``
and ``max`` compare from left to right, a remainder has the sign of the divisor, and a constant
power is a product by repeated squaring.

The templates of exported files are those of the folder ``templates``.
"""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from typing import NamedTuple

from asperity.core.errors import ParameterError


class NotExportableError(ParameterError):
    """A compiled function that cannot be exported to C, with the construct and the function."""

    def __init__(self, function: str, construct: str) -> None:
        super().__init__("law", f"cannot be exported: the function {function!r} {construct}")


@dataclass(frozen=True, order=True)
class ScalarType:
    """Type of a scalar; the common type of two scalars is the greater one.

    Attributes:
        rank: place in the order of the types.
        name: name of the type in Numba: ``float64``, ``float32``, ``int64`` or ``bool``.
    """

    rank: int
    name: str


BOOL, INT, SINGLE, FLOAT = map(ScalarType, range(4), ("bool", "int64", "float32", "float64"))


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

    def item_expression(self, value: str, index: int) -> str:
        """Return the C expression of an item of a value.

        Example:
            >>> TupleType((FLOAT, FLOAT)).item_expression("t", 1)
            't.v[1]'
            >>> TupleType((FLOAT, INT)).item_expression("t", 1)
            't.f1'
        """
        return f"{value}.v[{index}]" if self.is_uniform else f"{value}.f{index}"


@dataclass(frozen=True)
class ConstantRecord(TupleType):
    """A constant record of numbers and arrays, which is data of the program.

    Attributes:
        c_name: name in the program.
        read_macro: macro that hides the value of a real number from the compiler; empty for none.
    """

    c_name: str = ""
    read_macro: str = ""

    @property
    def is_uniform(self) -> bool:
        """False: items have names in C."""
        return False

    def item_expression(self, value: str, index: int) -> str:
        """Return the C expression of an item of the record."""
        place = f"{value}.{self.names[index]}"
        if self.read_macro:
            return f"{self.read_macro}({place})"
        return place


@dataclass(frozen=True)
class ArrayType:
    """Type of a work array on the stack, or of a constant array, which is data of the program.

    Attributes:
        shape: shape of the array.
        element: type of the elements.
        c_name: name of a constant array in the program; empty for a work array.
        lengths: C expressions of the lengths of a constant array that is loaded at run time and
            stored without gaps; empty for one of the given shape.
    """

    shape: tuple[int, ...]
    element: ScalarType = FLOAT
    c_name: str = ""
    lengths: tuple[str, ...] = ()


@dataclass(frozen=True)
class VoidType:
    """Result type of a function without a result."""


VOID = VoidType()

ValueType = ScalarType | TupleType | ArrayType | VoidType


def constant_name(value_type: ValueType) -> str:
    """Return the name of a constant, which is not passed to C functions; empty for a variable."""
    return value_type.c_name if isinstance(value_type, (ArrayType, ConstantRecord)) else ""


def is_constant(value_type: ValueType) -> bool:
    """Return whether a type is a constant, which is not passed to C functions."""
    return bool(constant_name(value_type))


def common_type(first: ValueType, second: ValueType) -> ValueType | None:
    """Return the type of a variable that holds values of both types, ``None`` if there is none.

    Example:
        >>> common_type(INT, FLOAT).name, common_type(INT, ArrayType((3,)))
        ('float64', None)
    """
    if first == second:
        return first
    if isinstance(first, ScalarType) and isinstance(second, ScalarType):
        return max(first, second)
    if not (isinstance(first, TupleType) and isinstance(second, TupleType)):
        return None
    if first.names != second.names or len(first.items) != len(second.items):
        return None
    common = list(map(common_type, first.items, second.items))
    items = tuple([item for item in common if item is not None])
    return TupleType(items, first.names) if len(items) == len(common) else None


def c_scalar_type(value_type: ValueType, real: str) -> str:
    """Return the C type of a number.

    Example:
        >>> c_scalar_type(INT, "double"), c_scalar_type(FLOAT, "double")
        ('int64_t', 'double')
    """
    known: dict[ValueType, str] = {BOOL: "int", INT: "int64_t", SINGLE: "float"}
    return known.get(value_type, real)


# Functions from real numbers to a real number, which C and Python call by the same name.
_SAME_FUNCTIONS = """
    acos acosh asin asinh atan atan2 atanh cbrt copysign cos cosh exp exp2 expm1 fabs hypot
    log log10 log1p log2 pow sin sinh sqrt tan tanh
"""
REAL_FUNCTIONS = {name: name for name in _SAME_FUNCTIONS.split()}
REAL_FUNCTIONS |= {f"arc{name}": f"a{name}" for name in ("cos", "sin", "tan", "tan2")}
"""C functions of the functions of ``math`` and ``numpy`` from real numbers to a real number."""

REAL_CONSTANTS = {name: float(getattr(math, name)) for name in ("e", "inf", "nan", "pi", "tau")}

BIT_OPERATORS: dict[type[ast.operator], str] = {
    ast.LShift: "<<",
    ast.RShift: ">>",
    ast.BitAnd: "&",
    ast.BitOr: "|",
    ast.BitXor: "^",
}

MODULE_ALIASES = ("math", "np", "numpy")
"""Names of ``math`` and ``numpy`` in compiled functions."""


class HelperFunction(NamedTuple):
    """A C function that implements an operator or a built-in function of Python.

    Attributes:
        name: name in C, after the prefix.
        definition: C code; ``@`` stands for the prefix, ``real`` for the type of real
            numbers, and a call like ``fmod!(`` for a library function in its precision.
    """

    name: str
    definition: str


def find_helper(name: str) -> HelperFunction:
    """Return a helper function of the template ``helpers.c``.

    Example:
        >>> print(find_helper("abs_int").definition, end="")
        static inline int64_t @abs_int(int64_t a)
        {
            return a < 0 ? -a : a;
        }
    """
    definitions = load_template("helpers.c").split("\n\n")
    (definition,) = [text for text in definitions if f" @{name}(" in text.split("{")[0]]
    return HelperFunction(name, definition.rstrip() + "\n")


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
    kind = "int64_t"
    name = "power_int"
    if base == FLOAT:
        kind = "real"
        name = "power"
    lines = []
    factors = []
    remaining = abs(exponent)
    square = "a"
    step = 1
    while remaining:
        if remaining & 1:
            factors.append(square)
        remaining >>= 1
        if remaining:
            step *= 2
            lines.append(f"    const {kind} a{step} = {square} * {square};\n")
            square = f"a{step}"
    product = " * ".join(factors) or "1"
    if exponent < 0:
        name = f"{name}_minus"
        product = f"1 / ({product})"
    name = f"{name}_{abs(exponent)}"
    body = "".join([*lines, f"    return {product};\n"])
    return HelperFunction(name, f"static inline {kind} @{name}({kind} a)\n{{\n{body}}}\n")


@lru_cache(maxsize=16)
def load_template(name: str) -> str:
    """Return a file of the folder ``templates``."""
    return resources.files("asperity.export").joinpath("templates", name).read_text("utf-8")


def fill_template(text: str, values: Mapping[str, str]) -> str:
    """Return a template with its placeholders, such as ``@name@``, replaced.

    Example:
        >>> fill_template("void @name@_reset(void);", {"name": "texture"})
        'void texture_reset(void);'
    """
    return re.sub(r"@(\w+)@", lambda match: values[match[1]], text)
