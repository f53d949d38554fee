"""A user-defined texture kind with its own sampler, and everything that follows from it.

Run it: ``python examples/own_texture.py``, or use it on the command line,

    asperity compare egg-box:amplitude=0.1mm,period=2mm --plugin examples/own_texture.py

The egg-box h = A cos(2πx/l) cos(2πy/l) below is one file: scalar functions that Numba compiles
together with a law, a class that states proved bounds, and a name with arguments.
"""

import math
import sys
from types import ModuleType
from typing import NamedTuple

import numpy as np

import asperity as asp
from asperity.contacts import closest_search, distance_bounds
from asperity.contacts.sampler_interface import DIVIDE, EXPAND
from asperity.core.arguments import Argument
from asperity.core.compiled import Kernels
from asperity.textures import Domain, ScanLine, Texture
from asperity.textures.catalogue import register
from asperity.textures.texture import TextureKind

# --- the sampler: plain Python that Numba compiles ------------------------------------------------

KERNELS = Kernels(provides=("sample_height", "sample_gradient", "sample_hessian", "enclose_box"))


class Egg(NamedTuple):
    """Record passed to the functions below: A [m] and k [rad/m]."""

    a: float
    k: float


def sample_height(x: float, y: float, egg: Egg) -> float:
    """Return h [m]."""
    return egg.a * math.cos(egg.k * x) * math.cos(egg.k * y)


def sample_gradient(x: float, y: float, egg: Egg) -> tuple[float, float, float]:
    """Return h [m], h_x, h_y [1]."""
    a, k = egg
    cx, cy, sx, sy = math.cos(k * x), math.cos(k * y), math.sin(k * x), math.sin(k * y)
    return a * cx * cy, -a * k * sx * cy, -a * k * cx * sy


def sample_hessian(x: float, y: float, egg: Egg) -> tuple[float, float, float, float, float, float]:
    """Return h [m], h_x, h_y [1], h_xx, h_xy, h_yy [1/m]."""
    a, k = egg
    h, hx, hy = sample_gradient(x, y, egg)
    return h, hx, hy, -k * k * h, a * k * k * math.sin(k * x) * math.sin(k * y), -k * k * h


def enclose_box(
    box: tuple[float, float, float, float], egg: Egg
) -> tuple[float, float, float, float, float, int]:
    """Return bounds of h, Hess h and D³h, for the search of closest points: those of the plane."""
    a, k = egg
    small = (box[1] - box[0]) * k < 3.0  # Taylor's formula cannot decide a box of several bumps
    return -a, a, a * k * k, 3.0 * a * k**3, a * k * k, EXPAND if small else DIVIDE


# --- the kind: proved bounds ---------------------------------------------------------------------


class EggBox(Texture):
    """Bumps and dimples on a square lattice.

    Args:
        amplitude: A [m].
        period: l [m].
    """

    kind = "egg-box"
    constructor_arguments = (
        Argument("amplitude", "half of the peak-to-valley height", "m", required=True),
        Argument("period", "from bump to bump", "m", required=True),
    )

    def __init__(self, amplitude: float, period: float) -> None:
        self.amplitude, self.period = amplitude, period
        self._k = 2.0 * math.pi / period

    @property
    def sampler(self) -> tuple[ModuleType, ...]:
        """These functions, and the search for closest points, which calls them."""
        return sys.modules[__name__], closest_search, distance_bounds

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
    def third_derivative_bound(self) -> float:
        """Optional, for tighter bounds: h is the mean of two waves A cos(k (x ± y))."""
        return math.sqrt(8.0) * self.amplitude * self._k**3

    @property
    def domain(self) -> Domain:
        """One period."""
        return Domain(np.zeros(2), self.period * np.eye(2), periodic=True, description="one period")

    def scan_line(self) -> ScanLine:
        """Along x over the bumps."""
        return ScanLine(np.zeros(2), np.array([1.0, 0.0]), self.period, periodic=True)


# --- its name: for commands and scenes ------------------------------------------------------------

EGG_BOX = TextureKind(
    "egg-box",
    "bumps and dimples on a square lattice",
    EggBox,
    EggBox.constructor_arguments,
    example={"amplitude": 0.1e-3, "period": 2e-3},
)


def main() -> None:
    """Compare the laws on the new kind."""
    register(EGG_BOX)
    texture = EggBox(amplitude=0.1e-3, period=2e-3)
    for row in asp.compare(texture, laws="WACE").rows:
        print(f"{row.law.letter}: q = {row.q.value:.4f} ({row.q.method}); {row.verdict}")


if __name__ == "__main__":
    main()
