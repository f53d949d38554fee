"""C, change of height: f = k δ w = -∇(k δ²/2).

Paper: (13) potential, (14) field, (15) Jacobian. Corrections: as printed, U of (13) is minus the
energy and f = +∇U; the x part of Table I, row C, has the wrong sign. With δ = h - z positive
inside, the force is k δ (-h_x, -h_y, 1), and the Jacobian -k(w wᵀ + δ diag(H, 0)).
"""

from asperity.laws.law import Law

LAW = Law(
    letter="C",
    name="change-of-height",
    contact="vertical",
    force=lambda c: c.k * c.depth * c.w,
    summary="gradient of the energy k δ²/2",
    clampable=True,
)
