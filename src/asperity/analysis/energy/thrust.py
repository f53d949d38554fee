"""The mean tangential force on a straight scan: what carries the hand along, or holds it back."""

from __future__ import annotations

import numpy as np

from asperity.analysis.energy.loops import integrate, smooth_panels
from asperity.analysis.energy.merit import scan_height
from asperity.checks import FloatArray
from asperity.surface import Surface
from asperity.textures.texture import ScanLine


def mean_thrust(surface: Surface, line: ScanLine) -> float:
    """Return (1/l) ∫ f_t dt along a line at constant height [N].

    At z = max h - max_depth, on the nominal contact at -max_depth.

    Args:
        surface: a surface whose law has no state.
        line: the line; its whole length counts.
    """
    height = scan_height(surface)
    tangent = np.array([*line.direction, 0.0])

    def integrand(s: FloatArray) -> FloatArray:
        xy = line.start + (s * line.length)[:, None] * line.direction
        points = np.column_stack([xy, np.full(len(s), height)])
        return np.asarray(surface.force(points) @ tangent)

    if surface.law.contact.costly:
        # Costly contacts: the periodic mean needs no more than equal steps.
        steps = (np.arange(_STEPS) + 0.5) / _STEPS
        return float(integrand(steps).mean())
    return integrate(integrand, smooth_panels(surface, line.length))


_STEPS = 512
