"""Hands: prescribed motion of the handle, and an elastic band on a mass in space."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import trapezoid

from asperity.simulation import (
    BandHand,
    Cartesian,
    PrescribedHand,
    Run,
    Servo,
    SpringHand,
    Stationary,
    Strokes,
    Waypoints,
    simulate,
)
from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid

WAVE = Sinusoid(amplitude=0.3e-3, period=2e-3, phase=0.3)
JOB: dict[str, Any] = {
    "surface": Surface(WAVE, "W", 500.0),
    "plant": Cartesian(0.05, 1.0),
    "servo": Servo(1e-3, delay=1),
    "motion": Strokes((0.0, 0.0, -1e-3), (8e-3, 3e-3, -1e-3), 0.08, 3),
    "duration": 0.4,
}


def run_of(**changes: Any) -> Run:
    return simulate(**{**JOB, **changes})


def test_prescribed_handle_does_the_work_of_the_field() -> None:
    """On a straight stroke through law A's field the work is k ∫ (h - z)⁺ e_z · dp."""
    motion = Waypoints([0.0, 0.2], [[0.0, 0.0, 0.0], [0.3e-3, 0.0, -2e-3]])
    surface = Surface(WAVE, "A", 800.0)
    run = run_of(
        surface=surface, hand=PrescribedHand(), motion=motion, servo=Servo(1e-5), duration=0.2
    )
    t = np.linspace(0.0, 1.0, 200_001)
    depth = np.maximum(0.3e-3 * np.sin(np.pi * 1e3 * 0.3e-3 * t + 0.3) + 2e-3 * t, 0.0)
    work = -2e-3 * 800.0 * float(trapezoid(depth, t))
    assert run.ledger.supplied[2] == pytest.approx(work, rel=1e-4)
    assert run.ledger.supplied[0] == 0.0
    assert run.ledger.hand == pytest.approx(-run.ledger.total, rel=1e-12)
    assert (run.ledger.dissipated, run.ledger.friction) == (0.0, 0.0)
    np.testing.assert_allclose(run.position, motion.at(run.time), atol=1e-15)


@pytest.mark.parametrize("letter", ["B", "F"])
def test_forces_along_a_path_agree_with_surface_trace(letter: str) -> None:
    """The path leaves the surface and returns, so that the law's state is reset."""
    surface = Surface(WAVE, letter, 700.0, friction=0.7, max_deflection=0.4e-3)
    points = [[0.0, 0.0, -1e-3], [3e-3, 1e-3, -1e-3], [3e-3, 1e-3, 1e-3], [4e-3, 2e-3, -1e-3]]
    motion = Waypoints([0.0, 0.1, 0.15, 0.2], points)
    run = run_of(surface=surface, hand=PrescribedHand(), motion=motion, duration=0.2)
    expected = surface.trace(run.position)
    assert 10 < np.count_nonzero(expected[:, 2] == 0.0) < 150
    np.testing.assert_allclose(run.commanded, expected, rtol=1e-12, atol=1e-15)


def test_band_is_in_static_equilibrium_with_the_wall() -> None:
    """At rest k depth equals the band's pull at that length; the ledger holds its energy."""
    band = BandHand(stiffness=200.0, tension=3.0, length=0.08, damping=3.0)
    rest = Stationary((0.0, 0.0, 0.0))
    run = run_of(hand=band, motion=rest, plant=Cartesian(0.02), duration=3.0, servo=Servo(1e-4))
    depth = 3.0 / (500.0 + 200.0)  # 500 d = 3 - 200 d
    assert run.state[2] == pytest.approx(-depth, rel=1e-9)
    ledger = run.ledger
    assert abs(ledger.closure) < 1e-9 * ledger.exchanged
    stretch = 3.0 / 200.0
    assert ledger.stored_before == pytest.approx(0.5 * 200.0 * stretch**2, rel=1e-12)
    assert ledger.stored_after == pytest.approx(0.5 * 200.0 * (stretch - depth) ** 2, rel=1e-6)


def test_band_force_is_nonlinear_in_direction() -> None:
    """Displaced sideways by a similar length, the force follows the sides of the triangle."""
    run = run_of(
        hand=BandHand(damping=0.0),
        motion=Stationary((0.0, 0.0, 0.0)),
        plant=Cartesian(1.0),
        start=(0.06, 0.0, 0.0),
        duration=1e-3,
        surface=Surface(WAVE, "W", 1e-6),
        servo=Servo(1e-3),
    )
    pull = 200.0 * (0.1 - 0.065)  # sides of 0.06, 0.08 and 0.1 m
    np.testing.assert_allclose(
        run.state[3:6], 1e-3 * pull * np.array([-0.6, 0.0, -0.8]), rtol=1e-4, atol=1e-12
    )


@pytest.mark.parametrize("period", [1e-4, 1e-3])
@pytest.mark.parametrize("band", [BandHand(), BandHand(400.0, 0.2)], ids=["taut", "slack"])
@pytest.mark.parametrize("friction", [0.0, 0.02])
def test_energy_ledger_of_a_mass_on_a_band_closes(
    period: float, band: BandHand, friction: float
) -> None:
    coupled = [[0.5, 0.1, 0.0], [0.1, 0.4, 0.0], [0.0, 0.0, 0.3]]
    run = run_of(
        hand=band,
        plant=Cartesian((0.05, 0.04, 0.06), coupled, friction=friction),
        servo=Servo(period, delay=1),
        start=(1e-3, 2e-3, 3e-3),
        surface=Surface(WAVE, "C", 200.0),
    )
    assert not run.stop_message
    assert abs(run.ledger.closure) < 1e-9 * run.ledger.exchanged
    assert (run.ledger.friction < 0.0) == (friction > 0.0)


def test_hand_of_zero_stiffness_leaves_a_free_mass() -> None:
    """Above the wall, with no spring: p = f t²/2m, and the whole work of the hand is kinetic."""
    pull, mass, time = np.array([0.3, -0.2, 0.1]), 0.05, 0.4
    run = run_of(
        hand=SpringHand(stiffness=0.0, force=pull),
        plant=Cartesian(mass),
        motion=Stationary((0.0, 0.0, 5e-3)),
        duration=time,
    )
    np.testing.assert_allclose(
        run.state[:3], [0.0, 0.0, 5e-3] + pull * time**2 / (2.0 * mass), rtol=1e-12
    )
    energy = 0.5 * mass * float(np.square(pull * time / mass).sum())
    assert run.ledger.hand == pytest.approx(energy, rel=1e-12)
