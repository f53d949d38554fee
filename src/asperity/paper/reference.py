"""Reference implementation: force and Jacobian in multi-precision arithmetic (mpmath).

Kernels, C code and analysis are tested against it. It shares only the symbolic force of the law
with them: heights come from the defining formulas of each texture, the god-object from solving its
condition, the Jacobian from differences of the force in doubled precision.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mpmath
import sympy as sp

from asperity.contacts.contact import ExactHeight
from asperity.contacts.symbols import DEPTH, DX, DY, H_HALF, H_MID, HX, HY, POSITION, H, K
from asperity.core.errors import ParameterError
from asperity.derive.derivatives import symbolic_force
from asperity.surface import Surface


def exact_force(
    surface: Surface,
    point: Sequence[Any],
    deflection: Sequence[Any] = (0, 0),
    digits: int = 30,
    height: ExactHeight | None = None,
) -> Any:
    """Return the unclamped force of a surface at one point, (3, 1) mpmath matrix [N].

    Args:
        surface: the surface; its clamp is ignored.
        point: probe position [m].
        deflection: deflection of the anchor [m], for a law with state.
        digits: decimal digits of the arithmetic.
        height: function of the height; by default :meth:`Texture.exact_height`.
    """
    height = height or surface.texture.exact_height()
    with mpmath.workdps(digits):
        p = [mpmath.mpf(c) for c in point]
        d = [mpmath.mpf(c) for c in deflection]
        return _force(surface, height, p, d)


def exact_jacobian(
    surface: Surface,
    point: Sequence[Any],
    deflection: Sequence[Any] = (0, 0),
    sliding: bool = False,
    digits: int = 30,
    height: ExactHeight | None = None,
) -> Any:
    """Return the Jacobian at one point, (3, 3) mpmath matrix [N/m].

    Central differences of :func:`exact_force` with doubled digits: the step is 10^-digits of the
    scale of the depth, so the error of the difference is far below the requested digits. While the
    anchor sticks, the deflection follows the probe; while it slides, only the part across d does.
    """
    height = height or surface.texture.exact_height()
    with mpmath.workdps(3 * digits):
        p = [mpmath.mpf(c) for c in point]
        d = [mpmath.mpf(c) for c in deflection]
        step = mpmath.mpf(10) ** (-digits) * mpmath.mpf(surface.max_depth)
        columns = []
        for axis in range(3):
            move = [step if i == axis else mpmath.mpf(0) for i in range(3)]
            follow = _anchor_motion(move, d, sliding)
            ahead = _force(surface, height, _offset(p, 1, move), _offset(d, 1, follow))
            behind = _force(surface, height, _offset(p, -1, move), _offset(d, -1, follow))
            columns.append((ahead - behind) / (2 * step))
        return mpmath.matrix([[columns[c][r] for c in range(3)] for r in range(3)])


def _anchor_motion(move: Sequence[Any], deflection: Sequence[Any], sliding: bool) -> list[Any]:
    """Return the change of the deflection: the motion of the probe, or its part across it."""
    square = deflection[0] ** 2 + deflection[1] ** 2
    if not sliding or square == 0:
        return list(move[:2])
    along = (deflection[0] * move[0] + deflection[1] * move[1]) / square
    return [move[0] - along * deflection[0], move[1] - along * deflection[1]]


def _offset(point: list[Any], sign: int, step: list[Any]) -> list[Any]:
    return [a + sign * b for a, b in zip(point, step, strict=True)]


def _force(surface: Surface, h: ExactHeight, p: list[Any], d: list[Any]) -> Any:
    law = surface.law
    contact = law.contact.exact_contact(surface.texture, h, p)
    if contact is None:
        raise ParameterError("surface", f"with law {law} has no reference implementation")
    depth, x, y = contact
    if depth <= 0:
        return mpmath.matrix([0, 0, 0])
    names = [*POSITION, DEPTH, H, HX, HY, DX, DY, K, H_MID, H_HALF]
    stiffness, middle, half = surface.law_arguments[:3]
    values = [*p, depth, h(x, y, 0, 0), h(x, y, 1, 0), h(x, y, 0, 1), *d]
    values += [mpmath.mpf(stiffness), mpmath.mpf(middle), mpmath.mpf(half)]
    for name, value in surface.law_parameters.items():
        names.append(sp.Symbol(name, real=True))
        values.append(mpmath.mpf(value))
    return sp.lambdify(names, symbolic_force(law), "mpmath")(*values)
