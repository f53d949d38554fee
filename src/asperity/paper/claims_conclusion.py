"""Section VI: what the paper concludes."""

from __future__ import annotations

from asperity.analysis.energy.continuity import continuity
from asperity.analysis.energy.loops import loop_work
from asperity.analysis.gain.characteristic import characteristic_number, one_sided_number
from asperity.paper.changes import laws, numbers, works
from asperity.paper.claim import Check, decide, judges, settle
from asperity.paper.claims_experiments import SETTINGS, growth
from asperity.paper.claims_friction import Rub, norm_of, stick_entries
from asperity.paper.comparisons import SLOPES, curl_check, q_of
from asperity.paper.plane import LAWS, SCANNING, Setting, groove_path, random_settings


@judges("sentence-VI-increase", "VI", flipped_by=numbers(0.99))
def increases() -> Check:
    """Texturing generally raises the effective stiffness."""
    cases = [*SETTINGS.values(), *random_settings(5)]
    numbers = {law: [q_of(case, law) for case in cases] for law in LAWS}
    least = min(min(values) for values in numbers.values())
    raised = [law for law, values in numbers.items() if max(values) > 1.0 + 1e-9]
    return decide(
        f"over {len(cases)} settings q >= {least:.6g}; above 1 for {', '.join(raised)}",
        printed=least >= 1.0 - 1e-6 and len(raised) >= 4,
        least=least,
        laws_above_1=", ".join(raised),
    )


@judges("sentence-VI-proportional", "VI", flipped_by=SLOPES)
def mostly_proportional() -> Check:
    """The characteristic number is most frequently proportional to A/l."""
    exponents = {}
    for law in "ABCEFG":
        q = [q_of(Setting(1000.0, length, 0.8e-3), law) for length in (1e-3, 1.01e-3)]
        taller = q_of(Setting(1000.0, 1e-3, 0.808e-3), law)
        exponents[law] = [growth([q[0], taller], [1.0, 1.01]), growth(q, [1.0, 1.01])]
    # The package's law scales the heights; the paper's own bound does not.
    amplitudes = [Rub(0.8, 1e-3, a, length, 1e-3) for a, length in
                  ((0.8, 1e-3), (0.808, 1e-3), (0.8, 1.01e-3))]  # fmt: skip
    base, taller, longer = (norm_of(*stick_entries(r)) for r in amplitudes)
    exponents["F"] = [growth([base, taller], [1.0, 1.01]), growth([base, longer], [1.0, 1.01])]
    like = [law for law, (a, length) in exponents.items()
            if abs(a - 1.0) < 0.3 and abs(length + 1.0) < 0.3]  # fmt: skip
    said = ", ".join(f"{law} {a:+.2f} {length:+.2f}" for law, (a, length) in exponents.items())
    return decide(
        f"exponents of A and l in V.A's setting: {said}; D has no finite number",
        printed=len(like) > len(LAWS) / 2,
        correction="A's, and F's where the texture is steep; B's and G's go as A D/l² where it "
        "is pressed deep, C's in between, and E's is constant",
        numbers={f"exponents for {law}": pair for law, pair in exponents.items()},
    )


@judges("sentence-VI-always", "VI", flipped_by=works(0.0))
def always_passive() -> Check:
    """Passivity can always be had by less gain, faster sampling or more damping."""
    length = 2.0 * (0.25 * SCANNING.period + SCANNING.amplitude)
    speeds = {}
    for law in "AC":
        for stiffness, damping in ((1000.0, 1.0), (10.0, 1.0), (1000.0, 100.0)):
            surface = SCANNING.surface(law, stiffness=stiffness)
            work = loop_work(surface, groove_path(SCANNING))
            speeds[law, stiffness, damping] = max(work, 0.0) / (damping * length)
    of_a, of_c = ([v for key, v in speeds.items() if key[0] == law] for law in "AC")
    return decide(
        "A is fed below "
        + ", ".join(f"{v * 1e3:.3g} mm/s" for v in of_a)
        + f" with κ₀ = 1000, 10, 1000 N/m and 1, 1, 100 N·s/m, C below {max(of_c):.1g} m/s, "
        "whatever the sampling",
        printed=max(of_a) <= 1e-12,
        corrected=min(of_a) > 1e-6 and max(of_c) <= 1e-12,
        correction="for conservative fields; a loop of any other feeds a hand that is slow enough",
        speeds_for_A=of_a,
        speeds_for_C=of_c,
    )


def _continuity_check(law: str, *, continuous: bool) -> Check:
    surface = SCANNING.surface(law)
    found = continuity(surface, characteristic_number(surface)).continuous
    says = f"force of {law} {'does not jump' if found else 'jumps'}"
    return decide(says, printed=found is continuous)


@judges("sentence-VI-C", "VI", flipped_by=laws(C="B"))
def best_of_c() -> Check:
    """C gives continuous and conservative fields."""
    return settle(_continuity_check("C", continuous=True), curl_check("C", conservative=True))


@judges("sentence-VI-D", "VI", flipped_by=laws(D="E"))
def summary_of_d() -> Check:
    """D is conservative and leaves the effective stiffness as it is, but jumps."""
    surface = SCANNING.surface("D")
    q, plus = characteristic_number(surface).value, one_sided_number(surface).value
    return settle(
        curl_check("D", conservative=True),
        decide(
            f"D in V.B's setting: q = {q}, q⁺ = {plus:g}",
            printed=q == 1.0,
            corrected=plus == 1.0,
            correction="what D leaves as it is, is the one-sided number, which decides without "
            "delay",
            q=q,
            one_sided=plus,
        ),
        _continuity_check("D", continuous=False),
    )


@judges("sentence-VI-E", "VI", flipped_by=laws(E="D"))
def summary_of_e() -> Check:
    """E does not jump, but is not conservative."""
    return settle(_continuity_check("E", continuous=True), curl_check("E", conservative=False))


@judges("sentence-VI-F", "VI", flipped_by=laws(F="W"))
def summary_of_f() -> Check:
    """F has no advantage in effective stiffness, but dissipates (its feel is left out).

    It has no small number, but a stroke forth and back loses energy.
    """
    numbers = {law: q_of(SCANNING, law) for law in "AEFG"}
    bound = norm_of(*stick_entries(Rub(0.8, 1e-3, 0.8, SCANNING.period, 1e-3)))
    surface, way, depth = SCANNING.surface("F"), 10.0 * SCANNING.deflection, -SCANNING.depth
    work = loop_work(surface, [[0, 0, depth], [way, 0, depth]])
    return decide(
        f"q_F = {numbers['F']:.3f} ({bound:.3f} by (26)) against 1 for E and the wall; a "
        f"stroke of 10 mm forth and back gives {work * 1e3:+.2f} mJ",
        printed=min(numbers["F"], bound) > 1.1 * numbers["E"] and work < 0.0,
        numbers={f"q_{law}": q for law, q in numbers.items()},
        work_of_a_stroke=work,
    )
