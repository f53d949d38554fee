"""Section VI: the paper's conclusions."""

from __future__ import annotations

from dataclasses import replace

from asperity.analysis.energy.loop_integral import loop_work
from asperity.analysis.gain.characteristic import characteristic_number, one_sided_number
from asperity.paper.claim import Check, check_statement, combine_checks, declare_claim
from asperity.paper.claims.experiment_statements import growth_exponent
from asperity.paper.claims.friction_law import PAPER_CASE, SCANNING_CASE, sticking_norm
from asperity.paper.formula_checks import check_continuity, check_curl, compute_q
from asperity.paper.planar_cases import (
    PAPER_LAWS,
    SCANNING,
    SETTINGS,
    ExperimentCase,
    groove_path,
    random_settings,
)


@declare_claim("sentence-VI-increase", "VI", flips_under="characteristic numbers times 0.99")
def stiffness_is_raised() -> Check:
    """Texturing generally raises the effective stiffness."""
    cases = [*SETTINGS.values(), *random_settings(5)]
    numbers = {law: [compute_q(case, law) for case in cases] for law in PAPER_LAWS}
    least = min(min(values) for values in numbers.values())
    raised = [law for law, values in numbers.items() if max(values) > 1.0 + 1e-9]
    return check_statement(
        f"over {len(cases)} settings q >= {least:.6g}; above 1 for {', '.join(raised)}",
        printed=least >= 1.0 - 1e-6 and len(raised) >= 4,
        least=least,
        laws_above_1=", ".join(raised),
    )


@declare_claim("sentence-VI-proportional", "VI", flips_under="2πA/l for every q")
def number_is_proportional() -> Check:
    """The characteristic number is most frequently proportional to A/l."""
    exponents = {law: _case_exponents(law) for law in "ABCEG"}
    # The package's law scales the heights; the paper's own bound does not.
    base = sticking_norm(PAPER_CASE)
    changes = ({"amplitude": 0.808}, {"period": 1.01e-3})
    exponents["F"] = [
        growth_exponent([base, sticking_norm(replace(PAPER_CASE, **change))], [1.0, 1.01])
        for change in changes
    ]
    proportional = [
        law for law, (a, length) in exponents.items() if max(abs(a - 1.0), abs(length + 1.0)) < 0.3
    ]
    summary = ", ".join(f"{law} {a:+.2f} {length:+.2f}" for law, (a, length) in exponents.items())
    return check_statement(
        f"exponents of A and l in V.A's setting: {summary}; D has no finite number",
        printed=len(proportional) > len(PAPER_LAWS) / 2,
        correction="A's, and F's where the texture is steep; B's and G's go as A D/l² where it "
        "is pressed deep, C's in between, and E's is constant",
        numbers={f"exponents for {law}": pair for law, pair in exponents.items()},
    )


def _case_exponents(law: str) -> list[float]:
    """Return the exponents with which q grows with A and with l."""
    base, taller, longer = (
        compute_q(ExperimentCase(1000.0, period, amplitude), law)
        for period, amplitude in ((1e-3, 0.8e-3), (1e-3, 0.808e-3), (1.01e-3, 0.8e-3))
    )
    return [growth_exponent([base, changed], [1.0, 1.01]) for changed in (taller, longer)]


@declare_claim("sentence-VI-always", "VI", flips_under="work around a path times 0")
def always_passive() -> Check:
    """Passivity can always be had by less gain, faster sampling or more damping."""
    length = 2.0 * (0.25 * SCANNING.period + SCANNING.amplitude)
    speeds: dict[str, list[float]] = {}
    for law in "AC":
        speeds[law] = []
        for stiffness, damping in ((1000.0, 1.0), (10.0, 1.0), (1000.0, 100.0)):
            work = loop_work(SCANNING.surface(law, stiffness=stiffness), groove_path(SCANNING))
            speeds[law].append(max(work, 0.0) / (damping * length))
    greatest = {law: max(values) for law, values in speeds.items()}
    return check_statement(
        "A gains energy below "
        + ", ".join(f"{speed * 1e3:.3g} mm/s" for speed in speeds["A"])
        + f" with κ₀ = 1000, 10, 1000 N/m and 1, 1, 100 N·s/m, C below {greatest['C']:.1g} m/s, "
        "whatever the sampling",
        printed=greatest["A"] <= 1e-12,
        corrected=min(speeds["A"]) > 1e-6 and greatest["C"] <= 1e-12,
        correction="for conservative fields; around a loop of any other the hand gains energy if "
        "it is slow enough",
        speeds_for_A=speeds["A"],
        speeds_for_C=speeds["C"],
    )


@declare_claim("sentence-VI-D", "VI", flips_under="law E in the place of D")
def conclusion_d() -> Check:
    """D is conservative and leaves the effective stiffness as it is, but jumps."""
    surface = SCANNING.surface("D")
    q, plus = characteristic_number(surface).value, one_sided_number(surface).value
    return combine_checks(
        check_curl("D", is_conservative=True),
        check_statement(
            f"D in V.B's setting: q = {q}, q⁺ = {plus:g}",
            printed=q == 1.0,
            corrected=plus == 1.0,
            correction="D leaves the one-sided number as it is, which decides without delay",
            q=q,
            one_sided=plus,
        ),
        check_continuity("D", is_continuous=False),
    )


@declare_claim("sentence-VI-F", "VI", flips_under="law W in the place of F")
def conclusion_f() -> Check:
    """F has no advantage in effective stiffness, but dissipates (its feel is left out).

    Its number is not small, but a stroke forth and back loses energy.
    """
    numbers = {law: compute_q(SCANNING, law) for law in "AEFG"}
    bound = sticking_norm(SCANNING_CASE)
    length, depth = 10.0 * SCANNING.deflection, -SCANNING.depth
    work = loop_work(SCANNING.surface("F"), [[0, 0, depth], [length, 0, depth]])
    return check_statement(
        f"q_F = {numbers['F']:.3f} ({bound:.3f} by (26)) against 1 for E and the wall; a "
        f"stroke of 10 mm forth and back gives {work * 1e3:+.2f} mJ",
        printed=min(numbers["F"], bound) > 1.1 * numbers["E"] and work < 0.0,
        numbers={f"q_{law}": q for law, q in numbers.items()},
        work_of_a_stroke=work,
    )
