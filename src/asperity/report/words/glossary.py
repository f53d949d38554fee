"""What the numbers of a page mean: terms and definitions."""

from __future__ import annotations

COMPARISON = (
    (
        "q, characteristic number",
        "By how much the law can multiply the stiffness of the smooth wall, at worst over the "
        "surface down to the depth pressed. The loop gain grows by q: where a smooth wall of "
        "stiffness K₀ held, this law has the same gain at K₀/q.",
    ),
    (
        "q⁺, one-sided number",
        "For a conservative law without delay only the stiffening part counts: K₀/q⁺.",
    ),
    (
        "stiffness up to, worth",
        "Proved: passive up to there, from the device's damping, rate and delay. Bounded: the same "
        "but for steps of positions and forces, whose buzz has a bound; half of what the delay "
        "rule allows. Plausible: a "
        "smooth wall of that gain held on the device, which proves nothing; it takes the wall for "
        "about to cycle and damping for alike in all directions. Quiet: the same for a law with "
        "curl, quiet against buzz only, since below the speed v* it feeds the hand at any "
        "stiffness.",
    ),
    (
        "worst leak",
        "The energy that the surface gives to the hand when the probe goes once around the worst "
        "simple loop, slowly, within one period. A law that leaks feels alive, whatever the "
        "damping.",
    ),
    (
        "T, strength",
        "RMS of the oscillating force on a straight scan, over the greatest loop gain and the "
        "period: how much texture for the gain that it costs.",
    ),
    (
        "S, support",
        "How stiff the surface is on average under the scan, over the greatest loop gain.",
    ),
    ("texture force", "RMS of the oscillating force at that stiffness."),
)

ANALYSIS = (
    (
        "q, characteristic number",
        "By how much the law can multiply the stiffness of the smooth wall, at worst over the "
        "surface down to the depth pressed: sup ‖J‖/k.",
    ),
    (
        "q⁺, one-sided number",
        "Only the stiffening part, sup λ_max(−sym J)/k; for a conservative law it takes the place "
        "of q where there is no delay.",
    ),
    (
        "lower, upper, method",
        "The number lies between lower, which is attained at the point given, and upper, which is "
        "proved. Theorem: holds for every surface. Closed form: a formula for this one. Certified: "
        "every cell of the working region was bounded. Sampled: the greatest value found; nothing "
        "is proved, and there is no upper end.",
    ),
    ("|curl f|", "The greatest work per area of a small loop, whatever its plane."),
    (
        "worst loop, v*",
        "The simple loop in a vertical plane on which the surface gives most energy to the hand, "
        "slowly turned once, within one period: a loop around n periods may gain n times as much. "
        "Below the speed v* the device's damping takes less than the loop "
        "gives.",
    ),
    (
        "limit, margin",
        "The greatest stiffness that a criterion allows, and that over the stiffness asked for; "
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
        "prints γ b/l < A; its dimensions are put right here.",
    ),
    (
        "5, q k ≤ K₀",
        "The stiffness k times what the law multiplies it by must not exceed the stiffest smooth "
        "wall that the device renders; for a conservative law q⁺ takes the place of q. The paper's "
        "2πA/l < A₀ is this for law A, without its stiffness.",
    ),
    ("6, v/l < F₀", "The frequency of the force must lie below the device's first resonance."),
)
