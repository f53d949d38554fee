"""Appendix I: the bound on the characteristic number of law F, written out."""

from __future__ import annotations

import math

import numpy as np

from asperity.paper.claim import Check, check_statement, check_values, combine_checks, declare_claim
from asperity.paper.claims.friction_law import (
    PAPER_CASE,
    FrictionCase,
    random_friction_cases,
    sticking_norm,
)


def expand_bound(r: FrictionCase, *, as_printed: bool) -> float:
    """Evaluate the last expression of (31) term by term, with lengths in millimetres.

    Corrected: μ instead of μ⁴ in two terms, μ² d p instead of μ (μ² d p) in a third, and a square
    root over the inner bracket.
    """
    mu, p, d = r.friction, r.depth * 1e3, r.deflection * 1e3
    e = math.pi * r.amplitude / (r.period * 1e3)
    outer = 4 * (mu * p) ** 2 + 8 * (mu * p) ** 2 * e * d + 4 * (mu * p * e * d) ** 2
    outer += 4 * (mu * d) ** 2 + d**2
    first, second, third = mu * p, mu**2 * d * p, mu * d
    if as_printed:
        first, second, third = mu**4 * p, mu * mu**2 * d * p, mu**4 * d
    inner = (
        16 * first**4
        + 32 * second**2
        + 64 * (mu * p) ** 4 * e * d
        + d**4
        + 96 * (mu * p) ** 4 * (e * d) ** 2
        + 64 * (mu * p) ** 4 * (e * d) ** 3
        + 64 * mu**4 * d**3 * p**2 * e
        - 16 * d**3 * (mu * p) ** 2 * e
        + 16 * (mu * p * e * d) ** 4
        + 32 * third**4 * (p * e) ** 2
        - 8 * d**4 * (mu * p * e) ** 2
        + 16 * (mu * d) ** 4
        + 8 * mu**2 * d**4
        - 8 * (mu * p * d) ** 2
    )
    whole = outer + (inner if as_printed else math.sqrt(inner))
    return math.sqrt(2.0) / (2.0 * d) * math.sqrt(max(whole, 0.0))


def max_norm_ratio(r: FrictionCase) -> float:
    """Return the greatest ‖J_F‖/κ₀ of the paper's law with h = A sin, by its kernel.

    The maximum is over x and both phases at |d| = d_max and the greatest depth, since the norm is
    convex in both.
    """
    return float(np.linalg.norm(r.compiled_jacobians(20001), 2, axis=(-2, -1)).max())


@declare_claim("eq-31", "App. I", "(31)", flips_under="compiled Jacobians times 1.2")
def friction_number_bound() -> Check:
    """An upper bound on q_F, and its expression written out."""
    cases = [PAPER_CASE, *random_friction_cases(6)]
    norms = [sticking_norm(case) for case in cases]
    ratios = [max_norm_ratio(case) / norm for case, norm in zip(cases, norms, strict=True)]
    bound = check_statement(
        f"the greatest ‖J_F‖/κ₀ is {min(ratios):.3f} to {max(ratios):.3f} of the norm of (26)",
        printed=max(ratios) <= 1.0,
        shares_of_the_bound=ratios,
        norm_for_section_V_A=norms[0],
    )
    written_out = check_values(
        f"expression written out against that norm, {len(cases)} parameter sets",
        printed=[expand_bound(case, as_printed=True) for case in cases],
        corrected=[expand_bound(case, as_printed=False) for case in cases],
        reference=norms,
        correction="16(μp)⁴, 32(μ²d_max p)² and 32(μd_max)⁴(pπA/l)² in the inner bracket, and a "
        "square root over that bracket (the copy at hand may have lost it)",
    )
    return combine_checks(bound, written_out)
