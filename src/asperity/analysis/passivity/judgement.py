"""Is the loop of hand, device and texture passive, and what decides it?"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum, auto
from fractions import Fraction
from typing import Literal

from asperity.analysis.passivity.criteria import (
    DELAY,
    LEAK,
    ONE_SIDED,
    STEPS,
    VIRTUAL,
    WALL,
    WALL_TEST,
    Buzz,
    Criterion,
)
from asperity.analysis.passivity.device_loop import HALF, Loop, Number, contradictory
from asperity.display import Displayed
from asperity.files import Record

Verdict = Literal["passive", "bounded", "plausible", "not passive", "undecided"]
Basis = Literal["proved", "plausible", "bounded", "quiet against buzz", "none"]


class Ground(Enum):
    """What a verdict rests on."""

    PROVED = auto()
    """The deciding criterion holds."""
    CRITERION = auto()
    """What the deciding criterion says."""
    BOUNDED = auto()
    """Passive but for the steps of positions and forces, whose buzz is bounded."""
    UNBOUNDED = auto()
    """Passive but for the steps of positions and forces, whose buzz has no bound."""
    WALL_HELD = auto()
    """A smooth wall that did not cycle: no proof."""
    WALL_CYCLED = auto()
    """A smooth wall that cycled at no more than this."""
    CONTRADICTION = auto()
    """Damping and delay prove a wall passive that cycled."""
    SHAKEN = auto()
    """A hand that shakes gains energy if damping there is σ₀."""
    SHAKEN_ANYHOW = auto()
    """A hand that shakes gains energy whatever the damping."""
    DEVICE_UNKNOWN = auto()
    """The smooth wall says nothing here, and damping or rate of the device are not known."""


@dataclass(frozen=True)
class Allowed(Record):
    """Up to which stiffness a law may be rendered on a device, and how well that is known.

    Attributes:
        stiffness: [N/m]; 0 if no stiffness is known to do, ``None`` if it is not decidable.
        basis: ``"proved"``: passive up to there, under the assumptions of the criterion.
            ``"plausible"``: a smooth wall of that gain did not cycle. ``"bounded"``: half of what
            the delay rule allows, where steps of positions and forces leave a buzz with a bound.
            ``"quiet against buzz"``: a wall of that gain did not cycle, but the law has curl and
            feeds the hand below v* at any stiffness. ``"none"``.
        criterion: the name of the criterion that gives it; empty for none.
        delay: samples of delay of the pair of damping and delay that binds; infinity where any
            delay is admissible, ``None`` where no such pair is behind the number.
        sampled: whether it rests on a number that was only sampled, so that it may be too great.
        proved: up to which stiffness it is proved passive [N/m]; 0 for none.
    """

    stiffness: float | None
    basis: Basis
    criterion: str = ""
    delay: float | None = None
    sampled: bool = False
    proved: float = 0.0


@dataclass(frozen=True)
class Passivity(Record, Displayed):
    """Whether a surface on a device can be made to give energy to the hand without end.

    Attributes:
        criteria: all of them, also those that do not decide.
        decided_by: name of the criterion that the verdict rests on; where it is "undecided", of
            the one that would decide.
        verdict: ``"passive"`` (proved, under the assumptions of that criterion), ``"bounded"``
            (proved but for the steps of positions and forces, whose buzz stays below ``buzz``),
            ``"plausible"`` (no proof: a smooth wall did not cycle), ``"not passive"`` (a motion of
            the hand that gains energy without end is known) or ``"undecided"``.
        ground: what the verdict rests on.
        reason: one sentence.
        stiffness: the surface's [N/m].
        allowed: up to which stiffness, and how well that is known.
        critical_speed: v* [m/s]: below that speed on the worst loop the damping does not absorb
            what the field gains; 0 for a conservative law, ``None`` if unknown.
        greatest_delay: the most whole samples of delay for which the delay rule is proved at this
            stiffness; ``None`` if not even none is, or if it is unknown.
        buzz: the most that steps of positions and forces may cause; ``None`` if there is no bound.
    """

    written = (
        "verdict decided_by reason stiffness safe_stiffness allowed critical_speed greatest_delay "
        "buzz criteria"
    )

    criteria: tuple[Criterion, ...]
    decided_by: str
    verdict: Verdict
    ground: Ground
    reason: str
    stiffness: float
    allowed: Allowed
    critical_speed: float | None
    greatest_delay: int | None
    buzz: Buzz | None

    @property
    def safe_stiffness(self) -> float | None:
        """The stiffness of ``allowed`` [N/m]; what it is worth, its basis says."""
        return self.allowed.stiffness

    def criterion(self, name: str) -> Criterion:
        """Return a criterion by its name.

        Raises:
            KeyError: if there is none of that name.
        """
        return {criterion.name: criterion for criterion in self.criteria}[name]

    def __repr__(self) -> str:
        known = self.safe_stiffness
        limit = "not known" if known is None else f"{known:.4g} N/m"
        return f"<Passivity: {self.verdict}, decided by {self.decided_by}, stiffness up to {limit}>"


def decide(
    loop: Loop, by_name: Mapping[str, Criterion], buzz: Buzz | None
) -> tuple[Verdict, str, Ground]:
    """Return the verdict, the name of the criterion that it rests on, and the ground.

    A law that is not conservative is judged by its leak, never by a norm.
    """
    main = _main_rule(loop)
    if not loop.conservative:
        unknown = by_name[LEAK].holds is None
        return "undecided" if unknown else "not passive", LEAK, Ground.CRITERION
    if contradictory(loop):
        return "undecided", main, Ground.CONTRADICTION
    if loop.delay is not None and by_name[main].holds:
        return _but_for_steps(by_name, main, buzz)
    ground = _pumped(loop)
    if ground is not None:
        return "not passive", WALL_TEST if ground is Ground.WALL_CYCLED else main, ground
    return _not_proved(loop, by_name, main)


def _but_for_steps(
    by_name: Mapping[str, Criterion], main: str, buzz: Buzz | None
) -> tuple[Verdict, str, Ground]:
    """Return what steps of positions and forces leave of a passive loop."""
    steps = by_name[STEPS]
    if steps.holds:
        return "passive", main, Ground.PROVED
    if buzz is not None and not steps.missing:
        return "bounded", STEPS, Ground.BOUNDED
    return "undecided", STEPS, Ground.UNBOUNDED


def allowed(loop: Loop, by_name: Mapping[str, Criterion]) -> Allowed:
    """Return up to which stiffness the law may be rendered, and how well that is known.

    One answer for whoever asks: the comparison of laws, the analysis of one, the device's limits.
    """
    main, steps = by_name[_main_rule(loop)], by_name[STEPS]
    if not loop.conservative:
        return _allowed("quiet against buzz", by_name[WALL])
    plausible = _allowed("plausible", by_name[WALL_TEST], loop.longest_delay)
    if loop.obstacle is not None or loop.delay is None or contradictory(loop):
        return plausible
    proved = _proved(main, steps)
    if (plausible.stiffness or 0.0) > (proved.stiffness or 0.0):
        return replace(plausible, proved=proved.proved)
    if proved.stiffness is None:
        return plausible
    if proved.stiffness == 0.0 and main.limit:
        return Allowed(0.5 * main.limit, "bounded", STEPS)
    return proved


def _proved(main: Criterion, steps: Criterion) -> Allowed:
    """Return up to which stiffness both the rule and what friction silences are proved."""
    if main.limit is None or steps.limit is None:
        sampled = _allowed("proved", main)
        return sampled if sampled.sampled else Allowed(None, "none")
    stiffness = min(main.limit, steps.limit)
    basis: Basis = "proved" if stiffness else "none"
    return Allowed(stiffness, basis, main.name if stiffness else "", proved=stiffness)


def _allowed(basis: Basis, criterion: Criterion, delay: Number | None = None) -> Allowed:
    sampled = criterion.limit is None and criterion.at_most is not None
    stiffness = criterion.at_most if sampled else criterion.limit
    if not stiffness:
        return Allowed(stiffness, "none")
    pair = None if delay is None else float(delay)
    return Allowed(stiffness, basis, criterion.name, pair, sampled)


def _main_rule(loop: Loop) -> str:
    """Return the criterion that covers what is known of the device."""
    if loop.virtual is not None:
        return VIRTUAL
    return ONE_SIDED if loop.delay == 0 else DELAY


def _pumped(loop: Loop) -> Ground | None:
    """Return why a small motion at a witness point gains energy without end, if one does.

    A straight shake along the witness direction, p + u ε cos(θ i), where -uᵀJu = K, gains per
    sample 2 ε² sin²(θ/2) times

        K sin((d + ½)θ)/(2 sin(θ/2)) - (b_v/T) cos((d + 1)θ) - σ₀/T.

    θ -> 0 and θ = πm/(d + 1), m odd, give the first two; for a slack direction, K = -k q, which is
    where q is attained if q > q⁺, m even gives the third (d >= 1). A wall that cycled has
    σ₀/T < K (½ + d): then θ -> 0 gains from that K on, whatever σ₀ and d are.
    """
    if _slack_without_bound(loop):
        return Ground.SHAKEN_ANYHOW
    stiff = loop.number(Fraction(1), Fraction(0), "lower") * loop.stiffness
    if loop.cycled is not None and stiff >= loop.cycled:
        return Ground.WALL_CYCLED
    if loop.loss is None:
        return None
    gains = [stiff / 2 + loop.damper]
    if loop.delay is not None:
        gains.append(stiff * (loop.delay + HALF) - loop.damper)
    if loop.delay and loop.q.lower > loop.one_sided.upper:
        slack = loop.number(Fraction(0), Fraction(1), "lower") * loop.stiffness
        gains.append(slack / 2 - loop.damper)
    return Ground.SHAKEN if max(gains) > loop.loss else None


def _slack_without_bound(loop: Loop) -> bool:
    """Return whether some delay meets a slack direction without bound, as below D's crests."""
    return bool(loop.delay) and math.isinf(loop.q.lower) and math.isfinite(loop.one_sided.upper)


def _not_proved(
    loop: Loop, by_name: Mapping[str, Criterion], main: str
) -> tuple[Verdict, str, Ground]:
    """Return what the wall's test says, or which criterion would decide."""
    if by_name[WALL_TEST].holds:
        return "plausible", WALL_TEST, Ground.WALL_HELD
    if loop.obstacle is not None:
        return "undecided", main, Ground.CRITERION
    if loop.loss is None and by_name[WALL_TEST].limit is not None:
        return "undecided", WALL_TEST, Ground.DEVICE_UNKNOWN
    if loop.delay is None and not by_name[main].missing:
        main = DELAY
    return "undecided", main, Ground.CRITERION
