"""Energy per stroke: against the ledger, and against what a field gains on a straight line."""

from __future__ import annotations

import math

import numpy as np
import pytest

from asperity.analysis import loop_work
from asperity.errors import ParameterError
from asperity.simulation import (
    Cartesian,
    MovedHand,
    Pantograph,
    Servo,
    SpringHand,
    Still,
    Strokes,
    scan_strokes,
    simulate,
)
from asperity.surface import Surface
from asperity.textures.sinusoid import Sinusoid

TEXTURE = Sinusoid(0.4e-3, 2e-3)
WAY = Strokes((0.0, 0.0, -1e-3), (20e-3, 0.0, -1e-3), 0.1, count=4)
SERVO, PLANT = Servo(1e-4), Cartesian(0.05, 1.0)
HAND = SpringHand((300.0, 300.0, 300.0), 3.0)


def test_strokes_add_up_to_the_ledger() -> None:
    surface = Surface(TEXTURE, "B", 500.0)
    (found,) = scan_strokes(surface, PLANT, HAND, SERVO, WAY, speeds=[0.1], depths=[1e-3])
    run = simulate(surface, PLANT, HAND, SERVO, WAY, WAY.duration)
    (first,) = scan_strokes(
        surface, PLANT, HAND, SERVO, Strokes(WAY.start, WAY.end, 0.1), speeds=[0.1], depths=[1e-3]
    )
    # Of four strokes the last two count, there and back; the first three end there.
    (three,) = scan_strokes(
        surface, PLANT, HAND, SERVO, Strokes(WAY.start, WAY.end, 0.1, 3), speeds=[0.1],
        depths=[1e-3],
    )  # fmt: skip
    two = simulate(surface, PLANT, HAND, SERVO, WAY, 2 * WAY.period)
    summed = np.array(two.ledger.supplied) + 2 * np.array(found.energy)
    np.testing.assert_allclose(summed, run.ledger.supplied, rtol=1e-9, atol=1e-15)
    third = simulate(surface, PLANT, HAND, SERVO, WAY, 3 * WAY.period)
    summed = np.array(first.energy) + 2 * np.array(three.energy)
    np.testing.assert_allclose(summed, third.ledger.supplied, rtol=1e-9, atol=1e-15)
    steps = np.diff(run.position[2000 * 2 :], axis=0)
    by_hand = np.sum(run.commanded[2000 * 2 + 1 :] * steps)
    assert 2 * sum(found.same_sample) == pytest.approx(by_hand, rel=2e-2)  # but the first sample
    assert found.closure < 1e-9


def test_a_moved_handle_gains_what_the_field_gives() -> None:
    """Along x at constant height B's work per stroke is that of the field, by quadrature."""
    surface = Surface(TEXTURE, "A", 500.0)
    (found,) = scan_strokes(
        surface, PLANT, MovedHand(), Servo(1e-5), WAY, speeds=[0.05], depths=[0.7e-3]
    )
    assert found.energy[0] == 0.0  # A pushes along z only
    lively = Surface(TEXTURE, "G", 500.0)
    way = Strokes((0.0, 0.0, 0.0), (20.7e-3, 0.0, 0.0), 0.05, count=4)  # not whole periods
    (found,) = scan_strokes(
        lively, PLANT, MovedHand(), Servo(1e-5), way, speeds=[0.05], depths=[0.7e-3]
    )
    x = np.linspace(0.0, 20.7e-3, 20_001)
    force = lively.force(np.column_stack([x, 0.0 * x, np.full_like(x, -0.7e-3)]))[:, 0]
    work = np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(x))
    assert abs(work) > 1e-5
    (single,) = scan_strokes(
        lively, PLANT, MovedHand(), Servo(1e-5), Strokes(way.start, way.end, 0.05),
        speeds=[0.05], depths=[0.7e-3],
    )  # fmt: skip
    assert single.field == pytest.approx(work, rel=1e-6)
    assert single.total == pytest.approx(work, rel=1e-2)
    assert abs(found.field) < 1e-9 * abs(work)  # there and back the same way
    assert not found.feeds


def test_law_a_feeds_and_f_takes() -> None:
    """The paper's section V.B, by the exact ledger."""
    plant = Pantograph(joint_damping=4.0e-3)
    hand = SpringHand((300.0, 0.0, 0.0), (3.0, 3.0, 3.0), 0.05, (0.0, 0.0, -1.0))
    way = Strokes((-20e-3, 0.0, -1e-3), (20e-3, 0.0, -1e-3), 0.1, count=5)
    servo, texture = Servo(1e-4, position_resolution=15e-6), Sinusoid(0.8e-3, 2e-3)
    found = {
        law: scan_strokes(
            Surface(texture, law, max_depth=1e-3), plant, hand, servo, way, speeds=[0.1],
            depths=[1e-3],
        )[0]
        for law in "WAFDH"
    }  # fmt: skip
    assert found["A"].feeds
    assert found["A"].energy[0] == 0.0
    assert found["A"].energy[2] > 1e-3
    assert found["F"].total < -1e-2
    for law in "WFDH":
        assert not found[law].feeds, law


def test_a_stroke_that_stops_has_no_energy() -> None:
    way = Strokes((0.0, 0.0, -1e-3), (0.2, 0.0, -1e-3), 0.1)
    surface = Surface(TEXTURE, "W", 500.0)
    (found,) = scan_strokes(surface, Pantograph(), HAND, SERVO, way, speeds=[0.4], depths=[1e-3])
    assert found.stopped.startswith("left the workspace")
    assert math.isnan(found.total)
    assert not found.feeds
    assert found.to_dict()["energy_sum"] is None


def test_lost_contact_is_counted() -> None:
    high = Strokes((0.0, 0.0, 0.0), (20e-3, 0.0, 0.0), 0.1)  # ten crests of a law on the surface
    (found,) = scan_strokes(
        Surface(TEXTURE, "B", 10.0), PLANT, MovedHand(), SERVO, high, speeds=[0.1], depths=[0.0]
    )
    assert found.lost_contact == 10.0


def test_only_strokes_are_scanned() -> None:
    surface = Surface(TEXTURE, "W", 500.0)
    with pytest.raises(ParameterError, match="must be strokes"):
        scan_strokes(
            surface,
            PLANT,
            HAND,
            SERVO,
            Still((0, 0, 0)),
            speeds=[0.1],
            depths=[0.0],  # the point of the test
        )
    with pytest.raises(ParameterError, match="speeds must be positive"):
        scan_strokes(surface, PLANT, HAND, SERVO, WAY, speeds=[0.0], depths=[0.0])


def test_a_slow_loop_gains_what_loop_work_says() -> None:
    """A closed rectangle, moved slowly and finely: the ledger is the field's work."""
    from asperity.simulation import Path

    corners = np.array([[0, 0, -1e-4], [7e-4, 0, -1e-4], [7e-4, 0, -5e-4], [0, 0, -5e-4]])
    surface = Surface(TEXTURE, "B", 500.0)
    sides = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    times = np.concatenate([[0.0], np.cumsum(sides)]) / 5e-3
    way = Path(times, np.vstack([corners, corners[:1]]))
    run = simulate(surface, PLANT, MovedHand(), Servo(2e-6), way, float(times[-1]))
    expected = loop_work(surface, corners)
    assert run.ledger.total - run.ledger.sampling == pytest.approx(expected, rel=2e-4)
