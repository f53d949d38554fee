"""Definitions of the terms on a page."""

from __future__ import annotations

COMPARISON = (
    (
        "q, characteristic number",
        "Greatest factor by which the law multiplies the stiffness of the smooth wall, over the "
        "surface down to the maximum depth. The loop gain grows by q: where a smooth wall of "
        "stiffness K₀ held, this law has the same gain at K₀/q.",
    ),
    (
        "q⁺, one-sided number",
        "For a conservative law without delay only the stiffening part counts: K₀/q⁺.",
    ),
    (
        "stiffness up to, basis",
        "Proved: passive up to the limit, from damping, rate and delay of the device. Bounded: "
        "proved except for steps of positions and forces, whose buzz has a bound; half of the "
        "limit of the delay rule. Plausible: a smooth wall of that gain was stable on the device, "
        "which proves nothing; it assumes that the wall was at its limit and that damping is "
        "isotropic. Quiet: the same for a law with curl, against buzz alone, since below the speed "
        "v* it feeds the hand at any stiffness.",
    ),
    (
        "worst leak",
        "Energy that the surface gives to the hand when the probe slowly traverses the worst "
        "simple loop within one period. A law that leaks feels alive, whatever the damping.",
    ),
    (
        "T, strength",
        "RMS of the oscillating force on a straight scan, divided by the greatest loop gain and "
        "the period: texture per loop gain.",
    ),
    ("S, support", "Mean stiffness of the surface on the scan, divided by the greatest loop gain."),
    ("texture force", "RMS of the oscillating force at that stiffness."),
)

ANALYSIS = (
    (
        "q, characteristic number",
        "Greatest factor by which the law multiplies the stiffness of the smooth wall, over the "
        "surface down to the maximum depth: sup ‖J‖/k.",
    ),
    (
        "q⁺, one-sided number",
        "The stiffening part alone, sup λ_max(−sym J)/k; for a conservative law without delay it "
        "replaces q.",
    ),
    (
        "lower, upper, method",
        "The number lies between lower, which is attained at the listed point, and upper, which is "
        "proved. Theorem: holds for every surface. Closed form: a formula for this one. Certified: "
        "every cell of the working region was bounded. Sampled: the greatest value found; nothing "
        "is proved, and there is no upper end.",
    ),
    ("|curl f|", "The greatest work per area of a small loop, whatever its plane."),
    (
        "worst loop, v*",
        "The simple loop in a vertical plane that gives most energy to the hand in one slow turn "
        "within one period: a loop around n periods may gain n times as much. Below the speed v* "
        "the damping of the device dissipates less than the loop gives.",
    ),
    (
        "limit, margin",
        "The greatest stiffness that a criterion allows, and its ratio to the given stiffness; "
        "both rounded down.",
    ),
)

LIMITS = (
    (
        "1, α v T < l",
        "At scanning speed v a wave of length l passes in l/v; the force must be updated α times "
        "in that time, once in every T.",
    ),
    (
        "2 and 3, β δ < l and α δ < l",
        "A wave must be β (α) position steps δ long. As printed in the paper these are one "
        "condition with two numbers of samples.",
    ),
    (
        "4, γ b < A_F",
        "The amplitude A_F of the force must be γ of the device's steps b of force. The paper "
        "prints γ b/l < A; its dimensions are corrected here.",
    ),
    (
        "5, q k ≤ K₀",
        "The stiffness k times the factor of the law must not exceed the stiffest smooth wall that "
        "the device renders; for a conservative law q⁺ replaces q. The paper's "
        "2πA/l < A₀ is this for law A, without its stiffness.",
    ),
    ("6, v/l < F₀", "The frequency of the force must lie below the device's first resonance."),
)
