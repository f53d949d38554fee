"""What is a limit cycle and what is not: cases that a shorter look would get wrong."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.simulation.onset.limit_cycle_definition import Shifted, ends_in_cycle, restlessness

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.simulation import Cartesian, Resonance, Run, Servo, SpringHand, Stationary, simulate
from asperity.simulation.limit_cycles.onset import Onset, find_onset, predict, start_offsets
from asperity.surface import Surface
from asperity.textures import Sinusoid

WALL = Surface(Sinusoid(0.4e-3, 1e-3), "W", stiffness=800.0, max_depth=0.5e-3)
PRESS = SpringHand(50.0, 20.0, 0.05, (0.0, 0.0, -0.5))


def test_damping_behind_a_resonance_is_no_damping_of_the_handle() -> None:
    """The hand's damper acts on the far mass: W breaks the "proved" delay rule if it counts."""
    plant, servo = Cartesian(0.1, 1.0, Resonance(100.0, 0.02)), Servo(1e-3, delay=1)
    found = find_onset(
        WALL, plant, PRESS, servo, Stationary((0.0, 0.0, 0.0)), start=(0.0, 0.0, 1e-3), starts=1,
        duration=1.0,
    )  # fmt: skip
    said = predict(WALL, plant, PRESS, servo, found)
    assert said.damping == pytest.approx(1.0)
    assert not said.violates_delay_rule


def test_a_cycle_whose_two_last_quarters_differ_is_still_a_cycle() -> None:
    """F at 2000 N/m, lag 6: starts "calm down" at 2 s and go on at 220 mm/s for good."""
    from asperity.paper.experiments.experiment_setups import band_setup

    setup = band_setup("F", 2000.0, 6)
    for shift in start_offsets(setup.surface, 24)[::2]:
        way = Shifted(setup.motion, shift)
        begin = np.array(setup.start) + shift

        def run_for(span: float, way: Shifted = way, begin: FloatArray = begin) -> Run:
            return simulate(
                setup.surface, setup.plant, setup.hand, setup.servo, way, span, start=begin
            )

        ended, _run = ends_in_cycle(run_for, setup.duration)
        later = run_for(8.0)
        goes_on = min(restlessness(later, quarter) for quarter in (1, 2, 3)) > 15e-3
        assert ended == goes_on


def test_a_handle_that_never_touches_has_no_limit_cycle() -> None:
    """It swings on the hand's spring in the air, at any stiffness of the wall."""
    found = find_onset(
        WALL, Cartesian(0.05, 0.01), SpringHand(100.0), Servo(2.5e-4), Stationary((0.0, 0.0, 0.02)),
        start=(0.0, 0.0, 0.025), starts=1, duration=0.5,
    )  # fmt: skip
    assert math.isinf(found.cycling)


def test_what_never_cycles_misses_no_rule() -> None:
    found = Onset("W", 0, 5e5, math.inf, 1, 0, (0.0, 0.0, 5e-3), (0.0, 0.0, 6e-3))
    said = predict(WALL, Cartesian(0.1, 1.0), SpringHand(50.0), Servo(1e-3), found)
    assert math.isinf(said.delay_rule)
    assert not said.violates_delay_rule


def test_the_search_goes_up_to_the_highest() -> None:
    loop = (
        WALL, Cartesian(0.1, 1.0, Resonance(100.0, 0.02)), PRESS, Servo(1e-3, delay=1),
        Stationary((0.0, 0.0, 0.0)),
    )  # fmt: skip
    more = {"start": (0.0, 0.0, 1e-3), "starts": 1, "duration": 1.0}
    onset = find_onset(*loop, **more)
    limited = find_onset(*loop, highest=1.2 * onset.cycling, **more)
    assert math.isfinite(limited.cycling)


def test_too_short_a_run_tells_nothing_of_cycles() -> None:
    with pytest.raises(ParameterError, match="duration must be at least 16 samples"):
        find_onset(
            WALL, Cartesian(0.05), PRESS, Servo(1e-3), Stationary((0.0, 0.0, -1e-3)), duration=10e-3
        )
