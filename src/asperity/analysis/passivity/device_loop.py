"""A surface on a device, as the criteria of passivity see it: exact numbers and what is known."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum, auto
from fractions import Fraction

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.energy.continuity import continuity
from asperity.analysis.energy.leak import Leak
from asperity.analysis.gain.theorems import theorem_of
from asperity.checks import positive, real
from asperity.devices import Device, WallTest
from asperity.errors import ParameterError
from asperity.surface import Surface

HALF = Fraction(1, 2)
Number = Fraction | float  # a fraction, or infinity
# A leak below this part of k · depth · length of the line is rounding, not a leak.
_ROUNDING = 1e-12


class Obstacle(Enum):
    """Why the rules for conservative laws do not apply."""

    CURL = auto()
    JUMPS = auto()


@dataclass(frozen=True)
class Loop:
    """A surface on a device; numbers of the device as exact fractions, ``None`` if not known.

    Attributes:
        surface: the surface.
        device: the device.
        q: characteristic number.
        one_sided: one-sided number q⁺.
        leak: the worst loop; ``None`` where only stiffnesses are asked for.
        conservative: whether the law is.
        obstacle: why the rules for conservative laws do not apply; ``None`` if they do.
        reason: what the curl, or the continuity of the force, says of the obstacle.
        rate: update rate 1/T [Hz].
        damping: σ₀ [N s/m].
        virtual: b_v [N s/m].
        delay: d, whole samples.
        test: what is known of the smooth wall K₀.
        friction: f_c, dry friction that acts at least [N]; 0 where none is known.
        step: |δ|, the longest way that positions may jump by when they are read [m].
        force_step: |b|, the same of the force [N].
    """

    surface: Surface
    device: Device
    q: Bound
    one_sided: Bound
    leak: Leak | None
    conservative: bool
    obstacle: Obstacle | None
    reason: str
    rate: Fraction | None
    damping: Fraction | None
    virtual: Fraction | None
    delay: int | None
    test: WallTest | None
    friction: Fraction
    step: Fraction
    force_step: Fraction

    @property
    def stiffness(self) -> Fraction:
        """The surface's k [N/m]."""
        return Fraction(self.surface.stiffness)

    @property
    def loss(self) -> Fraction | None:
        """σ₀/T [N/m]."""
        return None if self.damping is None or self.rate is None else self.damping * self.rate

    @property
    def damper(self) -> Fraction:
        """b_v/T [N/m]; 0 if no virtual damping is known of, which every criterion then says."""
        return (self.virtual or Fraction(0)) * (self.rate or Fraction(0))

    @property
    def samples(self) -> Fraction:
        """d, taken as 0 where it is not known: only for criteria that say so."""
        return Fraction(self.delay or 0)

    @property
    def wall(self) -> Fraction | None:
        """K₀ [N/m] at the device's rate, of a texture in the lightest direction."""
        if self.test is None:
            return None
        share = Fraction(1)
        if self.test.lightest is not None and self.surface.feels_texture:
            share = Fraction(self.test.lightest)
        if self.test.update_rate is not None and self.rate is not None:
            share *= min(Fraction(1), self.rate / Fraction(self.test.update_rate))
        return share * Fraction(self.test.value)

    @property
    def longest_delay(self) -> Number | None:
        """The greatest delay [samples] that the wall's test admits; ``None`` if it admits none.

        With the wall on the verge of cycling, σ₀/T >= K₀ (1/2 + d): any delay, unless d or σ₀ is
        known; it need not be whole then.
        """
        if self.delay is not None:
            return Fraction(self.delay)
        if self.loss is None or self.wall is None:
            return math.inf
        longest = self.loss / self.wall - HALF
        return longest if longest >= 0 else None

    @property
    def cycled(self) -> Fraction | None:
        """A stiffness K at which a wall cycled with exact positions [N/m]: σ₀/T < K (1/2 + d)."""
        test = self.test
        exact = test is not None and test.positions == "exact" and not self.virtual
        if test is None or test.cycled is None or not exact:
            return None
        same = test.update_rate is None or Fraction(test.update_rate) == self.rate
        return Fraction(test.cycled) if same else None

    def number(self, plus: Fraction, full: Fraction, side: str) -> Number:
        """Return plus · q⁺ + full · q at its lower or upper end; a weight of 0 hides infinity."""
        total = Fraction(0)
        for weight, bound in ((plus, self.one_sided), (full, self.q)):
            value = float(getattr(bound, side))
            if weight and math.isinf(value):
                return math.inf
            total += weight * Fraction(value) if weight else 0
        return total


def make_loop(
    surface: Surface, device: Device, q: Bound, one_sided: Bound, leak: Leak | None
) -> Loop:
    """Return what the criteria are about.

    Raises:
        ParameterError: for a number of the device that is out of its range.
    """
    obstacle, reason = _obstacle(surface, q)
    delay = _fraction(device, "delay_samples", _NOT_NEGATIVE)
    if delay is not None and delay.denominator != 1:
        raise ParameterError("device.delay_samples", "must be a whole number", float(delay))
    return Loop(
        surface=surface,
        device=device,
        q=q,
        one_sided=one_sided,
        leak=leak,
        conservative=surface.facts.conservative,
        obstacle=obstacle,
        reason=reason,
        rate=_fraction(device, "update_rate", _POSITIVE),
        damping=_fraction(device, "damping", _NOT_NEGATIVE),
        virtual=_fraction(device, "virtual_damping", _FINITE),
        delay=None if delay is None else int(delay),
        test=_wall_test(device),
        friction=_fraction(device, "least_friction", _NOT_NEGATIVE) or Fraction(0),
        step=_AXES * (_fraction(device, "position_resolution", _NOT_NEGATIVE) or 0),
        force_step=_AXES * (_fraction(device, "force_resolution", _NOT_NEGATIVE) or 0),
    )


# √3, rounded up: a step along each of three axes at once.
_AXES = Fraction(17320508075688773, 10**16)


def _wall_test(device: Device) -> WallTest | None:
    """Return what is known of the smooth wall; checked, since a device may be built by hand."""
    _fraction(device, "max_stiffness", _POSITIVE)
    test = device.wall_test
    for name in ("cycled", "update_rate", "lightest"):
        value = None if test is None else getattr(test, name)
        if value is not None:
            positive(f"device.max_stiffness.{name}", value)
    return test


_POSITIVE = ("must be positive", 5e-324)
_NOT_NEGATIVE = ("must not be negative", 0.0)
_FINITE = ("must be finite", -math.inf)


def _fraction(device: Device, field: str, rule: tuple[str, float]) -> Fraction | None:
    """Return a number of the device, exactly; checked, since a device may be built by hand."""
    value = device.value(field)
    if value is None:
        return None
    words, least = rule
    unit = device.data[field].unit
    if value < least or not math.isfinite(value):
        raise ParameterError(f"device.{field}", f"{words}, and finite [{unit}]", value)
    return Fraction(real(f"device.{field}", value, unit))


def _obstacle(surface: Surface, q: Bound) -> tuple[Obstacle | None, str]:
    """Return why the law's potential gives no bound, if so, and what is said of that.

    The rules need U(p + Δ) <= U(p) + ∇U · Δ + q⁺|Δ|²/2. The Jacobian proves that where the force
    is continuous. A jump can break it, but not where a theorem says that U is an infimum.
    """
    if not surface.facts.conservative:
        return Obstacle.CURL, surface.facts.reason
    if theorem_of(surface.law).infimum:
        return None, ""
    smooth = continuity(surface, q)
    return (None, "") if smooth.continuous else (Obstacle.JUMPS, smooth.reason)


def contradictory(loop: Loop) -> bool:
    """Return whether damping and delay prove a wall passive that cycled: one of them is wrong."""
    if loop.cycled is None or loop.loss is None or loop.delay is None:
        return False
    return loop.loss >= loop.cycled * (loop.delay + HALF)


def greatest_delay(loop: Loop) -> int | None:
    """Return the greatest d for which the delay rule is proved at this stiffness.

    ``None`` if not even d = 0 is, if it cannot be decided, or if q is 0 and any d will do.
    """
    if loop.loss is None or loop.obstacle:
        return None
    rest = (loop.loss - abs(loop.damper)) / loop.stiffness
    half = loop.number(HALF, Fraction(0), "upper")
    if half == math.inf or rest < half:
        return None
    q = loop.number(Fraction(0), Fraction(1), "upper")
    if q == math.inf:
        return 0
    return math.floor((rest - Fraction(half)) / Fraction(q)) if q > 0 else None


def leaks(loop: Loop) -> bool:
    """Return whether a loop that gains energy is known."""
    if loop.conservative or loop.leak is None:
        return False
    size = loop.surface.stiffness * loop.surface.max_depth * loop.leak.line.length
    return loop.leak.energy > _ROUNDING * size


def critical_speed(loop: Loop) -> float | None:
    """Return v* = W/(σ₀ length) [m/s], 0 for a conservative law, ``None`` if unknown."""
    if loop.conservative:
        return 0.0
    if loop.damping is None or loop.leak is None or not leaks(loop):
        return None
    return loop.leak.speed(float(loop.damping)) if loop.damping > 0 else math.inf
