"""The verdict on passivity of a surface on a device, with every criterion."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum, auto
from fractions import Fraction
from typing import Literal

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.energy.closed_loops import Leak
from asperity.analysis.passivity import criteria, device_loop
from asperity.analysis.passivity.criteria import Criterion, evaluate_criteria, main_rule
from asperity.analysis.passivity.device_loop import (
    BuzzBound,
    DeviceLoop,
    buzz_bound,
    critical_speed,
    make_device_loop,
    max_proved_delay,
)
from asperity.analysis.passivity.recommended_stiffness import StabilityLimit, stability_limit
from asperity.core.display import Displayable, Text
from asperity.core.errors import ParameterError
from asperity.core.files import OMITTED, Serializable, written
from asperity.devices import DeviceLike, load_device
from asperity.surface import Surface

Verdict = Literal["passive", "bounded", "plausible", "not passive", "undecided"]


class Ground(Enum):
    """The ground of a verdict."""

    PROVED = auto()
    """The deciding criterion holds."""
    CRITERION = auto()
    """The conclusion of the deciding criterion."""
    BOUNDED = auto()
    """Passive but for quantisation, whose buzz is bounded."""
    UNBOUNDED = auto()
    """Passive but for quantisation, whose buzz has no bound."""
    WALL_HELD = auto()
    """A smooth wall of that gain did not cycle: no proof."""
    WALL_CYCLED = auto()
    """A smooth wall of at most that gain cycled."""
    CONTRADICTION = auto()
    """Damping and delay prove a wall passive that cycled."""
    GAINS_ENERGY = auto()
    """A small oscillation gains energy if damping there is σ₀."""
    GAINS_ENERGY_REGARDLESS = auto()
    """A small oscillation gains energy whatever the damping."""
    DEVICE_UNKNOWN = auto()
    """The wall test decides nothing, and damping or rate of the device are unknown."""


def decide_verdict(
    loop: DeviceLoop, by_name: Mapping[str, Criterion], buzz: BuzzBound | None
) -> tuple[Verdict, str, Ground]:
    """Return the verdict, the name of the deciding criterion, and the ground.

    For a law that is not conservative the leak decides, never a norm; dry friction that absorbs the
    leak ends the gain of slow motions, and proves nothing about fast ones.
    """
    main = main_rule(loop)
    if not loop.conservative:
        return _assess_leak(by_name)
    if device_loop.is_contradictory(loop):
        return "undecided", main, Ground.CONTRADICTION
    if loop.delay is not None and by_name[main].holds:
        return _assess_quantization(by_name, main, buzz)
    ground = _find_unstable_motion(loop)
    if ground is not None:
        deciding = criteria.WALL_TEST if ground is Ground.WALL_CYCLED else main
        return "not passive", deciding, ground
    return _assess_wall_test(loop, by_name, main)


def _assess_leak(by_name: Mapping[str, Criterion]) -> tuple[Verdict, str, Ground]:
    """Return the verdict on a law with curl."""
    if by_name[criteria.DRY_FRICTION].holds:
        return "undecided", criteria.DRY_FRICTION, Ground.CRITERION
    if by_name[criteria.LEAK].holds is None:
        return "undecided", criteria.LEAK, Ground.CRITERION
    return "not passive", criteria.LEAK, Ground.CRITERION


def _assess_quantization(
    by_name: Mapping[str, Criterion], main: str, buzz: BuzzBound | None
) -> tuple[Verdict, str, Ground]:
    """Return the verdict on a loop that is passive but for quantisation."""
    steps = by_name[criteria.QUANTIZATION]
    if steps.holds:
        return "passive", main, Ground.PROVED
    if buzz is not None and not steps.missing:
        return "bounded", criteria.QUANTIZATION, Ground.BOUNDED
    return "undecided", criteria.QUANTIZATION, Ground.UNBOUNDED


def _find_unstable_motion(loop: DeviceLoop) -> Ground | None:
    """Return why a small motion at a witness point gains energy without limit, if one does.

    A straight oscillation along the witness direction, p + u ε cos(θ i), where -uᵀJu = K, gains
    per sample 2 ε² sin²(θ/2) times

        K sin((d + ½)θ)/(2 sin(θ/2)) - (b_v/T) cos((d + 1)θ) - σ₀/T.

    θ -> 0 and θ = πm/(d + 1), m odd, give the first two gains below; in a slack direction,
    K = -k q, where q is attained if q > q⁺, m even gives the third (d >= 1). A wall that cycled has
    σ₀/T < K (½ + d): then θ -> 0 gains energy from that K on, for any σ₀ and d.
    """
    # Delay meets an unbounded slack direction, as below crests with law D.
    if loop.delay and math.isinf(loop.q.lower) and math.isfinite(loop.one_sided.upper):
        return Ground.GAINS_ENERGY_REGARDLESS
    stiff = loop.weighted_gain(Fraction(1), Fraction(0), "lower") * loop.stiffness
    if loop.cycling_stiffness is not None and stiff >= loop.cycling_stiffness:
        return Ground.WALL_CYCLED
    if loop.damping_gain is None:
        return None
    gains = [stiff / 2 + loop.virtual_damping_gain]
    if loop.delay is not None:
        gains.append(stiff * (loop.delay + device_loop.HALF) - loop.virtual_damping_gain)
    if loop.delay and loop.q.lower > loop.one_sided.upper:
        slack = loop.weighted_gain(Fraction(0), Fraction(1), "lower") * loop.stiffness
        share, fixed = device_loop.presliding(loop.surface)
        slack -= share * loop.stiffness + fixed  # an anchor that sticks stiffens the direction
        gains.append(slack / 2 - loop.virtual_damping_gain)
    if max(gains) > loop.damping_gain:
        return Ground.GAINS_ENERGY
    return None


def _assess_wall_test(
    loop: DeviceLoop, by_name: Mapping[str, Criterion], main: str
) -> tuple[Verdict, str, Ground]:
    """Return the verdict of the wall test, or the criterion that would decide."""
    if by_name[criteria.WALL_TEST].holds:
        return "plausible", criteria.WALL_TEST, Ground.WALL_HELD
    if loop.obstacle is not None:
        return "undecided", main, Ground.CRITERION
    if loop.damping_gain is None and by_name[criteria.WALL_TEST].limit is not None:
        return "undecided", criteria.WALL_TEST, Ground.DEVICE_UNKNOWN
    if loop.delay is None and not by_name[main].missing:
        main = criteria.DELAY
    return "undecided", main, Ground.CRITERION


@dataclass(frozen=True)
class Passivity(Serializable, Displayable):
    """Passivity of a surface on a device: whether the hand can gain energy without limit.

    Attributes:
        loop: the surface on the device.
        evaluated: all criteria by name, without sentences.
        decided_by: name of the deciding criterion; for ``"undecided"``, of the one that would
            decide.
        verdict: ``"passive"`` (proved, under the assumptions of that criterion), ``"bounded"``
            (proved but for quantisation, whose buzz stays below ``buzz``), ``"plausible"`` (no
            proof: a smooth wall did not cycle), ``"not passive"`` (a motion of the hand that gains
            energy without limit is known) or ``"undecided"``.
        ground: ground of the verdict.
        stability_limit: stability limit of the stiffness, and its basis.
        buzz: bound of the motion that quantisation may cause; ``None`` if there is no bound.
    """

    loop: DeviceLoop = field(compare=False, metadata=OMITTED)
    evaluated: Mapping[str, Criterion] = field(metadata=OMITTED)
    decided_by: str
    verdict: Verdict
    ground: Ground = field(metadata=OMITTED)
    stability_limit: StabilityLimit
    buzz: BuzzBound | None
    reason = Text[str]("The reason of the verdict in one sentence.")
    criteria = Text[tuple[Criterion, ...]](
        "All criteria with their sentences, also those that do not decide."
    )

    @property
    @written
    def stiffness(self) -> float:
        """Stiffness of the surface [N/m]."""
        return self.loop.surface.stiffness

    @property
    @written
    def critical_speed(self) -> float | None:
        """v* = f_c*/σ₀ [m/s], the speed below which damping does not absorb every loop's energy.

        0 for a conservative law, ``None`` if unknown.
        """
        return critical_speed(self.loop)

    @property
    @written
    def greatest_delay(self) -> int | None:
        """Greatest number of whole samples of delay for which the delay rule is proved.

        At this stiffness; ``None`` if not even 0 is proved, or if it is unknown.
        """
        return max_proved_delay(self.loop)

    def criterion(self, name: str) -> Criterion:
        """Return a criterion by its name, with its sentences.

        Raises:
            KeyError: if there is none of that name.
        """
        return {criterion.name: criterion for criterion in self.criteria}[name]

    def __repr__(self) -> str:
        limit = self.stability_limit
        stiffness = "unknown" if limit.stiffness is None else f"{limit.stiffness:g} N/m"
        return (
            f"<Passivity: {self.verdict}, decided by {self.decided_by}; "
            f"limit {stiffness}, {limit.basis}>"
        )


def passivity(
    surface: Surface, device: DeviceLike, q: Bound, one_sided: Bound, leak: Leak
) -> Passivity:
    """Return whether the loop of hand, device and texture is passive, with every criterion.

    With T the period of the update rate, σ₀ the device's damping, b_v its virtual damping, d its
    whole samples of delay and K₀ the stiffest smooth wall that it renders, the criteria are:

    * paper (1): k q <= σ₀/(2T), as printed;
    * one-sided: k q⁺ <= 2σ₀/T, for a conservative law without delay;
    * delay: k (q⁺/2 + d q) <= σ₀/T, for a conservative law;
    * virtual damping: k (q⁺/2 + d q) T + |b_v| <= σ₀, for a conservative law;
    * steps and friction: k q |δ|/2 + |b|/2 <= f_c, for a conservative law, beside one of these;
    * smooth-wall rule: k q <= K₀, as printed in the paper's III.B, in a loop with the delay d₀ of
      the wall test, else k q <= K₀ (1/2 + d₀)/(1/2 + d): a rule of thumb;
    * wall test: k (q⁺/2 + d q) <= K₀ (1/2 + d₀), k q <= K₀ for any delay, for a conservative law:
      plausible, not proved;
    * leak: no loop of the field gains energy;
    * dry friction: f_c takes as much on every loop as the field gains, whatever the speed.

    Missing data of the device are never guessed: an unknown delay, damping or rate decides
    nothing. Virtual damping, quantisation and dry friction that are not given count as none.

    Args:
        surface: the surface.
        device: id of the catalogue, TOML file, or a :class:`~asperity.devices.Device`.
        q: its characteristic number.
        one_sided: its one-sided number.
        leak: its worst loop.

    Raises:
        ParameterError: for another type, or device data out of range.

    Reference:
        The paper's (1) and III.B; Colgate and Schenkel (the paper's [25]);
        docs/theory/passivity.md.

    Example:
        >>> from asperity.analysis import characteristic_number, one_sided_number
        >>> from asperity.analysis.energy.leak import worst_loop
        >>> from asperity.devices import parse_device
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> rig = {"damping": "2 N*s/m", "update_rate": "4 kHz", "delay_samples": 1}
        >>> surface = Surface(Sinusoid(amplitude=0.1e-3, period=1e-3), "H")
        >>> numbers = characteristic_number(surface), one_sided_number(surface)
        >>> leak = worst_loop(surface)
        >>> result = passivity(surface, parse_device(rig, "mine"), *numbers, leak)
        >>> result.verdict, result.decided_by, round(result.stability_limit.stiffness, 3)
        ('passive', 'delay', 5333.333)
    """
    types = (("surface", surface, Surface), ("q", q, Bound), ("one_sided", one_sided, Bound))
    for name, value, kind in (*types, ("leak", leak, Leak)):
        if not isinstance(value, kind):
            raise ParameterError(name, f"must be a {kind.__name__}", value)
    return assess_loop(make_device_loop(surface, load_device(device), q, one_sided, leak))


def assess_loop(loop: DeviceLoop) -> Passivity:
    """Return whether a surface on a device is passive; see :func:`passivity`."""
    criteria = evaluate_criteria(loop)
    buzz = buzz_bound(loop)
    verdict, decided_by, ground = decide_verdict(loop, criteria, buzz)
    limit = stability_limit(loop, criteria)
    return Passivity(loop, criteria, decided_by, verdict, ground, limit, buzz)
