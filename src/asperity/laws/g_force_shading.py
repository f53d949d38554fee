"""G, force shading: f = k δ₀ n, the smooth wall's force turned along the texture's normal.

Paper: (28) field (the trailing n there is stray), (29) energy. The paper finds no closed form of
the Jacobian; here it is exact: -k(n e_zᵀ - δ₀ N Eᵀ), singular values k and k δ₀ σ_i(N). Not
conservative, and on an asymmetric profile it pushes steadily along a straight scan.
"""

from asperity.laws.law import Law

LAW = Law(
    letter="G",
    name="force-shading",
    contact="nominal",
    force=lambda c: c.k * c.depth * c.normal,
    summary="smooth wall with a force along the texture normal",
    clampable=True,
)
