"""Sentences about a force field and its passivity: jumps, worst loop, criteria, verdict, limits."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from asperity.analysis.energy.closed_loops import AbsorbingFriction, Leak, LoopKind
from asperity.analysis.energy.continuity import Continuity, ContinuityCause
from asperity.analysis.passivity.criteria import (
    DELAY,
    DRY_FRICTION,
    LEAK,
    ONE_SIDED,
    PAPER,
    QUANTIZATION,
    VIRTUAL,
    WALL,
    WALL_TEST,
    Criterion,
    dry_friction_criterion,
)
from asperity.analysis.passivity.device_loop import (
    BuzzBound,
    DeviceLoop,
    Obstacle,
    critical_speed,
    has_known_leak,
    is_damping_below_wall,
    max_proved_delay,
    presliding,
)
from asperity.analysis.passivity.recommended_stiffness import StabilityLimit
from asperity.analysis.passivity.verdict import Ground, Passivity
from asperity.core.units import count_text, format_quantity, format_stiffness, round_down, round_up
from asperity.devices import WallTest
from asperity.surface import Surface

_GAINS_ENERGY = "a small oscillation where q⁺ or q is attained gains energy"
_IF_DAMPED = "if damping there is σ₀"


def verdict_reason(passivity: Passivity) -> str:
    """Return the reason of the verdict, in one sentence."""
    loop = passivity.loop
    criterion = passivity.criterion(passivity.decided_by)
    formula = criterion.formula
    conclusion = criterion.conclusion
    stiffness = f"{formula} at {loop.surface.stiffness:g} N/m"
    wall = f"a smooth wall of {float(loop.cycling_stiffness or 0.0):g} N/m cycled"
    reasons = {
        Ground.PROVED: f"{stiffness}; {conclusion}",
        Ground.CRITERION: conclusion,
        Ground.BOUNDED: _quantization_reason(criterion, passivity.buzz),
        Ground.UNBOUNDED: _quantization_reason(criterion, passivity.buzz),
        Ground.WALL_HELD: f"{stiffness}; {conclusion}; {criterion.assumptions}",
        Ground.WALL_CYCLED: f"{wall}, so {_GAINS_ENERGY}, {_IF_DAMPED}",
        Ground.CONTRADICTION: f"{wall}, which damping and delay prove passive: one is wrong",
        Ground.GAINS_ENERGY: f"{_GAINS_ENERGY}, {_IF_DAMPED}",
        Ground.GAINS_ENERGY_REGARDLESS: f"{_GAINS_ENERGY}, whatever the damping",
        Ground.DEVICE_UNKNOWN: f"{formula} {conclusion}; to decide: {_unknown_data(loop)}",
    }
    return reasons[passivity.ground]


def _quantization_reason(criterion: Criterion, buzz: BuzzBound | None) -> str:
    bound = "no bound of the buzz is known" if buzz is None else buzz_text(buzz)
    return f"silence is not proved, {criterion.formula} {criterion.conclusion}; {bound}"


def _unknown_data(loop: DeviceLoop) -> str:
    fields = ("update_rate", "damping", "delay_samples")
    return ", ".join([field for field in fields if loop.device.value(field) is None])


def buzz_text(buzz: BuzzBound) -> str:
    """Return the bound of the motion that steps of positions and forces may cause."""
    speed = format_quantity(buzz.speed, "m/s")
    power = format_quantity(buzz.power, "W")
    return f"a sustained buzz moves at {speed} RMS and draws {power} at most"


def delivery_text(loop: DeviceLoop) -> str:
    """Return below which speed the field of a law with curl delivers energy, and at which power.

    On a loop the field does the work W over the length ℓ, a mean force W/ℓ of at most f_c*; at the
    speed v damping absorbs σ₀ v of it. So it delivers energy below v* = f_c*/σ₀, at most σ₀ v*²/4
    at v*/2.
    """
    if dry_friction_criterion(loop).holds:
        return "delivers no energy on slow loops: the device's dry friction absorbs it"
    speed = critical_speed(loop)
    if loop.leak is None or (speed is None and not has_known_leak(loop)):
        return "may deliver energy at any stiffness: the law has curl"
    if speed is None or loop.damping is None:
        mean = format_quantity(loop.leak.absorbing.found, "N")
        return f"delivers energy below v* = {mean} / damping (missing)"
    if math.isinf(speed):
        return "delivers energy at any speed: the device has no damping"
    power = format_quantity(float(loop.damping) * speed**2 / 4.0, "W")
    return f"delivers energy below v* = {format_quantity(speed, 'm/s')}, at most {power}"


def absorbing_friction_text(friction: AbsorbingFriction) -> str:
    """Return the dry friction of a device that ends the gain of a law with curl at every speed.

    Example:
        >>> import numpy as np
        >>> absorbing_friction_text(AbsorbingFriction(0.29, 0.74, 9e-4, np.zeros((0, 3))))
        'at least 290 mN, greatest W/length of 1 plane; 740 mN proved to be enough'
    """
    planes = "1 plane" if friction.planes == 1 else f"{friction.planes} planes"
    least = format_quantity(round_down(friction.found), "N")
    requirement = (
        f"at least {least}, greatest W/length of {planes}" if friction.planes else "unknown"
    )
    if math.isinf(friction.upper):
        return f"{requirement}; no friction is proved to be enough"
    return f"{requirement}; {format_quantity(round_up(friction.upper), 'N')} proved to be enough"


def energy_gained_text(loop: DeviceLoop) -> str:
    """Return the energy gained on the worst loop, and the speed below which it is delivered."""
    if loop.leak is None or math.isnan(loop.leak.energy):
        return delivery_text(loop)
    return f"a loop gains {format_quantity(loop.leak.energy, 'J')}; it {delivery_text(loop)}"


# --- limits of the stiffness ----------------------------------------------------------------------


def _given_friction_text(loop: DeviceLoop | None) -> str:
    """Return with which given presliding stiffness; empty without one."""
    if loop is None or "presliding_stiffness" not in loop.surface.friction_values:
        return ""
    stiffness = loop.surface.friction_values["presliding_stiffness"]
    return f" with a presliding stiffness of {format_stiffness(stiffness)}"


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
        return "no stable stiffness is known" + _given_friction_text(loop)
    if limit.basis == "wall gain" and loop is not None:
        return delivery_text(loop)
    if limit.basis == "wall gain":
        return "no stable stiffness: below a speed v* the field delivers energy at any stiffness"
    at_most = "at most " if limit.sampled else ""
    stiffness = stiffness_limit_text(limit.stiffness)
    return f"{limit.basis} up to {at_most}{stiffness}{delay_clause(limit.delay)}"


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
    if stiffness == math.inf:
        return "infinite"
    return f"{round_down(stiffness):.10g} N/m"


# --- criteria -------------------------------------------------------------------------------------


def described_criteria(passivity: Passivity) -> tuple[Criterion, ...]:
    """Return all criteria with their conclusions in words and their complete assumptions."""
    loop = passivity.loop
    return tuple(
        [
            replace(
                criterion,
                conclusion=criterion.conclusion or _conclusion(loop, criterion),
                assumptions=_criterion_assumptions(loop, criterion),
            )
            for criterion in passivity.evaluated.values()
        ]
    )


_HOLDS_TEXT = {True: "holds", False: "does not hold", None: "not decidable"}


def _conclusion(loop: DeviceLoop, criterion: Criterion) -> str:
    """Return the conclusion of a criterion in words."""
    if criterion.name == LEAK:
        return _leak_conclusion(loop, criterion)
    if criterion.name == DRY_FRICTION:
        return _dry_friction_conclusion(loop, criterion)
    if criterion.obstacle is Obstacle.CURL:
        return f"not applicable: the law is not conservative ({loop.surface.facts.reason})"
    if criterion.obstacle is Obstacle.JUMPS and loop.continuity is not None:
        return f"not applicable: the force is not continuous: {continuity_reason(loop.continuity)}"
    answer = _HOLDS_TEXT[criterion.holds]
    if criterion.holds is None and criterion.missing:
        missing = ", ".join(criterion.missing)
        return f"{answer}: needs {missing}{_proved_delays_text(loop, criterion)}"
    return f"{answer}{_presliding_clause(loop, criterion) or _limit_clause(criterion)}"


def _presliding_clause(loop: DeviceLoop, criterion: Criterion) -> str:
    """Return that κ alone is too stiff for a device; empty if it is not."""
    _share, fixed = presliding(loop.surface)
    if not fixed or criterion.limit != 0.0 or criterion.name == QUANTIZATION:
        return ""
    stiffness = format_quantity(float(fixed), "N/m")
    return f": the presliding stiffness, {stiffness}, is more than the device allows"


def _limit_clause(criterion: Criterion) -> str:
    """Return the limit of a criterion, to be appended to whether it holds."""
    upper = criterion.upper_limit
    if criterion.limit is None and upper is None:
        return ""
    if criterion.limit is None:
        at_most = stiffness_limit_text(upper or 0.0)
        return f": the number was only sampled; the limit is at most {at_most}"
    limit = stiffness_limit_text(criterion.limit)
    if criterion.holds is None and upper is not None:
        return f": the limit is between {limit} and {stiffness_limit_text(upper)}"
    return f": the limit is {limit}"


def _proved_delays_text(loop: DeviceLoop, criterion: Criterion) -> str:
    """Return the proved delays, if the delay is all that is missing."""
    if criterion.missing != ("delay_samples",):
        return ""
    delay = max_proved_delay(loop)
    if delay is None:
        return "; at this stiffness not even d = 0 is proved"
    return f"; at this stiffness d <= {delay} is proved"


def _leak_conclusion(loop: DeviceLoop, criterion: Criterion) -> str:
    if loop.leak is not None and math.isnan(loop.leak.energy):
        return f"not decidable: {_TOO_STEEP}"
    if criterion.holds is None:
        return "not decidable: no loop found that gains energy, and no proof that none does"
    if criterion.holds:
        return "holds: no loop gains"
    return f"does not hold: {energy_gained_text(loop)}"


def _dry_friction_conclusion(loop: DeviceLoop, criterion: Criterion) -> str:
    if loop.conservative:
        return "holds: no loop gains, none is needed"
    needs = "the leak is not known"
    if loop.leak is not None:
        needs = f"f_c* is {absorbing_friction_text(loop.leak.absorbing)}"
    lacks = f": needs {', '.join(criterion.missing)}" if criterion.missing else ""
    answer = f"{_HOLDS_TEXT[criterion.holds]}{lacks}{_limit_clause(criterion)}; {needs}"
    datum = loop.device.data.get("friction")
    if datum is None or loop.leak is None or not criterion.missing:
        return answer
    judgement = "may be enough"
    if datum.value >= loop.leak.absorbing.upper:
        judgement = "would be enough"
    elif datum.value < loop.leak.absorbing.found:
        judgement = "is not enough"
    mark = "" if datum.verified else " (not verified)"
    return f"{answer}; friction {datum.text}{mark}, typical or at most, {judgement}"


def _criterion_assumptions(loop: DeviceLoop, criterion: Criterion) -> str:
    """Return the assumptions with the region and the numbers used, unverified ones marked."""
    describe = _ASSUMPTIONS.get(criterion.name)
    assumptions = criterion.assumptions if describe is None else describe(loop)
    if criterion.name in (LEAK, DRY_FRICTION) and loop.conservative:
        return assumptions
    data = loop.device.data
    numbers = []
    for field in criterion.used_fields:
        if field in data:
            mark = "" if data[field].verified else " (not verified)"
            numbers.append(f"{field} {data[field].text}{mark}")
    parts = (assumptions, _depth_text(loop.surface), ", ".join(numbers))
    return "; ".join(filter(None, parts))


def _depth_text(surface: Surface) -> str:
    if surface.effective_clamp.holds_whole_force:
        return "at every depth"
    return f"no deeper than {format_quantity(surface.clamped_depth, 'm')}"


_COMMON = "conservative law, zero-order hold, symmetric damping >= σ₀ wherever the force acts"


def _virtual_damping_assumptions(loop: DeviceLoop) -> str:
    delay = "no delay" if loop.delay is None else "d whole samples of delay"
    return f"{_COMMON}, {delay}, b_v on the last step's mean velocity"


def _quantization_assumptions(loop: DeviceLoop) -> str:
    is_missing = loop.wall_test is not None and loop.wall_test.positions == "stepped"
    if not (loop.position_step or loop.force_step or is_missing):
        return "positions and forces are assumed to be exact: their resolution is unknown"
    return f"{_COMMON}; |δ|, |b|: a step along three axes at once; f_c: least_friction"


def _wall_test_assumptions(loop: DeviceLoop) -> str:
    if loop.virtual_damping and loop.delay != 0:
        return "no limit: with delay, the wall test does not show the effect of virtual damping"
    if is_damping_below_wall(loop):
        return (
            "plausible, not proved: a wall of K₀ needs more damping than the device has, so the "
            f"damping limits the stiffness{delay_clause(float(loop.longest_delay))}"
        )
    return (
        "plausible, not proved: the wall of stiffness K₀ was close to its stability limit (heavy "
        f"handle, loose grip){_wall_conditions(loop)}; {damping_assumption(loop.wall_test)}; "
        "conservative law"
    )


def _wall_conditions(loop: DeviceLoop) -> str:
    """Return update rate and delay of the wall test, and how they limit a loop."""
    if loop.wall_test is None:
        return ""
    text = f" at {format_quantity(float(loop.wall_rate), 'Hz')}"
    if loop.delay is not None:
        text += f" with {count_text(float(loop.wall_delay), 'sample')} of delay"
    if loop.least_rate < loop.wall_rate:
        text += f"; at {format_quantity(float(loop.least_rate), 'Hz')} it is less in proportion"
    return text


def update_rate_text(limit: StabilityLimit) -> str:
    """Return the update rates at which a limit holds; empty without a limit.

    Example:
        >>> update_rate_text(StabilityLimit(900.0, "plausible", update_rate=300.0))
        'for a loop of 300 Hz or faster'
    """
    if limit.update_rate is None:
        return ""
    return f"for a loop of {format_quantity(limit.update_rate, 'Hz')} or faster"


def damping_assumption(wall_test: WallTest | None) -> str:
    """Return the assumption about the damping along directions in which no wall was tested."""
    if wall_test is not None and wall_test.lightest is not None:
        return f"damping is at least {wall_test.lightest:g} of the tested in all directions"
    if wall_test is not None and wall_test.directions:
        tested = f"tested along {', '.join(wall_test.directions)}"
        return f"damping is equal in all directions, {tested}"
    return "damping is equal in all directions, the direction of the test is not stated"


def _leak_assumptions(loop: DeviceLoop) -> str:
    if loop.conservative:
        return "the law's curl is identically zero; no data of the device are needed"
    method = "" if loop.leak is None else f" ({loop.leak.method})"
    return f"one slow traversal of the loop{method}; dry friction counts apart"


def _dry_friction_assumptions(loop: DeviceLoop) -> str:
    if loop.conservative:
        return "the law's curl is identically zero; no data of the device are needed"
    return "f_c: least_friction, taken per length of path at every speed; slow motion, no hold"


# The assumptions of the shipped criteria; a user-defined one has its own.
_ASSUMPTIONS: dict[str, Callable[[DeviceLoop], str]] = {
    PAPER: lambda _loop: (
        "zero-order hold; no certificate for a field with curl, nor from 2 samples of delay on"
    ),
    ONE_SIDED: lambda _loop: f"{_COMMON}, no delay, no virtual damping",
    DELAY: lambda _loop: (
        f"{_COMMON}, d whole samples of delay, no virtual damping, no quantisation"
    ),
    VIRTUAL: _virtual_damping_assumptions,
    QUANTIZATION: _quantization_assumptions,
    WALL: lambda _loop: (
        "the paper's III.B, for every law, at the delay of the loop; a rule of thumb: that a wall "
        "did not cycle proves no damping, and no norm bounds what a field with curl gains"
    ),
    WALL_TEST: _wall_test_assumptions,
    LEAK: _leak_assumptions,
    DRY_FRICTION: _dry_friction_assumptions,
}


_CONTINUITY = {
    ContinuityCause.JUMP_AT_CONTACT: (
        "the force jumps where contact begins: its formula does not vanish with the depth"
    ),
    ContinuityCause.SINGLE_VALUED: "force and contact point change without jumps",
    ContinuityCause.DISTANCE: "the distance to the surface never jumps",
    ContinuityCause.CURVATURE: "the nearest point is unique down to 1/K, K >= ‖Hess h‖",
    ContinuityCause.CRESTS: "the contact point jumps below crests, at depths from {onset}",
    ContinuityCause.NOT_FOUND: "no medial axis found down to {depth}; the force jumps below it",
    ContinuityCause.BLUNT_CRESTS: "no crest is so sharp that the nearest point jumps at {depth}",
}


def continuity_reason(continuity: Continuity) -> str:
    """Return why the force is continuous, or not, with its Lipschitz constant."""
    reason = _CONTINUITY[continuity.cause].format(
        onset=format_quantity(round_down(continuity.onset), "m"),
        depth=format_quantity(continuity.surface.max_depth, "m"),
    )
    slope = continuity.lipschitz
    if slope is None or math.isinf(slope.upper):
        return reason
    return f"{reason}; Lipschitz constant at most {round_up(slope.upper):.10g} N/m"


def jumps_clause(continuity: Continuity) -> str:
    """Return whether the force jumps, and how much."""
    if continuity.continuous:
        return "its force is continuous"
    if not continuity.jumps:
        return f"its force is not continuous ({continuity_reason(continuity)})"
    largest = format_quantity(max(jump.size for jump in continuity.jumps), "N")
    return f"its force jumps, by up to {largest} where that was located"


_TOO_STEEP = "the surface is too steep to integrate around a loop"
_LOOPS = {
    LoopKind.EVERY_LOOP: "every closed loop: zero by the symbolic curl",
    LoopKind.NO_GAIN: "no evaluated loop gains energy",
    LoopKind.CURL_BY_DEPTH: "around the region of one sign of the curl, depth to {depth:g} mm",
    LoopKind.CURL_BY_DISTANCE: (
        "around the region of one sign of the curl where the surface is nearer than {depth:g} mm"
    ),
    LoopKind.FRICTION_PATH: (
        "the paper's path of (27), worst of {starts} starts: {deflection:g} mm along in light "
        "contact, back at {depth:g} mm"
    ),
    LoopKind.TOO_STEEP: f"unknown: {_TOO_STEEP}",
    LoopKind.IN_PLANE: "in the plane at {depth:g} mm about an anchor that sticks",
}


def loop_description(leak: Leak) -> str:
    """Return the worst loop in words."""
    origin = leak.origin
    text = _LOOPS[origin.kind].format(
        depth=1e3 * origin.depth, starts=origin.starts, deflection=1e3 * origin.deflection
    )
    if origin.directions > 1:
        return f"{text}, the worst of {origin.lines} lines in {origin.directions} directions"
    if origin.lines > 1:
        return f"{text}, the worst of {origin.lines} lines in one direction"
    return text


def leak_energy_text(leak: Leak) -> str:
    """Return the energy gained on the worst loop, per period or line length if that is proved.

    Example:
        >>> from asperity.analysis.energy.leak import worst_loop
        >>> from asperity.surface import Surface
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> leak_energy_text(worst_loop(Surface(Sinusoid(0.8e-3, 2e-3), "A", max_depth=0.8e-3)))
        '1.28 mJ per period'
    """
    if math.isnan(leak.energy):
        return "an unknown energy (the surface is too steep to compute it)"
    energy = format_quantity(leak.worst_per_period, "J")
    if math.isinf(leak.upper_per_period):
        return f"{energy} per loop"
    if leak.line.periodic:
        return f"{energy} per period"
    return f"{energy} per {format_quantity(leak.line.length, 'm')}"
