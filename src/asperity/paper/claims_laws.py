"""Sections IV.A to IV.C and IV.G: the laws A, B, C and G, their fields, Jacobians and energies."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from asperity.analysis.energy.loops import loop_work
from asperity.analysis.gain.closed_forms import q_b, q_c, q_g
from asperity.checks import FloatArray
from asperity.laws import Law, find_law
from asperity.paper.changes import FORCES, JACOBIANS, laws, numbers
from asperity.paper.claim import Check, decide, judge, judges, settle
from asperity.paper.comparisons import (
    curl_check,
    field_check,
    greatest_norm,
    jacobian_check,
    leg_work,
    loop_check,
    outside_check,
    potential_check,
    q_of,
)
from asperity.paper.plane import (
    BUMP,
    PASSIVITY,
    SCANNING,
    Setting,
    Spot,
    crossing_path,
    groove_path,
    random_settings,
    spots,
)

# --- A --------------------------------------------------------------------------------------------


@judges("eq-6", "IV.A", "(6)", flipped_by=FORCES)
def field_a() -> Check:
    """Force of A: the vertical depth, along the wall's normal."""
    printed = field_check("A", lambda s: np.array([0.0, -s.k * s.d]))
    return settle(printed, outside_check("A"))


@judges("eq-7", "IV.A", "(7)", flipped_by=JACOBIANS)
def jacobian_a() -> Check:
    """Jacobian of A inside."""
    return jacobian_check("A", lambda s: -s.k * np.array([[0.0, 0.0], [-s.slope, 1.0]]))


@judges("eq-8", "IV.A", "(8)", flipped_by=JACOBIANS)
def norm_a() -> Check:
    """Norm of that Jacobian: κ₀ √(1 + h'²)."""
    places = list(spots("A"))
    norms = np.array([spot.norms() for spot in places])
    printed = np.array([[spot.k * math.hypot(1.0, spot.slope)] * 2 for spot in places])
    return judge("norm of the Jacobian of A", printed=printed, truth=norms)


@judges("eq-9", "IV.A", "(9)", flipped_by=JACOBIANS)
def number_a() -> Check:
    """The increase of stiffness by A is √(1 + h'²).

    A ratio of the greatest norm is set equal to a value at each place.
    """
    places = list(spots("A"))
    texture = places[0].surface.texture
    x = np.linspace(0.0, 2.0 * math.pi / 1e3, 20001) * 1.0
    steepest = float(np.abs(texture.gradient(np.column_stack([x, 0 * x]))[:, 0]).max())
    norms = np.array([spot.norms() / spot.k for spot in places]).T
    here = np.array([math.hypot(1.0, spot.slope) for spot in places])
    whole = np.full(len(places), math.hypot(1.0, steepest))
    local = judge("‖J‖/κ₀ at each place against √(1 + h'²)", printed=[here, here], truth=norms)
    ratio = judge(
        "κ_A^max/κ₀ against √(1 + h'²) at generic places",
        printed=here,
        corrected=np.full(len(places), math.sqrt(1.0 + steepest**2)),
        correction="q_A = max over p^x of √(1 + h'(p^x)²); κ_A, a stiffness, is κ₀ times that",
        truth=whole,
    )
    return settle(local, ratio)


@judges("eq-10", "IV.A", "(10)", flipped_by=JACOBIANS)
def sinusoid_a() -> Check:
    """On a sinusoid the greatest norm is κ₀ √(1 + (2πA/l)²), at x = 0 mod π/l.

    The value, and where it is attained.
    """
    cases = [PASSIVITY, SCANNING, *random_settings()]
    printed = [c.stiffness * math.hypot(1.0, 2.0 * math.pi * c.amplitude / c.period) for c in cases]
    found = [case.stiffness * greatest_norm(case.surface("A")) for case in cases]
    value = judge("greatest norm for 5 sinusoids", printed=printed, truth=found)
    as_printed = _reaches(cases, printed, [math.pi / case.period for case in cases])
    half = _reaches(cases, printed, [0.5 * case.period for case in cases])
    place = decide(
        f"the norm at x = nπ/l is {as_printed:.4f} of the greatest at worst, at n l/2 {half:.4f}",
        printed=as_printed > 1.0 - 1e-9,
        corrected=half > 1.0 - 1e-9,
        correction="attained at p^x = 0 mod l/2 (π/l is no length)",
        least_share_at_multiples_of_pi_over_l=as_printed,
        least_share_at_multiples_of_half_a_period=half,
    )
    return settle(value, place)


def _reaches(cases: list[Setting], greatest: list[float], steps: list[float]) -> float:
    """Return the least share of the greatest norm at multiples of a step on each texture."""
    least = math.inf
    for case, most, step in zip(cases, greatest, steps, strict=True):
        x = np.arange(1, 6) * step
        slope = case.texture.gradient(np.column_stack([x, 0 * x]))[:, 0]
        norms = case.stiffness * np.hypot(1.0, slope)
        least = min(least, float(norms.min()) / most)
    return least


@judges("sentence-IV.A-proportional", "IV.A", flipped_by=numbers(1.1))
def proportional_a() -> Check:
    """2πA/l is large, so A's number is nearly proportional to A and 1/l.

    Within a tenth in each of the paper's settings.
    """
    cases = {"V.A": PASSIVITY, "V.B": SCANNING, "V.C": BUMP}
    slopes = {name: 2.0 * math.pi * case.amplitude / case.period for name, case in cases.items()}
    ratios = {name: q_of(case, "A") / slopes[name] for name, case in cases.items()}
    said = ", ".join(f"{name} {slopes[name]:.2f} ({ratios[name]:.3f})" for name in cases)
    return decide(
        f"2πA/l, and q_A over it: {said}",
        printed=max(abs(ratio - 1.0) for ratio in ratios.values()) < 0.1,
        numbers={f"q_A over 2πA/l in {name}": ratio for name, ratio in ratios.items()},
    )


@judges("sentence-IV.A-energy", "IV.A", flipped_by=FORCES)
def energy_a() -> Check:
    """A is not conservative; around a path of Fig. 3 it generates κ₀A²/2."""
    printed = loop_check("A", lambda c: 0.5 * c.stiffness * c.amplitude**2)
    return settle(printed, curl_check("A", conservative=False))


# --- B --------------------------------------------------------------------------------------------


@judges("eq-11", "IV.B", "(11)", flipped_by=FORCES)
def field_b() -> Check:
    """Force of B: the vertical depth, along the groove's normal."""

    def printed(s: Spot) -> FloatArray:
        return -s.k * s.d * np.array([-s.slope, 1.0]) / math.sqrt(1.0 + s.slope**2)

    return settle(field_check("B", printed), outside_check("B"))


_CLOSED = {
    "B": "q_B = max(√(1 + G²), y)",
    "C": "q_C = the greatest of 1, y and the feasible roots of a cubic",
    "G": "q_G = max(1, y), with G = 2πA/l and y = 4π²AD/l²",
}


@judges("sentence-IV-closed-form", "IV.B", flipped_by=JACOBIANS)
def closed_forms() -> Check:
    """No manageable closed form was found for the numbers of B, C and G: they are evaluated.

    By a search over Jacobians, as the paper does it; beside it the forms that we found.
    """
    cases = [PASSIVITY, SCANNING, *random_settings(6)]
    checks = []
    for law, exact in (("B", q_b), ("C", q_c), ("G", q_g)):
        worst = 0.0
        for case in cases:
            found = greatest_norm(case.surface(law))
            worst = max(worst, abs(found / exact(case.texture, case.depth) - 1.0))
        checks.append(
            decide(
                f"{law}: closed form and search differ by {worst:.1e} on {len(cases)} sinusoids",
                printed=worst > 1e-6,
                corrected=worst <= 1e-6,
                correction=f"a search gives them, and on a sinusoid {_CLOSED[law]}",
                numbers={f"greatest relative difference for {law}": worst},
            )
        )
    return settle(*checks)


@judges("eq-12", "IV.B", "(12)", flipped_by=FORCES)
def energy_b() -> Check:
    """Energy of B around the path of Fig. 3."""

    def printed(c: Setting) -> float:
        a, length = c.amplitude, c.period
        root = math.sqrt((length**2 + 4.0 * a**2 * math.pi**2) / length**2)
        return 0.5 * c.stiffness * a**2 + c.stiffness * length**2 / (4.0 * math.pi**2) * (1 - root)

    return loop_check("B", printed)


@judges("remark-4", "IV.B", "Remark 4", flipped_by=laws(A="C"))
def remark_4() -> Check:
    """A and B are not conservative (that they feel active is not computed)."""
    return settle(curl_check("A", conservative=False), curl_check("B", conservative=False))


# --- C --------------------------------------------------------------------------------------------


def _force_c(s: Spot) -> FloatArray:
    return -s.k * np.array([-s.d * s.slope, s.d])


@judges("eq-13", "IV.C", "(13)", flipped_by=FORCES)
def potential_c() -> Check:
    """Potential of C.

    Its gradient, and its sign as an energy.
    """

    def potential(spot: Spot) -> Callable[[Any, Any], Any]:
        profile = spot.profile()
        return lambda x, z: -spot.k * (z - profile(x, 0)) ** 2 / 2

    return potential_check("C", potential, lambda s: 0.5 * s.d**2)


@judges("eq-14", "IV.C", "(14)", flipped_by=FORCES)
def field_c() -> Check:
    """Force of C, the gradient of that potential."""
    return settle(field_check("C", _force_c), outside_check("C"))


@judges("eq-15", "IV.C", "(15)", flipped_by=JACOBIANS)
def jacobian_c() -> Check:
    """Jacobian of C, with the second derivative of h."""

    def printed(s: Spot) -> FloatArray:
        corner = s.slope**2 - s.d * s.bend
        return -s.k * np.array([[corner, -s.slope], [-s.slope, 1.0]])

    return jacobian_check("C", printed)


@judges("sentence-IV.C-normal", "IV.C", flipped_by=laws(C="A"))
def direction_c() -> Check:
    """The force field of C does not follow the normal of the texture.

    The normal at the foot of the vertical depth, where C takes the height.
    """
    shares = []
    for spot in spots("C", 12):
        normal = np.array([-spot.slope, 1.0]) / math.hypot(1.0, spot.slope)
        for force in (spot.force(), spot.compiled_force()):
            across = abs(force[0] * normal[1] - force[1] * normal[0])
            shares.append(float(across / np.linalg.norm(force)))
    return decide(
        f"the part of C's force across the texture's normal is at most {max(shares):.1e} of it, at "
        "12 generic probes",
        printed=max(shares) > 1e-9,
        correction="it does: (14) is κ₀ d^z [h', -1], along the normal of (11), and longer than "
        "B's force by √(1 + h'²)",
        greatest_share_across=max(shares),
    )


@judges("sentence-IV.C-curvature", "IV.C", flipped_by=JACOBIANS)
def curvature_c() -> Check:
    """C's stiffness grows with curvature, very large in sharp asperities and crevices.

    At crests and troughs the norm is κ₀ times the greater of 1 and depth times curvature.
    """
    printed, truth = [], []
    for case in [PASSIVITY, SCANNING, *random_settings()]:
        x = np.array([0.25, 0.75]) * case.period
        top = case.texture.height(np.column_stack([x, 0 * x]))
        bend = np.abs(case.texture.hessian(np.column_stack([x, 0 * x]))[:, 0, 0])
        for depth in (0.3 * case.depth, case.depth):
            points = np.column_stack([x, 0 * x, top - depth])
            truth.append(np.linalg.norm(case.surface("C").jacobian(points), 2, axis=(1, 2)))
            printed.append(case.stiffness * np.maximum(1.0, depth * bend))
    return judge("norm of C's Jacobian at crests and troughs", printed=printed, truth=truth)


@judges("sentence-IV.C-conservative", "IV.C", flipped_by=laws(C="B"))
def conservative_c() -> Check:
    """C is conservative.

    By construction: curl and loops.
    """
    energies = [
        loop_work(case.surface("C"), groove_path(case)) / (case.stiffness * case.amplitude**2)
        for case in [SCANNING, *random_settings()]
    ]
    most = max(abs(energy) for energy in energies)
    loops = decide(f"energy around the path {most:.1e} of κ₀A²", printed=most < 1e-9, greatest=most)
    return settle(curl_check("C", conservative=True), loops)


@judges("remark-5", "IV.C", "Remark 5", flipped_by=laws(B="C"))
def remark_5() -> Check:
    """The factor √(1 + h'²) is what keeps B from being conservative."""
    import sympy as sp

    from asperity.derive.curl import curl_verdict

    without = curl_verdict(
        Law("Bs", "b-times-root", "vertical",
            lambda c: sp.sqrt(1 + c.slope.dot(c.slope)) * find_law("B").force(c))
    )  # fmt: skip
    return settle(
        curl_check("B", conservative=False),
        curl_check("C", conservative=True),
        decide(
            f"B times the factor: {without.reason}",
            printed=without.conservative,
            curl_of_B_times_the_factor=", ".join(str(entry) for entry in without.curl),
        ),
    )


# --- G --------------------------------------------------------------------------------------------


@judges("eq-28", "IV.G", "(28)", flipped_by=FORCES)
def field_g() -> Check:
    """Force of G: the wall's depth, along the texture's normal.

    A column times a column.
    """
    import sympy as sp

    column = sp.Matrix(sp.symbols("nx nz"))
    try:
        product = column * column
    except sp.ShapeError:
        product = None

    def right(s: Spot) -> FloatArray:
        return -s.k * s.z * np.array([-s.slope, 1.0]) / math.sqrt(1.0 + s.slope**2)

    def printed(s: Spot) -> FloatArray:
        return np.full(2, np.nan) if product is None else right(s)

    correction = "without the n that follows the fraction, which already is n"
    return settle(field_check("G", printed, right, correction), outside_check("G"))


@judges("eq-29", "IV.G", "(29)", flipped_by=FORCES)
def energy_g() -> Check:
    """Around its path of Fig. 3 G gains energy on one leg."""
    worst, least = 0.0, math.inf
    for case in [SCANNING, *random_settings()]:
        a, surface = 0.5 * case.depth, case.surface("G")
        points = np.array(crossing_path(case, a))
        scale = case.stiffness * a**2
        ends = np.roll(points, -1, axis=0)
        legs = [leg_work(surface, *leg) for leg in zip(points, ends, strict=True)]
        expected = [-0.5 * scale, legs[1], 0.5 * scale, 0.0]
        total = loop_work(surface, points)
        worst = max(worst, *(abs(leg - e) / scale for leg, e in zip(legs, expected, strict=True)))
        worst = max(worst, abs(total - legs[1]) / scale)
        least = min(least, legs[1] / scale)
    return settle(
        decide(
            f"legs are -κ₀a²/2, ΔE₂, +κ₀a²/2, 0 within {worst:.1e} κ₀a²; ΔE₂ >= {least:.3f} κ₀a²",
            printed=worst < 1e-9 and least > 0.0,
            worst_leg=worst,
            least_gain=least,
        ),
        curl_check("G", conservative=False),
    )
