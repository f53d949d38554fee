"""Buzz of random loops with encoders, friction and delay is within its bound (MATH section 7)."""

from __future__ import annotations

import numpy as np
from bench.stress.random_steps import scenes, shares


def test_buzz_of_random_scenes_does_not_exceed_its_bound() -> None:
    """``python -m bench.stress.random_steps 10000`` runs the same test with more scenes."""
    sampled_scenes = list(scenes(40, 1))
    assert sum(scene.silent for scene in sampled_scenes) >= 5
    ratios = shares(sampled_scenes)
    assert len(ratios) >= 30
    assert sum(share > 0.0 for share in ratios) >= 5  # some scenes buzz
    assert max(ratios) <= 1.0


def test_bound_from_half_of_the_encoder_step_is_exceeded() -> None:
    """Negative control: with half of the encoder step, scenes predicted silent do buzz."""
    halved = list(scenes(40, 1, is_halved=True))
    assert all(scene.silent for scene in halved)
    assert sum(share == np.inf for share in shares(halved)) >= 2
