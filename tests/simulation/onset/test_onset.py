"""Onsets of limit cycles: against the eigenvalues of a linear loop, and against the criteria."""

from __future__ import annotations

import math
import random
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.simulation.onset.limit_cycle_definition import calms_down, cycles, restlessness

from asperity.core.errors import ParameterError
from asperity.simulation import (
    BandHand,
    Cartesian,
    Pantograph,
    PrescribedHand,
    Servo,
    SpringHand,
    Stationary,
    Strokes,
    find_onset,
    simulate,
)
from asperity.simulation.limit_cycles.onset import (
    expected_onset,
    predict,
    smooth_wall_onset,
    start_offsets,
)
from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid

MASS, DAMPING, PERIOD = 0.05, 3.0, 1e-3
HAND = SpringHand(stiffness=(100.0, 100.0, 0.0), damping=1.0, force=(0.0, 0.0, -1.0))
WALL = Surface(Sinusoid(0.2e-3, 2e-3), "W", max_depth=1e-2)
PLANT, SERVO = Cartesian(MASS, DAMPING), Servo(PERIOD)
REST = Stationary((0.0, 0.0, 0.0))


def growth(stiffness: float, delay: int) -> float:
    """Return the greatest modulus of the eigenvalues of mass, damper and sampled wall along z."""
    b = DAMPING + 1.0
    rate = b / MASS
    fade = math.exp(-rate * PERIOD)
    a = np.array([[1.0, (1.0 - fade) / rate], [0.0, fade]])
    push = np.array([(PERIOD - (1.0 - fade) / rate) / b, (1.0 - fade) / b])
    n = 2 + delay
    whole = np.zeros((n, n))
    whole[:2, :2] = a
    if delay == 0:
        whole[:2, 0] -= stiffness * push
    else:
        whole[:2, 2] = push
        whole[2 : n - 1, 3:n] = np.eye(delay - 1)
        whole[n - 1, 0] = -stiffness
    return float(np.abs(np.linalg.eigvals(whole)).max())


def threshold(delay: int) -> float:
    """Return the stiffness at which the linear loop loses stability [N/m]."""
    low, high = 1.0, 1e6
    for _ in range(60):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if growth(middle, delay) < 1.0 else (low, middle)
    return low


@pytest.mark.parametrize("delay", [0, 2])
def test_the_onset_of_a_wall_is_that_of_its_eigenvalues(delay: int) -> None:
    """A wall that is only left by rebounding keeps the linear threshold, from below."""
    servo = replace(SERVO, delay=delay)
    found = find_onset(
        WALL, PLANT, HAND, servo, REST, start=(0.0, 0.0, -1e-3), duration=1.5, starts=2,
        tolerance=0.01, lowest=100.0,
    )  # fmt: skip
    assert found.quiet < found.cycling <= found.quiet * 1.01 * (1.0 + 1e-12)
    assert 0.97 * threshold(delay) < found.value < 1.03 * threshold(delay)
    assert (found.law, found.delay, found.starts) == ("W", delay, 2)
    assert found.low[2] <= -1e-3 < found.high[2] < 0.1


def test_what_never_cycles_has_no_onset() -> None:
    found = find_onset(
        WALL, PLANT, HAND, SERVO, REST, duration=0.3, starts=1, lowest=10.0, highest=100.0
    )
    assert math.isinf(found.cycling)
    assert math.isinf(found.value)
    assert found.quiet == 100.0  # the highest was tried
    assert found.cycles == 0
    assert found.to_dict()["cycling"] == "inf"


def test_what_always_cycles_has_no_quiet_stiffness() -> None:
    lively = replace(SERVO, virtual_damping=-40.0)  # feeds
    found = find_onset(WALL, PLANT, HAND, lively, REST, duration=0.5, starts=3, lowest=50.0)
    assert (found.quiet, found.cycling, found.value, found.cycles) == (0.0, 50.0, 50.0, 3)


def test_starts_share_out_a_period() -> None:
    surface = Surface(Sinusoid(0.2e-3, 2e-3, direction=(0.6, 0.8)), "A")
    shifts = start_offsets(surface, 4)
    np.testing.assert_allclose(shifts[1], [0.3e-3, 0.4e-3, 0.0], atol=1e-18)
    assert np.all(shifts[0] == 0.0)


def test_restlessness_counts_the_last_quarter() -> None:
    run = simulate(WALL, PLANT, HAND, SERVO, REST, 1.0, velocity=(1.0, 0.0, 0.0))
    by_hand = run.velocity[750:].std(axis=0).sum()
    assert restlessness(run) == pytest.approx(by_hand, rel=1e-12)
    assert not cycles(run)
    assert cycles(run, threshold=0.5 * by_hand)
    assert calms_down(run)


def test_sinking_is_no_cycle() -> None:
    soft = WALL.to_stiffness(1.0)
    run = simulate(soft, PLANT, HAND, SERVO, REST, 0.4)
    assert np.sqrt((run.velocity[300:] ** 2).mean()) > 0.1  # it moves
    assert not cycles(run)


def test_a_cycle_does_not_calm_down() -> None:
    lively = replace(SERVO, virtual_damping=-40.0)
    run = simulate(WALL.to_stiffness(500.0), PLANT, HAND, lively, REST, 1.0)
    assert cycles(run)
    assert not calms_down(run)


def test_a_hand_that_moves_to_the_end_is_refused() -> None:
    strokes = Strokes((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), 0.1)
    with pytest.raises(ParameterError, match="must be at rest"):
        find_onset(WALL, PLANT, HAND, SERVO, strokes, duration=0.5)
    with pytest.raises(ParameterError, match="must not prescribe the motion"):
        find_onset(WALL, PLANT, PrescribedHand(), SERVO, REST)
    with pytest.raises(ParameterError, match="starts must be a whole number"):
        find_onset(WALL, PLANT, HAND, SERVO, REST, starts=0)
    with pytest.raises(ParameterError, match="lowest must be positive"):
        find_onset(WALL, PLANT, HAND, SERVO, REST, lowest=0.0)


# --- predictions ----------------------------------------------------------------------------------


def test_the_delay_rule_of_the_wall_in_numbers() -> None:
    for delay in (0, 3):
        servo = replace(SERVO, delay=delay)
        found = find_onset(
            WALL, PLANT, HAND, servo, REST, start=(0.0, 0.0, -1e-3), duration=1.0, starts=1
        )
        said = predict(WALL, PLANT, HAND, servo, found, found)
        budget = (DAMPING + 1.0) / PERIOD
        assert said.damping == pytest.approx(DAMPING + 1.0)
        assert said.delay_rule == pytest.approx(budget / (0.5 + delay))
        assert said.paper_limit == pytest.approx(0.5 * budget)
        assert said.wall_rule == found.quiet
        assert said.depth == pytest.approx(-found.low[2])
        assert said.conservative
        assert not said.violates_delay_rule
        assert not said.violates_wall_rule
        assert smooth_wall_onset([found], delay) is found
        assert smooth_wall_onset([found], delay + 1) is None


def test_a_miss_is_a_miss() -> None:
    """An onset below the rule is called so, whatever made it."""
    lively = replace(SERVO, virtual_damping=-40.0)
    found = find_onset(WALL, PLANT, HAND, lively, REST, duration=0.5, starts=1, lowest=50.0)
    assert predict(WALL, PLANT, HAND, lively, found).violates_delay_rule
    dissipating = Surface(WALL.texture, "F", max_depth=1e-3)
    assert not predict(
        dissipating, PLANT, HAND, lively, found
    ).violates_delay_rule  # nothing was proved


def test_the_damping_of_a_pantograph_is_the_least_where_it_gets() -> None:
    plant = Pantograph(centre=(0.0375, 0.1))
    here = plant.min_damping((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert here == pytest.approx(0.991, abs=2e-3)  # MATH: sigma_0 at (37.5, 100) mm
    wide = plant.min_damping((-5e-3, 0.0, -5e-3), (5e-3, 0.0, 1.0))  # no brakes above z = 0
    assert wide < here
    assert replace(plant, joint_damping=0.0).min_damping((0, 0, 0), (0, 0, 0)) == 0.0
    assert PLANT.min_damping((0, 0, 0), (0, 0, 0), BandHand()) == DAMPING


def test_steps_of_the_encoder_can_break_the_delay_rule() -> None:
    """Just below the rule law H is quiet with exact positions, and not with steps of 15 um."""
    surface = Surface(Sinusoid(0.8e-3, 1e-3), "H", max_depth=1e-3)
    plant, hand, start = Pantograph(centre=(0.0375, 0.1)), BandHand(), (0.0, 0.0, 4e-3)
    found = {}
    for step in (0.0, 15e-6):
        servo = Servo(1e-4, position_resolution=step)
        onset = find_onset(
            surface, plant, hand, servo, REST, start=start, duration=0.5, starts=24,
            tolerance=0.1, lowest=18_221.0, highest=18.5e3,
        )  # fmt: skip
        found[step] = predict(surface, plant, hand, servo, onset)
    assert math.isinf(found[0.0].onset.cycling)
    assert not found[0.0].violates_delay_rule
    assert 19e3 < found[0.0].delay_rule < 21e3
    assert found[15e-6].violates_delay_rule


@pytest.mark.parametrize("seed", range(5))
def test_from_the_prediction_the_same_onset_is_found(seed: int) -> None:
    """Random loops: a heavier or lighter handle, damped more or less, laws, textures, delays."""
    draw = random.Random(seed)
    law = draw.choice("WABC")
    texture = Sinusoid(draw.uniform(0.05e-3, 0.4e-3), draw.uniform(1e-3, 3e-3))
    surface = Surface(texture, law, max_depth=0.5e-3)
    plant = Cartesian(draw.uniform(0.03, 0.2), draw.uniform(1.0, 6.0))
    servo = Servo(PERIOD, delay=draw.randrange(4))
    start = (0.0, 0.0, texture.amplitude + 1e-3)
    near = expected_onset(surface, plant, HAND, servo, start)
    assert near is not None
    more: dict[str, Any] = {"start": start, "duration": 0.4, "starts": 2, "tolerance": 0.05,
                            "lowest": 20.0}  # fmt: skip
    climbed = find_onset(surface, plant, HAND, servo, REST, **more)
    assert find_onset(surface, plant, HAND, servo, REST, near=near, **more) == climbed


def test_a_loop_without_damping_is_expected_nowhere() -> None:
    loose = replace(HAND, damping=0.0)
    assert expected_onset(WALL, Cartesian(MASS, 0.0), loose, SERVO, (0.0, 0.0, 0.0)) is None
