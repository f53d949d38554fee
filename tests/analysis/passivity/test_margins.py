"""The safety margins equal those of the random admissible loops."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from bench.stress.margins import (
    CEILINGS,
    FACTORS,
    LOOPS,
    MAX_SHARE,
    SEED,
    admissible_loops,
    count_cycles,
    lasting_motion,
    random_loop,
    to_random_rate,
)

from asperity.analysis import characteristic_number, one_sided_number, worst_loop
from asperity.analysis.passivity.recommended_stiffness import (
    NO_MARGIN,
    StabilityLimit,
    load_margins,
    safety_margin,
    unit_starts,
)
from asperity.analysis.passivity.verdict import passivity
from asperity.devices import parse_device
from asperity.laws import LAWS, Law, find_law
from asperity.surface import Surface
from asperity.textures import Sinusoid

PLAUSIBLE = StabilityLimit(1000.0, "plausible", "wall test")


@pytest.mark.parametrize(
    ("letter", "along_lightest", "cycling"),
    [
        (
            "C",
            False,
            (133, 457, 535, 555, 723, 936, 959, 1022, 1166, 1212, 1377, 1456, 1758, 1841, 1948),
        ),
        ("G", True, (693, 749, 751, 806, 1057, 1217, 1342, 1458, 1613, 1715, 1726, 1787, 1954)),
    ],
)
def test_random_loops_reproduce_the_margin(
    letter: str, along_lightest: bool, cycling: tuple[int, ...]
) -> None:
    """``bench.stress.margins`` writes the table; this repeats the loops that cycle and others."""
    margin = load_margins(along_lightest)[find_law(letter)]
    found = count_cycles(letter, margin.factor, 200, SEED + 1, along_lightest)
    assert [one.loop for one in found.motions] == [one for one in cycling if one < 200]
    motions = []
    for loop in (random_loop(SEED + 1, number) for number in cycling):
        wall = loop.wall * (loop.weakest_axis if along_lightest else 1.0)
        q = characteristic_number(loop.surface(letter), 0.05).value
        # In this order: a start that differs by its rounding may end elsewhere.
        motions.append(lasting_motion(loop, letter, margin.factor * wall / q))
    speeds = [motion.speed for motion in motions if motion is not None]
    assert len(speeds) == margin.cycles
    assert max(speeds) == pytest.approx(margin.speed, rel=1e-2)


def test_at_most_one_percent_of_the_loops_cycle_or_the_factor_is_the_least() -> None:
    for along in (False, True):
        margins = load_margins(along_lightest=along)
        assert {law.letter for law in margins} == set(LAWS) - {"W"}
        for margin in margins.values():
            assert margin.factor in {*FACTORS, CEILINGS.get(margin.law, 1.0)}
            assert margin.loops == LOOPS
            assert margin.cycles <= MAX_SHARE * margin.loops or margin.factor == FACTORS[0]


def test_wall_of_k0_rests_in_every_admissible_loop() -> None:
    """Negative control of the study: the wall, proved passive; above its limit it cycles."""
    assert count_cycles("W", 0.95, 100, SEED).cycles == 0
    assert count_cycles("W", 3.0, 100, SEED).share > 0.3


def test_damping_of_a_random_loop_is_that_of_its_wall_test() -> None:
    shares = []
    for number in range(50):
        loop = random_loop(7, number)
        normal = 1.0 / np.linalg.inv(loop.damping)[2, 2]
        assert normal == pytest.approx(loop.wall * (0.5 + loop.delay) * loop.period)
        shares.append(loop.lightest)
    assert 0.15 < min(shares) < 0.4
    assert max(shares) == pytest.approx(1.0)


@pytest.mark.parametrize("letter", "CH")
def test_no_loop_with_steps_moves_above_the_bound_of_its_steps(letter: str) -> None:
    """Encoders of 55 µm and forces of 10 mN: chatter that is felt, but below the bound."""
    loops, steps, felt = admissible_loops(letter, 11), (55e-6, 10e-3), 0
    for loop, q in (next(loops) for _ in range(30)):
        surface = loop.surface(letter).to_stiffness(0.3 * loop.lightest * loop.wall / q)
        data = {
            "damping": float(np.linalg.eigvalsh(loop.damping)[0]),
            "delay_samples": loop.delay,
            "update_rate": 1.0 / loop.period,
            "position_resolution": steps[0],
            "force_resolution": steps[1],
        }
        numbers = characteristic_number(surface), one_sided_number(surface)
        device = parse_device(data, "random")
        buzz = passivity(surface, device, *numbers, worst_loop(surface)).buzz
        assert buzz is not None
        motion = lasting_motion(loop, letter, surface.stiffness, steps)
        felt += motion is not None
        assert motion is None or motion.norm <= buzz.speed
    assert felt > 5


def test_known_lightest_direction_has_its_own_factor() -> None:
    surface = Surface(Sinusoid(1e-4, 1e-3), "H")
    unknown = parse_device({"max_stiffness": "1 kN/m"}, "blind")
    measured = parse_device({"max_stiffness": {"value": 1000.0, "lightest": 0.7}}, "seen")
    assert safety_margin(surface, unknown, PLAUSIBLE) == load_margins()[surface.law]
    assert (
        safety_margin(surface, measured, PLAUSIBLE)
        == load_margins(along_lightest=True)[surface.law]
    )
    for blind, seen in zip(
        load_margins().values(), load_margins(along_lightest=True).values(), strict=True
    ):
        assert blind.factor <= seen.factor


def test_margins_of_proved_limits_the_wall_and_user_defined_laws() -> None:
    device = parse_device({"max_stiffness": "1 kN/m"}, "mine")
    texture = Sinusoid(1e-4, 1e-3)
    proved = StabilityLimit(1000.0, "proved", "delay", proved_stiffness=1000.0)
    assert safety_margin(Surface(texture, "H"), device, proved) == NO_MARGIN
    assert safety_margin(Surface(texture, "W"), device, PLAUSIBLE) == NO_MARGIN
    user_law = Law("V", "own", "vertical", lambda c: c.k * c.depth * c.w)
    least = min(one.factor for one in load_margins().values())
    assert safety_margin(Surface(texture, user_law), device, PLAUSIBLE).factor == least


def test_unit_starts_are_the_factors_of_the_wall_and_what_calibrating_changes() -> None:
    known = {"max_stiffness": {"value": 1000.0, "lightest": 1.0}}
    blind, seen = (
        unit_starts(parse_device(data, "mine")) for data in ({"max_stiffness": "1 kN/m"}, known)
    )
    assert blind.keys() == seen.keys() == set(LAWS)
    assert blind["W"] == seen["W"] == 1000.0
    for starts, along_lightest in ((blind, False), (seen, True)):
        for law, margin in load_margins(along_lightest).items():
            assert starts[law.letter] == pytest.approx(1000.0 * margin.factor, rel=1e-3)
    assert not any(unit_starts(parse_device({"update_rate": "1 kHz"}, "mine")).values())


def test_weakest_axis_is_what_walls_along_the_axes_feel() -> None:
    """Between the lightest direction and the tested one; equal to the first along its axis."""
    for loop in map(partial(random_loop, 7), range(50)):
        needed = loop.wall * (0.5 + loop.delay) * loop.period
        felt = [1.0 / (np.linalg.inv(loop.damping) @ axis @ axis) for axis in np.eye(3)]
        assert loop.weakest_axis == pytest.approx(min(felt) / needed)
        assert loop.lightest - 1e-12 <= loop.weakest_axis <= 1.0 + 1e-12


def test_margin_at_a_risk_is_the_greatest_factor_up_to_which_the_curve_allows_it() -> None:
    for along in (False, True):
        for margin in load_margins(along_lightest=along).values():
            assert margin.curve[0].factor == margin.factor
            assert margin.curve[-1].factor == 1.0
            assert margin.limit_share == margin.curve[-1].cycles / margin.curve_loops
            assert margin.at_risk(0.01) is margin
            five = margin.at_risk(0.05)
            for point in margin.curve[1:]:
                if point.factor <= five.factor:
                    assert point.cycles <= 0.05 * margin.curve_loops
            beyond = [point for point in margin.curve if point.factor > five.factor]
            assert not beyond or beyond[0].cycles > 0.05 * margin.curve_loops
            if five.factor > margin.factor:
                assert (five.loops, five.cycles) == (margin.curve_loops, five.cycles)
    shading = load_margins()[find_law("G")]
    assert (shading.factor, shading.at_risk(0.05).factor, shading.limit_share) == (0.05, 0.3, 0.115)
    assert shading.at_risk(1.0).factor == 1.0


@pytest.mark.parametrize(("letter", "cycling"), [("G", [4, 21, 24, 43, 44]), ("H", [51])])
def test_a_sample_of_the_curve_is_reproduced(letter: str, cycling: list[int]) -> None:
    """The first 60 of the loops of the curve, and at the limit no fewer of them cycle."""
    five = load_margins()[find_law(letter)].at_risk(0.05)
    found = count_cycles(letter, five.factor, 60, SEED + 1)
    assert [one.loop for one in found.motions] == cycling
    assert len(cycling) <= five.cycles <= 0.05 * five.loops
    assert count_cycles(letter, 1.0, 60, SEED + 1).cycles >= found.cycles


def test_loops_of_any_rate_have_the_damping_of_their_wall_test() -> None:
    """Below 1 kHz the damping is that of a wall of K₀ at 1 kHz; K₀ falls with the rate."""
    rates = []
    for number in range(60):
        tested = random_loop(SEED, number)
        loop = to_random_rate(tested, SEED)
        rate = 1.0 / loop.period
        rates.append(rate)
        assert loop.wall == pytest.approx(tested.wall * min(1.0, rate / 1000.0))
        if rate < 1000.0:
            same = replace(tested, period=1e-3).damping
            np.testing.assert_allclose(loop.damping, same, rtol=1e-12)
    assert 100.0 <= min(rates) < 300.0
    assert 3000.0 < max(rates) <= 10_000.0


@pytest.mark.parametrize("letter", ["C", "G"])
def test_a_sample_of_loops_of_any_rate_keeps_the_stated_risk(letter: str) -> None:
    factor = load_margins()[find_law(letter)].factor
    assert count_cycles(letter, factor, 80, SEED + 2, any_rate=True).cycles <= 2
