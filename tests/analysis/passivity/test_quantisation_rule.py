"""Buzz of random loops with encoders, friction and delay is within its bound (MATH section 7)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from bench.stress.random_steps import scenes, shares

from asperity.analysis import characteristic_number, one_sided_number, worst_loop
from asperity.analysis.passivity.verdict import passivity
from asperity.devices import parse_device
from asperity.surface import Surface
from asperity.textures import Sinusoid


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


def test_stiff_friction_of_a_wall_is_counted_in_the_bound_of_its_buzz() -> None:
    """M = σ₀/T - max(k/2, κ/2) = 100 N/m; 22.4 µm to and fro repeat at 44.8 mm/s."""
    surface = Surface(
        Sinusoid(1e-4, 2e-3), "W", 100.0, 2e-4, friction=0.4, presliding_stiffness=3800.0
    )
    data = {"damping": "2 N*s/m", "update_rate": "1 kHz", "delay_samples": 0}
    device = parse_device({**data, "force_resolution": "0.01 N"}, "stepped")
    numbers = characteristic_number(surface), one_sided_number(surface)
    buzz = passivity(surface, device, *numbers, worst_loop(surface)).buzz
    assert buzz is not None
    excess, margin, period = 0.5 * math.sqrt(3.0) * 0.01, 100.0, 1e-3
    assert buzz.speed == pytest.approx(excess / (margin * period))
    assert buzz.power == pytest.approx(excess**2 / (4.0 * margin * period))
    x = 2.24e-5 * (-1.0) ** np.arange(2001)
    path = np.column_stack([x, 0.0 * x, np.full(2001, -5e-3)])
    path[0, 0] = 0.0
    steps = np.diff(path[:, 0])
    force = np.round(surface.trace(path)[:-1, 0] / 0.01) * 0.01
    supplied = float(force @ steps - 2.0 / period * (steps @ steps))
    speed = math.sqrt(np.square(steps[1:]).mean()) / period
    assert 0.040 < speed < buzz.speed
    assert 0.0 < supplied / (period * len(steps)) < buzz.power
