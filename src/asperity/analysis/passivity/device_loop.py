"""A surface on a device as the criteria of passivity use it: exact numbers, known or unknown."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass, replace
from enum import Enum, auto
from fractions import Fraction

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.energy.closed_loops import Leak
from asperity.analysis.energy.continuity import Continuity, continuity
from asperity.analysis.gain.theorems import theorem_on
from asperity.core.checks import check_positive, check_real
from asperity.core.errors import ParameterError
from asperity.devices import Device, WallTest
from asperity.devices.device import ASSUMED_WALL_RATE
from asperity.surface import Surface

HALF = Fraction(1, 2)
Number = Fraction | float  # a fraction, or infinity
# A leak below this part of k · depth · length of the line is rounding, not a leak.
_LEAK_ROUNDING = 1e-12


class Obstacle(Enum):
    """Why the rules for conservative laws do not apply."""

    CURL = auto()
    JUMPS = auto()


@dataclass(frozen=True)
class DeviceLoop:
    """A surface on a device; numbers of the device as exact fractions, ``None`` if unknown.

    Attributes:
        surface: the surface.
        device: the device.
        q: characteristic number.
        one_sided: one-sided number q⁺.
        leak: the worst loop; ``None`` where only stiffness limits are needed.
        conservative: whether the law is conservative.
        obstacle: why the rules for conservative laws do not apply; ``None`` if they do.
        continuity: jumps of the force, where they are the obstacle; else ``None``.
        rate: update rate 1/T [Hz].
        damping: σ₀ [N s/m].
        damping_gain: σ₀/T [N/m].
        virtual_damping: b_v [N s/m].
        virtual_damping_gain: b_v/T [N/m]; 0 if virtual damping is unknown, as every criterion
            states.
        delay: d, whole samples.
        known_delay: d, 0 where it is unknown: only for criteria that state this assumption.
        wall_test: test of the smooth wall K₀.
        friction: f_c, least dry friction [N]; 0 where it is unknown.
        position_step: |δ|, greatest step of the quantised position [m].
        force_step: |b|, greatest step of the quantised force [N].
    """

    surface: Surface
    device: Device
    q: Bound
    one_sided: Bound
    leak: Leak | None
    conservative: bool
    obstacle: Obstacle | None
    continuity: Continuity | None
    rate: Fraction | None
    damping: Fraction | None
    damping_gain: Fraction | None
    virtual_damping: Fraction | None
    virtual_damping_gain: Fraction
    delay: int | None
    known_delay: Fraction
    wall_test: WallTest | None
    friction: Fraction
    position_step: Fraction
    force_step: Fraction

    @property
    def stiffness(self) -> Fraction:
        """K of the surface [N/m]."""
        return Fraction(self.surface.stiffness)

    @property
    def slip_slope(self) -> Number:
        """Upper bound of the slope of the slip limit over the stiffness [1].

        |∇N| <= k √q⁺ and N <= k √q⁺ D; the height at the contact point rises by at most
        ``slope`` of the texture, or 1 + q where the contact point moves with the depth. On a
        closed body it also depends on the direction, without a bound.
        """
        friction = self.surface.contact_friction
        if friction is None:
            return Fraction(0)
        if friction.in_space:
            return math.inf
        texture = self.surface.texture
        rise = texture.bounds[0]
        if not self.surface.law.contact.is_above_probe:
            rise = 1.0 + self.q.upper
        rise *= self.surface.max_depth / self.surface.loop_arguments[2]
        variation = 0.5 * friction.modulation * rise if friction.modulation else 0.0
        bound = friction.coefficient * math.sqrt(self.one_sided.upper) * (1.0 + variation)
        return Fraction(bound * (1.0 + 1e-12)) if math.isfinite(bound) else math.inf

    def with_leak(self, surface: Surface, leak: Leak) -> DeviceLoop:
        """Return the loop of the same surface at another stiffness, with its worst loop."""
        return replace(self, surface=surface, leak=leak)

    @property
    def wall_stiffness(self) -> Fraction | None:
        """K₀ [N/m] at the device's rate, for a texture in the lightest direction."""
        if self.wall_test is None:
            return None
        share = Fraction(1)
        if self.wall_test.lightest is not None and self.surface.depends_on_texture:
            share = Fraction(self.wall_test.lightest)
        return share * self.least_rate / self.wall_rate * Fraction(self.wall_test.value)

    @property
    def wall_rate(self) -> Fraction:
        """f₀ [Hz], update rate of the wall test; the device's own, or 1 kHz, if not stated."""
        if self.wall_test is not None and self.wall_test.update_rate is not None:
            return Fraction(self.wall_test.update_rate)
        return self.rate or Fraction(ASSUMED_WALL_RATE)

    @property
    def least_rate(self) -> Fraction:
        """Least update rate [Hz] at which ``wall_stiffness`` is allowed; a faster loop may be."""
        return min(self.rate or self.wall_rate, self.wall_rate)

    @property
    def wall_delay(self) -> Fraction:
        """d₀, delay of the wall test [samples]; 0 if it is not stated."""
        if self.wall_test is None:
            return Fraction(0)
        return Fraction(self.wall_test.delay_samples or 0)

    @property
    def longest_delay(self) -> Number:
        """Greatest delay [samples] of a loop that the wall test admits.

        With the wall on the verge of cycling, σ₀/T >= K₀ (1/2 + d₀). The delay of the loop is that
        of the test unless it is known: d₀ where it is stated, else any, unless σ₀ is known. It need
        not be whole. 0 where a wall of K₀ needs more damping than σ₀.
        """
        if self.delay is not None:
            return Fraction(self.delay)
        if self.wall_test is not None and self.wall_test.delay_samples is not None:
            return self.wall_delay
        if self.damping_gain is None or self.wall_stiffness is None:
            return math.inf
        return max(self.damping_gain / self.wall_stiffness - HALF, Fraction(0))

    @property
    def delayed_wall_stiffness(self) -> Fraction | None:
        """Stiffest smooth wall [N/m] allowed at the delay of the loop, at its rate.

        K₀ min(1, f/f₀) (1/2 + d₀)/(1/2 + d).
        """
        if self.wall_stiffness is None or self.delay is None:
            return self.wall_stiffness
        return self.wall_stiffness * (HALF + self.wall_delay) / (HALF + self.delay)

    @property
    def cycling_stiffness(self) -> Fraction | None:
        """Stiffness K [N/m] at which a wall cycled with exact positions: σ₀/T < K (1/2 + d).

        With the delay d of the test, which is that of the loop unless both are stated.
        """
        test = self.wall_test
        exact = test is not None and test.positions == "exact" and not self.virtual_damping
        if test is None or test.cycled is None or not exact:
            return None
        if test.update_rate is not None and Fraction(test.update_rate) != self.rate:
            return None
        if test.delay_samples is None or self.delay is None:
            return Fraction(test.cycled)
        return Fraction(test.cycled) * (HALF + self.wall_delay) / (HALF + self.delay)

    def weighted_gain(self, one_sided_weight: Fraction, norm_weight: Fraction, end: str) -> Number:
        """Return the weighted sum of q⁺ and q at one end; a weight of 0 drops infinity."""
        total = Fraction(0)
        for weight, bound in ((one_sided_weight, self.one_sided), (norm_weight, self.q)):
            value = float(getattr(bound, end))
            if weight and math.isinf(value):
                return math.inf
            if weight:
                total += weight * Fraction(value)
        return total


def presliding(surface: Surface) -> tuple[Fraction, Fraction]:
    """Return κ of the friction: its part that is a share of k [1], and the rest [N/m]."""
    friction = surface.contact_friction
    if friction is None:
        return Fraction(0), Fraction(0)
    _coefficient, _modulation, share, fixed, _in_space = friction.arguments
    return Fraction(share), Fraction(fixed)


def add_friction(
    surface: Surface, gain: Number, budget: Fraction, weight: Fraction
) -> tuple[Number, Fraction]:
    """Return gain g and budget b of a rule k g + weight κ <= b as those of k g <= b.

    On a smooth wall, friction and wall act along different axes, and each is compared with b.

    Reference:
        docs/theory/friction.md.
    """
    share, fixed = presliding(surface)
    if surface.depends_on_texture:
        return gain + weight * share, budget - weight * fixed
    if weight * fixed > budget:
        budget = Fraction(0)
    return max(gain, weight * share), budget


def make_device_loop(
    surface: Surface, device: Device, q: Bound, one_sided: Bound, leak: Leak | None = None
) -> DeviceLoop:
    """Return the loop of a surface and a device.

    Raises:
        ParameterError: for device data out of range.
    """
    obstacle, jumps = _find_obstacle(surface, q)
    delay = _exact_value(device, "delay_samples", _NOT_NEGATIVE)
    if delay is not None and delay.denominator != 1:
        raise ParameterError("device.delay_samples", "must be a whole number", float(delay))
    _exact_value(device, "max_stiffness", _POSITIVE)
    test = device.wall_test
    for name in ("cycled", "update_rate", "lightest") if test is not None else ():
        if (value := getattr(test, name)) is not None:
            check_positive(f"device.max_stiffness.{name}", value)
    rate = _exact_value(device, "update_rate", _POSITIVE)
    damping = _exact_value(device, "damping", _NOT_NEGATIVE)
    virtual_damping = _exact_value(device, "virtual_damping", _FINITE)
    return DeviceLoop(
        surface=surface,
        device=device,
        q=q,
        one_sided=one_sided,
        leak=leak,
        conservative=surface.facts.conservative,
        obstacle=obstacle,
        continuity=jumps,
        rate=rate,
        damping=damping,
        damping_gain=None if damping is None or rate is None else damping * rate,
        virtual_damping=virtual_damping,
        virtual_damping_gain=(virtual_damping or Fraction(0)) * (rate or Fraction(0)),
        delay=None if delay is None else int(delay),
        known_delay=delay or Fraction(0),
        wall_test=test,
        friction=_exact_value(device, "least_friction", _NOT_NEGATIVE) or Fraction(0),
        position_step=_SQRT_3 * (_exact_value(device, "position_resolution", _NOT_NEGATIVE) or 0),
        force_step=_SQRT_3 * (_exact_value(device, "force_resolution", _NOT_NEGATIVE) or 0),
    )


# √3, rounded up: a step along each of three axes at once.
_SQRT_3 = Fraction(17320508075688773, 10**16)


_POSITIVE = ("must be positive", 5e-324)
_NOT_NEGATIVE = ("must not be negative", 0.0)
_FINITE = ("must be finite", -math.inf)


def _exact_value(device: Device, field: str, requirement: tuple[str, float]) -> Fraction | None:
    """Return exact device data, checked, since a device may be built by hand."""
    value = device.value(field)
    if value is None:
        return None
    words, least = requirement
    unit = device.data[field].unit
    if value < least or not math.isfinite(value):
        raise ParameterError(f"device.{field}", f"{words}, and finite [{unit}]", value)
    return Fraction(check_real(f"device.{field}", value, unit))


def _find_obstacle(surface: Surface, q: Bound) -> tuple[Obstacle | None, Continuity | None]:
    """Return why the law's potential gives no bound, if so, and the jumps of the force.

    The rules need U(p + Δ) <= U(p) + ∇U · Δ + q⁺|Δ|²/2. The Jacobian proves that where the force
    is continuous. A jump can violate it, except where U is an infimum by theorem.
    """
    if not surface.facts.conservative:
        return Obstacle.CURL, None
    if theorem_on(surface).is_infimum:
        return None, None
    force = continuity(surface, q)
    if force.continuous:
        return None, None
    return Obstacle.JUMPS, force


def is_contradictory(loop: DeviceLoop) -> bool:
    """Return whether damping and delay prove a wall passive that cycled: the data contradict."""
    if loop.cycling_stiffness is None or loop.damping_gain is None or loop.delay is None:
        return False
    return loop.damping_gain >= loop.cycling_stiffness * (loop.delay + HALF)


def is_damping_below_wall(loop: DeviceLoop) -> bool:
    """Return whether the device has less damping than a wall of K₀ needs at the test's delay."""
    if loop.wall_stiffness is None or loop.damping_gain is None:
        return False
    return loop.damping_gain < loop.wall_stiffness * (HALF + loop.wall_delay)


def max_proved_delay(loop: DeviceLoop) -> int | None:
    """Return the greatest d for which the delay rule is proved at this stiffness.

    ``None`` if not even d = 0 is proved, if it cannot be decided, or if q is 0 and d is unlimited.
    """
    if loop.damping_gain is None or loop.obstacle:
        return None
    budget = loop.damping_gain - abs(loop.virtual_damping_gain)
    half = loop.weighted_gain(HALF, Fraction(0), "upper")
    q = loop.weighted_gain(Fraction(0), Fraction(1), "upper")
    gain, rest = add_friction(loop.surface, half, budget, HALF)
    if gain == math.inf or rest < loop.stiffness * gain:
        return None
    if q == math.inf:
        return 0
    share, fixed = presliding(loop.surface)
    kappa = share * loop.stiffness + fixed
    start = Fraction(half) * loop.stiffness
    slope = Fraction(q) * loop.stiffness
    rules = [(start, slope), (HALF * kappa, 3 * HALF * kappa)]
    if loop.surface.depends_on_texture:
        rules = [(start + HALF * kappa, slope + 3 * HALF * kappa)]
    delays = [math.floor((budget - least) / rise) for least, rise in rules if rise > 0]
    return min(delays, default=None)


def has_known_leak(loop: DeviceLoop) -> bool:
    """Return whether a loop that gains energy is known."""
    if loop.conservative or loop.leak is None:
        return False
    size = loop.surface.stiffness * loop.surface.max_depth * loop.leak.line.length
    return loop.leak.energy > _LEAK_ROUNDING * size


def critical_speed(loop: DeviceLoop) -> float | None:
    """Return v* = f_c*/σ₀ [m/s], 0 for a conservative law, ``None`` if unknown."""
    if loop.conservative:
        return 0.0
    if loop.damping is None or loop.leak is None or not has_known_leak(loop):
        return None
    if loop.damping <= 0:
        return math.inf
    return loop.leak.critical_speed(float(loop.damping))


# --- the motion that quantisation may sustain -----------------------------------------------------


@dataclass(frozen=True)
class BuzzBound:
    """Upper bound of a periodic motion that quantisation may sustain.

    Attributes:
        speed: RMS of the distance per sample period over the motion's period [m/s].
        power: power gained by the hand [W].
    """

    speed: float
    power: float


def buzz_bound(loop: DeviceLoop) -> BuzzBound | None:
    """Return the bound of the buzz that quantisation may cause; ``None`` if there is none.

    Each step Δ gains at most (φ - f_c)|Δ| - m|Δ|², m = σ₀/T - |b_v|/T - k (q⁺/2 + d q), so a
    periodic motion has RMS speed (φ - f_c)/(m T) and draws (φ - f_c)²/(4 m T) at most.

    Reference:
        docs/theory/passivity.md.
    """
    terms = None if loop.damping_gain is None else _buzz_terms(loop)
    if terms is None or loop.rate is None:
        return None
    per_stiffness, fixed, gain, budget, ceiling = terms
    margin = min(budget - loop.stiffness * gain, ceiling)
    if margin <= 0:
        return None
    excess = max(loop.stiffness * per_stiffness + fixed, Fraction(0))
    speed = excess * loop.rate / margin
    power = excess**2 * loop.rate / (4 * margin)
    return BuzzBound(round_up_exactly(speed), round_up_exactly(power))


BUZZ_SPEED = 0.010
"""Bound of the buzz [m/s] for which a start is chosen where damping and delay are known.

The field ``max_buzz`` of a device replaces it.
"""


def buzz_goal(device: Device) -> float:
    """Return the bound of the buzz for which starts are chosen on a device [m/s]."""
    return device.value("max_buzz") or BUZZ_SPEED


def buzz_limited_stiffness(loop: DeviceLoop, speed: float | None = None) -> float | None:
    """Return the greatest stiffness [N/m] at which :func:`buzz_bound` is at most a speed.

    With φ - f_c = a k + c and m = (G - g k)/T it is (v G - c/T)/(a/T + v g). Errors of force that
    do not scale with k let it be c/(T G) at any stiffness: v is at least twice that. On a smooth
    wall with friction m is at most G less the part of κ that does not scale with k.

    Args:
        loop: the surface on the device; its stiffness does not count.
        speed: v [m/s]; :func:`buzz_goal` by default.

    Returns:
        The stiffness; ``None`` if there is no bound at any.
    """
    terms = _buzz_terms(loop)
    if terms is None or loop.rate is None or terms[-1] <= 0:
        return None
    per_stiffness, fixed, gain, budget, ceiling = terms
    v = max(Fraction(speed or buzz_goal(loop.device)), 2 * fixed * loop.rate / ceiling)
    a = per_stiffness * loop.rate
    c = fixed * loop.rate
    limits = [((v * budget - c), a + v * gain), ((v * ceiling - c), a)]
    stiffness = min([size / slope for size, slope in limits if slope > 0], default=None)
    return math.inf if stiffness is None else round_down_exactly(stiffness)


def _buzz_terms(loop: DeviceLoop) -> tuple[Fraction, Fraction, Fraction, Fraction, Fraction] | None:
    """Return the parts of a buzz, if they are known.

    They are φ - f_c per stiffness, its fixed part, q⁺/2 + d q, the budget [N/m], and what m T is at
    most: on a smooth wall the friction, which acts along other axes, takes of it alone.
    """
    if loop.obstacle or loop.damping_gain is None or loop.delay is None:
        return None
    q = loop.weighted_gain(Fraction(0), Fraction(1), "upper")
    gain = loop.weighted_gain(HALF, loop.known_delay, "upper")
    if math.inf in (q, gain):
        return None
    virtual = abs(loop.virtual_damping_gain)
    share, kappa = presliding(loop.surface)
    steps = friction_steps(loop)
    fixed = loop.force_step / 2 + virtual * loop.position_step - loop.friction
    per_stiffness = Fraction(q) * loop.position_step / 2
    weight = HALF + 3 * HALF * loop.known_delay
    whole = loop.damping_gain - virtual
    gain, budget = add_friction(loop.surface, gain, whole, weight)
    ceiling = min(budget, whole - weight * kappa)
    fixed += steps * kappa
    return per_stiffness + steps * share, fixed, Fraction(gain), budget, ceiling


def friction_steps(loop: DeviceLoop) -> Fraction:
    """Return the error [m] whose product with κ is that of the friction force by position steps.

    2 ε without delay and 8 ε with delay, or where it is unknown, ε = |δ|/2.
    """
    return loop.position_step * (1 if loop.delay == 0 else 4)


def round_up_exactly(value: Fraction) -> float:
    """Return the least float that is not below the value."""
    near = float(value)
    if Fraction(near) < value:
        return math.nextafter(near, math.inf)
    return near


def round_down_exactly(value: Number) -> float:
    """Return the greatest float that is not above the value."""
    if value == math.inf:
        return math.inf
    near = float(min(value, Fraction(sys.float_info.max)))
    if Fraction(near) > value:
        return math.nextafter(near, -math.inf)
    return near
