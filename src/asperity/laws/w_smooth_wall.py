"""W, the smooth wall: f = k δ₀ e_z, the virtual wall before it is textured.

Paper: (30). The force is a spring to the nominal plane; q = q⁺ = 1, conservative.
"""

from __future__ import annotations

from typing import Any

from asperity.laws.law import ContactSymbols, Law


def force(c: ContactSymbols) -> Any:
    """Return k δ₀ e_z."""
    return c.k * c.depth * c.e_z


LAW = Law(
    letter="W",
    name="smooth-wall",
    contact="nominal",
    force=force,
    summary="spring to the smooth wall",
)
