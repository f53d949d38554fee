"""A finger proxy on a sinusoidal surface, as many haptics libraries have one, for certification.

    asperity certify finger_proxy.py:FingerProxy --region -1mm:1mm,-1mm:1mm,-0.5mm:0.2mm

The proxy slides on the surface to the nearest local minimum of the distance from the probe, and
pulls the probe towards it. It remembers where it was: the force at a point depends on the approach,
and it jumps where the proxy falls over a crest.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

AMPLITUDE = 0.2e-3
PERIOD = 2e-3
STIFFNESS = 1000.0
_WAVENUMBER = 2.0 * math.pi / PERIOD


class FingerProxy:
    """A proxy that is free above the surface, and slides on it below."""

    def __init__(self) -> None:
        self._place: float | None = None

    def reset(self) -> None:
        """Let the proxy go: the next contact begins where the probe is."""
        self._place = None

    def __call__(self, point: NDArray[np.float64]) -> list[float]:
        """Return the force [N] at a position [m]."""
        x, _y, z = point.tolist()
        if z >= AMPLITUDE * math.sin(_WAVENUMBER * x):
            self._place = None
            return [0.0, 0.0, 0.0]
        start = x if self._place is None else self._place
        self._place = _slide(start, x, z)
        height = AMPLITUDE * math.sin(_WAVENUMBER * self._place)
        return [STIFFNESS * (self._place - x), 0.0, STIFFNESS * (height - z)]


def _slide(start: float, x: float, z: float) -> float:
    """Return where a proxy comes to rest that slides from a place: a local minimum of distance."""
    place = start
    for _ in range(60):
        angle = _WAVENUMBER * place
        gap = AMPLITUDE * math.sin(angle) - z
        slope = AMPLITUDE * _WAVENUMBER * math.cos(angle)
        gradient = place - x + gap * slope
        curvature = 1.0 + slope * slope - gap * AMPLITUDE * _WAVENUMBER**2 * math.sin(angle)
        step = -gradient / max(curvature, 0.2)
        place += min(max(step, -0.05 * PERIOD), 0.05 * PERIOD)
        if abs(step) < 1e-13:
            break
    return place
