"""The exact Jacobian of a law, by the chain rule through its contact."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import sympy as sp

from asperity.contacts import symbols as sym
from asperity.core.errors import LawError
from asperity.laws.law import Law

# s = |w| = √(1 + h_x² + h_y²), as a separate symbol so that formulas become rational.
ROOT = sp.Symbol("s", positive=True)
ROOT_SQUARED = 1 + sym.HX**2 + sym.HY**2


@dataclass(frozen=True)
class Derivation:
    """A law with its force and Jacobians, as SymPy matrices.

    Attributes:
        law: the law.
        force: force on the probe [N], shape (3, 1).
        jacobian: J[i, j] = ∂f_i/∂p_j [N/m], shape (3, 3).
        jacobian_saturated: the same at a fixed depth, as below a clamp.
        definitions: names that the Jacobians use for common subexpressions of the contact's
            derivative, with their values, in order; see :func:`expand_definitions`.
    """

    law: Law
    force: Any
    jacobian: Any
    jacobian_saturated: Any
    definitions: tuple[tuple[Any, Any], ...] = ()


@lru_cache(maxsize=64)
def derive(law: Law) -> Derivation:
    """Derive the Jacobian of a law.

    J = ∂f/∂depth ∇depth + ∂f/∂(h, h_x, h_y) ∂(h, h_x, h_y)/∂(X, Y) ∂(X, Y)/∂p
        + ∂f/∂d ∂d/∂p + ∂f/∂p.

    Raises:
        LawError: if the formula fails, or uses symbols that the contact does not offer.

    Example:
        >>> from asperity.laws import find_law
        >>> derive(find_law("A")).jacobian
        Matrix([
        [   0,    0,  0],
        [   0,    0,  0],
        [hx*k, hy*k, -k]])
    """
    force = symbolic_force(law)
    contact = law.contact.derivatives()
    by_height = force.jacobian([sym.H, sym.HX, sym.HY])
    height_by_point = sp.Matrix([[sym.HX, sym.HY], [sym.HXX, sym.HXY], [sym.HXY, sym.HYY]])
    saturated = by_height * height_by_point * contact.point_derivative
    saturated += force.jacobian(list(sym.POSITION))
    if law.stateful:
        # ∂d/∂p is an argument: the identity while sticking, I - u uᵀ while sliding.
        motion = sp.Matrix([[sym.SXX, sym.SXY, 0], [sym.SXY, sym.SYY, 0]])
        saturated += force.jacobian([sym.DX, sym.DY]) * motion
    saturated += law.contact.jacobian_contribution(force)
    full = saturated + force.diff(sym.DEPTH) * contact.depth_gradient
    return Derivation(
        law, force, _factor_entries(full), _factor_entries(saturated), contact.definitions
    )


def expand_definitions(derivation: Derivation, matrix: Any) -> Any:
    """Return a matrix of a derivation in contact symbols only."""
    for name, value in reversed(derivation.definitions):
        matrix = matrix.subs(name, value)
    return matrix


def substitute_root(expression: Any) -> Any:
    """Return an expression in which every power of the root is a power of s."""
    return expression.replace(
        lambda e: e.is_Pow and e.base == ROOT_SQUARED, lambda e: ROOT ** (2 * e.exp)
    )


def symbolic_force(law: Law) -> Any:
    """Return the validated force of a law as a (3, 1) SymPy matrix.

    Raises:
        LawError: see :func:`derive`.
    """
    symbols = sym.ContactSymbols(tuple(law.parameters), law.contact.contact_vector())
    _check_parameter_names(law)
    if law.stateful and "max_deflection" not in law.parameters:
        raise LawError(f"law {law.letter}: a law with state needs the parameter max_deflection")
    try:
        force = sp.Matrix(law.force(symbols))
    except Exception as error:  # whatever the formula raises is an error in the formula
        message = " ".join(str(error).split())
        raise LawError(
            f"law {law.letter}: its force is not a symbolic formula ({message}); it must return "
            "three SymPy expressions in the contact symbols, from which Jacobian, kernel and "
            "bounds are derived. Functions of math and NumPy only compute numbers: use SymPy's, "
            "such as sympy.sqrt or sympy.Piecewise"
        ) from error
    if force.shape != (3, 1):
        raise LawError(f"law {law.letter}: force must have 3 components, got {force.shape}")
    if force.has(sp.oo, -sp.oo, sp.zoo, sp.nan, sp.I):
        raise LawError(f"law {law.letter}: force must be real and finite, got {force.T}")
    _check_symbols(law, force)
    return force


def _check_parameter_names(law: Law) -> None:
    definitions = [name for name, _ in law.contact.derivatives().definitions]
    symbols = {str(symbol) for symbol in (*sym.ARGUMENT_ORDER, *definitions)}
    for name in law.parameters:
        if not name.isidentifier():
            raise LawError(
                f"law {law.letter}: a parameter needs a name like a variable's, got {name!r}"
            )
        if name in symbols:
            reason = f"formulas on the {law.contact} contact have another symbol of that name"
            raise LawError(f"law {law.letter}: a parameter cannot be called {name!r}: {reason}")


def _check_symbols(law: Law, force: Any) -> None:
    own = [sp.Symbol(name, real=True) for name in law.parameters]
    state = (sym.DX, sym.DY) if law.stateful else ()
    allowed = {*sym.POSITION, sym.K, sym.H_MID, sym.H_HALF, *own, *state}
    allowed |= {*law.contact.formula_symbols()}
    unknown = sorted(str(symbol) for symbol in force.free_symbols - allowed)
    if unknown:
        raise LawError(
            f"law {law.letter}: force uses {', '.join(unknown)}, which the contact does not offer; "
            "known: depth, h, slope (on the split contact toward instead), position, k, the "
            "parameters, and deflection if stateful (second derivatives of h enter through the "
            "Jacobian only)"
        )


def _factor_entries(matrix: Any) -> Any:
    return matrix.applyfunc(lambda entry: sp.factor_terms(sp.powsimp(entry)))
