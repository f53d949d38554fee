"""Energy per stroke: against the ledger, and against what a field gains on a straight line."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from asperity.analysis import loop_work
from asperity.core.errors import ParameterError
from asperity.simulation import (
    Cartesian,
    Pantograph,
    PrescribedHand,
    Servo,
    SpringHand,
    Stationary,
    Strokes,
    scan,
    scan_strokes,
    simulate,
)
from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid

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
        surface, PLANT, PrescribedHand(), Servo(1e-5), WAY, speeds=[0.05], depths=[0.7e-3]
    )
    assert found.energy[0] == 0.0  # A pushes along z only
    lively = Surface(TEXTURE, "G", 500.0)
    way = Strokes((0.0, 0.0, 0.0), (20.7e-3, 0.0, 0.0), 0.05, count=4)  # not whole periods
    (found,) = scan_strokes(
        lively, PLANT, PrescribedHand(), Servo(1e-5), way, speeds=[0.05], depths=[0.7e-3]
    )
    x = np.linspace(0.0, 20.7e-3, 20_001)
    force = lively.force(np.column_stack([x, 0.0 * x, np.full_like(x, -0.7e-3)]))[:, 0]
    work = np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(x))
    assert abs(work) > 1e-5
    (single,) = scan_strokes(
        lively, PLANT, PrescribedHand(), Servo(1e-5), Strokes(way.start, way.end, 0.05),
        speeds=[0.05], depths=[0.7e-3],
    )  # fmt: skip
    assert single.field == pytest.approx(work, rel=1e-6)
    assert single.total == pytest.approx(work, rel=1e-2)
    assert abs(found.field) < 1e-9 * abs(work)  # there and back the same way
    assert not found.gains_energy


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
    assert found["A"].gains_energy
    assert found["A"].energy[0] == 0.0
    assert found["A"].energy[2] > 1e-3
    assert found["F"].total < -1e-2
    for law in "WFDH":
        assert not found[law].gains_energy, law


def test_a_stroke_that_stops_has_no_energy() -> None:
    way = Strokes((0.0, 0.0, -1e-3), (0.2, 0.0, -1e-3), 0.1)
    surface = Surface(TEXTURE, "W", 500.0)
    (found,) = scan_strokes(surface, Pantograph(), HAND, SERVO, way, speeds=[0.4], depths=[1e-3])
    assert found.stop_message.startswith("left the workspace")
    assert math.isnan(found.total)
    assert not found.gains_energy
    assert found.to_dict()["energy_sum"] is None


def test_lost_contact_is_counted() -> None:
    high = Strokes((0.0, 0.0, 0.0), (20e-3, 0.0, 0.0), 0.1)  # ten crests of a law on the surface
    (found,) = scan_strokes(
        Surface(TEXTURE, "B", 10.0),
        PLANT,
        PrescribedHand(),
        SERVO,
        high,
        speeds=[0.1],
        depths=[0.0],
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
            Stationary((0, 0, 0)),
            speeds=[0.1],
            depths=[0.0],  # the point of the test
        )
    with pytest.raises(ParameterError, match="speeds must be positive"):
        scan_strokes(surface, PLANT, HAND, SERVO, WAY, speeds=[0.0], depths=[0.0])


def test_a_slow_loop_gains_what_loop_work_says() -> None:
    """A closed rectangle, moved slowly and finely: the ledger is the field's work."""
    from asperity.simulation import Waypoints

    corners = np.array([[0, 0, -1e-4], [7e-4, 0, -1e-4], [7e-4, 0, -5e-4], [0, 0, -5e-4]])
    surface = Surface(TEXTURE, "B", 500.0)
    sides = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    times = np.concatenate([[0.0], np.cumsum(sides)]) / 5e-3
    way = Waypoints(times, np.vstack([corners, corners[:1]]))
    run = simulate(surface, PLANT, PrescribedHand(), Servo(2e-6), way, float(times[-1]))
    expected = loop_work(surface, corners)
    assert run.ledger.total - run.ledger.sampling == pytest.approx(expected, rel=2e-4)


# --- what a stroke is made of ---------------------------------------------------------------------


def test_whole_turns_count_without_the_first_stroke() -> None:
    for count, kept in ((1, 1), (2, 2), (3, 2), (4, 2), (5, 4), (6, 4), (7, 6)):
        strokes = np.arange(count)
        np.testing.assert_array_equal(scan._whole_cycles(strokes), strokes[count - kept :])


def test_the_spread_is_that_of_turns() -> None:
    assert scan._cycle_spread(np.array([1.0, 3.0, 7.0, 5.0])) == 2.0  # turns of 2 and 6
    assert scan._cycle_spread(np.array([4.0])) == 0.0
    assert scan._cycle_spread(np.array([1.0, 2.0, 6.0])) == pytest.approx(np.std([1.0, 2.0, 6.0]))


def test_a_field_feeds_by_more_than_what_is_unsure() -> None:
    none = (0.0, 0.0, 0.0)
    plain = scan.Stroke("A", 1.0, 1.0, 1.0, (1.0, 2.0, 4.0), 0.75, 0.25, 0.5, none, 0.0, 0.0, "")
    assert not plain.gains_energy
    assert replace(plain, field=math.nextafter(0.75, 1.0)).gains_energy
    assert plain.total == 7.0


def test_work_along_a_path_by_simpson_and_by_trapezia() -> None:
    """Of a force that is cubic along each piece the one is exact, the other is not."""

    def trace(points: np.ndarray) -> np.ndarray:
        x, y, z = points.T
        return np.column_stack([x**3 + y, x * z, y**2 - 2.0 * z])

    path = np.array([[0.0, 1.0, 2.0], [1.0, -1.0, 2.5], [1.5, 0.0, 0.0], [1.5, 0.0, 0.0]])
    stub: Any = SimpleNamespace(trace=trace)
    fine, coarse = scan.field_work(stub, path)
    for i in range(3):
        way = path[i + 1] - path[i]
        s = np.linspace(0.0, 1.0, 20_001)
        along = trace(path[i] + s[:, None] * way) @ way
        exact = float(np.mean(0.5 * (along[1:] + along[:-1])))
        assert fine[i] == pytest.approx(exact, rel=1e-7, abs=1e-15)
        assert coarse[i] == pytest.approx(0.5 * (along[0] + along[-1]), rel=1e-14, abs=1e-15)


def test_turns_that_do_not_close_are_unsure() -> None:
    """Half of the mean distance of their ends times the force where they begin."""
    position, force = np.zeros((9, 3)), np.zeros((9, 3))
    position[:, 0] = [0.0, 5.0, 1.0, 6.0, 4.0, 9.0, 2.0, 7.0, 3.0]
    force[:, 2] = np.arange(1.0, 10.0)
    run: Any = SimpleNamespace(
        position=position, state=np.array([8.0, 0, 0, 0, 0, 0]), applied=force
    )
    begins = np.array([0, 2, 4, 6, 8])
    # Turns from samples 2 to 6 and from there to the end: 1 m at 3 N, 6 m at 7 N.
    assert scan._closing_error(run, begins, 4) == pytest.approx(0.5 * (1.0 * 3.0 + 6.0 * 7.0) / 2.0)
    assert scan._closing_error(run, begins, 2) == pytest.approx(0.5 * 6.0 * 7.0)
    assert scan._closing_error(run, begins[:1], 1) == 0.0
