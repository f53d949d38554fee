"""Limit cycles: cases that a shorter simulation would misjudge."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.simulation.limit_cycle_definition import ShiftedMotion, ends_in_cycle, velocity_spread

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.simulation import Cartesian, Resonance, Run, Servo, SpringHand, Stationary, simulate
from asperity.simulation.onset import Onset, find_onset, predict, start_offsets
from asperity.simulation.trace import COLUMNS, TailStatistics
from asperity.surface import Surface
from asperity.textures import Sinusoid

NAMES = [name for name, _unit in COLUMNS]
WALL = Surface(Sinusoid(0.4e-3, 1e-3), "W", stiffness=800.0, max_depth=0.5e-3)
PRESS = SpringHand(50.0, 20.0, 0.05, (0.0, 0.0, -0.5))


def test_damping_behind_a_resonance_does_not_damp_the_handle() -> None:
    """The hand's damper acts on the far mass: counting it would make W violate the delay rule."""
    plant, servo = Cartesian(0.1, 1.0, Resonance(100.0, 0.02)), Servo(1e-3, delay=1)
    onset = find_onset(
        WALL,
        plant,
        PRESS,
        servo,
        Stationary((0.0, 0.0, 0.0)),
        start=(0.0, 0.0, 1e-3),
        starts=1,
        duration=1.0,
    )
    prediction = predict(WALL, plant, PRESS, servo, onset)
    assert prediction.damping == pytest.approx(1.0)
    assert not prediction.violates_delay_rule


def test_cycle_with_unequal_last_quarters_is_a_cycle() -> None:
    """F at 2000 N/m, delay 6: starts seem to settle at 2 s but cycle at 220 mm/s permanently."""
    from asperity.paper.cycle_experiments import band_setup

    setup = band_setup("F", 2000.0, 6)
    for shift in start_offsets(setup.surface, 24)[::2]:
        motion = ShiftedMotion(setup.motion, shift)
        start = np.array(setup.start) + shift

        def run_for(span: float, motion: ShiftedMotion = motion, start: FloatArray = start) -> Run:
            return simulate(
                setup.surface, setup.plant, setup.hand, setup.servo, motion, span, start=start
            )

        cycles, _run = ends_in_cycle(run_for, setup.duration)
        long_run = run_for(8.0)
        persists = min(velocity_spread(long_run, quarter) for quarter in (1, 2, 3)) > 15e-3
        assert cycles == persists


def test_handle_without_contact_has_no_limit_cycle() -> None:
    """It swings on the hand's spring in the air, whatever the stiffness of the wall."""
    onset = find_onset(
        WALL,
        Cartesian(0.05, 0.01),
        SpringHand(100.0),
        Servo(2.5e-4),
        Stationary((0.0, 0.0, 0.02)),
        start=(0.0, 0.0, 0.025),
        starts=1,
        duration=0.5,
    )
    assert math.isinf(onset.cycling)


def test_loop_that_never_cycles_violates_no_rule() -> None:
    onset = Onset("W", 0, 5e5, math.inf, 1, 0, (0.0, 0.0, 5e-3), (0.0, 0.0, 6e-3))
    prediction = predict(WALL, Cartesian(0.1, 1.0), SpringHand(50.0), Servo(1e-3), onset)
    assert math.isinf(prediction.delay_rule)
    assert not prediction.violates_delay_rule


def test_search_reaches_the_highest_stiffness() -> None:
    loop = (
        WALL,
        Cartesian(0.1, 1.0, Resonance(100.0, 0.02)),
        PRESS,
        Servo(1e-3, delay=1),
        Stationary((0.0, 0.0, 0.0)),
    )
    options = {"start": (0.0, 0.0, 1e-3), "starts": 1, "duration": 1.0}
    onset = find_onset(*loop, **options)
    limited = find_onset(*loop, highest=1.2 * onset.cycling, **options)
    assert math.isfinite(limited.cycling)


def test_too_short_duration_is_an_error() -> None:
    with pytest.raises(ParameterError, match="duration must be at least 16 samples"):
        find_onset(
            WALL, Cartesian(0.05), PRESS, Servo(1e-3), Stationary((0.0, 0.0, -1e-3)), duration=10e-3
        )


def test_tail_statistics_do_not_depend_on_the_chunks() -> None:
    """The same as from the last quarters of the whole table."""
    rng = np.random.default_rng(48)
    for rows in range(8, 64):
        table = rng.normal(size=(rows, len(COLUMNS)))
        tail, row_count = TailStatistics(rows), 0
        for part in np.split(table, np.sort(rng.integers(0, rows + 1, 3))):
            tail.update(part)
            row_count += len(part)
            assert tail.is_complete == (row_count == rows)
        moving = table[rows - rows // 4 :, [NAMES.index(f"v{axis}") for axis in "xyz"]]
        assert tail.velocity_spread == pytest.approx(np.std(moving, axis=0).sum(), abs=1e-15)
        for quarter, part in zip(tail.last_quarters, np.array_split(table, 4)[2:], strict=True):
            values = dict(zip(NAMES, part.T, strict=True))
            supplied = sum(values[f"supplied {axis}"] for axis in "xyz")
            taken = values["lost"] - values["friction"]
            assert quarter.mean_energies == pytest.approx((supplied.mean(), taken.mean()))
            assert quarter.net_spread == pytest.approx((supplied - taken).std(), abs=1e-15)
            extent = sum(values[axis].std() for axis in "xyz")
            assert quarter.position_spread == pytest.approx(extent, abs=1e-15)
            speed = sum(values[f"v{axis}"].std() for axis in "xyz")
            assert quarter.velocity_spread == pytest.approx(speed, abs=1e-15)


@pytest.mark.parametrize(
    ("mass", "damping", "period", "delay"),
    [(3.0, 0.5, 1e-3, 0), (0.3, 0.2, 2.5e-4, 1), (1.0, 0.2, 2.5e-4, 1), (1.0, 0.5, 2.5e-4, 1)],
)
def test_heavy_hands_cycle_where_the_delay_rule_ends(
    mass: float, damping: float, period: float, delay: int
) -> None:
    """They bounce a few times a second, and lose little in each bounce.

    The wall takes and returns many times the loss: parts of a bounce were taken for its supply,
    and the wall was said to cycle at 2 % of the rule or to be quiet at 170 %.
    """
    rule = damping / (period * (0.5 + delay))
    onset = find_onset(
        Surface(Sinusoid(0.2e-3, 1e-3), "W", max_depth=1e-3),
        Cartesian(0.05, damping),
        SpringHand((300.0, 300.0, 0.0), 0.0, mass, (0.0, 0.0, -0.5)),
        Servo(period, delay),
        Stationary((0.0, 0.0, 0.0)),
        start=(0.0, 0.0, 2e-3),
        duration=1.0,
        starts=1,
        tolerance=0.1,
        lowest=20.0,
    )
    assert 0.9 * rule < onset.quiet < onset.cycling < 1.3 * rule
