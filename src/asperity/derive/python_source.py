"""SymPy expressions as scalar Python source that Numba compiles."""

from __future__ import annotations

import textwrap
from typing import Any

import sympy as sp
from sympy.printing.pycode import PythonCodePrinter

from asperity.contacts.symbols import ARGUMENT_ORDER
from asperity.derive.jacobian import ROOT, Derivation, derive, with_root_symbol
from asperity.errors import LawError
from asperity.laws.law import Law

_LARGEST_UNROLLED_POWER = 4


class _ScalarPrinter(PythonCodePrinter):  # type: ignore[misc]  # SymPy is untyped
    """Print small integer powers as products: a call of pow costs more than the rest."""

    def _print_Pow(self, expr: Any, rational: bool = False) -> str:  # noqa: N802 - SymPy's name
        exponent = expr.exp
        if exponent.is_Integer and 1 < abs(int(exponent)) <= _LARGEST_UNROLLED_POWER:
            base = self.parenthesize(expr.base, 100)
            product = "*".join([base] * abs(int(exponent)))
            return f"({product})" if exponent > 0 else f"(1.0/({product}))"
        return str(super()._print_Pow(expr, rational=rational))

    def _print_not_supported(self, expr: Any) -> str:
        raise LawError(f"the kernels know no function {type(expr).__name__}")


def law_source(law: Law) -> str:
    """Return the kernels of a law as Python source.

    Functions ``law_force`` (3 values) and ``law_jacobian`` (3 + 9 values, row by row); for a law
    that can be clamped also ``law_jacobian_saturated`` (9 values), the Jacobian where a clamp
    holds the depth constant. Each takes those of the contact symbols and parameters that it uses.

    Raises:
        LawError: see :func:`asperity.derive.jacobian.derive`.
    """
    d = derive(law)
    force, jacobian = list(d.force), list(d.jacobian)
    parts = [
        function_source(d, "law_force", force, "Force on the probe: fx, fy, fz [N]."),
        function_source(
            d,
            "law_jacobian",
            force + jacobian,
            "Force [N] and Jacobian [N/m]: fx, fy, fz, then J row by row.",
        ),
    ]
    if law.clampable:
        parts.append(
            function_source(
                d,
                "law_jacobian_saturated",
                list(d.jacobian_saturated),
                "Jacobian [N/m], row by row, where a clamp holds the depth constant.",
            )
        )
    return "\n\n".join(parts)


def function_source(d: Derivation, name: str, values: list[Any], summary: str) -> str:
    """Return one scalar function as source, common subexpressions computed once."""
    values = [sp.sympify(value) for value in values]
    named = {symbol for symbol, _ in d.definitions}
    needed = d.definitions if named & sp.Matrix(values).free_symbols else ()
    every = [with_root_symbol(value) for value in [*(v for _, v in needed), *values]]
    used = sp.Matrix([*values, *(v for _, v in needed)]).free_symbols
    arguments = [symbol for symbol in ARGUMENT_ORDER if symbol in used]
    own = [sp.Symbol(parameter, real=True) for parameter in d.law.parameters]
    arguments += [symbol for symbol in own if symbol in used]
    lines = []
    if any(ROOT in value.free_symbols for value in every):
        lines.append("s = math.sqrt(1.0 + hx*hx + hy*hy)")
    printer = _ScalarPrinter({"fully_qualified_modules": True})
    lines += [f"{symbol} = {printer.doprint(with_root_symbol(value))}" for symbol, value in needed]
    shared, results = sp.cse(
        every[len(needed) :], symbols=sp.numbered_symbols("t"), order="canonical"
    )
    lines += [f"{symbol} = {printer.doprint(value)}" for symbol, value in shared]
    lines.append("return (")
    lines += [f"    {_as_float(printer.doprint(value))}," for value in results]
    lines.append(")")
    body = textwrap.indent("\n".join(lines), "    ")
    header = f"def {name}({', '.join(str(argument) for argument in arguments)}):"
    return f'{header}\n    """{summary}"""\n{body}\n'


def _as_float(text: str) -> str:
    return f"{text}.0" if text.lstrip("-").isdigit() else text
