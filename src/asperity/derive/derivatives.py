"""The exact Jacobian of a law, by the chain rule through its contact, and its curl.

The curl proves that the force field of a law is conservative, or is the reason why it is not.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import sympy as sp

from asperity.contacts import symbols as sym
from asperity.contacts.symbols import CONTACT_VECTOR, DEPTH
from asperity.core.errors import LawError
from asperity.laws.clamps import CLAMPS
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
    _check_functions(law, force)
    _check_stiffness(law, force)
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
    unknown = sorted(map(str, force.free_symbols - allowed))
    if unknown:
        raise LawError(
            f"law {law.letter}: force uses {', '.join(unknown)}, which the contact does not offer; "
            "known: depth, h, slope (on the split contact toward instead), position, k, the "
            "parameters, and deflection if stateful (second derivatives of h enter through the "
            "Jacobian only)"
        )


def _check_functions(law: Law, force: Any) -> None:
    if force.has(sp.floor, sp.ceiling, sp.Mod):
        raise LawError(
            f"law {law.letter}: force must have derivatives, which floor, ceiling and Mod have not"
        )
    for pieces in force.atoms(sp.Piecewise):
        if pieces.args[-1].cond != sp.true:
            raise LawError(
                f"law {law.letter}: sympy.Piecewise needs a last piece (value, True), which holds "
                f"everywhere else, got {pieces}"
            )


def _check_stiffness(law: Law, force: Any) -> None:
    rate = force.diff(sym.K)
    rest = force.subs(sym.K, 0)
    if rate.has(sym.K) or rest != sp.zeros(3, 1):
        rate = sp.simplify(rate)
        rest = sp.simplify(rest)
    if rate.has(sym.K) or rest != sp.zeros(3, 1):
        raise LawError(
            f"law {law.letter}: force must be k times a formula without k, since limits and starts "
            f"scale with the stiffness, got {force.T}"
        )


def _factor_entries(matrix: Any) -> Any:
    return matrix.applyfunc(lambda entry: sp.factor_terms(sp.powsimp(entry)))


PIECEWISE_FUNCTIONS = (
    *(sp.Piecewise, sp.Abs, sp.sign, sp.Max, sp.Min),
    *(sp.Heaviside, sp.floor, sp.ceiling),
)
# The depth at which the arguments of Min and Max are compared where contact begins.
_JUST_INSIDE = sp.Rational(1, 10**40)
# The depth at which a clamp evaluates the force while the probe moves deeper.
_CLAMPED_DEPTH = sp.Symbol("clamped_depth", positive=True)


@dataclass(frozen=True)
class CurlVerdict:
    """The symbolic curl of a law and the verdict that follows from it.

    Attributes:
        conservative: whether the work around every closed path is zero.
        curl: the simplified curl, (3, 1) SymPy matrix in the contact symbols.
        reason: one sentence.
    """

    conservative: bool
    curl: Any
    reason: str


@lru_cache(maxsize=64)
def curl_verdict(law: Law) -> CurlVerdict:
    """Prove that a law is conservative, or return the reason why it is not.

    The curl is reduced to rational functions of the contact symbols and of s = |w|, modulo
    s² = 1 + h_x² + h_y²: it vanishes identically exactly if every numerator reduces to zero.
    Three more conditions must hold. The law has no state. At depth zero the force is along the
    gradient of the depth, so that its potential is the same wherever contact begins. The formula
    is smooth, not piecewise: where the closest point jumps, a smooth force with zero curl on every
    surface is c(p, δ) n + b(p, δ), because its Jacobian must be symmetric for every curvature
    there; it has a potential in p and the distance δ, which do not jump.

    Example:
        >>> from asperity.laws import find_law
        >>> curl_verdict(find_law("C")).conservative, curl_verdict(find_law("B")).conservative
        (True, False)
    """
    derivation = derive(law)
    jacobian = expand_definitions(derivation, derivation.jacobian)
    curl = _curl(jacobian)
    if law.stateful:
        reason = "the force depends on the deflection of the anchor: it is no field of position"
        return CurlVerdict(False, curl, reason)
    if curl != sp.zeros(3, 1):
        return CurlVerdict(False, curl, "the curl is not zero")
    if derivation.force.has(*PIECEWISE_FUNCTIONS):
        return CurlVerdict(False, curl, "not proved: the formula is piecewise")
    if not _is_normal_at_contact(law, derivation.force):
        return CurlVerdict(False, curl, "where contact begins the force has a tangential part")
    if law.contact.single_valued:
        return CurlVerdict(True, curl, "the curl is zero identically")
    return CurlVerdict(True, curl, "the curl is zero identically, its potential does not jump")


def conservative_clamps(law: Law) -> tuple[str, ...]:
    """Return the names of the depth clamps under which a conservative law stays conservative.

    Below max_depth the held components of the force are the law's at that depth, the others its
    own at the depth of the probe. The force is continuous there, and a backing wall has a potential
    of its own, so the curl below max_depth decides.
    """
    if not law.clampable:
        return ()
    derivation = derive(law)
    full = expand_definitions(derivation, derivation.jacobian)
    held = expand_definitions(derivation, derivation.jacobian_saturated).subs(DEPTH, _CLAMPED_DEPTH)
    names = []
    for clamp in CLAMPS.values():
        mixed = sp.Matrix(full)
        for component in clamp.held_components:
            mixed[component, :] = held[component, :]
        if clamp.held_components and _curl(mixed) == sp.zeros(3, 1):
            names.append(clamp.name)
    return tuple(names)


def _curl(jacobian: Any) -> Any:
    """Return the curl of a field from its Jacobian, reduced."""
    return sp.Matrix(
        [
            jacobian[2, 1] - jacobian[1, 2],
            jacobian[0, 2] - jacobian[2, 0],
            jacobian[1, 0] - jacobian[0, 1],
        ]
    ).applyfunc(_canonical_form)


def vanishes_at_contact(force: Any) -> bool:
    """Return whether a symbolic force is proved to vanish where contact begins."""
    start = _force_at_contact(force)
    return start is not None and bool(start.applyfunc(_canonical_form) == sp.zeros(3, 1))


def _force_at_contact(force: Any) -> Any:
    """Return a force where contact begins, ``None`` if its formula has no value there."""
    for extreme in force.atoms(sp.Min, sp.Max):
        inside = extreme.subs(DEPTH, _JUST_INSIDE)
        for argument in extreme.args:
            if argument.subs(DEPTH, _JUST_INSIDE) == inside:
                force = force.subs(extreme, argument)
    try:
        start = force.subs(dict.fromkeys([DEPTH, *CONTACT_VECTOR], 0))
    except ValueError:  # SymPy compares infinity, as in Min(1, 1/depth)
        return None
    return None if start.has(sp.oo, -sp.oo, sp.zoo, sp.nan) else start


def _is_normal_at_contact(law: Law, force: Any) -> bool:
    start = _force_at_contact(force)
    if start is None or not law.contact.is_determined_by_depth:
        return vanishes_at_contact(force)
    across = start.cross(law.contact.derivatives().depth_gradient.T)
    return bool(across.applyfunc(_canonical_form) == sp.zeros(3, 1))


def is_zero(expression: Any) -> bool:
    """Return whether an expression in the contact symbols vanishes identically."""
    return bool(_canonical_form(expression) == 0)


def _canonical_form(expression: Any) -> Any:
    """Return a canonical form, which is zero exactly if the expression vanishes identically."""
    root = sp.sqrt(ROOT_SQUARED)
    rational = substitute_root(expression).subs(root, ROOT)
    numerator, denominator = sp.fraction(sp.together(rational))
    remainder = sp.rem(sp.expand(numerator), ROOT**2 - ROOT_SQUARED, ROOT)
    if sp.expand(remainder) == 0:
        return sp.Integer(0)
    return sp.simplify(sp.factor(remainder) / denominator).subs(ROOT, root)
