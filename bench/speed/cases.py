"""What is measured: one texture of each kind, probe points in the body, the compiled loops."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from asperity.core.checks import FloatArray
from asperity.surface import Surface
from asperity.textures import Fourier, HeightMap, Profile, Sinusoid
from asperity.textures.texture import Texture

LAWS = "WABCDEFGH"
STIFFNESS = 1000.0
SEED = 20240607
HELD_HANDLE = """
[hand]
kind = "spring"
stiffness = "300 N/m"
damping = "3 N*s/m"
mass = "50 g"
[motion]
kind = "still"
point = ["0 mm", "0 mm", "-2 mm"]
"""
"""Part of a scene: a hand of 50 g that holds the handle 2 mm below the surface."""


def textures() -> dict[str, Texture]:
    """Return one texture of each kind, all of them about 0.3 mm to 0.8 mm from peak to valley."""
    rng = np.random.default_rng(SEED)
    # Eight waves of 0.8 mm to 3 mm that repeat together after 4 mm along x and y.
    multiples = [[2, 0], [1, 2], [-1, 3], [3, 1], [0, 4], [4, -2], [2, 3], [-3, 4]]
    waves = 2.0 * np.pi / 4e-3 * np.array(multiples, dtype=np.float64)
    return {
        "sinusoid": Sinusoid(amplitude=0.4e-3, period=1.5e-3, phase=0.3, direction=(0.8, 0.6)),
        "fourier": Fourier(rng.uniform(0.02e-3, 0.06e-3, 8), waves, rng.uniform(0.0, 6.0, 8)),
        "heightmap": HeightMap(rough_heights((256, 256), rng), pitch=50e-6),
        "profile": Profile(rough_heights((1024,), rng), pitch=50e-6),
    }


def rough_heights(shape: tuple[int, ...], rng: np.random.Generator) -> FloatArray:
    """Return band-limited noise [m]: white noise through a Gaussian filter of six nodes."""
    from scipy.ndimage import gaussian_filter

    noise = gaussian_filter(rng.standard_normal(shape), sigma=6.0, mode="reflect")
    return np.asarray(0.1e-3 * noise / noise.std(), dtype=np.float64)


def probes(texture: Texture, count: int, depth: float | None = None) -> FloatArray:
    """Return points [m] (count, 3) in contact for every law, uniform over the texture.

    At the given vertical depth [m]; without one, at depths up to the default max_depth below
    both the textured surface and the nominal one.
    """
    rng = np.random.default_rng(SEED + 1)
    spans = texture.domain.spans
    xy = texture.domain.points(rng.uniform(size=(count, len(spans))))
    if len(spans) == 1:  # across a profile, too
        along = spans[0] / np.hypot(*spans[0])
        xy = xy + rng.uniform(0.0, 10e-3, count)[:, None] * np.array([-along[1], along[0]])
    height = texture.height(xy)
    if depth is None:
        reach = Surface(texture).max_depth
        z = np.minimum(height, 0.0) - reach * rng.uniform(0.01, 1.0, count)
    else:
        z = height - depth
    return np.ascontiguousarray(np.column_stack([xy, z]))


@dataclass(frozen=True)
class Kernel:
    """The compiled loops of one surface with every array they need, allocated beforehand.

    Attributes:
        surface: the surface.
        points: probe points [m], shape (n, 3).
        state: deflection and sliding of law F, else nothing.
        force: result [N], shape (n, 3).
        jacobian: result [N/m], shape (n, 3, 3).
    """

    surface: Surface
    points: FloatArray
    state: tuple[Any, ...]
    force: FloatArray
    jacobian: FloatArray

    def run_force(self) -> None:
        """Compute the forces, exactly as :meth:`Surface.force` does after its checks."""
        surface = self.surface
        surface._loops.force_batch(
            self.points,
            *self.state[:1],
            self.force,
            surface.texture.arguments,
            surface.law_arguments,
        )

    def run_jacobian(self) -> None:
        """Compute forces and Jacobians, exactly as :meth:`Surface.jacobian` does."""
        surface = self.surface
        surface._loops.jacobian_batch(
            self.points,
            *self.state,
            self.force,
            self.jacobian,
            surface.texture.arguments,
            surface.law_arguments,
        )


def kernel(texture: Texture, law: str, points: FloatArray) -> Kernel:
    """Return the loops of a law on a texture at the points."""
    surface = Surface(texture, law, stiffness=STIFFNESS)
    count = len(points)
    state: tuple[Any, ...] = ()
    if surface.law.stateful:
        rng = np.random.default_rng(SEED + 2)
        reach = 0.7 * surface.max_deflection
        state = (rng.uniform(-reach, reach, (count, 2)), rng.uniform(size=count) < 0.5)
    return Kernel(surface, points, state, np.zeros((count, 3)), np.zeros((count, 3, 3)))
