"""Facts about a law that follow from its symbols; those of shipped laws need no SymPy."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from fractions import Fraction
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import Any

from asperity.laws import LAWS, Law
from asperity.laws.clamps import Clamp

GENERATED_DIRECTORY = Path(__file__).parent / "generated"


def generated_kernel_path(law: Law) -> Path:
    """Return the path of the generated kernels of a shipped law."""
    return GENERATED_DIRECTORY / f"law_{law.letter.lower()}.py"


@dataclass(frozen=True)
class LawFacts:
    """Facts about a law that follow from its symbols.

    Attributes:
        conservative: whether the work around every closed path is zero.
        reason: why, or why not.
        curl: the three components of the symbolic curl, as text.
        vanishes_at_contact: whether the force vanishes with the depth.
        depends_on_surface: whether the force depends on more of the surface than the depth.
        affine_in_depth: whether the Jacobian is affine in the depth at a fixed contact point; a
            norm of it is then convex, and greatest at an end of the depth range.
        conservative_clamps: names of the depth clamps under which the law stays conservative;
            empty for a law that is not conservative or cannot be clamped.
    """

    conservative: bool
    reason: str
    curl: tuple[str, str, str]
    vanishes_at_contact: bool
    depends_on_surface: bool
    affine_in_depth: bool
    conservative_clamps: tuple[str, ...] = ()


@lru_cache(maxsize=64)
def law_facts(law: Law) -> LawFacts:
    """Return the facts of a law: from its generated file, or derived for a user-defined law.

    Example:
        >>> from asperity.laws import find_law
        >>> law_facts(find_law("D")).conservative
        True
    """
    if LAWS.get(law.letter) is not law:
        return derive_facts(law)
    generated = import_module(f"asperity.derive.generated.law_{law.letter.lower()}")
    return LawFacts(**generated.FACTS)


def clamped_facts(law: Law, clamp: Clamp) -> LawFacts:
    """Return the facts of the force that a law renders under a depth clamp.

    Example:
        >>> from asperity.laws import find_law
        >>> from asperity.laws.clamps import BACKED, LATERAL
        >>> law = find_law("C")
        >>> clamped_facts(law, BACKED).conservative, clamped_facts(law, LATERAL).conservative
        (True, False)
    """
    facts = law_facts(law)
    unclamped = not (clamp.changes_force and law.clampable)
    if unclamped or not facts.conservative or clamp.name in facts.conservative_clamps:
        return facts
    reason = f"below max_depth the {clamp} clamp gives the force a curl"
    return replace(facts, conservative=False, reason=reason)


@lru_cache(maxsize=64)
def derive_facts(law: Law) -> LawFacts:
    """Derive the facts of a law from its symbols.

    Raises:
        LawError: see :func:`asperity.derive.derivatives.derive`.
    """
    from asperity.contacts.symbols import HX, HY, POSITION, H
    from asperity.derive.derivatives import (
        PIECEWISE_FUNCTIONS,
        conservative_clamps,
        curl_verdict,
        derive,
        expand_definitions,
        vanishes_at_contact,
    )

    verdict = curl_verdict(law)
    derivation = derive(law)
    force = derivation.force
    clamps: tuple[str, ...] = ()
    if verdict.conservative:
        clamps = conservative_clamps(law)
    moves = bool(derivation.jacobian.free_symbols & set(POSITION))
    x, y, z = map(str, verdict.curl)
    return LawFacts(
        conservative=verdict.conservative,
        reason=verdict.reason,
        curl=(x, y, z),
        vanishes_at_contact=vanishes_at_contact(force),
        depends_on_surface=bool(force.free_symbols & {H, HX, HY}),
        affine_in_depth=not moves
        and not force.has(*PIECEWISE_FUNCTIONS)
        and _is_affine(expand_definitions(derivation, derivation.jacobian)),
        conservative_clamps=clamps,
    )


def _is_affine(jacobian: Any) -> bool:
    """Return whether the second derivative by the depth vanishes identically."""
    from asperity.contacts.symbols import DEPTH
    from asperity.derive.derivatives import is_zero

    second = jacobian.diff(DEPTH).diff(DEPTH)  # of second order SymPy would factor the first
    # A nonzero value at one point decides at once; a proof is tried only if the value is zero.
    point = {
        symbol: Fraction(2 * index + 3, 7 + index)
        for index, symbol in enumerate(sorted(second.free_symbols, key=str))
    }
    if any(abs(entry.evalf(30, subs=point)) > 1e-20 for entry in second):
        return False
    return all(map(is_zero, second))


def facts_source(law: Law) -> str:
    """Return the facts as the assignment that the generated file carries."""
    lines = [f"    {name!r}: {value!r}," for name, value in asdict(derive_facts(law)).items()]
    return "\n".join(["FACTS = {", *lines, "}"])
