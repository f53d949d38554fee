"""The symbols in which a law is written."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import sympy as sp

# Probe position [m]. The body is z < h(x, y).
X, Y, Z = sp.symbols("x y z", real=True)
POSITION = (X, Y, Z)
# Depth of the probe [m], positive inside; the contact defines it.
DEPTH = sp.Symbol("depth", positive=True)
# Height and its derivatives at the contact point [m, 1, 1/m].
H, HX, HY, HXX, HXY, HYY = sp.symbols("h hx hy hxx hxy hyy", real=True)
# Tangential deflection of the dragged anchor [m] and its derivative by the probe position.
DX, DY = sp.symbols("dx dy", real=True)
SXX, SXY, SYY = sp.symbols("sxx sxy syy", real=True)
# From the probe to a contact point that is not on the surface, as for the split god-object [m],
# and the symmetric derivative of that vector by the probe position.
CONTACT_VECTOR = sp.symbols("tx ty tz", real=True)
MXX, MXY, MXZ, MYY, MYZ, MZZ = sp.symbols("mxx mxy mxz myy myz mzz", real=True)
# Potential energy of a spring of stiffness 1 to that point [m²].
CONTACT_ENERGY = sp.Symbol("energy_tk", nonnegative=True)
CONTACT_VECTOR_DERIVATIVE = sp.Matrix([[MXX, MXY, MXZ], [MXY, MYY, MYZ], [MXZ, MYZ, MZZ]])
# Stiffness of the smooth wall [N/m].
K = sp.Symbol("k", positive=True)
# Middle and half of the range of the heights of the texture [m].
H_MID = sp.Symbol("h_mid", real=True)
H_HALF = sp.Symbol("h_half", positive=True)

# The order of a kernel's arguments; it takes those that it uses.
ARGUMENT_ORDER = (
    *POSITION,
    DEPTH,
    H,
    HX,
    HY,
    HXX,
    HXY,
    HYY,
    DX,
    DY,
    SXX,
    SXY,
    SYY,
    *CONTACT_VECTOR,
    CONTACT_ENERGY,
    MXX,
    MXY,
    MXZ,
    MYY,
    MYZ,
    MZZ,
    K,
    H_MID,
    H_HALF,
)


def unit_normal() -> Any:
    """Return the unit normal of the textured surface at the contact point, upwards."""
    return sp.Matrix([-HX, -HY, 1]) / sp.sqrt(1 + HX**2 + HY**2)


@dataclass(frozen=True)
class ContactSymbols:
    """The symbols of a law's formula: the contact of one probe, in SymPy.

    Attributes:
        parameter_names: names of the law's own parameters.
        contact_vector: from the probe to the contact point, unless it is depth times normal.

    Example:
        >>> c = ContactSymbols()
        >>> c.k * c.depth * c.w
        Matrix([
        [-depth*hx*k],
        [-depth*hy*k],
        [    depth*k]])
    """

    parameter_names: tuple[str, ...] = ()
    contact_vector: Any = None

    k = K
    depth = DEPTH
    h = H
    slope = sp.Matrix([HX, HY])
    position = sp.Matrix(POSITION)
    deflection = sp.Matrix([DX, DY])
    e_z = sp.Matrix([0, 0, 1])

    @cached_property
    def w(self) -> Any:
        """Upward normal before normalisation: (-h_x, -h_y, 1)."""
        return sp.Matrix([-HX, -HY, 1])

    @cached_property
    def normal(self) -> Any:
        """Unit normal of the textured surface at the contact point, n = w / |w|."""
        return unit_normal()

    @cached_property
    def toward(self) -> Any:
        """Vector from the probe to the contact point [m]: p_h - p, or z̄ - p if split."""
        return self.depth * self.normal if self.contact_vector is None else self.contact_vector

    @cached_property
    def relative_height(self) -> Any:
        """Height scaled to [-1, 1] by the certified extremes of the texture."""
        return (H - H_MID) / H_HALF

    def tangential(self, vector: Any) -> Any:
        """Return a tangential 2-vector in space: (v_x, v_y, 0)."""
        return sp.Matrix([vector[0], vector[1], 0])

    def parameter(self, name: str) -> Any:
        """Return the symbol of one of the law's own parameters."""
        if name not in self.parameter_names:
            raise KeyError(f"the law does not declare a parameter {name!r}")
        return sp.Symbol(name, real=True)
