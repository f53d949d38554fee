"""How the contact moves when the probe moves: the derivatives that every law shares.

A contact has a depth and a point (X, Y, h(X, Y)) of the surface. For a law's Jacobian we need
the gradient of the depth and the derivative of (X, Y) by the probe position.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import sympy as sp

from asperity.laws.law import ContactName
from asperity.laws.symbols import DEPTH, HX, HXX, HXY, HY, HYY


@dataclass(frozen=True)
class ContactDerivatives:
    """Derivatives of a contact by the probe position.

    Attributes:
        depth_gradient: ∇depth, shape (1, 3).
        point_derivative: ∂(X, Y)/∂p, shape (2, 3).
        single_valued: whether the contact point depends continuously on the probe.
        definitions: names for parts of the above with their values, each in terms of the
            contact symbols and of the names before it; kept apart, because expanding the
            determinant of Q cancels digits near the medial axis.
    """

    depth_gradient: Any
    point_derivative: Any
    single_valued: bool
    definitions: tuple[tuple[Any, Any], ...] = ()


def contact_derivatives(contact: ContactName) -> ContactDerivatives:
    """Return the derivatives of one kind of contact.

    * nominal: depth = -z, (X, Y) = (x, y).
    * vertical: depth = h - z, (X, Y) = (x, y); ∇depth = (h_x, h_y, -1).
    * nearest: depth = distance to the nearest surface point; ∇depth = -n there, and by the
      implicit function theorem ∂(X, Y)/∂p = Q⁻¹ [I g] with Q = I + g gᵀ + (h - z) H, where
      h - z = depth / s because the foot lies along the normal (MATH section 3).
    * split: the vector to the contact point is all there is; its derivative comes with it.
    """
    known = {"nominal": _nominal, "vertical": _vertical, "nearest": _nearest, "split": _split}
    return known[contact]()


def _nominal() -> ContactDerivatives:
    return ContactDerivatives(sp.Matrix([[0, 0, -1]]), sp.Matrix([[1, 0, 0], [0, 1, 0]]), True)


def _vertical() -> ContactDerivatives:
    return ContactDerivatives(sp.Matrix([[HX, HY, -1]]), sp.Matrix([[1, 0, 0], [0, 1, 0]]), True)


def _nearest() -> ContactDerivatives:
    root = sp.sqrt(1 + HX**2 + HY**2)
    q11, q12, q22, r = sp.symbols("q11 q12 q22 r", real=True)
    definitions = (
        (q11, 1 + HX**2 + DEPTH / root * HXX),
        (q12, HX * HY + DEPTH / root * HXY),
        (q22, 1 + HY**2 + DEPTH / root * HYY),
        (r, 1 / (q11 * q22 - q12**2)),
    )
    inverse = r * sp.Matrix([[q22, -q12], [-q12, q11]])
    return ContactDerivatives(
        depth_gradient=sp.Matrix([[HX, HY, -1]]) / root,
        point_derivative=inverse * sp.Matrix([[1, 0, HX], [0, 1, HY]]),
        single_valued=False,
        definitions=definitions,
    )


def _split() -> ContactDerivatives:
    nothing = sp.zeros(1, 3)
    return ContactDerivatives(nothing, sp.zeros(2, 3), single_valued=True)
