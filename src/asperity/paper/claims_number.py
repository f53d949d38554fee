"""Section III.B: the characteristic number and what it is for."""

from __future__ import annotations

import math

import numpy as np

from asperity.paper.claim import Check, Claim, decide
from asperity.paper.comparisons import q_of
from asperity.paper.plane import LAWS, PASSIVITY, SCANNING, Setting, spots
from asperity.surface import Surface


def definition() -> Check:
    """(5): a number of the algorithm only if J is proportional to κ₀."""
    worst = 0.0
    for law in LAWS:
        for spot in spots(law, 2):
            points = np.array([[spot.x, 0.0, spot.z]])
            one, other = (
                Surface(SCANNING.texture, law, stiffness=k).jacobian(points - [0, 0, 2e-3])[0] / k
                for k in (211.0, 1733.0)
            )
            worst = max(worst, float(np.abs(one - other).max() / np.abs(one).max()))
    return decide(
        f"J/κ₀ of A to G at two stiffnesses differs by {worst:.1e}",
        printed=worst < 1e-12,
        greatest_difference=worst,
    )


def reduced() -> Check:
    """κ₁ = κ₀/q, for any algorithm."""
    numbers = {law: q_of(PASSIVITY, law) for law in LAWS}
    finite = [law for law, q in numbers.items() if math.isfinite(q)]
    worst = 0.0
    for law in finite:
        k = PASSIVITY.stiffness / numbers[law]
        again = k * q_of(Setting(k, PASSIVITY.period, PASSIVITY.amplitude), law)
        worst = max(worst, abs(again / PASSIVITY.stiffness - 1.0))
    without = "".join(law for law in LAWS if law not in finite)
    return decide(
        f"in V.A's setting κ₀/q has the norm κ₀ within {worst:.1e} for {''.join(finite)}; "
        f"q is infinite for {without or 'none'}",
        printed=worst < 1e-5 and not without,
        corrected=worst < 1e-5 and without == "D",
        correction="for D only as long as the depth stays above its medial axis",
        numbers={f"q_{law}": q for law, q in numbers.items()},
    )


def doubling() -> Check:
    """Doubling the spatial frequency requires half the stiffness."""
    ratios: dict[str, list[float]] = {}
    for law in LAWS:
        values = [q_of(Setting(1000.0, length, 0.4e-3), law) for length in (1e-3, 0.5e-3)]
        steep = [q_of(Setting(1000.0, length, 0.4e-3), law) for length in (2e-5, 1e-5)]
        ratios[law] = [values[1] / values[0], steep[1] / steep[0]]
    # From infinity to infinity the ratio is no number.
    printed = all(abs(ratio[0] - 2.0) < 0.02 for ratio in ratios.values())
    halves = "".join(law for law, ratio in ratios.items() if abs(ratio[1] - 2.0) < 0.02)
    said = ", ".join(
        f"{law} {ratio[0]:.2f}" for law, ratio in ratios.items() if math.isfinite(ratio[0])
    )
    return decide(
        f"l from 1 to 0.5 mm multiplies q by: {said} (D is infinite both times); "
        f"from 20 to 10 µm by 2 for {halves}",
        printed=printed,
        corrected=halves == "AF",
        correction="for A and F, where the texture is steep; q of B, C and G then grows four "
        "times, E's not at all, and D's is infinite",
        numbers={
            f"ratios for {law}": [r for r in ratio if math.isfinite(r)]
            for law, ratio in ratios.items()
        },
    )


def no_comparison() -> Check:
    """Whether q can rank algorithms."""
    orders = set()
    for amplitude, depth in ((0.8e-3, 1e-3), (0.05e-3, 1e-3), (0.05e-3, 0.1e-3)):
        case = Setting(1000.0, 2e-3, amplitude, depth=depth)
        numbers = {law: round(q_of(case, law), 6) for law in "ABCEG"}
        orders.add("".join(sorted(numbers, key=lambda law: (numbers[law], law))))
    return decide(
        f"three settings rank A, B, C, E, G by q as {', '.join(sorted(orders))}",
        printed=len(orders) > 1,
        orders=", ".join(sorted(orders)),
    )


SECTION_III_B = (
    Claim("eq-5", ("(5)",), "III.B", "q = σ_n(J)/κ₀ belongs to the algorithm, whatever κ₀ is.",
          definition),
    Claim("sentence-III.B-reduced", (), "III.B",
          "κ₁ = κ₀/q gives the textured wall the norm of the smooth one, for any algorithm.",
          reduced),
    Claim("sentence-III.B-doubling", (), "III.B",
          "Doubling the spatial frequency requires half the stiffness.", doubling),
    Claim("sentence-III.B-compare", (), "III.B",
          "q does not rank algorithms: its order depends on the parameters.", no_comparison),
)  # fmt: skip
