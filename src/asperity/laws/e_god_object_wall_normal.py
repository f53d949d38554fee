"""E, the god-object with a force along the wall's normal: f = k |p_h - p| e_z.

Paper: (19) field, (20) Jacobian, (21) q = 1. Correction: the sign of (19) and (20) as printed
pulls the probe inwards. The Jacobian is -k e_z nᵀ with n at the closest point: norm exactly k,
and f is k-Lipschitz even across the medial axis; not conservative.
"""

from asperity.laws.law import Law

LAW = Law(
    letter="E",
    name="god-object-wall-normal",
    contact="nearest",
    force=lambda c: c.k * c.depth * c.e_z,
    summary="distance to the surface, pushed along the wall normal",
)
