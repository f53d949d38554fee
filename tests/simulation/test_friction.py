"""Simulations, onsets and energies with friction."""

from __future__ import annotations

import pytest

from asperity.simulation import Cartesian, Servo, SpringHand
from asperity.simulation.onset import expected_onset
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
