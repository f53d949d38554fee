"""C, change of height: f = k δ w = -∇(k δ²/2).

Paper: (13) potential, (14) field, (15) Jacobian. Corrections: as printed, U of (13) is minus the
energy and f = +∇U; the x part of Table I, row C, has the wrong sign. With δ = h - z positive
inside, the force is k δ (-h_x, -h_y, 1), and the Jacobian -k(w wᵀ + δ diag(H, 0)).
"""

from __future__ import annotations

from typing import Any

from asperity.laws.law import ContactSymbols, Law


def force(c: ContactSymbols) -> Any:
    """Return k δ w."""
    return c.k * c.depth * c.w


LAW = Law(
    letter="C",
    name="change-of-height",
    contact="vertical",
    force=force,
    summary="gradient of the energy k δ²/2",
    clampable=True,
)
