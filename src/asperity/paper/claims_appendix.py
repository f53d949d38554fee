"""Appendices I and II: the number of F written out, and the Jacobian of D step by step."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np

from asperity.checks import FloatArray
from asperity.paper.changes import FORCES, JACOBIANS, jacobians, laws
from asperity.paper.claim import Check, decide, judge, judges, settle
from asperity.paper.claims_friction import PAPER, Rub, norm_of, random_rubs, stick_entries
from asperity.paper.claims_god_object import BENT, bent_jacobian, flat_jacobian
from asperity.paper.comparisons import compare_at, energy_sign_check, jacobian_check
from asperity.paper.plane import FootRates, Spot, foot_rates, random_settings, spots

# --- appendix I -----------------------------------------------------------------------------------


def expansion(r: Rub, *, as_printed: bool) -> float:
    """The last expression of (31), term by term, lengths in millimetres.

    Corrected: μ instead of μ⁴ in two terms, μ² d p instead of μ (μ² d p) in a third, and a root
    over everything that the inner bracket holds.
    """
    mu, p, d = r.friction, r.depth * 1e3, r.deflection * 1e3
    e = math.pi * r.amplitude / (r.period * 1e3)
    outer = 4 * (mu * p) ** 2 + 8 * (mu * p) ** 2 * e * d + 4 * (mu * p * e * d) ** 2
    outer += 4 * (mu * d) ** 2 + d**2
    first, second, third = (
        (mu**4 * p, mu * mu**2 * d * p, mu**4 * d)
        if as_printed
        else (mu * p, mu**2 * d * p, mu * d)
    )
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


def true_number(r: Rub) -> float:
    """The greatest ‖J_F‖/κ₀ of the paper's law with h = A sin, over x, both phases, |d| = d_max.

    By its kernel. The norm is convex in d and the depth, so both are at an end.
    """
    return float(np.linalg.norm(r.compiled_jacobians(20001), 2, axis=(-2, -1)).max())


@judges("eq-31", "App. I", "(31)", flipped_by=jacobians(1.2))
def appendix_one() -> Check:
    """An upper bound on q_F, and its expression written out."""
    rubs = [PAPER, *random_rubs(6)]
    norms = [norm_of(*stick_entries(r)) for r in rubs]
    ratios = [true_number(r) / norm for r, norm in zip(rubs, norms, strict=True)]
    bound = decide(
        f"the greatest ‖J_F‖/κ₀ is {min(ratios):.3f} to {max(ratios):.3f} of the norm of (26)",
        printed=max(ratios) <= 1.0,
        shares_of_the_bound=ratios,
        norm_for_section_V_A=norms[0],
    )
    written_out = judge(
        f"expression written out against that norm, {len(rubs)} parameter sets",
        printed=[expansion(r, as_printed=True) for r in rubs],
        corrected=[expansion(r, as_printed=False) for r in rubs],
        truth=norms,
        correction="16(μp)⁴, 32(μ²d_max p)² and 32(μd_max)⁴(pπA/l)² in the inner bracket, and a "
        "square root over that bracket (the copy at hand may have lost it)",
    )
    return settle(bound, written_out)


# --- appendix II ----------------------------------------------------------------------------------


Rate = Callable[[FootRates], object]


@lru_cache(maxsize=1)
def _rates() -> tuple[FootRates, ...]:
    """Return feet and their derivatives at generic probes."""
    return tuple(foot_rates())


def _against(
    what: str, truth: Rate, printed: Rate, corrected: Rate | None = None, correction: str = ""
) -> Check:
    """Compare formulas at the generic probes."""
    return compare_at(_rates(), what, (truth,), printed, corrected, correction)


@judges("eq-32", "App. II", "(32)", flipped_by=laws(D="E"))
def orthogonal() -> Check:
    """The penetration is at right angles to the surface."""

    # By Newton's foot, and by the force, which is -κ₀ times the same.
    def part(r: FootRates, axis: int) -> FloatArray:
        return np.array([r.spot.from_foot[axis], -r.force[axis] / r.spot.k])

    return _against("p^z - p_h^z", lambda r: part(r, 1), lambda r: -part(r, 0) / r.spot.slope)


@judges("eq-33", "App. II", "(33)", flipped_by=JACOBIANS)
def along_x() -> Check:
    """The foot stays on the surface as p moves along x."""
    return _against(
        "∂p_h^z/∂p^x", lambda r: r.rate("z", "x"), lambda r: r.spot.slope * r.rate("x", "x")
    )


@judges("eq-34", "App. II", "(34)", flipped_by=JACOBIANS)
def along_z() -> Check:
    """The foot stays on the surface as p moves along z."""
    return _against(
        "∂p_h^x/∂p^z", lambda r: r.rate("x", "z"), lambda r: r.rate("z", "z") / r.spot.slope
    )


@judges("eq-35", "App. II", "(35)", flipped_by=FORCES)
def energy_function() -> Check:
    """Energy function of D."""
    places = list(spots("D"))
    return energy_sign_check("D", places, [0.5 * s.distance**2 for s in places])


@judges("eq-36", "App. II", "(36)", flipped_by=FORCES)
def first_line() -> Check:
    """f_x of D is its derivative, before simplification."""

    def printed(r: FootRates) -> float:
        x, z = r.spot.from_foot
        return float(-r.spot.k * (x * (1.0 - r.rate("x", "x")) - z * r.rate("z", "x")))

    return _against("f_x of D", lambda r: r.force[0], printed)


@judges("eq-37", "App. II", "(37)", flipped_by=FORCES)
def second_line() -> Check:
    """f_x of D after (32) is used."""

    def line(r: FootRates, factor: float) -> float:
        left = r.rate("x", "x") - r.rate("z", "x") / r.spot.slope
        return float(-r.spot.k * r.spot.from_foot[0] + r.spot.k * factor * left)

    # The bracket vanishes by (33): the missing factor shows before that is used, in its parts.
    def parts(r: FootRates, factor: float) -> list[float]:
        return [line(r, factor), r.spot.k * factor * r.rate("x", "x"),
                -r.spot.k * factor * r.rate("z", "x") / r.spot.slope]  # fmt: skip

    def truth(r: FootRates) -> list[float]:
        x, z = r.spot.from_foot
        return [r.force[0], r.spot.k * x * r.rate("x", "x"), r.spot.k * z * r.rate("z", "x")]

    return _against(
        "(37) and the two parts of its bracket as they come from (36)",
        truth,
        lambda r: parts(r, 1.0),
        lambda r: parts(r, float(r.spot.from_foot[0])),
        "the bracket is multiplied by (p^x - p_h^x); as it vanishes the result is not affected",
    )


@judges("eq-38", "App. II", "(38)", flipped_by=FORCES)
def force_x() -> Check:
    """f_x of D after (33) is used.

    And f_x = 0 where h' = 0.
    """
    general = _against("f_x of D", lambda r: r.force[0], lambda r: -r.spot.k * r.spot.from_foot[0])
    level = 0.0
    for case in random_settings():
        radius = case.period**2 / (4.0 * math.pi**2 * case.amplitude)
        for x, top in ((0.25, case.amplitude), (0.75, -case.amplitude)):
            probe = [[x * case.period, 0.0, top - 0.7 * radius]]
            force = case.surface("D").force(probe)[0]
            level = max(level, abs(float(force[0] / force[2])))
    return settle(
        general,
        decide(
            f"above crests' centres and over troughs f_x is {level:.1e} of f_z",
            printed=level < 1e-9,
            greatest_share=level,
        ),
    )


@judges("eq-39", "App. II", "(39)", flipped_by=FORCES)
def force_z() -> Check:
    """f_z of D, by the reasoning of (36) to (38)."""
    return _against("f_z of D", lambda r: r.force[1], lambda r: -r.spot.k * r.spot.from_foot[1])


def _jacobian(r: FootRates, first: float, second: float) -> FloatArray:
    """Return -κ₀ [[1 - ∂x/∂x, first], [second, 1 - ∂z/∂z]]."""
    return -r.spot.k * np.array([[1.0 - r.rate("x", "x"), first], [second, 1.0 - r.rate("z", "z")]])


@judges("eq-40", "App. II", "(40)", flipped_by=JACOBIANS)
def general_jacobian() -> Check:
    """Jacobian of D from the derivatives of the foot."""
    return _against(
        "Jacobian of D",
        lambda r: r.jacobian,
        lambda r: _jacobian(r, -r.rate("z", "z"), -r.rate("z", "x")),
        lambda r: _jacobian(r, -r.rate("x", "z"), -r.rate("z", "x")),
        "entry (1, 2) is -∂p_h^x/∂p^z",
    )


@judges("eq-41", "App. II", "(41)", flipped_by=JACOBIANS)
def reduced_jacobian() -> Check:
    """Jacobian of D after (33) and (34) are used."""
    return _against(
        "Jacobian of D",
        lambda r: r.jacobian,
        lambda r: _jacobian(r, -r.rate("z", "z") / r.spot.slope, -r.spot.slope * r.rate("z", "x")),
        lambda r: _jacobian(r, -r.rate("z", "z") / r.spot.slope, -r.spot.slope * r.rate("x", "x")),
        "entry (2, 1) is -h' ∂p_h^x/∂p^x",
    )


def _bent(spot: Spot) -> float:
    return 1.0 + spot.slope**2 - spot.d * spot.bend


@judges("eq-42", "App. II", "(42)", flipped_by=JACOBIANS)
def foot_x() -> Check:
    """∂p_h^x/∂p^x = 1/(1 + h'²)."""
    return _against(
        "∂p_h^x/∂p^x",
        lambda r: r.rate("x", "x"),
        lambda r: math.cos(math.atan(r.spot.slope)) ** 2,
        lambda r: 1.0 / _bent(r.spot),
        BENT,
    )


@judges("eq-43", "App. II", "(43)", flipped_by=JACOBIANS)
def foot_z() -> Check:
    """∂p_h^z/∂p^z = h'²/(1 + h'²)."""
    return _against(
        "∂p_h^z/∂p^z",
        lambda r: r.rate("z", "z"),
        lambda r: math.sin(math.atan(r.spot.slope)) ** 2,
        lambda r: r.spot.slope**2 / _bent(r.spot),
        BENT,
    )


@judges("eq-44", "App. II", "(44)", flipped_by=JACOBIANS)
def final_jacobian() -> Check:
    """Jacobian of D from the slope alone."""
    return jacobian_check("D", flat_jacobian, bent_jacobian, BENT)
