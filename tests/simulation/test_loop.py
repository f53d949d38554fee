"""The closed loop: stability thresholds, energies and convergence that theory predicts."""

from __future__ import annotations

import numpy as np
import pytest

from asperity.checks import FloatArray
from asperity.errors import ParameterError
from asperity.simulation.body import body
from asperity.simulation.exact import exact_step
from asperity.simulation.loop import Servo, Simulation
from asperity.surface import Surface
from asperity.textures.sinusoid import Sinusoid

WAVE = Sinusoid(amplitude=0.2e-3, period=2e-3, phase=0.3, direction=(2.0, 1.0))
PERIOD = 1e-3
MASS, DAMPING = 0.1, 0.8


def pressed(count: int, depth: float) -> FloatArray:
    """A hand that stays at a depth: never out of contact."""
    return np.tile([0.0, 0.0, -depth], (count + 1, 1))


def spectral_radius(stiffness: float, delay: int) -> float:
    """Of one axis z of mass and damping with f = -k z of d samples ago, state (z, v, queue)."""
    step = exact_step(body(MASS, DAMPING), PERIOD)
    phi, gamma = step.motion[np.ix_([2, 5], [2, 5])], step.motion[[2, 5], 8]
    matrix = np.zeros((2 + delay, 2 + delay))
    matrix[:2, :2] = phi
    if delay == 0:
        matrix[:2, 0] -= gamma * stiffness
    else:
        matrix[:2, -1] = gamma
        matrix[2, 0] = -stiffness
        matrix[3:, 2:-1] = np.eye(delay - 1)
    return float(np.abs(np.linalg.eigvals(matrix)).max())


def threshold(delay: int) -> float:
    low, high = 1.0, 1e5
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if spectral_radius(middle, delay) <= 1.0 else (low, middle)
    return low


@pytest.mark.parametrize("delay", range(6))
def test_wall_is_stable_up_to_the_exact_threshold(delay: int) -> None:
    """The sampled loop's own eigenvalues say where W begins to oscillate, to 1e-6."""
    limit = threshold(delay)
    # About DAMPING/((d + 1/2) T), MATH section 4, exact as the mass grows.
    assert limit == pytest.approx(DAMPING / ((delay + 0.5) * PERIOD), rel=0.25)
    assert oscillates(limit * (1 - 1e-6), delay) < 1.0 < oscillates(limit * (1 + 1e-6), delay)


def oscillates(stiffness: float, delay: int) -> float:
    """Ratio of the swing after many samples to that before, by the simulation itself.

    The motion is inside the wall throughout: about a rest at -1 m where a spring of the hand, of
    next to no stiffness, balances the wall.
    """
    surface = Surface(WAVE, "W", stiffness)
    simulation = Simulation(surface, body(MASS, DAMPING), Servo(PERIOD, delay), np.zeros(3))
    one_sample = np.zeros((2, 3))
    simulation.run(one_sample)  # compiled and begun
    matrix = np.zeros((2 + delay, 2 + delay))
    rest = np.array([0.0, 0.0, -1.0])
    for column in range(2 + delay):
        matrix[:, column] = _response(surface, delay, rest, column)
    return float(np.abs(np.linalg.eigvals(matrix)).max())


def _response(surface: Surface, delay: int, rest: FloatArray, column: int) -> FloatArray:
    """Change of (z, v, waiting forces) in one sample for a unit change of one of them."""
    results = []
    for size in (0.0, 1.0):
        simulation = Simulation(surface, body(MASS, DAMPING), Servo(PERIOD, delay), rest)
        queue = np.zeros(delay)  # oldest last
        if column < 2:
            simulation._state[(2, 5)[column]] += size
        else:
            queue[column - 2] += size
        # The slot after the head is applied next, so the oldest force waits there.
        for i in range(delay):
            simulation._queue[delay - i, 2] = queue[i]
        simulation.run(np.zeros((2, 3)))
        waiting = [simulation._queue[(-i) % (delay + 1), 2] for i in range(delay)]
        state = simulation._state
        results.append(np.array([state[2], state[5], *waiting]))
    return np.asarray(results[1] - results[0])


@pytest.mark.parametrize("letter", "WACDEFGH")
def test_every_joule_is_accounted_for(letter: str) -> None:
    surface = Surface(WAVE, letter, 800.0, max_depth=0.4e-3)
    held = body(0.05, 0.5, hand_mass=0.02, hand_stiffness=300.0, hand_damping=2.0)
    servo = Servo(
        1e-4, delay=1, position_resolution=5e-6, force_resolution=5e-3, max_force=3.0,
        virtual_damping=0.2, velocity_share=0.3, friction=0.02,
    )  # fmt: skip
    t = np.arange(5001) * 1e-4
    way = np.stack([0.02 * t, 0.005 * np.sin(9 * t), -1e-3 + 0 * t], axis=-1)
    run = Simulation(surface, held, servo, np.array([0.0, 0.0, 1e-3])).run(way)
    assert abs(run.ledger.closure) < 1e-9 * run.ledger.exchanged
    assert run.ledger.exchanged > 1e-5
    assert not run.diverged
    assert np.abs(run.applied).max() <= 3.0 + 0.01


def test_sampling_adds_half_k_times_the_squared_steps() -> None:
    """The sampling leak of a wall: ½ K Σ|Δp|²; the paper's sum turns it around."""
    surface = Surface(WAVE, "W", 1000.0)
    simulation = Simulation(surface, body(0.05, 0.0), Servo(1e-4), np.array([0.0, 0.0, -1e-3]))
    run = simulation.run(np.zeros((51, 3)))
    steps = np.diff(run.position[:, 2])
    assert run.position[:, 2].max() < 0.0
    leak = 0.5 * 1000.0 * float((steps**2).sum())
    assert run.ledger.sampling == pytest.approx(leak, rel=1e-9)
    # Same-sample sum: work of the field less the leak.
    ends = 0.5 * 1000.0 * (run.position[0, 2] ** 2 - run.position[-1, 2] ** 2)
    assert sum(run.ledger.same_sample) == pytest.approx(ends - leak, rel=1e-9)


@pytest.mark.parametrize("letter", ["W", "C"])
def test_undamped_energy_drifts_with_the_first_order_of_the_period(letter: str) -> None:
    """A conservative law without losses keeps its energy as T -> 0, with order 1."""
    surface = Surface(WAVE, letter, 1000.0, max_depth=0.4e-3)

    def drift(period: float) -> float:
        begin = np.array([0.1e-3, 0.05e-3, -0.5e-3])
        simulation = Simulation(surface, body(0.05, 0.0), Servo(period), begin)
        simulation.run(np.zeros((round(4e-3 / period) + 1, 3)))
        state = simulation._state
        kinetic = 0.5 * 0.05 * float(state[3:6] @ state[3:6])
        return kinetic + _potential(surface, state[:3]) - _potential(surface, begin)

    periods = [4e-5, 2e-5, 1e-5, 5e-6]
    errors = [abs(drift(period)) for period in periods]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 1.0, atol=0.1)


def _potential(surface: Surface, p: FloatArray) -> float:
    depth = -p[2] if surface.law.letter == "W" else float(WAVE.height([p[:2]])[0]) - p[2]
    return float(0.5 * surface.stiffness * max(depth, 0.0) ** 2)


def test_a_run_goes_on_where_the_last_one_stopped() -> None:
    surface = Surface(WAVE, "F", 500.0)
    held = body(0.05, 0.5, hand_stiffness=300.0)
    servo = Servo(1e-3, delay=2, position_resolution=1e-5, virtual_damping=0.1)
    t = np.arange(201) * 1e-3
    way = np.stack([0.05 * t, 0 * t, -1e-3 + 0 * t], axis=-1)
    whole = Simulation(surface, held, servo, np.zeros(3)).run(way)
    parts = Simulation(surface, held, servo, np.zeros(3))
    first, second = parts.run(way[:91]), parts.run(way[90:])
    np.testing.assert_array_equal(np.concatenate([first.position, second.position]), whole.position)
    assert first.ledger.total + second.ledger.total == pytest.approx(whole.ledger.total, rel=1e-12)
    assert second.time[0] == pytest.approx(0.09)


def test_divergence_is_reported_and_the_trace_kept() -> None:
    surface = Surface(WAVE, "W", 1e9)
    light = body(1e-3, 0.0, hand_stiffness=1e5)
    run = Simulation(surface, light, Servo(1e-2, delay=3), np.array([0.0, 0.0, -1e-3])).run(
        pressed(20_000, 1e-3)
    )
    assert run.diverged
    assert 10 < len(run.time) < 20_000
    assert np.isfinite(run.position).all()


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"period": 0.0}, "period"),
        ({"period": 1e-3, "delay": 1.5}, "delay"),
        ({"period": 1e-3, "delay": -1}, "delay"),
        ({"period": 1e-3, "max_force": 0.0}, "max_force"),
        ({"period": 1e-3, "velocity_share": 0.0}, "velocity_share"),
        ({"period": 1e-3, "friction": -1.0}, "friction"),
    ],
)
def test_bad_servo_is_named(arguments: dict[str, float], named: str) -> None:
    with pytest.raises(ParameterError, match=named):
        Servo(**arguments)  # type: ignore[arg-type]
