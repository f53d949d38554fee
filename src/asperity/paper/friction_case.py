"""Parameters of the paper's law F, the numbers that it prints and those of its kernel."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from asperity.core.checks import FloatArray
from asperity.paper.cases import SCANNING
from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid

_TWO_PI = 2.0 * math.pi


@dataclass(frozen=True)
class FrictionCase:
    """Parameters of the paper's law F: friction, d_max [m], A [1], l [m], |p^z| [m]."""

    friction: float
    deflection: float
    amplitude: float
    period: float
    depth: float

    def modulation(self, x: Any, order: int = 0) -> Any:
        """Return h = A sin(2πx/l), or its derivative."""
        import mpmath

        wave = _TWO_PI / self.period
        return self.amplitude * wave**order * mpmath.sin(wave * x + order * mpmath.pi / 2)

    def surface(self) -> Surface:
        """Return this law as a surface, with twice the friction: 2μ(1 - m) = μ(1 - h).

        The modulation is m = (1 + A sin(2πx/l))/2, whatever the height of the texture.
        """
        parameters = self.depth, 2.0 * self.friction, self.deflection, self.amplitude
        return Surface(Sinusoid(1e-4, self.period), "F", 1.0, *parameters)

    def compiled_jacobians(self, count: int) -> FloatArray:
        """Return J/κ₀ in x and z by the kernel at the depth p^z, shape (2, 2, count, 2, 2).

        The first axes are: sliding and sticking; d = -d_max and d_max; points along a period.
        """
        surface, x = self.surface(), np.linspace(0.0, self.period, count)
        points = np.column_stack([x, 0 * x, np.full(count, -self.depth)])
        phases = [
            [
                surface.jacobian(
                    points, np.outer(np.full(count, d), [1, 0]), np.full(count, slides)
                )
                for d in (-self.deflection, self.deflection)
            ]
            for slides in (True, False)
        ]
        return np.array(phases)[..., ::2, ::2]

    def sticking_entries(self) -> tuple[float, float]:
        """Return the entries (1, 1) and (1, 2) of the printed (26) over -κ₀."""
        rate = 1.0 / self.deflection + math.pi * self.amplitude / self.period
        return 2.0 * self.friction * self.depth * rate, 2.0 * self.friction

    def sticking_norm(self) -> float:
        """Return the norm of the printed (26) over κ₀."""
        return matrix_norm(*self.sticking_entries())

    def max_norm_ratio(self) -> float:
        """Return the greatest ‖J_F‖/κ₀ of the paper's law with h = A sin, by its kernel.

        The maximum is over x and both phases at |d| = d_max and the greatest depth, since the norm
        is convex in both.
        """
        return float(np.linalg.norm(self.compiled_jacobians(20001), 2, axis=(-2, -1)).max())

    def max_entries(self) -> FloatArray:
        """Return the greatest entries (1, 1) and (1, 2) by the kernel: sliding, then sticking.

        Both are linear in d, so they are greatest at |d| = d_max.
        """
        return np.asarray(np.abs(self.compiled_jacobians(40001)[..., 0, :]).max(axis=(1, 2)))


def matrix_norm(a: float, b: float) -> float:
    """Return ‖[[a, b], [0, 1]]‖."""
    return float(np.linalg.norm(np.array([[a, b], [0.0, 1.0]]), 2))


PAPER_CASE = FrictionCase(0.8, 1e-3, 0.8, 1e-3, 1e-3)
"""Section V.A, where the paper uses A = 0.8 mm for the dimensionless A: in millimetres, 0.8."""
SCANNING_CASE = replace(PAPER_CASE, period=SCANNING.period)


def random_friction_cases(count: int = 4, seed: int = 7) -> Iterator[FrictionCase]:
    """Yield random parameter sets with 0 < A < 1."""
    draw = np.random.default_rng(seed)
    for _ in range(count):
        yield FrictionCase(
            friction=draw.uniform(0.1, 1.2),
            deflection=draw.uniform(0.1e-3, 3e-3),
            amplitude=draw.uniform(0.1, 0.95),
            period=draw.uniform(0.5e-3, 4e-3),
            depth=draw.uniform(0.1e-3, 2e-3),
        )
