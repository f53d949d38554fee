"""The living definition: a surface's force and Jacobian in many digits, slowly.

Kernels, C code and analysis are tested against it. It shares nothing with them but the symbolic
force of the law: heights come from the defining formulas of each texture, the god-object from
solving its condition, the Jacobian from differences of the force in doubled precision.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mpmath
import sympy as sp

from asperity.contacts.symbols import DEPTH, DX, DY, H_HALF, H_MID, HX, HY, POSITION, H, K
from asperity.derive.jacobian import symbolic_force
from asperity.errors import ParameterError
from asperity.surface import Surface
from asperity.textures.exact import ExactHeight
from asperity.textures.texture import Texture


def exact_force(
    surface: Surface, point: Sequence[Any], deflection: Sequence[Any] = (0, 0), digits: int = 30
) -> Any:
    """Return the unclamped force of a surface at one point, (3, 1) mpmath matrix [N].

    Args:
        surface: the surface; its clamp is not looked at.
        point: probe position [m].
        deflection: of the anchor [m], for a law with state.
        digits: decimal digits to work with.
    """
    with mpmath.workdps(digits):
        return _force(surface, [mpmath.mpf(c) for c in point], [mpmath.mpf(c) for c in deflection])


def exact_jacobian(
    surface: Surface,
    point: Sequence[Any],
    deflection: Sequence[Any] = (0, 0),
    sliding: bool = False,
    digits: int = 30,
) -> Any:
    """Return the Jacobian at one point, (3, 3) mpmath matrix [N/m].

    Central differences of :func:`exact_force` with doubled digits: the step is 10^-digits of the
    scale of the depth, so the error of the difference is far below the digits asked for. While
    sticking the deflection follows the probe; while sliding only its part across d does.
    """
    with mpmath.workdps(3 * digits):
        p, d = [mpmath.mpf(c) for c in point], [mpmath.mpf(c) for c in deflection]
        step = mpmath.mpf(10) ** (-digits) * mpmath.mpf(surface.max_depth)
        square = d[0] ** 2 + d[1] ** 2
        columns = []
        for axis in range(3):
            move = [step if i == axis else mpmath.mpf(0) for i in range(3)]
            follow = move[:2]
            if sliding and square > 0:
                along = (d[0] * move[0] + d[1] * move[1]) / square
                follow = [move[0] - along * d[0], move[1] - along * d[1]]
            ahead = _force(
                surface,
                [a + b for a, b in zip(p, move, strict=True)],
                [a + b for a, b in zip(d, follow, strict=True)],
            )
            behind = _force(
                surface,
                [a - b for a, b in zip(p, move, strict=True)],
                [a - b for a, b in zip(d, follow, strict=True)],
            )
            columns.append((ahead - behind) / (2 * step))
        return mpmath.matrix([[columns[c][r] for c in range(3)] for r in range(3)])


def _force(surface: Surface, p: list[Any], d: list[Any]) -> Any:
    law, h = surface.law, surface.texture.exact_height()
    if law.contact.name == "split":
        # Its definition is a supremum over space: the theorems on it are tested instead.
        raise ParameterError("surface", f"with law {law} has no definition in many digits")
    x, y, z = p
    if law.contact.name == "nominal":
        depth, foot = -z, (x, y)
    else:
        depth, foot = h(x, y, 0, 0) - z, (x, y)
    if depth <= 0:
        return mpmath.matrix([0, 0, 0])
    if law.contact.name == "nearest":
        foot = _exact_foot(surface.texture, h, p)
        away = [foot[0] - x, foot[1] - y, h(*foot, 0, 0) - z]
        depth = mpmath.sqrt(sum(part**2 for part in away))
    names = [*POSITION, DEPTH, H, HX, HY, DX, DY, K, H_MID, H_HALF]
    stiffness, middle, half = surface.law_arguments[:3]
    values = [*p, depth, h(*foot, 0, 0), h(*foot, 1, 0), h(*foot, 0, 1), *d]
    values += [mpmath.mpf(stiffness), mpmath.mpf(middle), mpmath.mpf(half)]
    for name, value in surface.law_parameters.items():
        names.append(sp.Symbol(name, real=True))
        values.append(mpmath.mpf(value))
    return sp.lambdify(names, symbolic_force(law), "mpmath")(*values)


def _exact_foot(texture: Texture, h: ExactHeight, p: list[Any]) -> tuple[Any, Any]:
    """Solve (X - x) + (h - z) h_x = 0, (Y - y) + (h - z) h_y = 0 from the double-precision foot."""
    start = texture.nearest([[float(c) for c in p]])[0]
    fx, fy = mpmath.mpf(start[0]), mpmath.mpf(start[1])
    for _ in range(60):
        gap, hx, hy = h(fx, fy, 0, 0) - p[2], h(fx, fy, 1, 0), h(fx, fy, 0, 1)
        hxx, hxy, hyy = h(fx, fy, 2, 0), h(fx, fy, 1, 1), h(fx, fy, 0, 2)
        a, b = fx - p[0] + gap * hx, fy - p[1] + gap * hy
        qxx, qxy, qyy = 1 + hx * hx + gap * hxx, hx * hy + gap * hxy, 1 + hy * hy + gap * hyy
        det = qxx * qyy - qxy * qxy
        sx, sy = (qxy * b - qyy * a) / det, (qxy * a - qxx * b) / det
        fx, fy = fx + sx, fy + sy
        if abs(sx) + abs(sy) <= mpmath.eps * (abs(fx) + abs(fy) + abs(gap)):
            break
    return fx, fy
