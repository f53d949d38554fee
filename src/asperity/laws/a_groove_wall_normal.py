"""A, groove with a force along the wall's normal: f = k δ e_z.

Paper: (6) field, (7) Jacobian, (8)–(10) norm and characteristic number √(1 + (2πA/l)²).
Corrections: (9) is written for κ where q is meant; the maximum (10) is attained at
x = 0 mod l/2, not mod π/l. Table I agrees. The curl is (-h_y, h_x, 0)·(-k): not conservative.
"""

from asperity.laws.law import Law

LAW = Law(
    letter="A",
    name="groove-wall-normal",
    contact="vertical",
    force=lambda c: c.k * c.depth * c.e_z,
    summary="height of the groove, pushed along the wall normal",
    clampable=True,
)
