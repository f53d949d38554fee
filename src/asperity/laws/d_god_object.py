"""D, the god-object: f = k (p_h - p) with p_h the nearest point of the textured surface.

Paper: (16) potential, (17) field, (18) and appendix II Jacobian. Corrections: (18), (42)–(44)
leave the curvature of the surface out; the exact Jacobian is
-k(n nᵀ + Σ δκ_i/(1 + δκ_i) t_i t_iᵀ), so ‖J‖ exceeds k below crests as soon as δ(-κ) > 1/2 and
is unbounded towards the medial axis, where the force jumps (Remark 6). (37) lacks a factor, (40)
entry (1, 2) and (41) entry (2, 1) are misprinted.
"""

from asperity.laws.law import Law

LAW = Law(
    letter="D",
    name="god-object",
    contact="nearest",
    force=lambda c: c.k * c.toward,
    summary="spring to the nearest surface point",
)
