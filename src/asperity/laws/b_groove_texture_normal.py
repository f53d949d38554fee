"""B, groove with a force along the texture's normal: f = k δ n.

Paper: (11) field, (12) energy of the loop of its Fig. 3. The paper finds no closed form of the
Jacobian; here it is derived exactly: -k(s n nᵀ - δ N Eᵀ), N = ∂n/∂(x, y). Remark 5: the
normalisation of n destroys the conservativity that law C has.
"""

from __future__ import annotations

from typing import Any

from asperity.laws.law import ContactSymbols, Law


def force(c: ContactSymbols) -> Any:
    """Return k δ n."""
    return c.k * c.depth * c.normal


LAW = Law(
    letter="B",
    name="groove-texture-normal",
    contact="vertical",
    force=force,
    summary="height of the groove, pushed along the texture normal",
    clampable=True,
)
