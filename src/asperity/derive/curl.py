"""Proof that the force field of a law is conservative, or the reason why it is not."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import sympy as sp

from asperity.clamps import CLAMPS
from asperity.contacts.symbols import CONTACT_VECTOR, DEPTH
from asperity.derive.jacobian import ROOT, ROOT_SQUARED, derive, expand_definitions, substitute_root
from asperity.laws.law import Law

PIECEWISE_FUNCTIONS = (
    *(sp.Piecewise, sp.Abs, sp.sign, sp.Max, sp.Min),
    *(sp.Heaviside, sp.floor, sp.ceiling),
)
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
    if any(entry != 0 for entry in curl):
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
    curl_free = {
        components
        for components in {clamp.held_components for clamp in CLAMPS.values()} - {()}
        if _curl(sp.Matrix.vstack(*((held if i in components else full)[i, :] for i in range(3))))
        == sp.zeros(3, 1)
    }
    return tuple(c.name for c in CLAMPS.values() if c.held_components in curl_free)


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
    """Return whether a symbolic force vanishes where contact begins."""
    zero = dict.fromkeys([DEPTH, *CONTACT_VECTOR], 0)
    return bool(force.subs(zero).applyfunc(_canonical_form) == sp.zeros(3, 1))


def _is_normal_at_contact(law: Law, force: Any) -> bool:
    start = force.subs(dict.fromkeys([DEPTH, *CONTACT_VECTOR], 0))
    if not law.contact.is_determined_by_depth:
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
