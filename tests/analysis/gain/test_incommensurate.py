"""Two waves whose ratio is nearly, but not exactly, rational drift through all of the torus."""

from __future__ import annotations

import math

import numpy as np
import pytest

from asperity.analysis import characteristic_number, one_sided_number
from asperity.surface import Surface
from asperity.textures import plane_waves
from asperity.textures.kinds.fourier import Fourier

A, WAVE, D = 0.05e-3, 2 * math.pi / 1e-3, 0.1e-3
PHASE = 0.3
RATIOS = [2.0 * (1.0 + sign * 10.0**-k) for k in range(6, 16) for sign in (1.0, -1.0)]


def surface(ratio: float, law: str = "C") -> Surface:
    return Surface(Fourier([A, 0.4 * A], [WAVE, ratio * WAVE], [0.0, PHASE]), law, 1000.0, D)


def number_c(first: np.ndarray, second: np.ndarray, ratio: float = 2.0) -> float:
    """The greatest ‖J‖/k of law C over phases: J = -k(w wᵀ + δ diag(h'', 0))."""
    slope = A * WAVE * (np.cos(first) + 0.4 * ratio * np.cos(second))
    hessian = -A * WAVE**2 * (np.sin(first) + 0.4 * ratio**2 * np.sin(second))
    worst = 0.0
    for depth in (0.0, D):
        xx, zz = slope**2 + depth * hessian, 1.0
        middle, apart = 0.5 * (xx + zz), np.hypot(0.5 * (xx - zz), slope)
        worst = max(worst, float((np.abs(middle) + apart).max()))
    return worst


def on_the_torus(ratio: float) -> float:
    """What is reached where the sum goes on for ever: every pair of phases."""
    turn = np.linspace(0.0, 2 * math.pi, 1001)
    return number_c(*np.meshgrid(turn, turn), ratio)


@pytest.mark.parametrize("ratio", RATIOS)
def test_a_ratio_that_is_nearly_two_is_certified_on_the_torus(ratio: float) -> None:
    assert ratio * WAVE != 2.0 * WAVE
    reached = on_the_torus(ratio)
    for number in (characteristic_number, one_sided_number):
        found = number(surface(ratio))
        assert found.method == "certified"
        assert reached <= found.upper <= reached * (1 + 1e-4)
        assert found.lower <= reached * (1 + 1e-4)
    assert not surface(ratio).texture.domain.periodic


def test_a_ratio_of_exactly_two_repeats() -> None:
    locked = surface(2.0)
    turn = np.linspace(0.0, 2 * math.pi, 2_000_001)
    expected = number_c(turn, 2 * turn + PHASE)
    found = characteristic_number(locked)
    assert locked.texture.domain.periodic
    assert found.upper == pytest.approx(expected, rel=1e-6)
    assert expected < on_the_torus(2.0) * (1 - 1e-3)


def test_a_looser_ratio_is_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    """Negative control: what counts as rational up to 1e-9 is certified too low."""
    monkeypatch.setattr(plane_waves, "_ROUNDING", 1e-9)
    ratio = 2.0 * (1.0 + 9e-10)
    assert characteristic_number(surface(ratio)).upper < on_the_torus(ratio) * (1 - 1e-3)


def test_the_extremes_are_those_of_the_torus() -> None:
    """Locked, the crests of the second wave miss those of the first; drifting, they meet."""
    assert surface(2.0).texture.extremes[1] < 1.39 * A
    for ratio in RATIOS:
        low, high = surface(ratio).texture.extremes
        assert (low, high) == pytest.approx((-1.4 * A, 1.4 * A), rel=1e-12)
