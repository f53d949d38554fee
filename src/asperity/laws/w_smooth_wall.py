"""W, the smooth wall: f = k δ₀ e_z, the virtual wall before it is textured.

Paper: (30). The force is a spring to the nominal plane; q = q⁺ = 1, conservative.
"""

from asperity.laws.law import Law

LAW = Law(
    letter="W",
    name="smooth-wall",
    contact="nominal",
    force=lambda c: c.k * c.depth * c.e_z,
    summary="spring to the smooth wall",
)
