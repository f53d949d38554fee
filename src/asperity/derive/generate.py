"""The kernels of a law as scalar Python source that Numba compiles, from its SymPy expressions.

Run as ``python -m asperity.derive.generate [--check]``, it writes the kernels of the shipped laws
into the package, or checks that they are up to date; ``make kernels`` and ``make check`` do.
"""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Sequence
from typing import Any

import sympy as sp
from sympy.printing.pycode import PythonCodePrinter

from asperity.contacts.contact import parameter_name
from asperity.contacts.symbols import ARGUMENT_ORDER, DEPTH
from asperity.core.errors import LawError
from asperity.derive.derivatives import ROOT, Derivation, derive, substitute_root
from asperity.derive.facts import derive_facts, facts_source, generated_kernel_path
from asperity.laws import LAWS, Law

_MAX_UNROLLED_POWER = 4


class _ScalarPrinter(PythonCodePrinter):  # type: ignore[misc]  # SymPy is untyped
    """Printer of a law's formulas: parameters by their names in compiled code, powers as products.

    A call of ``pow`` for a small integer power would cost more than the rest.

    Args:
        parameters: the symbols of the law's parameters.
    """

    def __init__(self, parameters: Sequence[Any]) -> None:
        super().__init__({"fully_qualified_modules": True})
        self._parameters = frozenset(parameters)

    def _print_Symbol(self, expr: Any) -> str:  # noqa: N802 - SymPy's name
        return parameter_name(expr.name) if expr in self._parameters else str(expr)

    def _print_Pow(self, expr: Any, rational: bool = False) -> str:  # noqa: N802 - SymPy's name
        exponent = expr.exp
        if exponent.is_Integer and 1 < abs(int(exponent)) <= _MAX_UNROLLED_POWER:
            base = self.parenthesize(expr.base, 100)
            product = "*".join([base] * abs(int(exponent)))
            return f"({product})" if exponent > 0 else f"(1.0/({product}))"
        return str(super()._print_Pow(expr, rational=rational))

    def _print_not_supported(self, expr: Any) -> str:
        raise LawError(f"the kernels have no function {type(expr).__name__}")


def law_source(law: Law) -> str:
    """Return the kernels of a law as Python source.

    Functions ``law_force`` (3 values) and ``law_jacobian`` (3 + 9 values, row by row); for a law
    that can be clamped also ``law_jacobian_saturated`` (9 values), the Jacobian at a fixed depth.
    Their arguments are the contact symbols and parameters that they use.

    Raises:
        LawError: see :func:`asperity.derive.derivatives.derive`.
    """
    d = derive(law)
    force = list(d.force)
    jacobian = list(d.jacobian)
    saturated = list(d.jacobian_saturated)
    both_text = "Force [N] and Jacobian [N/m]: fx, fy, fz, then J row by row."
    fixed_text = "Jacobian [N/m], row by row, where a clamp holds the depth constant."
    parts = [
        function_source(d, "law_force", force, "Force on the probe: fx, fy, fz [N]."),
        function_source(d, "law_jacobian", force + jacobian, both_text),
    ]
    if law.clampable:
        parts.append(function_source(d, "law_jacobian_saturated", saturated, fixed_text))
    return "\n\n".join(parts)


def law_energy_source(law: Law) -> str:
    """Return ``law_energy`` of a law as Python source; empty without a potential in closed form.

    Its values are the potential energy [J] and the derivative by the depth [N].
    """
    facts = derive_facts(law)
    if law.stateful or not (facts.conservative and facts.vanishes_at_contact):
        return ""
    derivation = derive(law)
    energy = law.contact.potential(derivation.force)
    if energy is None:
        return ""
    values = [energy, energy.diff(DEPTH)]
    return function_source(derivation, "law_energy", values, "Energy [J], and by the depth [N].")


def function_source(derivation: Derivation, name: str, values: list[Any], summary: str) -> str:
    """Return the source of one scalar function, with common subexpressions eliminated."""
    values = [sp.sympify(value) for value in values]
    definitions = dict(derivation.definitions)
    if definitions.keys().isdisjoint(sp.Matrix(values).free_symbols):
        definitions = {}
    used = sp.Matrix([*values, *definitions.values()]).free_symbols
    parameters = [sp.Symbol(parameter, real=True) for parameter in derivation.law.parameters]
    arguments = [symbol for symbol in (*ARGUMENT_ORDER, *parameters) if symbol in used]
    values = [substitute_root(value) for value in values]
    definitions = {symbol: substitute_root(value) for symbol, value in definitions.items()}
    lines = []
    if ROOT in sp.Matrix([*values, *definitions.values()]).free_symbols:
        lines.append("s = math.sqrt(1.0 + hx*hx + hy*hy)")
    printer = _ScalarPrinter(parameters)
    lines += [f"{symbol} = {printer.doprint(value)}" for symbol, value in definitions.items()]
    shared, results = sp.cse(values, symbols=sp.numbered_symbols("t"), order="canonical")
    lines += [f"{symbol} = {printer.doprint(value)}" for symbol, value in shared]
    lines.append("return (")
    for value in results:
        text = printer.doprint(value)
        if text.lstrip("-").isdigit():
            text = f"{text}.0"
        lines.append(f"    {text},")
    lines.append(")")
    body = textwrap.indent("\n".join(lines), "    ")
    header = f"def {name}({', '.join(map(printer.doprint, arguments))}):"
    return f'{header}\n    """{summary}"""\n{body}\n'


def kernel_file_text(law: Law) -> str:
    """Return the kernel file of a law: its documentation, its facts and the functions."""
    doc = (sys.modules[law.force.__module__].__doc__ or law.summary).strip()
    title = f"Kernels of law {law.letter}. Generated by `make kernels`, do not edit."
    head = f'"""{title}\n\n{doc}\n"""\n\nimport math\n\n# What the symbols say of this law.'
    functions = "\n\n".join(filter(None, [law_source(law), law_energy_source(law)]))
    return f"{head}\n{facts_source(law)}\n\n\n{functions}"


def main(arguments: list[str]) -> int:
    """Write the generated files, or with ``--check`` list those that are out of date."""
    stale = []
    for law in LAWS.values():
        path = generated_kernel_path(law)
        text = kernel_file_text(law)
        current = path.read_text(encoding="utf-8") if path.exists() else ""
        if current == text:
            continue
        stale.append(path.name)
        if "--check" not in arguments:
            path.write_bytes(text.encode())
    if "--check" in arguments and stale:
        sys.stderr.write(f"out of date, run `make kernels`: {', '.join(stale)}\n")
        return 1
    sys.stdout.write(f"{len(LAWS)} laws, {len(stale)} {'stale' if stale else 'changes'}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
