"""Safety limits of a loop, with their defaults."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from asperity.analysis.gain.characteristic import characteristic_number, one_sided_number
from asperity.analysis.passivity.recommended_stiffness import recommend_stiffness
from asperity.core.arguments import read_arguments
from asperity.core.errors import ParameterError
from asperity.core.files import Serializable
from asperity.core.units import format_quantity, round_down
from asperity.devices import Device
from asperity.simulation.servo import Servo
from asperity.surface import Surface

DEFAULT_RISE_TIME = 5e-3
"""Time for the force to rise from zero to its maximum, unless a slew limit is given [s]."""
LATE_PERIODS = 10
MIN_LATENESS = 0.02
"""Time for which the loop may be late unless one is given: in periods, and at least [s]."""
REACH_FACTOR = 1.5
"""Largest distance of a reading, over the radius of the device's workspace."""


@dataclass(frozen=True)
class Safety(Serializable):
    """Limits of a loop.

    Attributes:
        ramp: time in which the force rises after the start, and falls before the end [s].
        max_slew: largest change of the force [N/s]; ``None`` for zero to the maximum force in
            ``DEFAULT_RISE_TIME``.
        lateness: longest time for which the loop may be late, whether in one sample or in many in a
            row: from the due time of the first sample that is not finished when the next one is
            due [s]; ``None`` for ``LATE_PERIODS`` periods, at least ``MIN_LATENESS``.
        silence: longest time without a heartbeat of the supervising process [s].
        beyond_depth: whether a probe deeper than the surface's ``max_depth`` is a "fault", or is
            counted and reported, "warn". It is neither under a clamp that bounds every depth.
        passivity_damping: largest damping of the passivity controller [N s/m]; 0 for none.
        reach: largest distance of a reading from the middle of the workspace [m]; ``None`` for 1.5
            times the device's.
        wall: orientation of the surface: "lying", like a table, or "standing", facing the user.
        origin: origin of the surface, in the device's axes [m].

    Raises:
        ParameterError: for a value out of its range.
    """

    ramp: float = 0.25
    max_slew: float | None = None
    lateness: float | None = None
    silence: float = 1.0
    beyond_depth: Literal["fault", "warn"] = "fault"
    passivity_damping: float = 0.0
    reach: float | None = None
    wall: str = "lying"
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for argument in ARGUMENTS:
            if (value := getattr(self, argument.name)) is not None:
                object.__setattr__(self, argument.name, argument.validate(value))

    def slew_limit(self, max_force: float) -> float:
        """Return the largest change of the force [N/s]; infinite if neither number is known."""
        if self.max_slew is not None:
            return self.max_slew
        return max_force / DEFAULT_RISE_TIME

    def lateness_limit(self, period: float) -> float:
        """Return the longest time for which a loop of a period [s] may be late [s]."""
        if self.lateness is not None:
            return self.lateness
        return max(LATE_PERIODS * period, MIN_LATENESS)

    def reach_limit(self, device: Device) -> float:
        """Return the largest distance of a reading from the middle of the workspace [m].

        It is ``REACH_FACTOR`` times the radius of the ball around the device's workspace; infinite
        if that is not known.
        """
        if self.reach is not None:
            return self.reach
        radius = device.value("workspace_radius")
        diameter = device.value("workspace_diameter")
        length = device.value("workspace_length")
        if radius is None and diameter is not None and length is not None:
            radius = 0.5 * math.hypot(diameter, length)
        if radius is None:
            return math.inf
        return REACH_FACTOR * radius


ARGUMENTS = tuple(read_arguments(Path(__file__).with_suffix(".toml"), defaults=Safety).values())
"""Arguments of the section [servo]."""


def check_passivity_damping(safety: Safety, device: Device, servo: Servo) -> None:
    """Check that the passivity controller cannot feed energy into the handle.

    A damping b acts by the displacement in the last sample, d samples of delay later. On a mass m
    the velocity then obeys v' = v - (b T/m) (v₋ + v₋₋)/2, which grows above b T/m = 2, 0.83, 0.54,
    0.40 for d = 0, 1, 2, 3. The bound m/((1 + d) T) is half to two thirds of that.

    Args:
        safety: limits of the loop.
        device: device, whose apparent mass is the least that the handle has; a hand adds to it.
        servo: period T and delay d.

    Raises:
        ParameterError: for a damping above the bound, or a device whose mass is not known.
    """
    mass = device.value("apparent_mass")
    damping = safety.passivity_damping
    if not damping:
        return
    if mass is None:
        text = f"needs the mass of {device.id}, which bounds it, such as {{apparent_mass}}"
        raise ParameterError("passivity_damping", text, apparent_mass="50 g")
    bound = mass / ((1 + servo.delay) * servo.period)
    if damping > bound:
        requirement = (
            f"must be at most m/((1 + d) T) = {format_quantity(bound, 'N*s/m', digits=3)}, with the"
            f" apparent mass m of {device.id}, the period T and a delay of d = {servo.delay}"
            " samples: above it the controller may feed energy into the handle"
        )
        raise ParameterError("passivity_damping", requirement, damping)


DEFAULT_SAFETY = Safety()


def excess_stiffness_reason(surface: Surface, device: Device, *, keeps_margin: bool = False) -> str:
    """Return why a surface at its stiffness may cycle on a device; empty within the limit.

    Args:
        surface: the surface, with law and stiffness.
        device: the device.
        keeps_margin: whether the limit is the recommended stiffness, which is the stability limit
            with its margin.

    Example:
        >>> from asperity.devices import load_device
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> steep = Surface(Sinusoid(amplitude=0.1e-3, period=2e-3), "C", stiffness=2000.0)
        >>> excess_stiffness_reason(steep, load_device("touch"))[:43]
        '2000 N/m is above the limit of 363 N/m for '
    """
    q = characteristic_number(surface)
    recommended = recommend_stiffness(surface, device, q, one_sided_number(surface))
    allowed = recommended.stability_limit.stiffness
    limit = "limit"
    if keeps_margin:
        allowed = recommended.stiffness
        limit = "recommended limit"
    context = f"for law {surface.law.letter} on {device.id}"
    if not allowed:
        return f"no stable stiffness is known {context}: analyze says what is missing"
    if surface.stiffness <= allowed:
        return ""
    stiffness = format_quantity(surface.stiffness, "N/m", digits=6)
    limit += f" of {format_quantity(round_down(allowed), 'N/m')}"
    reason = f"{recommended.stability_limit.basis}; q = {q.value:.3g}"
    return f"{stiffness} is above the {limit} {context} ({reason})"
