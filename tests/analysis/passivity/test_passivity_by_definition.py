"""Criteria, limits and verdicts compared with their definitions on grids of small numbers."""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction
from itertools import product
from types import SimpleNamespace
from typing import Any

import pytest

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.passivity import criteria, device_loop
from asperity.analysis.passivity import verdict as judgement
from asperity.analysis.passivity.criteria import (
    DELAY,
    DRY_FRICTION,
    LEAK,
    ONE_SIDED,
    QUANTIZATION,
    VIRTUAL,
    WALL,
    WALL_TEST,
    Criterion,
    StiffnessRule,
)
from asperity.analysis.passivity.device_loop import (
    BuzzBound,
    DeviceLoop,
    Obstacle,
    critical_speed,
    has_known_leak,
    is_contradictory,
    max_proved_delay,
)
from asperity.analysis.passivity.recommended_stiffness import StabilityLimit
from asperity.analysis.passivity.verdict import Ground
from asperity.devices import Datum, Device, WallTest

INF, HALF = math.inf, Fraction(1, 2)
DEVICE = Device("mine", "Mine", {"damping": Datum(1.0, "N*s/m", "by hand", verified=True)})


def number(lower: float, upper: float | None = None) -> Bound:
    return Bound(lower, lower if upper is None else upper, "theorem")


def make_loop(stiffness: float = 1.0, **more: Any) -> DeviceLoop:
    """Return a device loop at 1 Hz with the given data."""
    plain: dict[str, Any] = {
        "surface": SimpleNamespace(
            stiffness=stiffness, max_depth=2.0, depends_on_texture=True, contact_friction=None
        ),
        "device": DEVICE,
        "q": number(1.0),
        "one_sided": number(1.0),
        "leak": None,
        "conservative": True,
        "obstacle": None,
        "continuity": None,
        "rate": Fraction(1),
        "damping": None,
        "virtual_damping": None,
        "delay": None,
        "wall_test": None,
        "friction": Fraction(0),
        "position_step": Fraction(0),
        "force_step": Fraction(0),
    } | more
    rate, damping, virtual = plain["rate"] or 0, plain["damping"], plain["virtual_damping"] or 0
    return DeviceLoop(
        **plain,
        damping_gain=damping * rate if damping is not None and rate else None,
        virtual_damping_gain=Fraction(virtual * rate),
        known_delay=Fraction(plain["delay"] or 0),
    )


def make_wall_test(cycled: float) -> WallTest:
    return WallTest(1.0, "N/m", "by hand", verified=True, cycled=cycled, positions="exact")


def to_fraction(value: float | None) -> Fraction | None:
    return None if value is None else Fraction(value)


# --- one rule -------------------------------------------------------------------------------------


@pytest.mark.parametrize("budget", [-1.0, 0.0, 1.0, 3.0])
@pytest.mark.parametrize("weights", [(0.0, 1.0), (1.0, 0.0), (0.5, 2.0)])
def test_rule_holds_by_the_upper_bound_and_fails_by_the_lower_bound(
    budget: float, weights: tuple[float, float]
) -> None:
    """The rule is K (w⁺ q⁺ + w q) <= budget; the limit is 0 for budget <= 0, and 0 · ∞ = 0."""
    plus, full = weights
    sizes = (0.0, 0.5, 1.0, 3.0, INF)
    ends = [(low, high) for low, high in product(sizes, sizes) if low <= high]
    for stiffness, (low, high), (low_plus, high_plus) in product((1.0, 2.0), ends, ends):
        loop = make_loop(stiffness, q=number(low, high), one_sided=number(low_plus, high_plus))
        rule = StiffnessRule(
            "", "", Fraction(plus), Fraction(full), Fraction(budget), ("damping",), ""
        )
        criterion = criteria.evaluate_rule(loop, rule)

        def largest_stiffness(q: float, q_plus: float) -> float:
            total = sum(w * size for w, size in ((plus, q_plus), (full, q)) if w)
            if budget <= 0.0 or total == INF:
                return 0.0
            return budget / total if total else INF

        proved, possible = largest_stiffness(high, high_plus), largest_stiffness(low, low_plus)
        assert criterion.holds is (
            True if stiffness <= proved else False if stiffness > possible else None
        )
        sampled = possible > 0.0 == proved and budget > 0.0
        if sampled:
            assert (criterion.limit, criterion.margin) == (None, None)
        else:
            assert criterion.limit == pytest.approx(proved)
            assert criterion.margin == pytest.approx(proved / stiffness)
        assert criterion.upper_limit == pytest.approx(possible)
        assert criterion.missing == ()


def test_rule_without_its_data_lists_missing_fields() -> None:
    for budget in (Fraction(1), None):
        rule = StiffnessRule(
            "", "", HALF, HALF, budget, ("damping", "update_rate"), "", used_fields=("mass",)
        )
        criterion = criteria.evaluate_rule(make_loop(), rule)
        assert (criterion.holds, criterion.limit, criterion.missing) == (
            None,
            None,
            ("update_rate",),
        )
        assert criterion.used_fields == ("damping", "update_rate", "mass")
    rule = StiffnessRule("", "", HALF, HALF, None, ("damping",), "")
    assert criteria.evaluate_rule(make_loop(), rule).missing == ()
    barred = StiffnessRule("", "", HALF, HALF, Fraction(1), ("mass",), "", Obstacle.CURL)
    criterion = criteria.evaluate_rule(make_loop(), barred)
    assert (criterion.holds, criterion.obstacle, criterion.missing) == (None, Obstacle.CURL, ())


# --- delays and speeds ----------------------------------------------------------------------------


def test_max_proved_delay_is_the_largest_allowed_delay() -> None:
    seen = set()
    for loss, virtual, stiffness, q, share in product(
        (None, 0.0, 0.5, 1.0, 3.0, 7.0),
        (None, -1.0, 1.0),
        (1.0, 2.0),
        (0.0, 0.5, 1.0, 2.0, INF),
        (0.0, 0.5, 1.0),
    ):
        plus = share * q if share else 0.0
        loop = make_loop(
            stiffness,
            damping=to_fraction(loss),
            virtual_damping=to_fraction(virtual),
            q=number(q),
            one_sided=number(plus),
        )

        def allows(
            d: int,
            k: float = stiffness,
            q: float = q,
            plus: float = plus,
            loss: float | None = loss,
            virtual: float | None = virtual,
        ) -> bool:
            total = plus / 2 + (d * q if d else 0.0)
            return loss is not None and k * total + abs(virtual or 0.0) <= loss

        delays = [d for d in range(100) if allows(d)]
        expected = None if not delays or q == 0.0 else max(delays)
        assert max_proved_delay(loop) == expected
        seen.add(expected)
    assert seen > {None, 0, 1, 2, 3}
    assert max_proved_delay(make_loop(damping=Fraction(9), obstacle=Obstacle.JUMPS)) is None


def test_leak_above_rounding_sets_the_critical_speed() -> None:
    """Rounding is 1e-12 of k · depth · length; the speed W/(σ₀ length) is infinite at σ₀ = 0."""

    def leak(energy: float) -> Any:
        line = SimpleNamespace(length=3.0)
        return SimpleNamespace(
            energy=energy, line=line, critical_speed=lambda sigma: energy / (sigma * 3.0)
        )

    size = 1e-12 * 5.0 * 2.0 * 3.0
    for energy, leaking in ((0.0, False), (size, False), (1.01 * size, True), (6.0, True)):
        nonconservative = make_loop(5.0, conservative=False, leak=leak(energy), damping=Fraction(2))
        assert has_known_leak(nonconservative) is leaking
        speed = critical_speed(nonconservative)
        assert speed == (pytest.approx(energy / 6.0) if leaking else None)
    assert not has_known_leak(make_loop(conservative=True, leak=leak(6.0)))
    assert not has_known_leak(make_loop(conservative=False))
    assert critical_speed(make_loop(conservative=True, damping=Fraction(1))) == 0.0
    assert critical_speed(make_loop(conservative=False, leak=leak(6.0))) is None
    undamped = make_loop(conservative=False, leak=leak(6.0), damping=Fraction(0))
    assert critical_speed(undamped) == INF


# --- buzz -----------------------------------------------------------------------------------------


def test_buzz_bound_equals_its_formula() -> None:
    """Speed (φ - f_c)/(m T) and power (φ - f_c)²/(4 m T), see MATH section 7."""
    margins = []
    for q, plus, loss, virtual, delay, friction in product(
        (1.0, 3.0, INF), (1.0, INF), (None, 0.5, 1.0, 6.0), (None, -1.0), (None, 0, 1), (0.0, 9.0)
    ):
        loop = make_loop(
            2.0,
            q=number(q),
            one_sided=number(plus),
            damping=to_fraction(loss),
            virtual_damping=to_fraction(virtual),
            delay=delay,
            friction=Fraction(friction),
            position_step=Fraction(3),
            force_step=Fraction(5),
        )
        result, b = device_loop.buzz_bound(loop), abs(virtual or 0.0)
        if loss is None or delay is None or INF in (q, plus):
            assert result is None
            continue
        m = loss - b - 2.0 * (plus / 2 + delay * q)
        margins.append(m)
        if m <= 0.0:
            assert result is None
            continue
        excess = max(2.0 * q * 3.0 / 2 + 5.0 / 2 + b * 3.0 - friction, 0.0)
        assert result is not None
        assert result.speed == pytest.approx(excess / m)
        assert result.power == pytest.approx(excess**2 / (4 * m))
    assert min(margins) < 0.0 < max(margins)
    assert 0.0 in margins
    whole: dict[str, Any] = {"damping": Fraction(6), "delay": 0, "position_step": Fraction(1)}
    assert device_loop.buzz_bound(make_loop(**whole)) is not None
    assert device_loop.buzz_bound(make_loop(**whole, rate=None)) is None
    assert device_loop.buzz_bound(make_loop(**whole, obstacle=Obstacle.JUMPS)) is None


# --- stability limit ------------------------------------------------------------------------------

LIMITS = (None, 0.0, 0.25, 0.5, 2.0)


def make_criterion(name: str, limit: float | None, at_most: float | None = None) -> Criterion:
    return Criterion(name, "", limit=limit, upper_limit=limit if at_most is None else at_most)


def test_stability_limit_is_the_larger_of_plausible_and_proved() -> None:
    """Ties are proved. Where the buzz is bounded, the limit is that of its bound."""
    unbounded = make_loop(damping=Fraction(1), delay=2, rate=None)
    bounded = make_loop(damping=Fraction(1), delay=2, force_step=Fraction(1, 1000))
    check_stability_limits(unbounded, None)
    check_stability_limits(bounded, device_loop.buzz_limited_stiffness(bounded))


def check_stability_limits(loop: DeviceLoop, calm: float | None) -> None:
    """Compare limits with their definition; ``calm`` is the one that bounds the buzz."""
    for main, steps, wall in product(LIMITS, (*LIMITS, INF), LIMITS):
        by_name = {
            DELAY: make_criterion(DELAY, main),
            QUANTIZATION: make_criterion(QUANTIZATION, steps),
            WALL_TEST: make_criterion("w", wall),
        }
        limit = judgement.stability_limit(loop, by_name)
        both = None if None in (main, steps) else min(main or 0.0, steps or 0.0)
        quiet = 0.0 if calm is None or not main else min(calm or 0.5 * main, main)
        if quiet > (both or 0.0):
            assert limit == StabilityLimit(
                quiet, "bounded", QUANTIZATION, proved_stiffness=both or 0.0
            )
        elif (wall or 0.0) > (both or 0.0):
            assert limit == StabilityLimit(
                wall, "plausible", "w", 2.0, proved_stiffness=both or 0.0
            )
        elif both is None:
            assert limit == StabilityLimit(wall, "none")
        else:
            assert limit == StabilityLimit(
                both, "proved" if both else "none", DELAY if both else "", proved_stiffness=both
            )


def test_sampled_number_gives_no_proved_limit() -> None:
    loop = make_loop(damping=Fraction(1), delay=2)
    sampled = {
        DELAY: make_criterion(DELAY, None, 3.0),
        QUANTIZATION: make_criterion(QUANTIZATION, INF),
        WALL_TEST: make_criterion("w", None),
    }
    assert judgement.stability_limit(loop, sampled) == StabilityLimit(
        3.0, "proved", DELAY, None, sampled=True
    )
    with_wall_test = sampled | {WALL_TEST: make_criterion("w", None, 4.0)}
    assert judgement.stability_limit(loop, with_wall_test) == StabilityLimit(
        4.0, "plausible", "w", 2.0, sampled=True
    )


@pytest.mark.parametrize(
    "more",
    [
        {"obstacle": Obstacle.JUMPS, "delay": 0},
        {"delay": None},
        {"delay": 0, "wall_test": make_wall_test(2.0)},
    ],
)
def test_wall_test_sets_the_limit_when_no_rule_does(more: dict[str, Any]) -> None:
    """Covers an obstacle, an unknown delay, and a cycling wall that contradicts the damping."""
    loop = make_loop(damping=Fraction(1), **more)
    by_name = {name: make_criterion(name, 5.0) for name in (DELAY, ONE_SIDED, QUANTIZATION)}
    limit = judgement.stability_limit(loop, by_name | {WALL_TEST: make_criterion("w", 0.5)})
    assert (limit.stiffness, limit.basis, limit.proved_stiffness) == (0.5, "plausible", 0.0)
    nonconservative = make_loop(conservative=False, delay=0)
    limit = judgement.stability_limit(
        nonconservative,
        by_name | {WALL: make_criterion("k", 0.75), WALL_TEST: make_criterion("w", 9.0)},
    )
    assert limit == StabilityLimit(0.75, "wall gain", "k")


# --- verdicts -------------------------------------------------------------------------------------


def max_oscillation_gain(k: float, slack: float | None, damper: float, delay: int | None) -> float:
    """Return the largest gain of the oscillations in MATH, over 2 ε² sin²(θ/2), without damping."""

    def gain(stiffness: float, d: int, theta: float) -> float:
        return stiffness * math.sin((d + 0.5) * theta) / (2 * math.sin(theta / 2)) - (
            damper * math.cos((d + 1) * theta)
        )

    d = delay or 0
    steps = range(1, d + 2)
    gains = [gain(k, d, math.pi * m / (d + 1)) for m in steps if m % 2]
    if delay is None:
        gains = [gain(k, 0, math.pi)]
    else:
        gains.append(gain(k, d, 1e-7))
    if slack is not None:
        gains += [gain(-slack, d, math.pi * m / (d + 1)) for m in steps if m % 2 == 0]
    return max(gains)


def test_oscillation_that_gains_energy_refutes_passivity() -> None:
    seen = set()
    for k, q, plus, virtual, delay, loss in product(
        (1.0, 2.0),
        (1.0, 4.0),
        (1.0, 3.0),
        (None, -1.0, 1.0),
        (None, 0, 1, 2, 3),
        (None, 0.0, 0.5, 1.0, 1.5, 2.5, 4.0, 9.0),
    ):
        loop = make_loop(
            k,
            q=number(max(q, plus)),
            one_sided=number(plus),
            virtual_damping=to_fraction(virtual),
            delay=delay,
            damping=to_fraction(loss),
        )
        slack = k * q if q > plus and delay else None
        gain = max_oscillation_gain(k * plus, slack, virtual or 0.0, delay)
        is_unstable = loss is not None and gain > loss + 1e-9
        assert judgement._find_unstable_motion(loop) is (
            Ground.GAINS_ENERGY if is_unstable else None
        )
        seen.add(None if loss is None else math.copysign(1.0, round(gain - loss, 9)) * (gain > 0))
    assert {-1.0, 1.0, None} <= seen


def test_cycling_wall_and_unbounded_slack_refute_without_damping_data() -> None:
    test = make_wall_test(2.0)
    for stiffness, refuted in ((1.99, False), (2.0, True), (3.0, True)):
        ground = judgement._find_unstable_motion(make_loop(stiffness, wall_test=test))
        assert ground is (Ground.WALL_CYCLED if refuted else None)
    slack = number(INF)
    for delay, plus, refuted in (
        (None, 1.0, False),
        (0, 1.0, False),
        (1, 1.0, True),
        (1, INF, False),
    ):
        ground = judgement._find_unstable_motion(
            make_loop(q=slack, one_sided=number(plus), delay=delay)
        )
        assert ground is (Ground.GAINS_ENERGY_REGARDLESS if refuted else None)


def test_damping_that_proves_a_cycling_wall_passive_is_contradictory() -> None:
    """The contradiction is σ₀/T >= K (1/2 + d) for a cycling wall of K; all data must be known."""
    test = make_wall_test(0.5)
    for loss, delay, contradictory in (
        (0.74, 1, False),
        (0.75, 1, True),
        (0.75, 2, False),
        (0.25, 0, True),
        (None, 1, False),
        (9.0, None, False),
    ):
        loop = make_loop(wall_test=test, delay=delay, damping=to_fraction(loss))
        assert is_contradictory(loop) is contradictory
    assert not is_contradictory(make_loop(delay=0, damping=Fraction(9)))
    others: list[dict[str, Any]] = [
        {"virtual_damping": Fraction(1)},
        {"wall_test": replace(test, positions="stepped")},
        {"wall_test": replace(test, update_rate=2.0)},
        {"wall_test": replace(test, positions=None)},
    ]
    for more in others:
        assert make_loop(**{"wall_test": test, **more}).cycling_stiffness is None
    assert make_loop(wall_test=replace(test, update_rate=1.0)).cycling_stiffness == Fraction(1, 2)


def decide(loop: DeviceLoop, buzz: BuzzBound | None = None, **holds: bool | None) -> Any:
    names = {
        "main": (DELAY, VIRTUAL, ONE_SIDED),
        "steps": (QUANTIZATION,),
        "wall": (WALL_TEST,),
        "leak": (LEAK,),
        "friction": (DRY_FRICTION,),
    }
    by_name = {
        name: Criterion(
            name,
            "",
            holds=holds.get(key),
            limit=holds.get(f"{key}_limit"),
            missing=("mass",) if key == "steps" and holds.get("missing") else (),
        )
        for key, group in names.items()
        for name in group
    }
    return judgement.decide_verdict(loop, by_name, buzz)


def test_deciding_criterion_and_ground_of_each_verdict() -> None:
    """The leak decides laws with curl; proofs, then refutations, then the wall test the others."""
    nonconservative = make_loop(conservative=False)
    assert decide(nonconservative, leak=None)[:2] == ("undecided", LEAK)
    assert decide(nonconservative, leak=False)[:2] == ("not passive", LEAK)
    assert decide(nonconservative, leak=False, friction=True)[:2] == ("undecided", DRY_FRICTION)
    proved = make_loop(delay=1, damping=Fraction(100))
    buzz = BuzzBound(1.0, 1.0)
    assert decide(proved, main=True, steps=True) == ("passive", DELAY, Ground.PROVED)
    assert decide(proved, buzz, main=True) == ("bounded", QUANTIZATION, Ground.BOUNDED)
    assert decide(proved, None, main=True) == ("undecided", QUANTIZATION, Ground.UNBOUNDED)
    assert decide(proved, buzz, main=True, missing=True)[2] is Ground.UNBOUNDED
    is_unstable = make_loop(delay=1, damping=Fraction(1, 100))
    assert decide(is_unstable, wall=True) == ("not passive", DELAY, Ground.GAINS_ENERGY)
    test = make_wall_test(0.5)
    assert decide(make_loop(wall_test=test), main=True) == (
        "not passive",
        WALL_TEST,
        Ground.WALL_CYCLED,
    )
    assert decide(make_loop(wall_test=test, delay=1, damping=Fraction(1)), main=True) == (
        "undecided",
        DELAY,
        Ground.CONTRADICTION,
    )
    assert decide(make_loop(damping=Fraction(9)), wall=True)[0] == "plausible"
    barred = make_loop(obstacle=Obstacle.JUMPS)
    assert decide(barred) == ("undecided", DELAY, Ground.CRITERION)
    assert decide(make_loop(), wall_limit=1.0) == ("undecided", WALL_TEST, Ground.DEVICE_UNKNOWN)
    assert decide(make_loop()) == ("undecided", DELAY, Ground.CRITERION)
    well_damped = make_loop(damping=Fraction(9))
    assert decide(well_damped, wall_limit=1.0) == ("undecided", DELAY, Ground.CRITERION)
    damped = {"damping": Fraction(9), "virtual_damping": Fraction(1)}
    assert decide(make_loop(**damped)) == ("undecided", DELAY, Ground.CRITERION)
    assert decide(make_loop(**damped, delay=1)) == ("undecided", VIRTUAL, Ground.CRITERION)
    assert decide(make_loop(damping=Fraction(9), delay=0)) == (
        "undecided",
        ONE_SIDED,
        Ground.CRITERION,
    )
