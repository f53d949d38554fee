"""B, groove with a force along the texture's normal: f = k δ n.

Paper: (11) field, (12) energy of the loop of its Fig. 3. The paper finds no closed form of the
Jacobian; here it is derived exactly: -k(s n nᵀ - δ N Eᵀ), N = ∂n/∂(x, y). Remark 5: the
normalisation of n destroys the conservativity that law C has.
"""

from asperity.laws.law import Law

LAW = Law(
    letter="B",
    name="groove-texture-normal",
    contact="vertical",
    force=lambda c: c.k * c.depth * c.normal,
    summary="height of the groove, pushed along the texture normal",
    clampable=True,
)
