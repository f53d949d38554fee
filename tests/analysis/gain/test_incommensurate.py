"""Two waves of nearly, but not exactly, rational ratio take all pairs of phases (the torus)."""

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
    """Return the largest ‖J‖/k of law C over phases: J = -k(w wᵀ + δ diag(h'', 0))."""
    slope = A * WAVE * (np.cos(first) + 0.4 * ratio * np.cos(second))
    hessian = -A * WAVE**2 * (np.sin(first) + 0.4 * ratio**2 * np.sin(second))
    worst = 0.0
    for depth in (0.0, D):
        xx, zz = slope**2 + depth * hessian, 1.0
        middle, apart = 0.5 * (xx + zz), np.hypot(0.5 * (xx - zz), slope)
        worst = max(worst, float((np.abs(middle) + apart).max()))
    return worst


def number_on_the_torus(ratio: float) -> float:
    """Return the number over all pairs of phases, which the unbounded sum approaches."""
    turn = np.linspace(0.0, 2 * math.pi, 1001)
    return number_c(*np.meshgrid(turn, turn), ratio)


@pytest.mark.parametrize("ratio", RATIOS)
def test_nearly_rational_ratio_is_certified_on_the_torus(ratio: float) -> None:
    assert ratio * WAVE != 2.0 * WAVE
    torus_number = number_on_the_torus(ratio)
    for number in (characteristic_number, one_sided_number):
        bound = number(surface(ratio))
        assert bound.method == "certified"
        assert torus_number <= bound.upper <= torus_number * (1 + 1e-4)
        assert bound.lower <= torus_number * (1 + 1e-4)
    assert not surface(ratio).texture.domain.periodic


def test_ratio_of_exactly_two_is_periodic() -> None:
    periodic_surface = surface(2.0)
    turn = np.linspace(0.0, 2 * math.pi, 2_000_001)
    expected = number_c(turn, 2 * turn + PHASE)
    bound = characteristic_number(periodic_surface)
    assert periodic_surface.texture.domain.periodic
    assert bound.upper == pytest.approx(expected, rel=1e-6)
    assert expected < number_on_the_torus(2.0) * (1 - 1e-3)


def test_loose_tolerance_for_rational_ratios_gives_too_low_a_number(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Negative control: with a tolerance of 1e-9 for rational ratios the number is too low."""
    monkeypatch.setattr(plane_waves, "_ROUNDING", 1e-9)
    ratio = 2.0 * (1.0 + 9e-10)
    assert characteristic_number(surface(ratio)).upper < number_on_the_torus(ratio) * (1 - 1e-3)


def test_extremes_are_those_of_the_torus() -> None:
    """At ratio 2 the crests of the two waves never coincide; at nearly rational ratios they do."""
    assert surface(2.0).texture.extremes[1] < 1.39 * A
    for ratio in RATIOS:
        low, high = surface(ratio).texture.extremes
        assert (low, high) == pytest.approx((-1.4 * A, 1.4 * A), rel=1e-12)
