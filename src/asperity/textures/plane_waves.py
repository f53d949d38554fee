"""Plane waves as data: what sums of them tell those who can do better with waves."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from asperity.checks import FloatArray
from asperity.textures.lattice import integer_lattice


@dataclass(frozen=True, eq=False)
class PlaneWaves:
    """The waves of a height function h(x, y) = Σ a_i sin(k_i · (x, y) + phase_i).

    Attributes:
        amplitudes: a_i [m], shape (n,).
        wavevectors: k_i [rad/m], shape (n, 2).
        phases: [rad], shape (n,).
    """

    amplitudes: FloatArray
    wavevectors: FloatArray
    phases: FloatArray

    @cached_property
    def lattice(self) -> tuple[FloatArray, FloatArray]:
        """Independent wave vectors B [rad/m], (r, 2), and integers N with wavevectors = N @ B."""
        return integer_lattice(self.wavevectors)

    @property
    def shortest(self) -> float:
        """Wavelength of the shortest wave [m]."""
        return 2.0 * math.pi / float(np.hypot(*self.wavevectors.T).max())


class SingleWave(Protocol):
    """The one wave A sin(2π (x u_x + y u_y)/l + phase) of a texture with closed forms.

    Attributes:
        amplitude: A [m].
        period: l [m].
        phase: [rad].
        direction: (u_x, u_y), a unit vector.
    """

    amplitude: float
    period: float
    phase: float
    direction: tuple[float, float]
