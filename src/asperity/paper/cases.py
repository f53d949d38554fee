"""The paper's parameter sets, with their textures, laws and closed paths in the x-z plane.

Those of law F follow, with the numbers that the paper prints and those of its kernel.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from asperity.analysis.gain.characteristic import characteristic_number
from asperity.core.checks import FloatArray
from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid

PAPER_LAWS = "ABCDEFG"
MENDED = "F mended"
"""Law W with the slip limit of law F and a constant presliding stiffness."""
TURNING_DEPTH = 0.1e-3
"""Depth at which the paths of (27) and (29) turn [m]; not stated by the paper."""


def path_points(*corners: tuple[float, float]) -> FloatArray:
    """Return vertices (x, z) as points (x, 0, z)."""
    return np.array([(x, 0.0, z) for x, z in corners])


@dataclass(frozen=True)
class ExperimentCase:
    """Parameters of one of the paper's experiments, SI.

    Attributes:
        stiffness: κ₀ [N/m].
        period: l [m].
        amplitude: A [m].
        friction: μ.
        deflection: d_max in x [m].
        depth: d_max in z [m].
        joint_damping: [N·m·s].
    """

    stiffness: float
    period: float
    amplitude: float
    friction: float = 0.8
    deflection: float = 1e-3
    depth: float = 1e-3
    joint_damping: float = 4.0e-3

    @property
    def texture(self) -> Sinusoid:
        """A sin(2πx/l)."""
        return Sinusoid(self.amplitude, self.period)

    @property
    def crest_radius(self) -> float:
        """Radius of curvature at the crests [m]."""
        return self.period**2 / (4.0 * math.pi**2 * self.amplitude)

    def surface(self, law: str, **changes: Any) -> Surface:
        """Return this texture with a law, or ``MENDED``; ``changes`` are arguments of a surface."""
        if law == MENDED:
            return self.mended_friction(**changes)
        arguments: dict[str, Any] = {"stiffness": self.stiffness, "max_depth": self.depth}
        if law == "F":
            arguments |= {"friction": self.friction, "max_deflection": self.deflection}
        return Surface(self.texture, law, **(arguments | changes))

    def mended_friction(self, **changes: Any) -> Surface:
        """Return law W with friction whose slip limit is that of law F: μ(1 - m) times the load."""
        modulation = self.surface("F").modulation_depth
        friction = 0.5 * self.friction * (1.0 + modulation)
        contrast = 2.0 * modulation / (1.0 + modulation)
        return self.surface("W", friction=friction, friction_modulation=contrast, **changes)

    def untextured_friction(self) -> Surface:
        """Return law F without texture, with twice the friction.

        Its modulation m = 1/2 then equals the paper's h = 0.
        """
        return self.surface("F", modulation_depth=0.0, friction=2.0 * self.friction)

    def q(self, law: str) -> float:
        """Return the characteristic number of a law."""
        return characteristic_number(self.surface(law)).value

    def groove_path(self) -> FloatArray:
        """Return the path for A, B and E: along the wall, up at the crest, and back."""
        quarter = 0.25 * self.period
        top = self.amplitude
        return path_points((0.0, 0.0), (quarter, 0.0), (quarter, top), (0.0, top))

    def friction_path(self, shallow_depth: float = TURNING_DEPTH) -> FloatArray:
        """Return the path of (27), for F: out at the shallow depth a, back at the full depth."""
        x = self.deflection
        deep = -self.depth
        return path_points(
            (0.0, 1e-3), (0.0, -shallow_depth), (x, -shallow_depth), (x, deep), (0.0, deep)
        )

    def crossing_path(self, turning_depth: float = TURNING_DEPTH) -> FloatArray:
        """Return the path of (29), for G: down at the crest, along at depth a, up at the trough."""
        a = turning_depth
        crest = 0.25 * self.period
        trough = 0.75 * self.period
        return path_points((crest, a), (crest, -a), (trough, -a), (trough, a))

    def loop_path(self, law: str) -> FloatArray:
        """Return the path of Fig. 3 for a law; C and D, absent from the figure, use that of A."""
        paths = {"F": self.friction_path, "G": self.crossing_path}
        return paths.get(law, self.groove_path)()


PASSIVITY = ExperimentCase(2000.0, 1e-3, 0.8e-3, joint_damping=4.7e-3)  # section V.A
SCANNING = ExperimentCase(1000.0, 2e-3, 0.8e-3)  # V.B
BUMP = ExperimentCase(1000.0, 20e-3, 20e-3)  # V.C
SETTINGS = {"V.A": PASSIVITY, "V.B": SCANNING, "V.C": BUMP}
SAMPLING_PERIOD = 1e-4  # [s], section V


def random_settings(count: int = 3, seed: int = 11) -> list[ExperimentCase]:
    """Return random parameter sets; the same ones for the same seed."""
    draw = np.random.default_rng(seed)
    result = []
    for _ in range(count):
        period = draw.uniform(0.7e-3, 4e-3)
        amplitude = period * draw.uniform(0.1, 0.7)
        result.append(
            ExperimentCase(
                stiffness=draw.uniform(300.0, 2500.0),
                period=period,
                amplitude=amplitude,
                friction=draw.uniform(0.2, 1.1),
                deflection=draw.uniform(0.1e-3, 2e-3),
                depth=amplitude * draw.uniform(0.4, 1.3),
            )
        )
    return result


# --- law F --------------------------------------------------------------------------------------


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

        wave = 2.0 * math.pi / self.period
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
        surface = self.surface()
        x = np.linspace(0.0, self.period, count)
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
