"""A texture kind with a sampler of its own, and everything that follows from it.

Run it: ``python examples/own_texture.py``, or name it on the command line,

    asperity compare egg-box:amplitude=0.1mm,period=2mm --law-module examples/own_texture.py

The egg-box h = A cos(2πx/l) cos(2πy/l) below is one file: scalar functions that Numba compiles
together with a law, a class that says what is proved of them, and a name with arguments.
"""

import math
import sys
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

import asperity as asp
from asperity.arguments import Argument
from asperity.compiled import Kernels
from asperity.contacts.nearest import plane_search
from asperity.contacts.nearest.plane_search import descend
from asperity.textures import Domain, ScanLine, Texture
from asperity.textures.catalogue import register
from asperity.textures.texture import Kind

# --- the sampler: plain Python that Numba compiles ------------------------------------------------

KERNELS = Kernels(provides=("height", "slope", "curvature", "foot"), requires=("descend",))


class Egg(NamedTuple):
    """What the functions receive of a texture: A [m] and k [rad/m]."""

    a: float
    k: float


def height(x: float, y: float, egg: Egg) -> float:
    """Return h [m]."""
    return egg.a * math.cos(egg.k * x) * math.cos(egg.k * y)


def slope(x: float, y: float, egg: Egg) -> tuple[float, float, float]:
    """Return h [m], h_x, h_y [1]."""
    a, k = egg
    cx, cy, sx, sy = math.cos(k * x), math.cos(k * y), math.sin(k * x), math.sin(k * y)
    return a * cx * cy, -a * k * sx * cy, -a * k * cx * sy


def curvature(x: float, y: float, egg: Egg) -> tuple[float, float, float, float, float, float]:
    """Return h [m], h_x, h_y [1], h_xx, h_xy, h_yy [1/m]."""
    a, k = egg
    h, hx, hy = slope(x, y, egg)
    return h, hx, hy, -k * k * h, a * k * k * math.sin(k * x) * math.sin(k * y), -k * k * h


def foot(x: float, y: float, z: float, egg: Egg) -> tuple[float, float, float, float, float]:
    """Return X, Y of the nearest surface point, and h, h_x, h_y there: the best of 25 descents."""
    best = descend(x, y, z, x, y, egg)
    step = 0.5 * math.sqrt(best[2])
    for i in range(-2, 3):
        for j in range(-2, 3):
            found = descend(x, y, z, x + i * step, y + j * step, egg)
            if found[2] < best[2]:
                best = found
    return best[0], best[1], best[3], best[4], best[5]


# --- the kind: what is proved ---------------------------------------------------------------------


class EggBox(Texture):
    """Bumps and dimples on a square lattice.

    Args:
        amplitude: A [m].
        period: l [m].
    """

    kind = "egg-box"

    def __init__(self, amplitude: float, period: float) -> None:
        self.amplitude, self.period = amplitude, period
        self._k = 2.0 * math.pi / period

    @property
    def sampler(self) -> tuple[ModuleType, ...]:
        """These functions, and ``descend``, which they call."""
        return sys.modules[__name__], plane_search

    @property
    def arguments(self) -> Egg:
        """A and k."""
        return Egg(self.amplitude, self._k)

    @property
    def extremes(self) -> tuple[float, float]:
        """-A and A."""
        return -self.amplitude, self.amplitude

    @property
    def bounds(self) -> tuple[float, float]:
        """A k and A k²; Hess h has the eigenvalues -A k² cos(k (x ± y))."""
        return self.amplitude * self._k, self.amplitude * self._k**2

    @property
    def twist(self) -> float:
        """Not needed, but numbers get sharper: h is the mean of two waves A cos(k (x ± y))."""
        return math.sqrt(8.0) * self.amplitude * self._k**3

    @property
    def domain(self) -> Domain:
        """One period."""
        return Domain(np.zeros(2), self.period * np.eye(2), periodic=True, description="one period")

    def scan_line(self) -> ScanLine:
        """Along x over the bumps."""
        return ScanLine(np.zeros(2), np.array([1.0, 0.0]), self.period, periodic=True)

    def describe(self) -> dict[str, Any]:
        """See :class:`Texture`."""
        return {"kind": self.kind, "amplitude": self.amplitude, "period": self.period}


# --- its name: for commands and scenes ------------------------------------------------------------

EGG_BOX = Kind(
    "egg-box",
    "bumps and dimples on a square lattice",
    EggBox,
    (
        Argument("amplitude", "half of the peak-to-valley height", "m", required=True),
        Argument("period", "from bump to bump", "m", required=True),
    ),
    example={"amplitude": 0.1e-3, "period": 2e-3},
)


def main() -> None:
    """Show what follows from the kind."""
    register(EGG_BOX)
    texture = EggBox(amplitude=0.1e-3, period=2e-3)
    for row in asp.compare(texture, laws="WACE").rows:
        print(f"{row.law.letter}: q = {row.q.value:.4f} ({row.q.method}); {row.verdict}")


if __name__ == "__main__":
    main()
