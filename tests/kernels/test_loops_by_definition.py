"""Every loop as a plain function: the law's arguments at each point, and the stored results."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from asperity.contacts.warm_start import ERROR_BOUND, EVALUATIONS
from asperity.kernels import block_loops, contact_loop, sampler_loops, tick
from asperity.kernels import loop_functions as storing
from asperity.kernels import path_loop as path_loops
from asperity.kernels import point_loops as probe_loops
from asperity.kernels import stateful_loops as anchored_loops
from asperity.kernels.block_loops import BLOCK

COUNT = 2 * BLOCK + 3
RNG = np.random.default_rng(12)
POINTS = RNG.normal(size=(COUNT, 3))
TEXTURE, LAW = object(), object()


def distinct_values(count: int, *arguments: float) -> tuple[float, ...]:
    """Return values that depend on every argument differently."""
    return tuple(
        float(np.dot(arguments, np.cos(np.arange(len(arguments)) + 9.0 * k))) for k in range(count)
    )


def stand_in_law(count: int, calls: list[tuple[Any, ...]] | None = None) -> Any:
    """Return a stand-in for a law's function, which returns values of its arguments."""

    def function(*arguments: Any) -> tuple[float, ...]:
        *numbers, texture, parameters = arguments
        if calls is not None:
            calls.append((texture, parameters))
        return distinct_values(count, *numbers)

    return function


@pytest.mark.parametrize("loops", [probe_loops, block_loops])
@pytest.mark.parametrize("count", [1, BLOCK - 1, BLOCK, COUNT])
def test_law_without_state_gets_zero_deflection(
    loops: Any, count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """D = 0, ∂d/∂p = (1, 0, 1)."""
    points, calls = POINTS[:count], list[Any]()
    monkeypatch.setattr(loops, "probe_force", stand_in_law(3, calls))
    monkeypatch.setattr(loops, "probe_jacobian", stand_in_law(12, calls))
    force, force_with_jacobian = np.full((2, count, 3), np.nan)
    jacobian = np.full((count, 3, 3), np.nan)
    loops.force_batch(points, force, TEXTURE, LAW)
    loops.jacobian_batch(points, force_with_jacobian, jacobian, TEXTURE, LAW)
    assert calls == 2 * count * [(TEXTURE, LAW)]
    for k, point in enumerate(points):
        np.testing.assert_array_equal(force[k], distinct_values(3, *point, 0.0, 0.0))
        expected = distinct_values(12, *point, 0.0, 0.0, 1.0, 0.0, 1.0)
        np.testing.assert_array_equal(force_with_jacobian[k], expected[:3])
        np.testing.assert_array_equal(jacobian[k].ravel(), expected[3:])


@pytest.mark.parametrize("loops", [probe_loops, block_loops])
def test_arrays_of_wrong_shape_are_not_written(loops: Any) -> None:
    points_3d, narrow = np.full((2, 3), np.nan), np.full((2, 2), np.nan)
    square = np.full((2, 3, 3), np.nan)
    for points, out in ((points_3d, narrow), (narrow, points_3d)):
        loops.force_batch(points, out, TEXTURE, LAW)
        loops.jacobian_batch(points, out, square, TEXTURE, LAW)
    for invalid in (np.full((2, 2, 3), np.nan), np.full((2, 3, 2), np.nan)):
        loops.jacobian_batch(points_3d, points_3d.copy(), invalid, TEXTURE, LAW)
        assert np.isnan(invalid).all()
    assert np.isnan(square).all()
    assert np.isnan(points_3d).all()
    assert np.isnan(narrow).all()


def test_law_with_state_gets_its_deflection(monkeypatch: pytest.MonkeyPatch) -> None:
    deflection, sliding = RNG.normal(size=(COUNT, 2)), RNG.random(COUNT) < 0.5
    monkeypatch.setattr(anchored_loops, "probe_force", stand_in_law(3))
    monkeypatch.setattr(anchored_loops, "probe_jacobian", stand_in_law(12))
    force, force_with_jacobian = np.full((2, COUNT, 3), np.nan)
    jacobian = np.full((COUNT, 3, 3), np.nan)
    anchored_loops.force_batch(POINTS, deflection, force, TEXTURE, LAW)
    anchored_loops.jacobian_batch(
        POINTS, deflection, sliding, force_with_jacobian, jacobian, TEXTURE, LAW
    )
    for k, (point, d) in enumerate(zip(POINTS, deflection, strict=True)):
        np.testing.assert_array_equal(force[k], distinct_values(3, *point, *d))
        deflection_derivative = storing.sliding_derivative(*d, bool(sliding[k]))
        expected = distinct_values(12, *point, *d, *deflection_derivative)
        np.testing.assert_array_equal(force_with_jacobian[k], expected[:3])
        np.testing.assert_array_equal(jacobian[k].ravel(), expected[3:])


def test_path_carries_the_state_of_the_law(monkeypatch: pytest.MonkeyPatch) -> None:
    """The anchor is free at the start; error bound and evaluations are those of each tick."""
    states: list[tuple[Any, ...]] = []

    def probe_tick(x: float, y: float, z: float, *rest: Any) -> Any:
        ax, ay, az, held, memory, texture, parameters = rest
        assert (memory[ERROR_BOUND], memory[EVALUATIONS], texture, parameters) == (
            0.0,
            0.0,
            TEXTURE,
            LAW,
        )
        states.append((ax, ay, az, held))
        memory[ERROR_BOUND], memory[EVALUATIONS] = x, y
        return x + y, y + z, z + x, 2.0 * x, 3.0 * y, 5.0 * z, True

    monkeypatch.setattr(path_loops, "probe_tick", probe_tick)
    out, bounds, memory = np.empty((COUNT, 3)), np.empty((COUNT, 2)), np.full(20, np.nan)
    path_loops.path_batch(POINTS, out, bounds, memory, TEXTURE, LAW)
    x, y, z = POINTS.T
    np.testing.assert_array_equal(out, np.column_stack([x + y, y + z, z + x]))
    np.testing.assert_array_equal(bounds, POINTS[:, :2])
    expected = [
        (0.0, 0.0, 0.0, False),
        *((2.0 * a, 3.0 * b, 5.0 * c, True) for a, b, c in POINTS[:-1]),
    ]
    assert states == expected


def test_contact_batch_passes_contacts_in_order(monkeypatch: pytest.MonkeyPatch) -> None:
    depths, derivatives, deflections = (
        RNG.normal(size=5),
        RNG.normal(size=(5, 6)),
        RNG.normal(size=(5, 2)),
    )
    sliding = np.array([True, False, True, False, True])
    monkeypatch.setattr(contact_loop, "contact_jacobian", lambda *g: distinct_values(12, *g[:-1]))
    force, jacobian = np.full((5, 3), np.nan), np.full((5, 3, 3), np.nan)
    contact_loop.contact_batch(
        POINTS, depths, derivatives, deflections, sliding, force, jacobian, LAW
    )
    for k in range(5):
        deflection_derivative = storing.sliding_derivative(*deflections[k], bool(sliding[k]))
        expected = distinct_values(
            12, *POINTS[k], depths[k], *derivatives[k], *deflections[k], *deflection_derivative
        )
        np.testing.assert_array_equal(force[k], expected[:3])
        np.testing.assert_array_equal(jacobian[k].ravel(), expected[3:])


def test_sampler_loops_evaluate_each_point(monkeypatch: pytest.MonkeyPatch) -> None:
    cases = {
        "sample_height": ("height", 1, 2),
        "sample_gradient": ("slope", 3, 2),
        "sample_hessian": ("curvature", 6, 2),
        "closest_point": ("nearest", 5, 3),
    }
    for name, (batch, count, coordinates) in cases.items():

        def sampler(*arguments: Any, count: int = count) -> Any:
            assert arguments[-1] is TEXTURE
            values = distinct_values(count, *arguments[:-1])
            return values if count > 1 else values[0]

        monkeypatch.setattr(sampler_loops, name, sampler)
        columns = 2 if name == "closest_point" else count
        out = np.full((COUNT, columns), np.nan)
        getattr(sampler_loops, f"{batch}_batch")(POINTS, out, TEXTURE)
        expected = [distinct_values(count, *point[:coordinates])[:columns] for point in POINTS]
        np.testing.assert_array_equal(out, expected)


def test_results_are_stored_in_the_row_of_their_point() -> None:
    force, jacobian = np.full((3, 3), np.nan), np.full((3, 3, 3), np.nan)
    storing.store_force(force, 2, (1.0, 2.0, 3.0))
    storing.store_jacobian(force, jacobian, 1, tuple(map(float, range(12))))  # type: ignore[arg-type]  # twelve numbers
    np.testing.assert_array_equal(force[1:], [[0.0, 1.0, 2.0], [1.0, 2.0, 3.0]])
    np.testing.assert_array_equal(jacobian[1], np.arange(3.0, 12.0).reshape(3, 3))
    assert np.isnan(force[0]).all()
    assert np.isnan(jacobian[[0, 2]]).all()


# --- anchors and ticks ----------------------------------------------------------------------------


def test_anchor_sticks_up_to_the_maximum_deflection() -> None:
    assert storing.drag_anchor(3.0, 4.0, False, 9.0, 9.0, 5.0) == (3.0, 4.0, 0.0, 0.0)
    assert storing.drag_anchor(4.0, 6.0, True, 1.0, 2.0, 5.0) == (1.0, 2.0, 3.0, 4.0)
    dragged = storing.drag_anchor(4.0, 6.0, True, 1.0, 2.0, 2.5)
    assert dragged == pytest.approx((2.5, 4.0, 1.5, 2.0), rel=1e-15)
    assert storing.sliding_derivative(3.0, 4.0, False) == (1.0, 0.0, 1.0)
    assert storing.sliding_derivative(0.0, 0.0, True) == (1.0, 0.0, 1.0)
    assert storing.sliding_derivative(3.0, 4.0, True) == pytest.approx(
        (0.64, -0.48, 0.36), rel=1e-15
    )


def settings(**more: float) -> tick.ServoSettings:
    defaults = {
        "position_step": 0.0,
        "force_step": 0.0,
        "max_force": 1e9,
        "virtual_damping": 0.0,
        "velocity_share": 1.0,
        "period": 0.5,
    }
    return tick.ServoSettings(**(defaults | more))


def test_positions_and_forces_are_quantised() -> None:
    for value, step, expected in (
        (0.74, 0.5, 0.5),
        (0.75, 0.5, 1.0),
        (-0.75, 0.5, -0.5),
        (-0.76, 0.5, -1.0),
        (0.74, 0.0, 0.74),
    ):
        assert tick.quantize(value, step) == expected
    assert tick.quantize_force(1.3, -2.8, 0.6, 0.0, 1.0) == (1.3, -2.8, 0.6)
    assert tick.quantize_force(1.3, -2.8, 0.6, 0.5, 99.0) == (1.5, -3.0, 0.5)
    # The squared length of the rounded force is 11.5, equal to the limit up to rounding.
    assert tick.quantize_force(1.3, -2.8, 0.6, 0.5, 11.5) == (1.5, -3.0, 0.5)
    assert tick.quantize_force(1.3, -2.8, 0.6, 0.5, 11.5 * (1.0 - 0.9e-12)) == (1.5, -3.0, 0.5)
    assert tick.quantize_force(1.3, -2.8, 0.6, 0.5, 11.5 * (1.0 - 1.1e-12)) == (1.0, -2.5, 0.5)


def test_subnormal_state_is_flushed_to_zero() -> None:
    state = tick.ServoState(*[1e-60 * (-1.0) ** k for k in range(8)], True, *[1e-60] * 4)
    assert tick.flush_subnormal_state(state) == state
    small = tick.ServoState(*[0.9e-60] * 8, True, *[-0.9e-60] * 4)
    assert tick.flush_subnormal_state(small) == tick.ServoState(held=True)


def test_tick_quantises_damps_limits_and_rounds(monkeypatch: pytest.MonkeyPatch) -> None:
    memory = np.zeros(3)

    def probe_tick(*arguments: Any) -> Any:
        assert arguments == (0.5, -1.0, 2.0, 7.0, 8.0, 6.0, True, memory, TEXTURE, LAW)
        return 3.0, -4.0, 12.0, 0.1, 0.2, 0.3, False

    monkeypatch.setattr(tick, "probe_tick", probe_tick)
    state = tick.ServoState(0.25, -0.5, 1.0, 1.0, 2.0, 3.0, 7.0, 8.0, True, 9.0, 9.0, 9.0, 6.0)

    def next_state(**more: float) -> tick.ServoState:
        servo_settings = settings(position_step=0.5, **more)
        return tick.servo_tick(state, servo_settings, 0.6, -1.1, 2.1, memory, TEXTURE, LAW)

    undamped = next_state(max_force=13.0)
    assert undamped == (0.5, -1.0, 2.0, 1.0, 2.0, 3.0, 0.1, 0.2, False, 3.0, -4.0, 12.0, 0.3)
    assert next_state(max_force=6.5)[9:12] == pytest.approx((1.5, -2.0, 6.0), rel=1e-15)
    assert next_state(max_force=6.5, force_step=4.0)[9:12] == (0.0, 0.0, 4.0)
    # The newest velocities over a period of 0.5 s are 0.5, -1 and 2 m/s.
    velocity = (1.0 + 0.25 * (0.5 - 1.0), 2.0 + 0.25 * (-1.0 - 2.0), 3.0 + 0.25 * (2.0 - 3.0))
    damped = next_state(virtual_damping=2.0, velocity_share=0.25)
    assert damped[3:6] == velocity
    force = (3.0 - 2.0 * velocity[0], -4.0 - 2.0 * velocity[1], 12.0 - 2.0 * velocity[2])
    assert damped[9:12] == force
    initial = tick.initial_servo_state(0.6, -1.1, 2.1, settings(position_step=0.5))
    assert initial == (0.5, -1.0, 2.0, 0, 0, 0, 0, 0, False, 0, 0, 0, 0)
    assert math.isclose(float(np.linalg.norm(next_state(max_force=1e-3)[9:12])), 1e-3)
