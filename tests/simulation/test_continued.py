"""A run that goes on is the run that was asked for at once."""

from __future__ import annotations

import numpy as np
import pytest

from asperity.errors import ParameterError
from asperity.simulation import Cartesian, Servo, SpringHand, Still, Strokes, simulate
from asperity.simulation.continued import Continued
from asperity.simulation.run import Run, Stop
from asperity.surface import Surface
from asperity.textures import Sinusoid

SURFACE = Surface(Sinusoid(0.2e-3, 2e-3), "F", stiffness=900.0, max_depth=1e-3)
PLANT, HAND = Cartesian(0.05, 1.5), SpringHand((100.0, 100.0, 0.0), 1.0, 0.0, (0.0, 0.0, -1.0))
SERVO = Servo(1e-3, delay=2, position_resolution=5e-6)
WAY = Strokes((0.0, 0.0, -0.5e-3), (4e-3, 1e-3, -0.5e-3), 0.05, count=2)
LOOP = SURFACE, PLANT, HAND, SERVO, WAY


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


def test_a_longer_run_goes_on_bit_for_bit() -> None:
    """Over parts that end within the 256 samples between flushes; what was returned stays."""
    run_for = Continued(*LOOP, start=(1e-4, 0.0, 1e-3), velocity=(0.0, 0.05, 0.0))
    runs = [run_for(span) for span in (0.3, 1.1, 1.1, 17.0)]
    fed = set()
    for run in runs:
        fed.add(run.fed)
        whole = simulate(*LOOP, run.duration, start=(1e-4, 0.0, 1e-3), velocity=(0.0, 0.05, 0.0))
        same(run, whole)
    assert [run.samples for run in runs] == [300, 1100, 1100, 17_000]
    assert not np.array_equal(runs[0].state, runs[1].state)
    assert fed == {True, False}


def test_next_to_nothing_is_made_nothing_at_the_same_samples() -> None:
    """A handle that fades away freely: which sample makes it nothing does not depend on parts."""
    loop = SURFACE, Cartesian(0.05, 40.0), SpringHand(), Servo(1e-3), Still((0.0, 0.0, 1.0))
    run_for = Continued(*loop, start=(0.0, 0.0, 1.0), velocity=(1.0, 0.0, 0.0))
    run_for(0.1)
    run = run_for(0.6)
    same(run, simulate(*loop, 0.6, start=(0.0, 0.0, 1.0), velocity=(1.0, 0.0, 0.0)))
    assert run.table[-1, 4] == 0.0 < run.table[170, 4] < 1e-50


def test_a_run_that_has_ended_does_not_go_on() -> None:
    servo = Servo(1e-3, virtual_damping=-400.0)
    run_for = Continued(SURFACE, PLANT, HAND, servo, WAY, velocity=(0.0, 0.0, -1.0))
    first = run_for(1.0)
    assert first.stop is Stop.DIVERGED
    assert first.samples < 1000
    again = run_for(4.0)
    alike(again, first)
    np.testing.assert_array_equal(again.table, first.table)


def test_what_fits_not_together_is_refused() -> None:
    with pytest.raises(ParameterError, match="plant must be"):
        Continued(SURFACE, HAND, HAND, SERVO, WAY)  # type: ignore[arg-type]  # the point of it
    with pytest.raises(ParameterError, match="duration"):
        Continued(*LOOP)(0.0)
