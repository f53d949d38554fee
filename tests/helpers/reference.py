"""The reference implementation of force and Jacobian on all texture kinds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from tests.helpers.exact_heights import exact_height

from asperity.paper import reference
from asperity.surface import Surface


def exact_force(
    surface: Surface, point: Sequence[Any], deflection: Sequence[Any] = (0, 0), digits: int = 30
) -> Any:
    """Return the unclamped force, (3, 1) mpmath matrix [N]; see :mod:`asperity.paper.reference`."""
    return reference.exact_force(surface, point, deflection, digits, exact_height(surface.texture))


def exact_jacobian(
    surface: Surface,
    point: Sequence[Any],
    deflection: Sequence[Any] = (0, 0),
    sliding: bool = False,
    digits: int = 30,
) -> Any:
    """Return the Jacobian, (3, 3) mpmath matrix [N/m]."""
    h = exact_height(surface.texture)
    return reference.exact_jacobian(surface, point, deflection, sliding, digits, h)
