"""Passivity of a surface on a device: every criterion and the verdict, with their sentences."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.energy.leak import Leak
from asperity.analysis.passivity.criteria import (
    LEAK,
    BuzzBound,
    Criterion,
    buzz_bound,
    evaluate_criteria,
)
from asperity.analysis.passivity.device_loop import (
    DeviceLoop,
    Obstacle,
    critical_speed,
    has_known_leak,
    make_device_loop,
    max_proved_delay,
)
from asperity.analysis.passivity.verdict import (
    Ground,
    StabilityLimit,
    Verdict,
    decide_verdict,
    stability_limit,
)
from asperity.analysis.surface_sentences import depth_range_text
from asperity.core.display import Displayable
from asperity.core.errors import ParameterError
from asperity.core.files import Serializable
from asperity.core.units import format_quantity, round_down
from asperity.devices import DeviceLike, load_device
from asperity.surface import Surface


def with_sentences(loop: DeviceLoop, criterion: Criterion) -> Criterion:
    """Return a criterion with its conclusion in words and its complete assumptions."""
    conclude = _leak_conclusion if criterion.name == LEAK else _conclusion
    conclusion = criterion.conclusion or conclude(loop, criterion)
    assumptions = _criterion_assumptions(loop, criterion)
    return replace(criterion, conclusion=conclusion, assumptions=assumptions)


def verdict_reason(
    loop: DeviceLoop, criterion: Criterion, ground: Ground, buzz: BuzzBound | None
) -> str:
    """Return the reason of the verdict, in one sentence.

    Args:
        loop: the surface on the device.
        criterion: the deciding criterion, with its sentences.
        ground: ground of the verdict.
        buzz: bound of the motion that quantisation may cause, if there is one.
    """
    formula = criterion.formula
    conclusion = criterion.conclusion
    at = f"{formula} at {loop.surface.stiffness:g} N/m; {conclusion}"
    cycling = loop.cycling_stiffness
    wall = "" if cycling is None else f"a smooth wall of {float(cycling):g} N/m cycled"
    fields = ("update_rate", "damping", "delay_samples")
    unknown = ", ".join(field for field in fields if loop.device.value(field) is None)
    bound = "no bound of the buzz is known" if buzz is None else buzz_text(buzz)
    steps = f"silence is not proved, {formula} {conclusion}; {bound}"
    return {
        Ground.PROVED: at,
        Ground.CRITERION: conclusion,
        Ground.BOUNDED: steps,
        Ground.UNBOUNDED: steps,
        Ground.WALL_HELD: f"{at}; {criterion.assumptions}",
        Ground.WALL_CYCLED: f"{wall}, so {_GAINS_ENERGY}, {_IF_DAMPED}",
        Ground.CONTRADICTION: f"{wall}, which damping and delay prove passive: one is wrong",
        Ground.GAINS_ENERGY: f"{_GAINS_ENERGY}, {_IF_DAMPED}",
        Ground.GAINS_ENERGY_REGARDLESS: f"{_GAINS_ENERGY}, whatever the damping",
        Ground.DEVICE_UNKNOWN: f"{formula} {conclusion}; to decide: {unknown}",
    }[ground]


_GAINS_ENERGY = "a small oscillation where q⁺ or q is attained gains energy"
_IF_DAMPED = "if damping there is σ₀"


def buzz_text(buzz: BuzzBound) -> str:
    """Return the bound of the motion that steps of positions and forces may cause."""
    speed = format_quantity(buzz.speed, "m/s")
    power = format_quantity(buzz.power, "W")
    return f"a sustained buzz moves at {speed} RMS and draws {power} at most"


def delivery_text(loop: DeviceLoop) -> str:
    """Return below which speed the field of a law with curl delivers energy, and at which power.

    On its worst loop the field does the work W over the length ℓ, a mean force W/ℓ; at the speed v
    damping absorbs σ₀ v of it. So it delivers energy below v* = W/(σ₀ ℓ), at most σ₀ v*²/4 at v*/2.
    """
    speed = critical_speed(loop)
    if speed is None and (loop.leak is None or not has_known_leak(loop)):
        return "may deliver energy at any stiffness: the law has curl"
    if speed is None or loop.damping is None or loop.leak is None:
        force = 0.0 if loop.leak is None else loop.leak.energy / loop.leak.length
        mean = format_quantity(force, "N")
        return f"delivers energy below v* = {mean} / damping (missing)"
    if math.isinf(speed):
        return "delivers energy at any speed: the device has no damping"
    power = format_quantity(float(loop.damping) * speed**2 / 4.0, "W")
    return f"delivers energy below v* = {format_quantity(speed, 'm/s')}, at most {power}"


def energy_gained_text(loop: DeviceLoop) -> str:
    """Return the energy gained on the worst loop, and the speed below which it is delivered."""
    energy = 0.0 if loop.leak is None else loop.leak.energy
    return f"a loop gains {format_quantity(energy, 'J')}; it {delivery_text(loop)}"


def stability_limit_text(limit: StabilityLimit, loop: DeviceLoop | None = None) -> str:
    """Return the stability limit and its basis.

    Args:
        limit: the limit.
        loop: the surface on the device, for v* and power of a law with curl.

    Example:
        >>> stability_limit_text(StabilityLimit(1999.9, "plausible", "wall test", math.inf))
        'plausible up to 1990 N/m at the delay of the wall test'
        >>> stability_limit_text(StabilityLimit(1999.9, "wall gain"))
        'no stable stiffness: below a speed v* the field delivers energy at any stiffness'
        >>> stability_limit_text(StabilityLimit(None, "none"))
        'no stable stiffness is known: the device data are insufficient'
        >>> stability_limit_text(StabilityLimit(0.0, "none"))
        'no stable stiffness is known'
    """
    if limit.stiffness is None:
        return "no stable stiffness is known: the device data are insufficient"
    if limit.basis == "none":
        return "no stable stiffness is known"
    if limit.basis == "wall gain" and loop is not None:
        return delivery_text(loop)
    if limit.basis == "wall gain":
        return "no stable stiffness: below a speed v* the field delivers energy at any stiffness"
    at_most = f"{'at most ' if limit.sampled else ''}{stiffness_limit_text(limit.stiffness)}"
    return f"{limit.basis} up to {at_most}{delay_clause(limit.delay)}"


def delay_clause(delay: float | None) -> str:
    """Return the admissible delay [samples], to be appended to a limit; empty for ``None``.

    Infinity: the limit holds whatever the delay of the wall test was; it is not a limit for a loop
    with a longer delay than that of the test.
    """
    if delay is None:
        return ""
    if math.isinf(delay):
        return " at the delay of the wall test"
    return f", for a delay up to {delay:.3g} samples"


def stiffness_limit_text(stiffness: float) -> str:
    """Return a stiffness limit for reading: rounded down, never overstated.

    Example:
        >>> stiffness_limit_text(1234.5), stiffness_limit_text(math.inf)
        ('1230 N/m', 'infinite')
    """
    return "infinite" if stiffness == math.inf else f"{round_down(stiffness):.10g} N/m"


_OBSTACLE_TEXT = {
    Obstacle.CURL: "the law is not conservative ({})",
    Obstacle.JUMPS: "the force is not continuous: {}",
}
_HOLDS_TEXT = {True: "holds", False: "does not hold", None: "not decidable"}


def _conclusion(loop: DeviceLoop, criterion: Criterion) -> str:
    """Return the conclusion of a criterion in words."""
    if criterion.obstacle is not None:
        return f"not applicable: {_OBSTACLE_TEXT[criterion.obstacle].format(loop.reason)}"
    answer = _HOLDS_TEXT[criterion.holds]
    limit = criterion.limit
    most = criterion.upper_limit
    if criterion.holds is None and criterion.missing:
        missing = ", ".join(criterion.missing)
        return f"{answer}: needs {missing}{_proved_delays_text(loop, criterion)}"
    if limit is None and most is None:
        return answer
    if limit is None:
        at_most = stiffness_limit_text(most or 0.0)
        return f"{answer}: the number was only sampled; the limit is at most {at_most}"
    limit_text = stiffness_limit_text(limit)
    if criterion.holds is None and most is not None:
        return f"{answer}: the limit is between {limit_text} and {stiffness_limit_text(most)}"
    return f"{answer}: the limit is {limit_text}"


def _proved_delays_text(loop: DeviceLoop, criterion: Criterion) -> str:
    """Return the proved delays, if the delay is all that is missing."""
    if criterion.missing != ("delay_samples",):
        return ""
    most = max_proved_delay(loop)
    if most is None:
        return "; at this stiffness not even d = 0 is proved"
    return f"; at this stiffness d <= {most} is proved"


def _leak_conclusion(loop: DeviceLoop, criterion: Criterion) -> str:
    if criterion.holds is None:
        return "not decidable: no loop found that gains energy, and no proof that none does"
    if criterion.holds:
        return "holds: no loop gains"
    return f"does not hold: {energy_gained_text(loop)}"


def _criterion_assumptions(loop: DeviceLoop, criterion: Criterion) -> str:
    """Return the assumptions with the region and the numbers used, unverified ones marked."""
    if criterion.name == LEAK and criterion.holds:
        return criterion.assumptions
    depth = depth_range_text(loop.surface)
    depth = depth.replace("depths to", "no deeper than").replace("every", "at every")
    data = loop.device.data
    numbers = ", ".join(
        f"{field} {data[field].text}{'' if data[field].verified else ' (not verified)'}"
        for field in criterion.used_fields
        if field in data
    )
    return "; ".join(filter(None, (criterion.assumptions, depth, numbers)))


@dataclass(frozen=True)
class Passivity(Serializable, Displayable):
    """Passivity of a surface on a device: whether the hand can gain energy without limit.

    Attributes:
        loop: the surface on the device.
        evaluated: all criteria by name, before their sentences are added.
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

    serialized_attributes = (
        "verdict decided_by reason stiffness stability_limit critical_speed greatest_delay buzz "
        "criteria"
    )

    loop: DeviceLoop = field(compare=False)
    evaluated: Mapping[str, Criterion]
    decided_by: str
    verdict: Verdict
    ground: Ground
    stability_limit: StabilityLimit
    buzz: BuzzBound | None

    @cached_property
    def criteria(self) -> tuple[Criterion, ...]:
        """All criteria with their sentences, also those that do not decide."""
        return tuple(with_sentences(self.loop, one) for one in self.evaluated.values())

    @cached_property
    def reason(self) -> str:
        """The reason of the verdict in one sentence."""
        return verdict_reason(self.loop, self.criterion(self.decided_by), self.ground, self.buzz)

    @property
    def stiffness(self) -> float:
        """Stiffness of the surface [N/m]."""
        return self.loop.surface.stiffness

    @property
    def critical_speed(self) -> float | None:
        """v* [m/s], the speed on the worst loop below which damping does not absorb its energy.

        0 for a conservative law, ``None`` if unknown.
        """
        return critical_speed(self.loop)

    @property
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
        return with_sentences(self.loop, self.evaluated[name])

    def __repr__(self) -> str:
        limit = stability_limit_text(self.stability_limit, self.loop)
        return f"<Passivity: {self.verdict}, decided by {self.decided_by}; {limit}>"


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
    * smooth-wall rule: k q <= K₀, as printed in the paper's III.B: a rule of thumb;
    * wall test: k (q⁺/2 + d q) <= K₀ (1/2 + d), k q <= K₀ for any delay, for a conservative law:
      plausible, not proved;
    * leak: no loop of the field gains energy.

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
    loop = make_device_loop(surface, load_device(device), q, one_sided, leak)
    criteria = evaluate_criteria(loop)
    buzz = buzz_bound(loop)
    verdict, decided_by, ground = decide_verdict(loop, criteria, buzz)
    limit = stability_limit(loop, criteria)
    return Passivity(loop, criteria, decided_by, verdict, ground, limit, buzz)
