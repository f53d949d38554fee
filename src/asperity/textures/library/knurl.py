"""Diamond knurl: pyramids pressed into metal by two crossed rolls."""

from __future__ import annotations

import math

import numpy as np

from asperity.core.arguments import Argument
from asperity.textures.library.named import SyntheticPatch

SUMMARY = "diamond knurl with raised points, like a tool handle"
SOURCE = (
    "DIN 82, type RGE: grooves at 30° to the axis, profile angle 90°, pitches 0.5 to 1.6 mm "
    "measured across the grooves; the flat left on the points is typical, our choice"
)
ARGUMENTS = (
    Argument("spacing", "of the grooves, across them", "m", 1e-3, minimum=1e-5, maximum=0.1),
    Argument("groove_angle", "of the grooves to the y axis", "rad", math.radians(30.0),
             minimum=math.radians(10.0), maximum=math.radians(80.0)),
    Argument("profile_angle", "between the flanks", "rad", math.radians(90.0),
             minimum=math.radians(40.0), maximum=math.radians(170.0)),
    Argument("flat", "left on the points, share of spacing", "", 0.1, maximum=0.8),
)  # fmt: skip

_CELLS = (4, 2)
_NODES = (384, 320)


def synthesize(
    spacing: float, groove_angle: float, profile_angle: float, flat: float
) -> SyntheticPatch:
    """Return 4 x 2 cells of the lattice, two pyramids each."""
    cell = spacing / np.array([math.cos(groove_angle), math.sin(groove_angle)])
    (cx, cy), (nx, ny) = _CELLS, _NODES
    u = (np.arange(nx) + 0.5) * cx / nx
    v = (np.arange(ny)[:, None] + 0.5) * cy / ny
    # Distance from the bottom of the nearest groove [spacings], for both families of grooves.
    both = [np.abs(phase - np.round(phase)) for phase in (u + v, u - v)]
    rise = np.minimum(*both)
    steep = spacing / math.tan(0.5 * profile_angle)
    heights = steep * np.minimum(rise, 0.5 * (1.0 - flat))
    return SyntheticPatch(heights, (float(cell[0] * cx / nx), float(cell[1] * cy / ny)))
