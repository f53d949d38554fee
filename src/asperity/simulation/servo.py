"""What the device's electronics do between reading a position and holding a force."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from asperity.core.checks import check_nonnegative, check_positive, check_real
from asperity.core.errors import ParameterError
from asperity.core.files import Serializable
from asperity.kernels.tick import ServoSettings


@dataclass(frozen=True)
class Servo(Serializable):
    """What the device's electronics do to position and force.

    Attributes:
        period: T [s].
        delay: whole samples between reading a position and applying its force.
        position_resolution: of the encoder [m]; 0 for none.
        force_resolution: smallest step of the force [N]; 0 for none.
        max_force: the length to which a force is limited [N].
        virtual_damping: b_v [N s/m], on the filtered velocity; a negative one feeds.
        velocity_share: of the newest difference in the filtered velocity [1]; 1 for no filter.

    Raises:
        ParameterError: for a value out of its range; a delay that is not whole is refused.

    Example:
        >>> Servo(1e-4, delay=2).delay
        2
    """

    period: float
    delay: int = 0
    position_resolution: float = 0.0
    force_resolution: float = 0.0
    max_force: float = math.inf
    virtual_damping: float = 0.0
    velocity_share: float = 1.0

    def __post_init__(self) -> None:
        check_positive("period", self.period, "s")
        object.__setattr__(self, "delay", _check_delay(self.delay))
        check_nonnegative("position_resolution", self.position_resolution, "m")
        check_nonnegative("force_resolution", self.force_resolution, "N")
        if isinstance(self.max_force, bool) or not _to_float(self.max_force) > 0.0:
            raise ParameterError("max_force", "must be positive [N]", self.max_force)
        check_real("virtual_damping", self.virtual_damping, "N s/m")
        if not 0.0 < check_real("velocity_share", self.velocity_share) <= 1.0:
            raise ParameterError("velocity_share", "must be in (0, 1]", self.velocity_share)

    def without_steps(self) -> Servo:
        """Return the servo with exact positions and forces."""
        return replace(self, position_resolution=0.0, force_resolution=0.0)

    @property
    def settings(self) -> ServoSettings:
        """What the compiled loop receives."""
        return ServoSettings(
            float(self.position_resolution),
            float(self.force_resolution),
            float(self.max_force),
            float(self.virtual_damping),
            float(self.velocity_share),
            float(self.period),
        )


def _to_float(value: object) -> float:
    return float(value) if isinstance(value, (int, float, np.number)) else math.nan


def _check_delay(delay: object) -> int:
    number = _to_float(delay)
    if isinstance(delay, bool) or not (math.isfinite(number) and number >= 0.0 and number % 1 == 0):
        raise ParameterError("delay", "must be a whole number of samples, 0 or more", delay)
    return int(number)
