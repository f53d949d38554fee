"""Simulations, onsets and energies with friction."""

from __future__ import annotations

import pytest

from asperity.simulation import Cartesian, PrescribedHand, Servo, SpringHand, Strokes, simulate
from asperity.simulation.onset import expected_onset
from asperity.simulation.scan import scan_strokes
from asperity.surface import Surface
from asperity.textures import Sinusoid

WAVE = Sinusoid(1e-4, 1e-3)
HAND = SpringHand(force=(0.0, 0.0, -1.0))


@pytest.mark.parametrize(
    ("law", "friction", "limit"),
    [
        ("H", {}, 2000.0 / 2.5),
        ("H", {"friction": 0.4}, 2000.0 / (2.5 + 3.5 / 4)),
        ("H", {"friction": 0.4, "presliding_stiffness": 100.0}, (2000.0 - 350.0) / 2.5),
        ("W", {"friction": 0.4}, 2000.0 / 2.5),
        ("H", {"friction": 0.4, "presliding_stiffness": 1000.0}, None),
    ],
)
def test_expected_onset_counts_friction(
    law: str, friction: dict[str, float], limit: float | None
) -> None:
    surface = Surface(WAVE, law, **friction)  # type: ignore[arg-type]  # by name
    servo = Servo(1e-3, delay=2)
    onset = expected_onset(surface, Cartesian(0.1, 2.0), HAND, servo, (0.0, 0.0, 1e-4))
    assert onset == (None if limit is None else pytest.approx(limit, rel=1e-6))


def test_energy_of_slip_and_deflection_on_a_wall() -> None:
    """Four strokes at constant depth: each but the first slides by its length less 2 μ N/κ."""
    surface = Surface(WAVE, "W", 1000.0, 2e-4, friction=0.5, presliding_stiffness=500.0)
    depth, length = 1e-4, 2e-3
    strokes = Strokes((0.0, 0.0, -depth), (length, 0.0, -depth), speed=0.02, count=4)
    servo = Servo(2e-4)
    run = simulate(surface, Cartesian(0.1), PrescribedHand(), servo, strokes, strokes.duration)
    force = 0.5 * 1000.0 * depth
    reach = force / 500.0
    assert run.slipped == pytest.approx(force * (4 * length - 7 * reach), rel=1e-2)
    assert run.deflected == pytest.approx(0.5 * 500.0 * reach**2, rel=1e-2)
    taken = run.slipped + run.deflected
    assert run.ledger.total == pytest.approx(-taken, rel=2e-2)  # holding the force adds 1 %
    assert run.to_dict()["slipped"] == run.slipped
    (stroke,) = scan_strokes(
        surface, Cartesian(0.1), PrescribedHand(), servo, strokes, speeds=[0.02], depths=[depth]
    )
    assert stroke.slipped == run.slipped / 4
    assert not stroke.gains_energy
