"""Energy per stroke against the ledger, and against the work of the field on straight lines."""

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
STROKES = Strokes((0.0, 0.0, -1e-3), (20e-3, 0.0, -1e-3), 0.1, count=4)
SERVO, PLANT = Servo(1e-4), Cartesian(0.05, 1.0)
HAND = SpringHand((300.0, 300.0, 300.0), 3.0)


def test_stroke_energies_sum_to_the_ledger() -> None:
    surface = Surface(TEXTURE, "B", 500.0)
    (scan_of_four,) = scan_strokes(
        surface, PLANT, HAND, SERVO, STROKES, speeds=[0.1], depths=[1e-3]
    )
    run = simulate(surface, PLANT, HAND, SERVO, STROKES, STROKES.duration)
    (scan_of_one,) = scan_strokes(
        surface,
        PLANT,
        HAND,
        SERVO,
        Strokes(STROKES.start, STROKES.end, 0.1),
        speeds=[0.1],
        depths=[1e-3],
    )
    # Of four strokes the last two count, one in each direction.
    (scan_of_three,) = scan_strokes(
        surface,
        PLANT,
        HAND,
        SERVO,
        Strokes(STROKES.start, STROKES.end, 0.1, 3),
        speeds=[0.1],
        depths=[1e-3],
    )
    half = simulate(surface, PLANT, HAND, SERVO, STROKES, 2 * STROKES.period)
    summed = np.array(half.ledger.supplied) + 2 * np.array(scan_of_four.energy)
    np.testing.assert_allclose(summed, run.ledger.supplied, rtol=1e-9, atol=1e-15)
    three_strokes = simulate(surface, PLANT, HAND, SERVO, STROKES, 3 * STROKES.period)
    summed = np.array(scan_of_one.energy) + 2 * np.array(scan_of_three.energy)
    np.testing.assert_allclose(summed, three_strokes.ledger.supplied, rtol=1e-9, atol=1e-15)
    steps = np.diff(run.position[2000 * 2 :], axis=0)
    expected = np.sum(run.commanded[2000 * 2 + 1 :] * steps)
    assert 2 * sum(scan_of_four.same_sample) == pytest.approx(
        expected, rel=2e-2
    )  # the first sample differs
    assert scan_of_four.closure < 1e-9


def test_prescribed_motion_gains_the_work_of_the_field() -> None:
    """Along x at constant height the work per stroke agrees with quadrature of the force."""
    surface = Surface(TEXTURE, "A", 500.0)
    (stroke,) = scan_strokes(
        surface, PLANT, PrescribedHand(), Servo(1e-5), STROKES, speeds=[0.05], depths=[0.7e-3]
    )
    assert stroke.energy[0] == 0.0  # A acts along z only
    lateral = Surface(TEXTURE, "G", 500.0)
    strokes = Strokes((0.0, 0.0, 0.0), (20.7e-3, 0.0, 0.0), 0.05, count=4)  # not whole periods
    (stroke,) = scan_strokes(
        lateral, PLANT, PrescribedHand(), Servo(1e-5), strokes, speeds=[0.05], depths=[0.7e-3]
    )
    x = np.linspace(0.0, 20.7e-3, 20_001)
    force = lateral.force(np.column_stack([x, 0.0 * x, np.full_like(x, -0.7e-3)]))[:, 0]
    work = np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(x))
    assert abs(work) > 1e-5
    (single,) = scan_strokes(
        lateral,
        PLANT,
        PrescribedHand(),
        Servo(1e-5),
        Strokes(strokes.start, strokes.end, 0.05),
        speeds=[0.05],
        depths=[0.7e-3],
    )
    assert single.field == pytest.approx(work, rel=1e-6)
    assert single.total == pytest.approx(work, rel=1e-2)
    assert abs(stroke.field) < 1e-9 * abs(work)  # out and back on the same line
    assert not stroke.gains_energy


def test_law_a_gains_energy_and_f_dissipates() -> None:
    """The paper's section V.B, by the exact ledger."""
    plant = Pantograph(joint_damping=4.0e-3)
    hand = SpringHand((300.0, 0.0, 0.0), (3.0, 3.0, 3.0), 0.05, (0.0, 0.0, -1.0))
    strokes = Strokes((-20e-3, 0.0, -1e-3), (20e-3, 0.0, -1e-3), 0.1, count=5)
    servo, texture = Servo(1e-4, position_resolution=15e-6), Sinusoid(0.8e-3, 2e-3)
    scans = {
        law: scan_strokes(
            Surface(texture, law, max_depth=1e-3),
            plant,
            hand,
            servo,
            strokes,
            speeds=[0.1],
            depths=[1e-3],
        )[0]
        for law in "WAFDH"
    }
    assert scans["A"].gains_energy
    assert scans["A"].energy[0] == 0.0
    assert scans["A"].energy[2] > 1e-3
    assert scans["F"].total < -1e-2
    for law in "WFDH":
        assert not scans[law].gains_energy, law


def test_interrupted_stroke_has_no_energy() -> None:
    strokes = Strokes((0.0, 0.0, -1e-3), (0.2, 0.0, -1e-3), 0.1)
    surface = Surface(TEXTURE, "W", 500.0)
    (stroke,) = scan_strokes(
        surface, Pantograph(), HAND, SERVO, strokes, speeds=[0.4], depths=[1e-3]
    )
    assert stroke.stop_message.startswith("left the workspace")
    assert math.isnan(stroke.total)
    assert not stroke.gains_energy
    assert stroke.to_dict()["energy_sum"] is None


def test_lost_contact_is_counted() -> None:
    high = Strokes(
        (0.0, 0.0, 0.0), (20e-3, 0.0, 0.0), 0.1
    )  # contact is lost between the ten crests
    (stroke,) = scan_strokes(
        Surface(TEXTURE, "B", 10.0),
        PLANT,
        PrescribedHand(),
        SERVO,
        high,
        speeds=[0.1],
        depths=[0.0],
    )
    assert stroke.lost_contact == 10.0


def test_scan_of_other_motions_or_speeds_is_an_error() -> None:
    surface = Surface(TEXTURE, "W", 500.0)
    with pytest.raises(ParameterError, match="must be strokes"):
        scan_strokes(
            surface,
            PLANT,
            HAND,
            SERVO,
            Stationary((0, 0, 0)),
            speeds=[0.1],
            depths=[0.0],  # not strokes
        )
    with pytest.raises(ParameterError, match="speeds must be positive"):
        scan_strokes(surface, PLANT, HAND, SERVO, STROKES, speeds=[0.0], depths=[0.0])


def test_slow_loop_gains_its_loop_work() -> None:
    """A closed rectangle, moved slowly and finely sampled: the ledger equals the field's work."""
    from asperity.simulation import Waypoints

    corners = np.array([[0, 0, -1e-4], [7e-4, 0, -1e-4], [7e-4, 0, -5e-4], [0, 0, -5e-4]])
    surface = Surface(TEXTURE, "B", 500.0)
    sides = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    times = np.concatenate([[0.0], np.cumsum(sides)]) / 5e-3
    motion = Waypoints(times, np.vstack([corners, corners[:1]]))
    run = simulate(surface, PLANT, PrescribedHand(), Servo(2e-6), motion, float(times[-1]))
    expected = loop_work(surface, corners)
    assert run.ledger.total - run.ledger.sampling == pytest.approx(expected, rel=2e-4)


# --- the parts of a stroke's energy ---------------------------------------------------------------


def test_whole_cycles_count_without_the_first_stroke() -> None:
    for count, counted in ((1, 1), (2, 2), (3, 2), (4, 2), (5, 4), (6, 4), (7, 6)):
        strokes = np.arange(count)
        np.testing.assert_array_equal(scan._whole_cycles(strokes), strokes[count - counted :])


def test_spread_is_computed_over_cycles() -> None:
    assert scan._cycle_spread(np.array([1.0, 3.0, 7.0, 5.0])) == 2.0  # cycles of 2 and 6
    assert scan._cycle_spread(np.array([4.0])) == 0.0
    assert scan._cycle_spread(np.array([1.0, 2.0, 6.0])) == pytest.approx(np.std([1.0, 2.0, 6.0]))


def test_energy_gain_must_exceed_the_uncertainty() -> None:
    zero = (0.0, 0.0, 0.0)
    stroke = scan.Stroke("A", 1.0, 1.0, 1.0, (1.0, 2.0, 4.0), 0.75, 0.25, 0.5, zero, 0.0, 0.0, "")
    assert not stroke.gains_energy
    assert replace(stroke, field=math.nextafter(0.75, 1.0)).gains_energy
    assert stroke.total == 7.0


def test_field_work_by_simpson_and_trapezoidal_rule() -> None:
    """Simpson's rule is exact for a force that is cubic along each segment."""

    def trace(points: np.ndarray) -> np.ndarray:
        x, y, z = points.T
        return np.column_stack([x**3 + y, x * z, y**2 - 2.0 * z])

    path = np.array([[0.0, 1.0, 2.0], [1.0, -1.0, 2.5], [1.5, 0.0, 0.0], [1.5, 0.0, 0.0]])
    surface: Any = SimpleNamespace(trace=trace)
    fine, coarse = scan.field_work(surface, path)
    for i in range(3):
        segment = path[i + 1] - path[i]
        s = np.linspace(0.0, 1.0, 20_001)
        along = trace(path[i] + s[:, None] * segment) @ segment
        exact = float(np.mean(0.5 * (along[1:] + along[:-1])))
        assert fine[i] == pytest.approx(exact, rel=1e-7, abs=1e-15)
        assert coarse[i] == pytest.approx(0.5 * (along[0] + along[-1]), rel=1e-14, abs=1e-15)


def test_closing_error_of_open_cycles() -> None:
    """Half of the mean distance between their ends times the force at their starts."""
    position, force = np.zeros((9, 3)), np.zeros((9, 3))
    position[:, 0] = [0.0, 5.0, 1.0, 6.0, 4.0, 9.0, 2.0, 7.0, 3.0]
    force[:, 2] = np.arange(1.0, 10.0)
    run: Any = SimpleNamespace(
        position=position, state=np.array([8.0, 0, 0, 0, 0, 0]), applied=force
    )
    starts = np.array([0, 2, 4, 6, 8])
    # Cycles from samples 2 to 6 and from 6 to the end: 1 m at 3 N, 6 m at 7 N.
    assert scan._closing_error(run, starts, 4) == pytest.approx(0.5 * (1.0 * 3.0 + 6.0 * 7.0) / 2.0)
    assert scan._closing_error(run, starts, 2) == pytest.approx(0.5 * 6.0 * 7.0)
    assert scan._closing_error(run, starts[:1], 1) == 0.0
