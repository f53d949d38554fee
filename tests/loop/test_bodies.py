"""Bodies in space: per-axis kernels against the dense form, energies, dry friction."""

from __future__ import annotations

import numpy as np
import pytest
from tests.helpers.stroked_loops import FULL, HAND, STROKES

from asperity.simulation import (
    BandHand,
    Cartesian,
    Resonance,
    Run,
    Servo,
    SpringHand,
    Stationary,
    simulate,
)
from asperity.simulation.plants import coupled_plant, sampled_plant
from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid

WAVE = Sinusoid(amplitude=0.2e-3, period=2e-3, phase=0.3, direction=(2.0, 1.0))
COUPLED = [[2.0, 0.5, 0.1], [0.5, 1.0, -0.2], [0.1, -0.2, 0.7]]
BODIES = {
    "axes": Cartesian((0.05, 0.04, 0.03), (0.5, 0.3, 0.4)),
    "dry": Cartesian((0.05, 0.04, 0.03), (0.5, 0.3, 0.4), friction=0.02),
    "mode": Cartesian((0.05, 0.04, 0.03), (0.5, 0.3, 0.4), Resonance(300.0, 0.05, 0.4)),
    "dry mode": Cartesian(0.05, 0.4, Resonance(300.0, 0.05, 0.4), friction=0.02),
    "coupled": Cartesian((0.05, 0.04, 0.03), COUPLED),
    "dry coupled": Cartesian((0.05, 0.04, 0.03), COUPLED, friction=0.02),
}


def simulate_strokes(plant: Cartesian, duration: float = 0.3) -> Run:
    surface = Surface(WAVE, "C", 800.0, max_depth=0.4e-3)
    return simulate(surface, plant, HAND, FULL, STROKES, duration, start=(0.0, 0.0, 1e-3))


@pytest.mark.parametrize("kind", BODIES)
def test_energy_ledger_closes_and_agrees_with_the_trace(kind: str) -> None:
    run = simulate_strokes(BODIES[kind])
    ledger, energies = run.ledger, run.energies
    assert abs(ledger.closure) < 1e-9 * ledger.exchanged
    assert ledger.dissipated > 0.0
    assert (ledger.friction < 0.0) == ("dry" in kind)
    # Work of the held force on the true motion, summed from the trace.
    steps = np.diff(run.position, axis=0)
    np.testing.assert_allclose(
        energies["supplied"][1:], np.cumsum(run.applied[:-1] * steps, axis=0), atol=1e-13
    )
    readings = 5e-6 * np.floor(run.position / 5e-6 + 0.5)
    same_sample = np.cumsum(run.commanded[1:] * np.diff(readings, axis=0), axis=0)
    np.testing.assert_allclose(energies["same_sample"][1:], same_sample, atol=1e-13)
    np.testing.assert_array_equal(run.applied[1:], run.commanded[:-1])
    # The energy balance closes at every sample, not only at the end.
    inflow = energies["supplied"].sum(axis=1) + energies["hand"] + energies["friction"]
    gap = energies["stored"] - energies["stored"][0] - inflow + energies["lost"]
    assert np.abs(gap).max() < 1e-9 * ledger.exchanged


@pytest.mark.parametrize("kind", ["axes", "dry", "mode", "dry mode"])
def test_per_axis_kernels_equal_the_dense_form(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The two independent implementations give the same motion."""
    plant = BODIES[kind]
    default = simulate_strokes(plant, 0.05)
    monkeypatch.setattr("asperity.simulation.plants._axis_plant", coupled_plant)
    assert len(sampled_plant(plant, HAND, FULL).record) > 8
    # The stiff spring of a mode costs the dense form some digits.
    tolerance = 1e-9 if plant.resonance else 1e-12
    smooth = Servo(1e-4, delay=1)  # no quantisation, which would amplify rounding
    dense = _simulate_unquantised(plant, smooth)
    monkeypatch.undo()
    per_axis = _simulate_unquantised(plant, smooth)
    scale = np.abs(dense.table).max(axis=0)
    assert (np.abs(per_axis.table - dense.table).max(axis=0) <= tolerance * scale).all()
    assert per_axis.ledger.dissipated == pytest.approx(dense.ledger.dissipated, rel=tolerance)
    assert per_axis.ledger.hand == pytest.approx(dense.ledger.hand, rel=tolerance)
    assert default.samples == 500


def _simulate_unquantised(plant: Cartesian, servo: Servo) -> Run:
    surface = Surface(WAVE, "C", 800.0, max_depth=0.4e-3)
    return simulate(surface, plant, HAND, servo, STROKES, 0.05, start=(0.0, 0.0, 1e-3))


def test_body_slips_when_the_push_exceeds_dry_friction() -> None:
    """Below the friction limit it stays; above it accelerates by the excess."""
    surface, plant = Surface(WAVE, "W", 500.0), Cartesian(0.05, friction=0.5)
    air, servo = Stationary((0.0, 0.0, 0.1)), Servo(1e-3)
    for push, expected in ((0.499, 0.0), (0.7, 0.2 / 0.05 * 0.5)):
        hand = SpringHand(force=(0.6 * push, 0.8 * push, 0.0))
        run = simulate(surface, plant, hand, servo, air, 0.5)
        speed = float(np.hypot(run.state[3], run.state[4]))
        assert speed == pytest.approx(expected, rel=1e-9, abs=1e-15)
        distance = float(np.hypot(run.state[0], run.state[1]))
        assert -run.ledger.friction == pytest.approx(0.5 * distance, rel=1e-9, abs=1e-15)


@pytest.mark.parametrize("kind", ["axes", "mode", "coupled", "band"])
def test_friction_holds_a_body_of_anisotropic_mass(kind: str) -> None:
    """Light along one axis, heavy along another: it neither creeps nor vibrates."""
    plant = Cartesian(
        (0.01, 0.05, 0.5),
        COUPLED if kind == "coupled" else 0.0,
        Resonance(300.0) if kind == "mode" else None,
        friction=0.5,
    )
    # A mass swinging on the spring of a mode pulls with up to twice the push.
    share = 0.5 if kind == "mode" else 1.0
    push = SpringHand(force=(0.2 * share, 0.3 * share, 0.3 * share))
    hand = BandHand(tension=0.45) if kind == "band" else push
    wall, servo, air = Surface(WAVE, "W", 500.0), Servo(1e-3), Stationary((0.0, 0.0, 0.1))
    run = simulate(wall, plant, hand, servo, air, 0.5)
    # The swinging mass moves the body by microns.
    tolerance = 1e-5 if kind == "mode" else 1e-9
    assert np.abs(run.state[:3] - [0.0, 0.0, 0.1]).max() < tolerance
    assert abs(run.ledger.closure) < 1e-9 * max(run.ledger.exchanged, 1e-9)


def test_sliding_body_stops_when_friction_has_dissipated_its_energy() -> None:
    surface, plant = Surface(WAVE, "W", 500.0), Cartesian(0.05, friction=0.5)
    run = simulate(
        surface,
        plant,
        SpringHand(),
        Servo(1e-4),
        Stationary((0.0, 0.0, 0.1)),
        0.2,
        velocity=(0.6, 0.8, 0.0),
    )
    assert np.abs(run.state[3:6]).max() < 1e-15
    distance = float(np.hypot(run.state[0], run.state[1]))
    assert distance == pytest.approx(0.5 * 0.05 / 0.5, rel=1e-3)
    assert run.ledger.friction == pytest.approx(-0.5 * 0.05, rel=1e-12)
