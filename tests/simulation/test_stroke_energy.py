"""Strokes over the texture of the paper's section V.B: energy gains by the exact ledger."""

from __future__ import annotations

import numpy as np
import pytest

from asperity.simulation import Cartesian, Pantograph, Run, Servo, SpringHand, Strokes, simulate
from asperity.simulation.plants import Plant
from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid

STIFFNESS = 1000.0
TEXTURE = Sinusoid(amplitude=0.8e-3, period=2e-3)
HANDS = {
    "of the experiments": SpringHand(300.0, 3.0, 0.05, (0.0, 0.0, -1.0)),
    "stiff": SpringHand(600.0, 6.0, 0.05, (0.0, 0.0, -1.5)),
    "light": SpringHand(150.0, 2.0, 0.02, (0.0, 0.0, -0.7)),
}
CASES = [(name, speed) for name in HANDS for speed in (0.05, 0.1, 0.2)]


def simulate_stroke(letter: str, hand: str, speed: float, plant: Plant | None = None) -> Run:
    surface = Surface(TEXTURE, letter, STIFFNESS, max_depth=1e-3)
    strokes = Strokes((-0.02, 0.0, 0.0), (0.02, 0.0, 0.0), speed, 3)
    device = Pantograph(joint_damping=4.0e-3) if plant is None else plant
    return simulate(
        surface,
        device,
        HANDS[hand],
        Servo(1e-4),
        strokes,
        strokes.duration,
        start=(-0.02, 0.0, 1e-3),
    )


def sampling_bound(run: Run) -> float:
    """Return ½ k Σ|Δp|²: the most that sampling can add to a conservative field with q⁺ = 1."""
    places = np.vstack([run.position, run.state[:3]])
    return 0.5 * STIFFNESS * float((np.diff(places, axis=0) ** 2).sum())


@pytest.mark.parametrize(("hand", "speed"), CASES)
def test_law_a_gains_energy_in_z_only(hand: str, speed: float) -> None:
    run = simulate_stroke("A", hand, speed)
    x, y, z = run.ledger.supplied
    assert (x, y) == (0.0, 0.0)
    # More than sampling can add: the field itself is not conservative.
    assert z > 0.0
    assert run.energies["supplied"][-1, 2] > 0.0
    if speed <= 0.1:
        assert z > 2.0 * sampling_bound(run)


@pytest.mark.parametrize(("hand", "speed"), CASES)
def test_law_f_dissipates(hand: str, speed: float) -> None:
    run = simulate_stroke("F", hand, speed)
    assert run.ledger.supplied[0] < -5e-3
    assert run.ledger.total < -5e-3
    # Dry friction: the loss per stroke hardly depends on the speed.
    third = len(run.time) // 3
    x = run.energies["supplied"][:, 0]
    strokes = x[[2 * third, -1]] - x[[third, 2 * third]]
    assert strokes.max() / strokes.min() == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("letter", "DH")
@pytest.mark.parametrize(("hand", "speed"), CASES)
def test_laws_d_and_h_gain_less_than_the_sampling_bound(
    letter: str, hand: str, speed: float
) -> None:
    """U(0) = 0 outside, so without delay the work is at most ½ k q⁺ Σ|Δp|², q⁺ = 1."""
    run = simulate_stroke(letter, hand, speed)
    assert run.ledger.total < sampling_bound(run)
    assert run.ledger.total < 0.5e-3


def test_same_sample_sum_has_the_leak_negated() -> None:
    """For a cycling wall the true supply is positive, the paper's same-sample sum negative."""
    wall, servo = Surface(TEXTURE, "W", 4500.0), Servo(1e-4, delay=4)
    strokes = Strokes((0.0, 0.0, -1e-3), (1e-3, 0.0, -1e-3), 0.01)
    hand = SpringHand(300.0, 0.2, 0.0, (0.0, 0.0, -1.0))
    plant = Cartesian(0.02, 1.2)
    run = simulate(wall, plant, hand, servo, strokes, 1.0, start=(0.0, 0.0, 0.0))
    assert np.abs(run.velocity[-1000:, 2]).max() > 5e-3  # it still cycles
    assert run.ledger.total > 0.0
    assert sum(run.ledger.same_sample) < 0.0
    assert run.ledger.total == pytest.approx(run.ledger.dissipated - run.ledger.hand, rel=0.1)
