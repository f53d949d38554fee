"""The closed loop: stability thresholds, energies and convergence orders predicted by theory."""

from __future__ import annotations

import numpy as np
import pytest
from tests.helpers.stroked_loops import FULL, HAND, STROKES

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.simulation import (
    Cartesian,
    PrescribedHand,
    Run,
    Servo,
    SpringHand,
    Stationary,
    Waypoints,
    simulate,
)
from asperity.simulation.discretization import integrate, linear_body
from asperity.simulation.plants import SampledPlant, sampled_plant
from asperity.simulation.simulate import Simulation
from asperity.simulation.trace import COLUMNS
from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid

WAVE = Sinusoid(amplitude=0.2e-3, period=2e-3, phase=0.3, direction=(2.0, 1.0))
PERIOD = 1e-3
MASS, DAMPING = 0.1, 0.8
PLANT = Cartesian(MASS, DAMPING)


def spectral_radius(stiffness: float, delay: int) -> float:
    """Return that of a mass with damping and f = -k z delayed by d samples, state (z, v, queue)."""
    body = linear_body(PLANT.mass, PLANT.damping, SpringHand())
    change, _loss = integrate(body.dynamics, body.loss, PERIOD)
    phi, gamma = np.eye(2) + change[np.ix_([2, 5], [2, 5])], change[[2, 5], 14]
    matrix = np.zeros((2 + delay, 2 + delay))
    matrix[:2, :2] = phi
    if delay == 0:
        matrix[:2, 0] -= gamma * stiffness
    else:
        matrix[:2, -1] = gamma
        matrix[2, 0] = -stiffness
        matrix[3:, 2:-1] = np.eye(delay - 1)
    return float(np.abs(np.linalg.eigvals(matrix)).max())


def stability_threshold(delay: int) -> float:
    low, high = 1.0, 1e5
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if spectral_radius(middle, delay) <= 1.0 else (low, middle)
    return low


@pytest.mark.parametrize("delay", range(6))
def test_wall_is_stable_up_to_the_exact_threshold(delay: int) -> None:
    """The simulated W becomes unstable at the threshold of the eigenvalues, to 1e-6."""
    limit = stability_threshold(delay)
    # About DAMPING/((d + 1/2) T), exact in the limit of a large mass (MATH section 4).
    assert limit == pytest.approx(DAMPING / ((delay + 0.5) * PERIOD), rel=0.25)
    assert (
        simulated_spectral_radius(limit * (1 - 1e-6), delay)
        < 1.0
        < simulated_spectral_radius(limit * (1 + 1e-6), delay)
    )


def simulated_spectral_radius(stiffness: float, delay: int) -> float:
    """Return the spectral radius of one sample of the simulation itself.

    The motion stays inside the wall, around a rest position at -1 m.
    """
    surface = Surface(WAVE, "W", stiffness)
    matrix = np.zeros((2 + delay, 2 + delay))
    rest = np.array([0.0, 0.0, -1.0])
    for column in range(2 + delay):
        matrix[:, column] = _response(surface, delay, rest, column)
    return float(np.abs(np.linalg.eigvals(matrix)).max())


def _response(surface: Surface, delay: int, rest: FloatArray, column: int) -> FloatArray:
    """Return the change of (z, v, delayed forces) in one sample per unit change of one of them."""
    results = []
    for perturbation in (0.0, 1.0):
        servo = Servo(PERIOD, delay)
        plant = sampled_plant(PLANT, SpringHand(), servo)
        simulation = Simulation(surface, plant, servo, rest, np.zeros(3))
        queue = np.zeros(delay)  # oldest last
        if column < 2:
            simulation.state[(2, 5)[column]] += perturbation
        else:
            queue[column - 2] += perturbation
        # The slot after the head is applied next; it holds the oldest force.
        for i in range(delay):
            simulation.queue[delay - i, 2] = queue[i]
        simulation.run(np.zeros((2, 3)))
        delayed = [simulation.queue[(-i) % (delay + 1), 2] for i in range(delay)]
        state = simulation.state
        results.append(np.array([state[2], state[5], *delayed]))
    return np.asarray(results[1] - results[0])


BODY = Cartesian((0.05, 0.04, 0.03), (0.5, 0.3, 0.4))


def simulate_strokes(letter: str, plant: Cartesian, duration: float = 0.3) -> Run:
    surface = Surface(WAVE, letter, 800.0, max_depth=0.4e-3)
    return simulate(surface, plant, HAND, FULL, STROKES, duration, start=(0.0, 0.0, 1e-3))


@pytest.mark.parametrize("letter", "WACDEFGH")
def test_energy_ledger_closes(letter: str) -> None:
    run = simulate_strokes(letter, BODY)
    assert abs(run.ledger.closure) < 1e-9 * run.ledger.exchanged
    assert run.ledger.exchanged > 1e-5
    assert not run.stop_message
    assert np.abs(run.applied).max() <= 3.0 + 0.01


def test_sampling_adds_half_k_times_the_squared_steps() -> None:
    """The sampling leak of a wall is ½ K Σ|Δp|²; the paper's same-sample sum has it negated."""
    surface, rest = Surface(WAVE, "W", 1000.0), Stationary((0.0, 0.0, -1e-3))
    run = simulate(surface, Cartesian(0.05), SpringHand(), Servo(1e-4), rest, 51e-4)
    assert run.position[:, 2].max() < 0.0
    leak = 0.5 * 1000.0 * float((np.diff(run.position[:, 2]) ** 2).sum())
    first, last = run.position[[0, -1], 2]
    # Up to the last sample, like the trace.
    energies = run.energies
    assert energies["sampling"][-1] == pytest.approx(leak, rel=1e-9)
    field = 0.5 * 1000.0 * (first**2 - last**2)
    assert energies["supplied"][-1].sum() == pytest.approx(field + leak, rel=1e-9)
    assert run.ledger.sampling == pytest.approx(leak, rel=1e-9)
    # Same-sample sum: work of the field minus the leak.
    assert sum(run.ledger.same_sample) == pytest.approx(field - leak, rel=1e-9)


@pytest.mark.parametrize("letter", ["W", "C"])
def test_energy_drift_is_of_first_order_in_the_period(letter: str) -> None:
    """A conservative law without losses conserves energy as T -> 0, with order 1."""
    surface = Surface(WAVE, letter, 1000.0, max_depth=0.4e-3)
    start = np.array([0.1e-3, 0.05e-3, -0.5e-3])

    def drift(period: float) -> float:
        run = simulate(
            surface,
            Cartesian(0.05),
            SpringHand(),
            Servo(period),
            Stationary((0.0, 0.0, 0.0)),
            4e-3,
            start=start,
            trace=False,
        )
        kinetic = 0.5 * 0.05 * float(run.state[3:6] @ run.state[3:6])
        return kinetic + _potential(surface, run.state[:3]) - _potential(surface, start)

    periods = [4e-5, 2e-5, 1e-5, 5e-6]
    errors = [abs(drift(period)) for period in periods]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 1.0, atol=0.1)


def _potential(surface: Surface, p: FloatArray) -> float:
    depth = -p[2] if surface.law.letter == "W" else float(WAVE.height([p[:2]])[0]) - p[2]
    return float(0.5 * surface.stiffness * max(depth, 0.0) ** 2)


@pytest.mark.parametrize("letter", "CF")
def test_split_run_equals_whole_run(letter: str) -> None:
    """State, delayed forces, filter and the law's anchor are carried over."""
    surface, servo = Surface(WAVE, letter, 500.0), Servo(1e-3, 2, 1e-5, virtual_damping=0.1)
    plant: SampledPlant = sampled_plant(BODY, HAND, servo)
    anchors = STROKES.at(np.arange(201) * 1e-3)
    rest = np.zeros((2, 3))
    whole = Simulation(surface, plant, servo, *rest)
    table = np.empty((200, len(COLUMNS)))
    whole.run(anchors, table)
    split, split_table = Simulation(surface, plant, servo, *rest), np.empty_like(table)
    split.run(anchors[:91], split_table[:90])
    split.run(anchors[90:], split_table[90:])
    # The trace and the ledger are equal to the bit.
    np.testing.assert_array_equal(split_table, table)
    assert split.ledger() == whole.ledger()


def test_divergence_is_reported_with_its_trace() -> None:
    surface, hand = Surface(WAVE, "W", 1e9), SpringHand(1e5)
    run = simulate(
        surface, Cartesian(1e-3), hand, Servo(1e-2, delay=3), Stationary((0.0, 0.0, -1e-3)), 200.0
    )
    assert run.stop_message == "diverged"
    assert 10 < len(run.time) == run.samples < 20_000
    assert np.isfinite(run.table).all()


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_handle_beyond_all_bounds_has_diverged(axis: int, sign: float) -> None:
    """At 6e5 m/s along an axis, distance and speed sum to the bound of 1e6 after 2/3 s."""
    soft_wall = Surface(WAVE, "W", 1e-9)
    run = simulate(
        soft_wall,
        Cartesian(1.0),
        SpringHand(1e-9),
        Servo(1e-2),
        Stationary((0.0, 0.0, 1.0)),
        2.0,
        velocity=sign * 6e5 * np.eye(3)[axis],
    )
    assert run.stop_message == "diverged"
    assert run.samples == pytest.approx(67, abs=1)


def test_longest_delay_is_accepted() -> None:
    rest = np.zeros((2, 3))
    plant = sampled_plant(PLANT, SpringHand(100.0), Servo(1e-3))
    servo = Servo(1e-3, delay=1_000_000)
    assert len(Simulation(Surface(WAVE, "W"), plant, servo, *rest).queue) == 1_000_001
    with pytest.raises(ParameterError, match="delay"):
        Simulation(Surface(WAVE, "W"), plant, Servo(1e-3, delay=1_000_001), *rest)


def commanded_force(force: tuple[float, float, float], step: float, limit: float) -> FloatArray:
    """Return the servo's command for a force, made by virtual damping of a prescribed motion."""
    start, period = np.array([0.0, 0.0, 1.0]), 0.25
    end = start - period * np.array(force)
    run = simulate(
        Surface(WAVE, "W", 1.0),
        PLANT,
        PrescribedHand(),
        Servo(period, force_resolution=step, max_force=limit, virtual_damping=1.0),
        Waypoints(np.array([0.0, period]), np.array([start, end])),
        2.0 * period,
    )
    return np.asarray(run.commanded[1])


@pytest.mark.parametrize(
    ("force", "limit", "expected"),
    [
        ((0.0, 0.0, 2.0), 0.609375, (0.0, 0.0, 0.59375)),  # 19.5 steps: rounded down, not to 20
        ((0.0, 0.0, -2.0), 0.609375, (0.0, 0.0, -0.59375)),  # towards zero, not down
        ((0.0, 0.0, 0.609375), 0.609375, (0.0, 0.0, 0.59375)),  # at its limit before rounding
        ((3.0, 0.0, -4.0), 1.0, (0.59375, 0.0, -0.78125)),  # of (0.6, 0, -0.8): 19.2, 25.6 steps
        ((0.0, 0.0, 2.0), 0.625, (0.0, 0.0, 0.625)),  # exactly 20 steps
        ((0.0, 0.0, 2.0), 0.623, (0.0, 0.0, 0.59375)),  # 20 steps would exceed it by 0.3 %
        ((0.0, 0.0, 0.609375), 9.0, (0.0, 0.0, 0.625)),  # far from the limit: nearest step
        ((-0.609375, 0.0, 0.0), 9.0, (-0.59375, 0.0, 0.0)),
    ],
)
def test_limited_force_is_rounded_towards_zero(
    force: tuple[float, float, float], limit: float, expected: tuple[float, float, float]
) -> None:
    np.testing.assert_array_equal(commanded_force(force, 1.0 / 32.0, limit), expected)


def test_limit_of_whole_steps_loses_no_step_to_rounding() -> None:
    """In binary, three steps of 0.1 exceed 0.3, and 0.3/0.1 is less than three."""
    assert commanded_force((0.0, 0.0, 2.0), 0.1, 0.3)[2] == pytest.approx(0.3, rel=1e-12)


@pytest.mark.parametrize(
    "direction", [(1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.5, 0.0, 0.25), (-3.0, 0.0, 4.0)]
)
def test_force_is_scaled_to_its_limit_to_rounding(direction: tuple[float, float, float]) -> None:
    """Above the limit its length is the limit, in the same direction; below it is unchanged."""
    limit, unit = 0.625, np.array(direction) / np.linalg.norm(direction)
    for length in (0.626, 0.63, 3.5):
        np.testing.assert_allclose(
            commanded_force(tuple(length * unit), 0.0, limit), limit * unit, rtol=1e-13, atol=1e-16
        )
    for length in (0.5, 0.624, 0.6249):
        np.testing.assert_allclose(
            commanded_force(tuple(length * unit), 0.0, limit), length * unit, rtol=1e-13, atol=1e-16
        )


def test_applied_force_never_exceeds_its_limit() -> None:
    run = simulate(
        Surface(Sinusoid(0.4e-3, 1e-3), "A", 900.0),
        Cartesian(0.05, 1.0),
        SpringHand(200.0, 2.0, 0.0, (0.1, 0.0, -1.5)),
        Servo(2.5e-4, force_resolution=0.02, max_force=0.61),
        Stationary((0.2e-3, 0.0, -0.5e-3)),
        0.1,
    )
    lengths = np.linalg.norm(run.applied, axis=1)
    assert 0.59 < lengths.max() <= 0.61 * (1.0 + 1e-12)


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        ({"period": 0.0}, "period"),
        ({"period": 1e-3, "delay": 1.5}, "delay"),
        ({"period": 1e-3, "delay": -1}, "delay"),
        ({"period": 1e-3, "delay": np.nan}, "delay"),
        ({"period": 1e-3, "max_force": 0.0}, "max_force"),
        ({"period": 1e-3, "max_force": np.nan}, "max_force"),
        ({"period": 1e-3, "velocity_share": 0.0}, "velocity_share"),
        ({"period": 1e-3, "force_resolution": -1.0}, "force_resolution"),
        ({"period": 1e-3, "position_resolution": np.nan}, "position_resolution"),
    ],
)
def test_invalid_servo_argument_is_named_in_the_error(
    arguments: dict[str, float], name: str
) -> None:
    with pytest.raises(ParameterError, match=name):
        Servo(**arguments)
