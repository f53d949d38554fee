"""Runs that go on side by side are the runs that were asked for one by one, at once."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from asperity.errors import ParameterError
from asperity.simulation import (
    BandHand,
    Cartesian,
    Pantograph,
    Servo,
    SpringHand,
    Still,
    Strokes,
    simulate,
)
from asperity.simulation.kernels.body_functions import LANES
from asperity.simulation.run import Run, Stop
from asperity.simulation.together import Together
from asperity.surface import Surface
from asperity.textures import Sinusoid

SURFACE = Surface(Sinusoid(0.2e-3, 2e-3), "F", stiffness=900.0, max_depth=1e-3)
PLANT, HAND = Cartesian(0.05, 1.5), SpringHand((100.0, 100.0, 0.0), 1.0, 0.0, (0.0, 0.0, -1.0))
SERVO = Servo(1e-3, delay=2, position_resolution=5e-6)
WAY = Strokes((0.0, 0.0, -0.5e-3), (4e-3, 1e-3, -0.5e-3), 0.05, count=2)
LOOP = SURFACE, PLANT, HAND, SERVO


def same(one: Run, whole: Run) -> None:
    """Compare a run that went on with a whole one."""
    np.testing.assert_array_equal(one.table[:, :7], whole.table[:, :7])
    energies, few = whole.energies, one.part("supplied", "taken")
    np.testing.assert_allclose(few[:, 0], energies["supplied"].sum(axis=1), rtol=1e-12, atol=1e-18)
    np.testing.assert_array_equal(few[:, 1], energies["lost"] - energies["friction"])
    assert one.fed == whole.fed
    alike(one, whole)


def alike(one: Run, other: Run) -> None:
    np.testing.assert_array_equal(one.state, other.state)
    assert one.ledger == other.ledger
    assert (one.samples, one.stop, one.place) == (other.samples, other.stop, other.place)
    assert (one.short, one.gap) == (other.short, other.gap)


def test_longer_runs_go_on_bit_for_bit() -> None:
    """Over parts that end within the 256 samples between flushes; what was returned stays."""
    starts = [(1e-4, 0.0, 1e-3), (3e-4, 1e-4, 0.0)]
    runs_for = Together(*LOOP, [WAY, WAY], starts, velocity=(0.0, 0.05, 0.0))
    spans = (0.3, 1.1, 1.1, 17.0)
    found = [runs_for(span) for span in spans]
    fed = set()
    for runs in found:
        for run, start in zip(runs, starts, strict=True):
            fed.add(run.fed)
            same(run, simulate(*LOOP, WAY, run.duration, start=start, velocity=(0.0, 0.05, 0.0)))
    assert [runs[1].samples for runs in found] == [300, 1100, 1100, 17_000]
    assert not np.array_equal(found[0][0].state, found[1][0].state)
    assert fed == {True, False}


def test_next_to_nothing_is_made_nothing_at_the_same_samples() -> None:
    """A handle that fades away freely: which sample makes it nothing does not depend on parts."""
    loop = SURFACE, Cartesian(0.05, 40.0), SpringHand(), Servo(1e-3)
    still = Still((0.0, 0.0, 1.0))
    runs_for = Together(*loop, [still], [(0.0, 0.0, 1.0)], velocity=(1.0, 0.0, 0.0))
    runs_for(0.1)
    (run,) = runs_for(0.6)
    same(run, simulate(*loop, still, 0.6, start=(0.0, 0.0, 1.0), velocity=(1.0, 0.0, 0.0)))
    assert run.table[-1, 4] == 0.0 < run.table[170, 4] < 1e-50


def test_a_run_that_has_ended_does_not_go_on() -> None:
    servo = Servo(1e-3, virtual_damping=-400.0)
    runs_for = Together(SURFACE, PLANT, HAND, servo, [WAY], [None], velocity=(0.0, 0.0, -1.0))
    (first,) = runs_for(1.0)
    assert first.stop is Stop.DIVERGED
    assert first.samples < 1000
    (again,) = runs_for(4.0)
    alike(again, first)
    np.testing.assert_array_equal(again.table, first.table)


def test_what_fits_not_together_is_refused() -> None:
    with pytest.raises(ParameterError, match="plant must be"):
        Together(SURFACE, HAND, HAND, SERVO, [WAY], [None])  # type: ignore[arg-type]  # the point
    with pytest.raises(ParameterError, match="duration"):
        Together(*LOOP, [WAY], [None])(0.0)
    with pytest.raises(ParameterError, match=f"at most {LANES}"):
        Together(*LOOP, [WAY] * (LANES + 1), [None] * (LANES + 1))


# --- a pantograph, whose handles move on together -------------------------------------------------


BAND = BandHand(200.0, 3.0, 0.08, 0.02)
STILL = Still((0.0, 0.0, 0.0))
STARTS = np.array([(1e-4 * i, 0.0, 4e-3 - 1e-3 * i) for i in range(LANES)])
AT_THE_END = SpringHand(0.0, 0.1, 0.0, (0.0, 0.0, 1.0))


@pytest.mark.parametrize(
    ("plant", "hand", "velocity", "above", "period"),
    [
        (Pantograph(), BAND, None, 0.0, 1e-4),
        (Pantograph(friction=0.05), BAND, None, 0.0, 1e-4),  # parts of a sample
        (Pantograph(), BandHand(200.0, 0.5, 0.08, 0.02), (0.0, 0.0, -0.5), 0.0, 1e-4),
        (Pantograph(), SpringHand(300.0, 1.0, 0.01), (6.0, 0.0, 0.0), 0.0, 1e-4),  # shorter steps
        (Pantograph(), AT_THE_END, None, 0.03, 1e-4),
        (Pantograph(inside_only=False), BAND, None, 0.0, 1e-4),
        (Pantograph(), BAND, None, 0.0, 1e-3),
    ],
    ids=["plain", "friction", "slack", "fast", "leaves", "brakes always on", "slow servo"],
)
def test_handles_that_move_together_move_as_alone(
    plant: Pantograph, hand: Any, velocity: Any, above: float, period: float
) -> None:
    surface = Surface(Sinusoid(0.8e-3, 1e-3), "W", stiffness=900.0)
    loop = surface, plant, hand, Servo(period, delay=2, position_resolution=15e-6)
    starts = list(STARTS + np.array([0.0, 0.0, above]))
    runs_for = Together(*loop, [STILL] * LANES, starts, velocity=velocity)
    some = runs_for(0.05, [0, 2, 5])
    every = runs_for(0.05), runs_for(0.12, [1, 2, 7])
    for runs, which, span in (
        (some, [0, 2, 5], 0.05), (every[0], range(LANES), 0.05), (every[1], [1, 2, 7], 0.12),
    ):  # fmt: skip
        for run, number in zip(runs, which, strict=True):
            alone = simulate(*loop, STILL, span, start=starts[number], velocity=velocity)
            same(run, alone)
