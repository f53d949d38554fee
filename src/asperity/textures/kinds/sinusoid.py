"""The paper's texture: one sinusoid."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from types import ModuleType
from typing import Any, ClassVar

import numpy as np

from asperity.core.arguments import Argument
from asperity.core.checks import check_array, check_positive, check_real
from asperity.core.errors import ParameterError
from asperity.textures.domain import Domain, ScanLine
from asperity.textures.kinds import kind_arguments
from asperity.textures.kinds.sinusoid_sampler import SinusoidArguments
from asperity.textures.plane_waves import PlaneWaves, SingleWave, check_curvature
from asperity.textures.texture import ExactHeight, Texture


class Sinusoid(Texture):
    """h(x, y) = A sin(2π (x u_x + y u_y)/l + phase).

    Args:
        amplitude: A [m], half of the peak-to-valley height; positive.
        period: l [m], positive.
        phase: [rad].
        direction: (u_x, u_y) along which the height varies; normalised.

    Raises:
        ParameterError: for an amplitude or a period that is not positive and finite, or a
            direction without length.

    Reference:
        Campion and Hayward, section IV, h(x) = A sin(2π x/l).

    Example:
        >>> texture = Sinusoid(amplitude=0.8e-3, period=1e-3)
        >>> texture.height([[0.25e-3, 0.0]])
        array([0.0008])
    """

    kind: ClassVar[str] = "sinusoid"
    finds_contacts: ClassVar[bool] = True
    constructor_arguments: ClassVar[tuple[Argument, ...]] = kind_arguments("sinusoid")

    def __init__(
        self,
        amplitude: float,
        period: float,
        phase: float = 0.0,
        direction: Sequence[float] = (1.0, 0.0),
    ) -> None:
        self.amplitude = check_positive("amplitude", amplitude, "m")
        self.period = check_positive("period", period, "m")
        wave = 2.0 * math.pi / self.period
        check_curvature("amplitude", self.amplitude * wave * wave, "period")
        self.phase = check_real("phase", phase, "rad")
        vector = check_array("direction", direction, (2,), "1")
        length = math.hypot(*vector)
        if length == 0.0:
            raise ParameterError("direction", "must have a length", tuple(direction))
        self.direction = (float(vector[0] / length), float(vector[1] / length))

    @property
    def sampler(self) -> tuple[ModuleType, ...]:
        """See :class:`Texture`."""
        from asperity.textures.kinds import sine, sinusoid_sampler

        return sinusoid_sampler, sine

    @cached_property
    def arguments(self) -> SinusoidArguments:
        """See :class:`Texture`."""
        k = 2.0 * math.pi / self.period
        kx = k * self.direction[0]
        ky = k * self.direction[1]
        return SinusoidArguments(self.amplitude, kx, ky, self.phase)

    @cached_property
    def extremes(self) -> tuple[float, float]:
        """-A and A [m], exactly."""
        return -self.amplitude, self.amplitude

    @cached_property
    def bounds(self) -> tuple[float, float]:
        """2πA/l and 4π²A/l²."""
        k = 2.0 * math.pi / self.period
        return k * self.amplitude, k * k * self.amplitude

    @cached_property
    def domain(self) -> Domain:
        """One period along the direction."""
        span = self.period * np.array([self.direction])
        return Domain(np.zeros(2), span, periodic=True, description="one period")

    @cached_property
    def waves(self) -> PlaneWaves:
        """The only wave."""
        amplitude, kx, ky, phase = self.arguments
        return PlaneWaves(np.array([amplitude]), np.array([[kx, ky]]), np.array([phase]))

    @property
    def single_wave(self) -> SingleWave:
        """This wave."""
        return self

    def exact_height(self) -> ExactHeight:
        """See :class:`Texture`; the direction as the sampler receives it, of rounded length."""
        import mpmath

        from asperity.textures.exact_heights import exact_waves

        def height(x: Any, y: Any, m: int, n: int) -> Any:
            k = 2 * mpmath.pi / mpmath.mpf(self.period)
            ux, uy = self.direction
            return exact_waves([(self.amplitude, k * ux, k * uy, self.phase)])(x, y, m, n)

        return height

    def scan_line(self) -> ScanLine:
        """One period along the direction, through the origin."""
        return ScanLine(np.zeros(2), np.array(self.direction), self.period, periodic=True)
