"""When the loop holds the force back, and when it gives up; all defaults stand here."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from asperity.arguments import Argument, whole
from asperity.checks import positive, real
from asperity.devices import Device
from asperity.errors import ParameterError
from asperity.files import Record

RISE = 5e-3
"""[s] in which the force may go from nothing to its greatest, unless a slew limit is given."""
BEYOND = ("fault", "warn")
LIES = ("lying", "standing")

BEYOND_REACH = 1.5
"""Times the reach of a device: a reading further away is none."""


@dataclass(frozen=True)
class Safety(Record):
    """Limits of a loop.

    Attributes:
        ramp: time in which the force comes in after the start, and goes before the end [s].
        max_slew: greatest change of the force [N/s]; ``None`` for from nothing to the greatest
            force in ``RISE``.
        misses: samples in a row that may be late: not done when the next one is due.
        lateness: of one sample that is a fault, from when it was due until it is done [s].
        silence: time without a heartbeat of the watching process that is a fault [s].
        beyond_depth: whether a probe deeper than the surface's ``max_depth`` is a "fault", or is
            counted and told, "warn". It never is under a clamp that holds at every depth.
        passivity_damping: greatest damping of the passivity controller [N s/m]; 0 for none.
        reach: of the handle from the middle of the workspace [m]; a reading further away is a
            fault. ``None`` for 1.5 times the device's.
        wall: how the surface lies before the user: "lying", like a table, or "standing", facing
            him.
        origin: of the surface, in the device's axes [m].

    Raises:
        ParameterError: for a value out of its range.
    """

    ramp: float = 0.25
    max_slew: float | None = None
    misses: int = 100
    lateness: float = 0.05
    silence: float = 1.0
    beyond_depth: Literal["fault", "warn"] = "fault"
    passivity_damping: float = 0.0
    reach: float | None = None
    wall: str = "lying"
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for name in ("ramp", "passivity_damping"):
            if real(name, getattr(self, name)) < 0.0:
                raise ParameterError(name, "must not be negative", getattr(self, name))
        for name in ("lateness", "silence"):
            positive(name, getattr(self, name), "s")
        for name in ("max_slew", "reach"):
            if getattr(self, name) is not None:
                positive(name, getattr(self, name))
        whole("misses", self.misses)
        if self.wall not in LIES:
            raise ParameterError("wall", "must be 'lying' or 'standing'", self.wall)
        if self.beyond_depth not in BEYOND:
            raise ParameterError("beyond_depth", "must be 'fault' or 'warn'", self.beyond_depth)

    def slew(self, max_force: float) -> float:
        """Return the greatest change of the force [N/s]; infinite where neither is known."""
        if self.max_slew is not None:
            return self.max_slew
        return max_force / RISE if math.isfinite(max_force) else math.inf

    def reach_on(self, device: Device) -> float:
        """Return how far from the middle of the workspace a reading may be [m].

        It is ``BEYOND_REACH`` times the radius of the ball that holds the device's workspace;
        infinite where that is not known.
        """
        if self.reach is not None:
            return self.reach
        radius = device.value("workspace_radius")
        sides = device.value("workspace_diameter"), device.value("workspace_length")
        if radius is None and None not in sides:
            radius = 0.5 * math.hypot(*(side or 0.0 for side in sides))
        return math.inf if radius is None else BEYOND_REACH * radius


ARGUMENTS: tuple[Argument, ...] = (
    Argument(
        "ramp", "time in which the force comes in, and goes at the end", "s", Safety.ramp
    ),
    Argument(
        "max_slew", "greatest change of the force", "N/s", positive=True, example="2000N/s",
        default_words="to the greatest force in 5 ms",
    ),
    Argument("misses", "samples in a row that may be late", "", Safety.misses, form="integer"),
    Argument("lateness", "of one sample that is a fault", "s", Safety.lateness, positive=True),
    Argument(
        "silence", "of the program that watches, which is a fault", "s", Safety.silence,
        positive=True,
    ),
    Argument(
        "beyond_depth", "what a probe below max_depth is", "", Safety.beyond_depth, form="text",
        choices=BEYOND,
    ),
    Argument(
        "passivity_damping", "greatest of the passivity controller, 0 for none", "N*s/m",
        Safety.passivity_damping,
    ),
    Argument(
        "reach", "of the handle from the middle of the workspace", "m", positive=True,
        example="100mm", default_words="1.5 times the device's",
    ),
    Argument(
        "wall", "how the surface lies: like a table, or facing the user", "", Safety.wall,
        form="text", choices=LIES,
    ),
    Argument(
        "origin", "of the surface, in the device's axes", "m", form="space",
        default_words="the device's",
    ),
)  # fmt: skip
"""What [servo] can say."""

USUAL = Safety()
"""All by default."""
