"""What the mathematics of a law says once and for all, without loading SymPy for shipped laws."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from fractions import Fraction
from functools import lru_cache
from importlib import import_module
from typing import Any

from asperity.derive.shipped import generated_path
from asperity.laws import LAWS, Law


@dataclass(frozen=True)
class LawFacts:
    """Facts about a law that follow from its symbols.

    Attributes:
        conservative: whether the work around every closed path is zero.
        reason: why, or why not.
        curl: the three components of the symbolic curl, as text.
        begins_at_zero: whether the force vanishes with the depth.
        looks_at_surface: whether the force depends on more of the surface than the depth.
        affine_in_depth: whether the Jacobian is affine in the depth at a fixed contact point; a
            norm of it is then convex, and greatest at an end of the depth range.
        conservative_clamps: the depth clamps under which the law is conservative, too; empty for
            a law that is not, or is not clamped.
    """

    conservative: bool
    reason: str
    curl: tuple[str, str, str]
    begins_at_zero: bool
    looks_at_surface: bool
    affine_in_depth: bool
    conservative_clamps: tuple[str, ...] = ()


@lru_cache(maxsize=64)
def law_facts(law: Law) -> LawFacts:
    """Return the facts of a law: from its generated file, or derived now for a law of your own.

    Example:
        >>> from asperity.laws import find_law
        >>> law_facts(find_law("D")).conservative
        True
    """
    if LAWS.get(law.letter) is not law:
        return derive_facts(law)
    generated = import_module(f"asperity.derive.generated.{generated_path(law).stem}")
    return LawFacts(**generated.FACTS)


def clamped_facts(law: Law, clamp: str) -> LawFacts:
    """Return the facts of the force that a law renders under a depth clamp.

    Example:
        >>> from asperity.laws import find_law
        >>> law = find_law("C")
        >>> clamped_facts(law, "backed").conservative, clamped_facts(law, "lateral").conservative
        (True, False)
    """
    facts = law_facts(law)
    unclamped = clamp == "none" or not law.clampable
    if unclamped or not facts.conservative or clamp in facts.conservative_clamps:
        return facts
    reason = f"below max_depth the {clamp} clamp gives the force a curl"
    return replace(facts, conservative=False, reason=reason)


def derive_facts(law: Law) -> LawFacts:
    """Derive the facts of a law from its symbols.

    Raises:
        LawError: see :func:`asperity.derive.jacobian.derive`.
    """
    from asperity.contacts.symbols import HX, HY, POSITION, H
    from asperity.derive.curl import IN_PIECES, begins_at_zero, conservative_clamps, curl_verdict
    from asperity.derive.jacobian import derive, explicit

    verdict = curl_verdict(law)
    derivation = derive(law)
    force = derivation.force
    moves = bool(derivation.jacobian.free_symbols & set(POSITION))
    x, y, z = (str(component) for component in verdict.curl)
    return LawFacts(
        conservative=verdict.conservative,
        reason=verdict.reason,
        curl=(x, y, z),
        begins_at_zero=begins_at_zero(force),
        looks_at_surface=bool(force.free_symbols & {H, HX, HY}),
        affine_in_depth=not moves
        and not force.has(*IN_PIECES)
        and _is_affine(explicit(derivation, derivation.jacobian)),
        conservative_clamps=conservative_clamps(law) if verdict.conservative else (),
    )


def _is_affine(jacobian: Any) -> bool:
    """Return whether the second derivative by the depth vanishes identically."""
    from asperity.contacts.symbols import DEPTH
    from asperity.derive.curl import is_zero

    bend = jacobian.diff(DEPTH, 2)
    # A point where it is not zero settles it at once; a proof is only tried where there is none.
    somewhere = {
        symbol: Fraction(2 * index + 3, 7 + index)
        for index, symbol in enumerate(sorted(bend.free_symbols, key=str))
    }
    if any(abs(entry.evalf(30, subs=somewhere)) > 1e-20 for entry in bend):
        return False
    return all(is_zero(entry) for entry in bend)


def facts_source(law: Law) -> str:
    """Return the facts as the assignment that the generated file carries."""
    lines = [f"    {name!r}: {value!r}," for name, value in asdict(derive_facts(law)).items()]
    return "\n".join(["FACTS = {", *lines, "}"])
