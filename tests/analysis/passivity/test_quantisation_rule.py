"""No buzz is above its bound: random loops with encoders, friction and delay (MATH section 7)."""

from __future__ import annotations

import numpy as np
from bench.random_steps import scenes, shares


def test_no_buzz_is_above_its_bound() -> None:
    """``python -m bench.simulation --steps 10000`` runs the same with more scenes."""
    some = list(scenes(40, 1))
    assert sum(scene.silent for scene in some) >= 5
    found = shares(some)
    assert len(found) >= 30
    assert sum(share > 0.0 for share in found) >= 5  # some do buzz
    assert max(found) <= 1.0


def test_half_of_the_step_is_detected() -> None:
    """Negative control: with half of the encoder's step a buzz would count as silent."""
    drawn = list(scenes(40, 1, is_halved=True))
    assert all(scene.silent for scene in drawn)
    assert sum(share == np.inf for share in shares(drawn)) >= 2
