"""F, friction modulation: f = k δ₀ (-μ (1 - m) d/d_max + e_z), d the deflection of the anchor.

Paper: (22) field, (23)–(26) Jacobian, (27) energy of the loop of Fig. 3, appendix I bound on q.
The friction model is the time-free stick-slip model of Hayward and Armstrong (the paper's [32]):
d = p_xy - anchor; stick while |d| ≤ d_max, else the anchor is dragged so that |d| = d_max.
Corrections: the sign of (22) as printed lets friction drive the motion ((27) confirms the one
used here); Table I, row F, lacks d/d_max; h' in (23) must be h'·d; (25) and (26) are bounds entry
by entry, and their factor 2 contradicts 0 ≤ h ≤ 1; (31) has garbled terms. Here the modulation is
m = (1 + a_m ĥ)/2 with ĥ the height scaled to [-1, 1], a_m the modulation depth; in space the slip
phase keeps its transverse stiffness, ∂d/∂p = I - u uᵀ.
"""

from __future__ import annotations

from typing import Any

from asperity.core.arguments import Argument
from asperity.laws.law import ContactSymbols, Law


def force(c: ContactSymbols) -> Any:
    """Return k δ₀ (-μ (1 - m) d/d_max + e_z)."""
    m = (1 + c.parameter("modulation_depth") * c.relative_height) / 2
    friction = c.parameter("friction") * (1 - m) / c.parameter("max_deflection")
    return c.k * c.depth * (c.e_z - c.tangential(friction * c.deflection))


LAW = Law(
    letter="F",
    name="friction-modulation",
    contact="nominal",
    force=force,
    summary="smooth wall with friction that the height modulates",
    clampable=True,
    stateful=True,
    parameters={
        "friction": Argument("friction", "friction coefficient μ of law F", default=0.8),
        "max_deflection": Argument(
            "max_deflection",
            "maximum deflection d_max between probe and friction anchor (law F)",
            "m",
            1e-3,
            must_be_positive=True,
        ),
        "modulation_depth": Argument(
            "modulation_depth", "modulation depth a_m of law F, 0 to 1", default=0.8, maximum=1.0
        ),
    },
)
