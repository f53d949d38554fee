"""Is the loop of hand, device and texture passive, and what decides it?"""

from __future__ import annotations

import html
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Literal

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.energy.leak import Leak
from asperity.analysis.passivity.criteria import (
    DELAY,
    LEAK,
    ONE_SIDED,
    VIRTUAL,
    WALL,
    WALL_ONE_SIDED,
    Criterion,
    criteria,
)
from asperity.analysis.passivity.device_loop import (
    HALF,
    Loop,
    critical_speed,
    greatest_delay,
    make_loop,
)
from asperity.devices import Device, load_device
from asperity.errors import ParameterError
from asperity.files import record
from asperity.surface import Surface

Verdict = Literal["passive", "not passive", "undecided"]


@dataclass(frozen=True)
class Passivity:
    """Whether a surface on a device can be made to give energy to the hand without end.

    Attributes:
        criteria: all of them, also those that do not decide.
        decided_by: name of the criterion that the verdict rests on; where it is "undecided", of
            the one that would decide.
        verdict: ``"passive"`` (proved, under the assumptions of that criterion), ``"not passive"``
            (a motion of the hand that gains energy without end is known) or ``"undecided"``.
        reason: one sentence.
        stiffness: the surface's [N/m].
        safe_stiffness: the greatest stiffness that the deciding criterion allows [N/m]; 0 if it
            allows none, ``None`` if unknown.
        critical_speed: v* [m/s]: below that speed on the worst loop the damping does not absorb
            what the field gains; 0 for a conservative law, ``None`` if unknown.
        greatest_delay: the most whole samples of delay for which the delay rule is proved at this
            stiffness; ``None`` if not even none is, or if it is unknown.
    """

    criteria: tuple[Criterion, ...]
    decided_by: str
    verdict: Verdict
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
        for criterion in self.criteria:
            if criterion.name == name:
                return criterion
        raise KeyError(name)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        return {
            **record(self, "verdict", "decided_by", "reason", "stiffness", "safe_stiffness"),
            **record(self, "critical_speed", "greatest_delay", "criteria"),
        }

    def _repr_html_(self) -> str:
        """Return the verdict and a table for a notebook."""
        rows = [[c.name, c.formula, c.says, c.assumptions] for c in self.criteria]
        head = "".join(f"<th>{title}</th>" for title in ("criterion", "formula", "says", "assumes"))
        body = "".join(
            f"<tr>{''.join(f'<td>{html.escape(cell)}</td>' for cell in row)}</tr>" for row in rows
        )
        answer = f"{self.verdict}, decided by {self.decided_by}: {self.reason}"
        return f"<p>{html.escape(answer)}</p><table><tr>{head}</tr>{body}</table>"


def passivity(
    surface: Surface,
    device: str | os.PathLike[str] | Device,
    q: Bound,
    one_sided: Bound,
    leak: Leak,
) -> Passivity:
    """Return whether the loop of hand, device and texture is passive, and what decides it.

    With T the period of the update rate, σ₀ the device's damping, b_v its virtual damping, d its
    whole samples of delay and K₀ the stiffest smooth wall that it renders, the criteria are:

    * paper (1): k q <= σ₀/(2T), as printed;
    * one-sided: k q⁺ <= 2σ₀/T, for a conservative law without delay;
    * delay: k (q⁺/2 + d q) <= σ₀/T, for a conservative law;
    * virtual damping: k (q⁺/2 + d q) T + |b_v| <= σ₀, for a conservative law;
    * smooth-wall rule: k q <= K₀; one-sided: k (q⁺/2 + d q) <= K₀ (1/2 + d), conservative law;
    * leak: no loop of the field gains energy.

    Args:
        surface: the surface.
        device: id of the catalogue, TOML file, or a :class:`~asperity.devices.Device`.
        q: its characteristic number.
        one_sided: its one-sided number.
        leak: its worst loop.

    Raises:
        ParameterError: for another type, or a number of the device that is out of its range.

    Reference:
        The paper's (1) and III.B; Colgate and Schenkel (the paper's [25]); MATH section 4.

    Example:
        >>> from asperity.analysis import characteristic_number, one_sided_number
        >>> from asperity.analysis.energy.leak import worst_loop
        >>> from asperity.devices import parse_device
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> rig = {"damping": "2 N*s/m", "update_rate": "4 kHz", "delay_samples": 1}
        >>> surface = Surface(Sinusoid(amplitude=0.1e-3, period=1e-3), "H")
        >>> numbers = characteristic_number(surface), one_sided_number(surface)
        >>> leak = worst_loop(surface)
        >>> answer = passivity(surface, parse_device(rig, "mine"), *numbers, leak)
        >>> answer.verdict, answer.decided_by, round(answer.safe_stiffness, 3)
        ('passive', 'delay', 5333.333)
    """
    given = (("surface", surface, Surface), ("q", q, Bound), ("one_sided", one_sided, Bound))
    for name, value, kind in (*given, ("leak", leak, Leak)):
        if not isinstance(value, kind):
            raise ParameterError(name, f"must be a {kind.__name__}", value)
    loop = make_loop(surface, load_device(device), q, one_sided, leak)
    judged = criteria(loop)
    by_name = {criterion.name: criterion for criterion in judged}
    verdict, decisive, reason = _decide(loop, by_name)
    return Passivity(
        criteria=judged,
        decided_by=decisive,
        verdict=verdict,
        reason=reason,
        stiffness=surface.stiffness,
        safe_stiffness=by_name[decisive].limit,
        critical_speed=critical_speed(loop),
        greatest_delay=greatest_delay(loop),
    )


def _decide(loop: Loop, by_name: Mapping[str, Criterion]) -> tuple[Verdict, str, str]:
    """Return the verdict, the name of the criterion that it rests on, and the reason.

    A law that is not conservative is judged by its leak, never by a norm.
    """
    main = _main_rule(loop)
    if not loop.conservative:
        leak = by_name[LEAK]
        return "undecided" if leak.holds is None else "not passive", LEAK, leak.says
    if loop.delay is not None and by_name[main].holds:
        return "passive", main, _shown(loop, by_name[main])
    if _pumped(loop):
        tail = "whatever the damping" if _slack_without_bound(loop) else "if damping there is σ₀"
        text = f"a hand that shakes where q⁺ or q is attained gains energy, {tail}"
        decisive = main if by_name[main].limit is not None else WALL_ONE_SIDED
        return "not passive", decisive if by_name[decisive].limit is not None else main, text
    for rule in _valid_walls(loop):
        if by_name[rule].holds:
            return "passive", rule, _shown(loop, by_name[rule])
    if loop.obstacle:
        return "undecided", main, by_name[main].says
    return _undecided(loop, by_name, main)


def _main_rule(loop: Loop) -> str:
    """Return the criterion that covers what is known of the device."""
    if loop.virtual is not None:
        return VIRTUAL
    return ONE_SIDED if loop.delay == 0 else DELAY


def _shown(loop: Loop, criterion: Criterion) -> str:
    return f"{criterion.formula} at {loop.surface.stiffness:g} N/m; {criterion.says}"


def _valid_walls(loop: Loop) -> tuple[str, ...]:
    """Return the smooth-wall rules that prove passivity here.

    K₀/q covers every delay; the one-sided rule needs a known one. With virtual damping both are
    proved without delay only: the wall's test does not show its part of the loss then.
    """
    if loop.obstacle or (loop.virtual and loop.delay != 0):
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


def _undecided(loop: Loop, by_name: Mapping[str, Criterion], main: str) -> tuple[Verdict, str, str]:
    """Return which criterion would decide, and what keeps it from doing so."""
    wall = by_name[WALL_ONE_SIDED]
    if loop.loss is None and wall.limit is not None:
        fields = ("update_rate", "damping", "delay_samples")
        needs = ", ".join(field for field in fields if loop.device.value(field) is None)
        return "undecided", WALL_ONE_SIDED, f"{wall.formula} {wall.says}; to decide: {needs}"
    if loop.delay is None and not by_name[main].missing:
        main = DELAY
    return "undecided", main, by_name[main].says
