"""Onsets of limit cycles against the eigenvalues of a linear loop and against the criteria."""

from __future__ import annotations

import math
import random
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.simulation.limit_cycle_definition import (
    is_cycling,
    is_moving,
    is_settling,
    velocity_spread,
)

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
from asperity.simulation.onset import expected_onset, predict, smooth_wall_onset, start_offsets
from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid

MASS, DAMPING, PERIOD = 0.05, 3.0, 1e-3
HAND = SpringHand(stiffness=(100.0, 100.0, 0.0), damping=1.0, force=(0.0, 0.0, -1.0))
WALL = Surface(Sinusoid(0.2e-3, 2e-3), "W", max_depth=1e-2)
PLANT, SERVO = Cartesian(MASS, DAMPING), Servo(PERIOD)
REST = Stationary((0.0, 0.0, 0.0))


def spectral_radius(stiffness: float, delay: int) -> float:
    """Return the greatest modulus of the eigenvalues of mass, damper and sampled wall along z."""
    b = DAMPING + 1.0
    rate = b / MASS
    decay = math.exp(-rate * PERIOD)
    transition = np.array([[1.0, (1.0 - decay) / rate], [0.0, decay]])
    input_gain = np.array([(PERIOD - (1.0 - decay) / rate) / b, (1.0 - decay) / b])
    size = 2 + delay
    matrix = np.zeros((size, size))
    matrix[:2, :2] = transition
    if delay == 0:
        matrix[:2, 0] -= stiffness * input_gain
    else:
        matrix[:2, 2] = input_gain
        matrix[2 : size - 1, 3:size] = np.eye(delay - 1)
        matrix[size - 1, 0] = -stiffness
    return float(np.abs(np.linalg.eigvals(matrix)).max())


def stability_threshold(delay: int) -> float:
    """Return the stiffness at which the linear loop becomes unstable [N/m]."""
    low, high = 1.0, 1e6
    for _ in range(60):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if spectral_radius(middle, delay) < 1.0 else (low, middle)
    return low


@pytest.mark.parametrize("delay", [0, 2])
def test_wall_onset_agrees_with_eigenvalues(delay: int) -> None:
    """A wall that is left only by rebounding has the linear threshold, approached from below."""
    servo = replace(SERVO, delay=delay)
    onset = find_onset(
        WALL,
        PLANT,
        HAND,
        servo,
        REST,
        start=(0.0, 0.0, -1e-3),
        duration=1.5,
        starts=2,
        tolerance=0.01,
        lowest=100.0,
    )
    assert onset.quiet < onset.cycling <= onset.quiet * 1.01 * (1.0 + 1e-12)
    assert 0.97 * stability_threshold(delay) < onset.value < 1.03 * stability_threshold(delay)
    assert (onset.law, onset.delay, onset.starts) == ("W", delay, 2)
    assert onset.low[2] <= -1e-3 < onset.high[2] < 0.1


def test_heavy_hand_that_bounces_for_long_settles_on_a_cycle() -> None:
    """It bounces down to 130 um at 24 kN/m, for longer than 64 durations; 22 kN/m is the limit."""
    plant = Cartesian(2.51, 1.054)
    servo = Servo(2e-5, delay=2)
    hand = SpringHand(stiffness=(165.0, 165.0, 165.0), damping=0.055, force=(0.0, 0.0, -1.0))
    for stiffness, cycles in ((21e3, False), (24e3, True)):
        onset = find_onset(
            WALL,
            plant,
            hand,
            servo,
            REST,
            start=(0.0, 0.0, 1e-3),
            starts=1,
            lowest=stiffness,
            highest=1.001 * stiffness,
        )
        assert math.isfinite(onset.cycling) is cycles


def test_loop_that_never_cycles_has_infinite_onset() -> None:
    onset = find_onset(
        WALL, PLANT, HAND, SERVO, REST, duration=0.3, starts=1, lowest=10.0, highest=100.0
    )
    assert math.isinf(onset.cycling)
    assert math.isinf(onset.value)
    assert onset.quiet == 100.0  # the highest stiffness was tried
    assert onset.cycles == 0
    assert onset.to_dict()["cycling"] == "inf"


def test_loop_that_always_cycles_has_no_quiet_stiffness() -> None:
    feeding = replace(SERVO, virtual_damping=-40.0)  # adds energy
    onset = find_onset(WALL, PLANT, HAND, feeding, REST, duration=0.5, starts=3, lowest=50.0)
    assert (onset.quiet, onset.cycling, onset.value, onset.cycles) == (0.0, 50.0, 50.0, 3)


def test_start_offsets_divide_one_period_evenly() -> None:
    surface = Surface(Sinusoid(0.2e-3, 2e-3, direction=(0.6, 0.8)), "A")
    shifts = start_offsets(surface, 4)
    np.testing.assert_allclose(shifts[1], [0.3e-3, 0.4e-3, 0.0], atol=1e-18)
    assert np.all(shifts[0] == 0.0)


def test_velocity_spread_is_that_of_the_last_quarter() -> None:
    run = simulate(WALL, PLANT, HAND, SERVO, REST, 1.0, velocity=(1.0, 0.0, 0.0))
    expected = run.velocity[750:].std(axis=0).sum()
    assert velocity_spread(run) == pytest.approx(expected, rel=1e-12)
    assert not is_cycling(run)
    assert is_moving(run, threshold=0.5 * expected)
    assert is_settling(run)


def test_sinking_into_a_soft_wall_is_not_a_cycle() -> None:
    soft = WALL.to_stiffness(1.0)
    run = simulate(soft, PLANT, HAND, SERVO, REST, 0.4)
    assert np.sqrt((run.velocity[300:] ** 2).mean()) > 0.1  # it moves
    assert not is_cycling(run)


def test_limit_cycle_does_not_settle() -> None:
    feeding = replace(SERVO, virtual_damping=-40.0)
    run = simulate(WALL.to_stiffness(500.0), PLANT, HAND, feeding, REST, 1.0)
    assert is_cycling(run)
    assert not is_settling(run)


def test_moving_hands_and_invalid_options_are_errors() -> None:
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


def test_predictions_for_a_wall_have_the_expected_values() -> None:
    for delay in (0, 3):
        servo = replace(SERVO, delay=delay)
        onset = find_onset(
            WALL, PLANT, HAND, servo, REST, start=(0.0, 0.0, -1e-3), duration=1.0, starts=1
        )
        prediction = predict(WALL, PLANT, HAND, servo, onset, onset)
        budget = (DAMPING + 1.0) / PERIOD
        assert prediction.damping == pytest.approx(DAMPING + 1.0)
        assert prediction.delay_rule == pytest.approx(budget / (0.5 + delay))
        assert prediction.paper_limit == pytest.approx(0.5 * budget)
        assert prediction.wall_rule == onset.quiet
        assert prediction.depth == pytest.approx(-onset.low[2])
        assert prediction.conservative
        assert not prediction.violates_delay_rule
        assert not prediction.violates_wall_rule
        assert smooth_wall_onset([onset], delay) is onset
        assert smooth_wall_onset([onset], delay + 1) is None


def test_onset_below_the_delay_rule_is_a_violation() -> None:
    """Whatever causes it; a law without a proof violates nothing."""
    feeding = replace(SERVO, virtual_damping=-40.0)
    onset = find_onset(WALL, PLANT, HAND, feeding, REST, duration=0.5, starts=1, lowest=50.0)
    assert predict(WALL, PLANT, HAND, feeding, onset).violates_delay_rule
    dissipating = Surface(WALL.texture, "F", max_depth=1e-3)
    assert not predict(
        dissipating, PLANT, HAND, feeding, onset
    ).violates_delay_rule  # nothing was proved


def test_pantograph_damping_is_the_least_in_the_visited_box() -> None:
    plant = Pantograph(centre=(0.0375, 0.1))
    at_centre = plant.min_damping((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert at_centre == pytest.approx(0.991, abs=2e-3)  # MATH: sigma_0 at (37.5, 100) mm
    in_box = plant.min_damping((-5e-3, 0.0, -5e-3), (5e-3, 0.0, 1.0))  # no brakes above z = 0
    assert in_box < at_centre
    assert replace(plant, joint_damping=0.0).min_damping((0, 0, 0), (0, 0, 0)) == 0.0
    assert PLANT.min_damping((0, 0, 0), (0, 0, 0), BandHand()) == DAMPING


def test_encoder_steps_can_violate_the_delay_rule() -> None:
    """Just below the rule law H is quiet with exact positions and cycles with steps of 15 µm.

    Such chatter belongs to the encoder: it counts above a threshold that is given, not by default.
    """
    surface = Surface(Sinusoid(0.8e-3, 1e-3), "H", max_depth=1e-3)
    plant, hand, start = Pantograph(centre=(0.0375, 0.1)), BandHand(), (0.0, 0.0, 4e-3)
    predictions = {}
    for step, threshold in ((0.0, 15e-3), (15e-6, 15e-3), (15e-6, None)):
        servo = Servo(1e-4, position_resolution=step)
        onset = find_onset(
            surface,
            plant,
            hand,
            servo,
            REST,
            start=start,
            duration=0.5,
            starts=24,
            tolerance=0.1,
            lowest=18_221.0,
            highest=18.5e3,
            threshold=threshold,
        )
        predictions[step, threshold] = predict(surface, plant, hand, servo, onset)
    for quiet in (predictions[0.0, 15e-3], predictions[15e-6, None]):
        assert math.isinf(quiet.onset.cycling)
        assert not quiet.violates_delay_rule
        assert 19e3 < quiet.delay_rule < 21e3
    assert predictions[15e-6, 15e-3].violates_delay_rule


@pytest.mark.parametrize("seed", range(5))
def test_search_from_the_predicted_onset_finds_the_same_onset(seed: int) -> None:
    """For random masses, dampings, laws, textures and delays."""
    rng = random.Random(seed)
    law = rng.choice("WABC")
    texture = Sinusoid(rng.uniform(0.05e-3, 0.4e-3), rng.uniform(1e-3, 3e-3))
    surface = Surface(texture, law, max_depth=0.5e-3)
    plant = Cartesian(rng.uniform(0.03, 0.2), rng.uniform(1.0, 6.0))
    servo = Servo(PERIOD, delay=rng.randrange(4))
    start = (0.0, 0.0, texture.amplitude + 1e-3)
    near = expected_onset(surface, plant, HAND, servo, start)
    assert near is not None
    options: dict[str, Any] = {
        "start": start,
        "duration": 0.4,
        "starts": 2,
        "tolerance": 0.05,
        "lowest": 20.0,
    }
    expected = find_onset(surface, plant, HAND, servo, REST, **options)
    assert find_onset(surface, plant, HAND, servo, REST, near=near, **options) == expected


def test_undamped_loop_has_no_expected_onset() -> None:
    undamped = replace(HAND, damping=0.0)
    assert expected_onset(WALL, Cartesian(MASS, 0.0), undamped, SERVO, (0.0, 0.0, 0.0)) is None
