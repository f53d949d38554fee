"""What compiled functions may call besides each other, and how C says it.

Numba's meaning counts: ``math.floor`` and ``int`` make a 64-bit integer, ``min``, ``max`` go from
argument to argument, the sign of a remainder is that of the divisor, and a constant power is a
product by repeated squaring.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from asperity.export.subset import FLOAT, INT, Number

# Functions of one or more real numbers that C's library has under another name, or the same.
_REAL = {
    "acos": "acos", "acosh": "acosh", "asin": "asin", "asinh": "asinh", "atan": "atan",
    "arccos": "acos", "arcsin": "asin", "arctan": "atan", "arctan2": "atan2",
    "atan2": "atan2", "atanh": "atanh", "cbrt": "cbrt", "copysign": "copysign", "cos": "cos",
    "cosh": "cosh", "exp": "exp", "exp2": "exp2", "expm1": "expm1", "fabs": "fabs",
    "hypot": "hypot", "log": "log", "log10": "log10", "log1p": "log1p", "log2": "log2",
    "pow": "pow", "sin": "sin", "sinh": "sinh", "sqrt": "sqrt", "tan": "tan", "tanh": "tanh",
}  # fmt: skip

REAL_FUNCTIONS = frozenset(_REAL)
"""Names in ``math`` and ``numpy`` of functions from real numbers to a real number."""

REAL_CONSTANTS = {
    "e": math.e, "inf": math.inf, "nan": math.nan, "pi": math.pi, "tau": math.tau,
}  # fmt: skip
"""Numbers in ``math`` and ``numpy``."""

LIBRARIES = ("math", "np", "numpy")
"""Names by which compiled functions know ``math`` and ``numpy``."""


def real_function(name: str) -> str:
    """Return the name in C of a function from real numbers to a real number."""
    return _REAL[name]


@dataclass(frozen=True)
class Helper:
    """A small C function that says what an operator or a builtin of Python means.

    Attributes:
        name: in C, after the prefix.
        result: kind of its value.
        text: its definition; ``@`` stands for the prefix, ``real`` for the type of real numbers,
            and a call like ``fmod!(`` for a function of the library in its precision.
    """

    name: str
    result: Number
    text: str


def _real(name: str, parameters: str, body: str, result: Number = FLOAT) -> Helper:
    kind = "real" if result == FLOAT else "int64_t"
    lines = "".join(f"    {line}\n" for line in body.strip().splitlines())
    return Helper(name, result, f"static inline {kind} @{name}({parameters})\n{{\n{lines}}}\n")


_DIVMOD = """real rest = fmod!(a, b);
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
        _real("max", "real a, real b", "return b > a ? b : a;"),
        _real("min", "real a, real b", "return b < a ? b : a;"),
        _real("max_int", "int64_t a, int64_t b", "return b > a ? b : a;", INT),
        _real("min_int", "int64_t a, int64_t b", "return b < a ? b : a;", INT),
        _real("abs_int", "int64_t a", "return a < 0 ? -a : a;", INT),
        _real(
            "floor", "real x",
            "const int64_t whole = (int64_t)x;\nreturn whole - (x < (real)whole);", INT,
        ),
        _real(
            "ceil", "real x",
            "const int64_t whole = (int64_t)x;\nreturn whole + (x > (real)whole);", INT,
        ),
        _real("round", "real x", "return (int64_t)rint!(x);", INT),
        _real(
            "quotient_int", "int64_t a, int64_t b",
            "if (b == 0) {\n    return 0;\n}\n"
            "return a / b - (a % b != 0 && (a < 0) != (b < 0));", INT,
        ),
        _real(
            "rest_int", "int64_t a, int64_t b",
            "if (b == 0) {\n    return 0;\n}\n"
            "return a % b + (a % b != 0 && (a < 0) != (b < 0) ? b : 0);", INT,
        ),
        _real("quotient", "real a, real b", _DIVMOD + "(void)rest;\nreturn below;"),
        _real("rest", "real a, real b", _DIVMOD + "(void)below;\nreturn rest;"),
        _real(
            "power", "real a, int64_t n",
            "real result = 1;\nint64_t left = n < 0 ? -n : n;\n"
            "while (left != 0) {\n    if (left & 1) {\n        result *= a;\n    }\n"
            "    left >>= 1;\n    a *= a;\n}\nreturn n < 0 ? 1 / result : result;",
        ),
    )
}  # fmt: skip
"""Small C functions that say what operators and builtins of Python mean."""


def power_helper(exponent: int, base: Number) -> Helper:
    """Return the function of a constant power: by repeated squaring, as Numba does.

    Example:
        >>> print(power_helper(3, FLOAT).text)
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
    return _real(whole, f"{kind} a", "\n".join(lines), base)
