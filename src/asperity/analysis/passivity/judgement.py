"""Is the loop of hand, device and texture passive, and what decides it?"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, auto
from fractions import Fraction
from typing import Literal

from asperity.analysis.passivity.criteria import (
    DELAY,
    LEAK,
    ONE_SIDED,
    VIRTUAL,
    WALL,
    WALL_ONE_SIDED,
    Criterion,
)
from asperity.analysis.passivity.device_loop import HALF, Loop
from asperity.files import Record
from asperity.notebook import as_html

Verdict = Literal["passive", "not passive", "undecided"]


class Ground(Enum):
    """What a verdict rests on."""

    PROVED = auto()
    """The deciding criterion holds."""
    CRITERION = auto()
    """What the deciding criterion says."""
    SHAKEN = auto()
    """A hand that shakes gains energy if damping there is σ₀."""
    SHAKEN_ANYHOW = auto()
    """A hand that shakes gains energy whatever the damping."""
    DEVICE_UNKNOWN = auto()
    """The smooth wall proves nothing here, and damping or rate of the device are not known."""


@dataclass(frozen=True)
class Passivity(Record):
    """Whether a surface on a device can be made to give energy to the hand without end.

    Attributes:
        criteria: all of them, also those that do not decide.
        decided_by: name of the criterion that the verdict rests on; where it is "undecided", of
            the one that would decide.
        verdict: ``"passive"`` (proved, under the assumptions of that criterion), ``"not passive"``
            (a motion of the hand that gains energy without end is known) or ``"undecided"``.
        ground: what the verdict rests on.
        reason: one sentence.
        stiffness: the surface's [N/m].
        safe_stiffness: the greatest stiffness that the deciding criterion allows [N/m]; 0 if it
            allows none, ``None`` if unknown.
        critical_speed: v* [m/s]: below that speed on the worst loop the damping does not absorb
            what the field gains; 0 for a conservative law, ``None`` if unknown.
        greatest_delay: the most whole samples of delay for which the delay rule is proved at this
            stiffness; ``None`` if not even none is, or if it is unknown.
    """

    written = (
        "verdict decided_by reason stiffness safe_stiffness critical_speed greatest_delay criteria"
    )

    criteria: tuple[Criterion, ...]
    decided_by: str
    verdict: Verdict
    ground: Ground
    reason: str
    stiffness: float
    safe_stiffness: float | None
    critical_speed: float | None
    greatest_delay: int | None

    def criterion(self, name: str) -> Criterion:
        """Return a criterion by its name.

        Raises:
            KeyError: if there is none of that name.
        """
        return {criterion.name: criterion for criterion in self.criteria}[name]

    def _repr_html_(self) -> str:
        """Return the verdict and a table for a notebook."""
        rows = [[c.name, c.formula, c.says, c.assumptions] for c in self.criteria]
        answer = f"{self.verdict}, decided by {self.decided_by}: {self.reason}"
        return as_html(answer, (["criterion", "formula", "says", "assumes"], rows))


def decide(loop: Loop, by_name: Mapping[str, Criterion]) -> tuple[Verdict, str, Ground]:
    """Return the verdict, the name of the criterion that it rests on, and the ground.

    A law that is not conservative is judged by its leak, never by a norm.
    """
    main = _main_rule(loop)
    if not loop.conservative:
        unknown = by_name[LEAK].holds is None
        return "undecided" if unknown else "not passive", LEAK, Ground.CRITERION
    if loop.delay is not None and by_name[main].holds:
        return "passive", main, Ground.PROVED
    if _pumped(loop):
        ground = Ground.SHAKEN_ANYHOW if _slack_without_bound(loop) else Ground.SHAKEN
        known = by_name[main].limit is None and by_name[WALL_ONE_SIDED].limit is not None
        return "not passive", WALL_ONE_SIDED if known else main, ground
    for rule in _valid_walls(loop):
        if by_name[rule].holds:
            return "passive", rule, Ground.PROVED
    if loop.obstacle is not None:
        return "undecided", main, Ground.CRITERION
    return _undecided(loop, by_name, main)


def _main_rule(loop: Loop) -> str:
    """Return the criterion that covers what is known of the device."""
    if loop.virtual is not None:
        return VIRTUAL
    return ONE_SIDED if loop.delay == 0 else DELAY


def _valid_walls(loop: Loop) -> tuple[str, ...]:
    """Return the smooth-wall rules that prove passivity here.

    K₀/q covers every delay; the one-sided rule needs a known one. With virtual damping both are
    proved without delay only: the wall's test does not show its part of the loss then.
    """
    if loop.obstacle is not None or (loop.virtual and loop.delay != 0):
        return ()
    return (WALL,) if loop.delay is None else (WALL, WALL_ONE_SIDED)


def _pumped(loop: Loop) -> bool:
    """Return whether a small motion at a witness point gains energy without end.

    A straight shake along the witness direction, p + u ε cos(θ i), where -uᵀJu = K, gains per
    sample 2 ε² sin²(θ/2) times

        K sin((d + ½)θ)/(2 sin(θ/2)) - (b_v/T) cos((d + 1)θ) - σ₀/T.

    θ -> 0 and θ = πm/(d + 1), m odd, give the first two; for a slack direction, K = -k q, which is
    where q is attained if q > q⁺, m even gives the third (d >= 1).
    """
    if _slack_without_bound(loop):
        return True
    if loop.loss is None:
        return False
    stiff = loop.number(Fraction(1), Fraction(0), "lower") * loop.stiffness
    gains = [stiff / 2 + loop.damper]
    if loop.delay is not None:
        gains.append(stiff * (loop.delay + HALF) - loop.damper)
    if loop.delay and loop.q.lower > loop.one_sided.upper:
        slack = loop.number(Fraction(0), Fraction(1), "lower") * loop.stiffness
        gains.append(slack / 2 - loop.damper)
    return max(gains) > loop.loss


def _slack_without_bound(loop: Loop) -> bool:
    """Return whether some delay meets a slack direction without bound, as below D's crests."""
    return bool(loop.delay) and math.isinf(loop.q.lower) and math.isfinite(loop.one_sided.upper)


def _undecided(
    loop: Loop, by_name: Mapping[str, Criterion], main: str
) -> tuple[Verdict, str, Ground]:
    """Return which criterion would decide, and what keeps it from doing so."""
    if loop.loss is None and by_name[WALL_ONE_SIDED].limit is not None:
        return "undecided", WALL_ONE_SIDED, Ground.DEVICE_UNKNOWN
    if loop.delay is None and not by_name[main].missing:
        main = DELAY
    return "undecided", main, Ground.CRITERION
