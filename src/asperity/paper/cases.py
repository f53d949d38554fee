"""The paper's parameter sets, with their textures, laws and closed paths in the x-z plane."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from asperity.analysis.gain.characteristic import characteristic_number
from asperity.core.checks import FloatArray
from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid

PAPER_LAWS = "ABCDEFG"
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
        """Return this texture with a law; ``changes`` are arguments of ``Surface``."""
        arguments: dict[str, Any] = {"stiffness": self.stiffness, "max_depth": self.depth}
        if law == "F":
            arguments |= {"friction": self.friction, "max_deflection": self.deflection}
        return Surface(self.texture, law, **(arguments | changes))

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
        quarter, top = 0.25 * self.period, self.amplitude
        return path_points((0.0, 0.0), (quarter, 0.0), (quarter, top), (0.0, top))

    def friction_path(self, shallow_depth: float = TURNING_DEPTH) -> FloatArray:
        """Return the path of (27), for F: out at the shallow depth a, back at the full depth."""
        x, deep = self.deflection, -self.depth
        return path_points(
            (0.0, 1e-3), (0.0, -shallow_depth), (x, -shallow_depth), (x, deep), (0.0, deep)
        )

    def crossing_path(self, turning_depth: float = TURNING_DEPTH) -> FloatArray:
        """Return the path of (29), for G: down at the crest, along at depth a, up at the trough."""
        a, crest, trough = turning_depth, 0.25 * self.period, 0.75 * self.period
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
