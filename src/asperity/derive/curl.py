"""Is a law's force field conservative? A proof, or a point where the curl is not zero."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import sympy as sp

from asperity.contacts.symbols import DEPTH, TOWARD
from asperity.derive.jacobian import (
    ROOT,
    ROOT_SQUARED,
    derive,
    explicit,
    with_root_symbol,
)
from asperity.laws.law import Law

IN_PIECES = (sp.Piecewise, sp.Abs, sp.sign, sp.Max, sp.Min, sp.Heaviside, sp.floor, sp.ceiling)
# The depth at which a clamp holds the force, while the probe goes deeper.
_HELD_DEPTH = sp.Symbol("held_depth", positive=True)


@dataclass(frozen=True)
class CurlVerdict:
    """What the symbolic curl of a law says.

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
    """Prove that a law is conservative, or say why it is not.

    The curl is reduced to rational functions of the contact symbols and of s = |w|, modulo
    s² = 1 + h_x² + h_y²: it vanishes identically exactly if every numerator reduces to zero.
    Three things are asked besides. No state. At depth zero the force lies along the gradient of
    the depth, so that its potential is the same wherever contact begins. And one smooth formula,
    not pieces: where the nearest point jumps, a smooth force with zero curl on every surface is
    c(p, δ) n + b(p, δ), because its Jacobian must be symmetric for every curvature there; it has
    a potential in p and the distance δ, which do not jump.

    Example:
        >>> from asperity.laws import find_law
        >>> curl_verdict(find_law("C")).conservative, curl_verdict(find_law("B")).conservative
        (True, False)
    """
    derivation = derive(law)
    jacobian = explicit(derivation, derivation.jacobian)
    curl = _curl(jacobian)
    if law.stateful:
        reason = "the force depends on the deflection of the anchor: it is no field of position"
        return CurlVerdict(False, curl, reason)
    if any(entry != 0 for entry in curl):
        return CurlVerdict(False, curl, "the curl is not zero")
    if derivation.force.has(*IN_PIECES):
        return CurlVerdict(False, curl, "not proved: the formula is in pieces")
    if not _starts_along_the_normal(law, derivation.force):
        return CurlVerdict(False, curl, "where contact begins the force has a tangential part")
    if law.contact.single_valued:
        return CurlVerdict(True, curl, "the curl is zero identically")
    return CurlVerdict(True, curl, "the curl is zero identically, its potential does not jump")


def conservative_clamps(law: Law) -> tuple[str, ...]:
    """Return the depth clamps under which a law that is conservative stays so.

    Below max_depth the force is the law's at that depth; under the lateral clamp its z part is the
    law's at the probe's own depth. The force is continuous there, and the wall behind a backed
    clamp has a potential of its own: what decides is the curl below.
    """
    if not law.clampable:
        return ()
    derivation = derive(law)
    full = explicit(derivation, derivation.jacobian)
    held = explicit(derivation, derivation.jacobian_saturated).subs(DEPTH, _HELD_DEPTH)
    lateral = held[:2, :].col_join(full[2:, :])
    below = {("whole", "backed"): held, ("lateral",): lateral}
    kept = (clamps for clamps, jacobian in below.items() if _curl(jacobian) == sp.zeros(3, 1))
    return tuple(clamp for clamps in kept for clamp in clamps)


def _curl(jacobian: Any) -> Any:
    """Return the curl of a field from its Jacobian, reduced."""
    return sp.Matrix(
        [
            jacobian[2, 1] - jacobian[1, 2],
            jacobian[0, 2] - jacobian[2, 0],
            jacobian[1, 0] - jacobian[0, 1],
        ]
    ).applyfunc(_reduce)


def begins_at_zero(force: Any) -> bool:
    """Return whether a symbolic force vanishes where contact begins."""
    nothing = dict.fromkeys([DEPTH, *TOWARD], 0)
    return bool(force.subs(nothing).applyfunc(_reduce) == sp.zeros(3, 1))


def _starts_along_the_normal(law: Law, force: Any) -> bool:
    start = force.subs(dict.fromkeys([DEPTH, *TOWARD], 0))
    if not law.contact.given_by_depth:
        return begins_at_zero(force)
    across = start.cross(law.contact.derivatives().depth_gradient.T)
    return bool(across.applyfunc(_reduce) == sp.zeros(3, 1))


def is_zero(expression: Any) -> bool:
    """Return whether an expression in the contact symbols vanishes identically."""
    return bool(_reduce(expression) == 0)


def _reduce(expression: Any) -> Any:
    """Return a canonical form: zero exactly if the expression vanishes identically."""
    root = sp.sqrt(ROOT_SQUARED)
    rational = with_root_symbol(expression).subs(root, ROOT)
    numerator, denominator = sp.fraction(sp.together(rational))
    remainder = sp.rem(sp.expand(numerator), ROOT**2 - ROOT_SQUARED, ROOT)
    if sp.expand(remainder) == 0:
        return sp.Integer(0)
    return sp.simplify(sp.factor(remainder) / denominator).subs(ROOT, root)
