"""The sinusoid, against closed forms of its properties."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import mpmath as mp
import numpy as np
import pytest

from asperity.core.errors import ParameterError
from asperity.textures import Sinusoid
from asperity.textures.kinds import sinusoid_sampler as sinusoid

Check = Callable[..., Any]


@pytest.fixture
def wave() -> Sinusoid:
    return Sinusoid(0.4e-3, 1.5e-3, phase=0.7, direction=(3.0, -4.0))


def test_height_is_the_formula(wave: Sinusoid, scatter: Check):
    xy = scatter(wave, 50, seed=1, stretch=5.0)
    along = xy @ np.array([0.6, -0.8])
    expected = 0.4e-3 * np.sin(2 * np.pi * along / 1.5e-3 + 0.7)
    np.testing.assert_allclose(wave.height(xy), expected, rtol=0, atol=1e-14 * 0.4e-3 * 10)


@pytest.mark.parametrize("texture", ["sinusoid", "steep sinusoid"], indirect=True)
def test_slopes_and_hessian_are_derivatives(
    texture: Sinusoid, scatter: Check, check_derivatives: Check
):
    check_derivatives(texture, scatter(texture, 50, seed=2), step=texture.period * 1e-4)


def test_sinusoid_is_constant_across_its_direction(wave: Sinusoid, scatter: Check):
    xy = scatter(wave, 20, seed=3)
    across = np.array([0.8, 0.6]) * 7e-3
    np.testing.assert_allclose(wave.height(xy + across), wave.height(xy), rtol=0, atol=1e-17)
    np.testing.assert_allclose(wave.gradient(xy) @ across, 0.0, atol=1e-17)
    assert wave.is_profile


def test_domain_is_one_period(wave: Sinusoid, scatter: Check):
    xy = scatter(wave, 20, seed=4)
    span = wave.domain.spans[0]
    assert np.hypot(*span) == pytest.approx(1.5e-3, rel=1e-15)
    np.testing.assert_allclose(wave.height(xy + 3 * span), wave.height(xy), rtol=0, atol=1e-17)
    assert np.abs(wave.height(xy + 0.5 * span) + wave.height(xy)).max() < 1e-17


def test_scan_line_is_one_period(wave: Sinusoid):
    line = wave.scan_line()
    end = line.start + line.length * line.direction
    assert line.periodic
    assert np.hypot(*line.direction) == pytest.approx(1.0, rel=1e-15)
    np.testing.assert_allclose(wave.height([line.start]), wave.height([end]), atol=1e-17)
    points = line.points(4)
    np.testing.assert_allclose(np.diff(points, axis=0), np.tile(end / 4, (3, 1)), rtol=1e-12)
    np.testing.assert_allclose(points[0], end / 8, rtol=1e-12)


def test_extremes_and_bounds_are_exact(
    wave: Sinusoid, sampled_extremes: Check, sampled_bounds: Check
):
    assert wave.extremes == (-0.4e-3, 0.4e-3)
    assert wave.peak_to_valley == 0.8e-3
    np.testing.assert_allclose(sampled_extremes(wave, 100), wave.extremes, rtol=1e-12)
    k = 2 * math.pi / 1.5e-3
    np.testing.assert_allclose(wave.bounds, (0.4e-3 * k, 0.4e-3 * k * k), rtol=1e-15)
    np.testing.assert_allclose(sampled_bounds(wave, 5000), wave.bounds, rtol=1e-6)


def test_description_and_repr_give_the_same_texture(wave: Sinusoid):
    description = wave.describe()
    assert description.pop("kind") == "sinusoid"
    xy = [[1e-4, 2e-4]]
    assert Sinusoid(**description).height(xy) == wave.height(xy)
    assert eval(repr(wave)).height(xy) == wave.height(xy)


@pytest.mark.parametrize(
    ("argument", "value"),
    [
        ("amplitude", 0.0),
        ("amplitude", -1e-3),
        ("amplitude", math.inf),
        ("amplitude", True),
        ("amplitude", "1 kg"),
        ("period", 0.0),
        ("period", -1e-3),
        ("period", math.nan),
        ("period", None),
        ("phase", math.nan),
        ("phase", "zero"),
        ("direction", (0.0, 0.0)),
        ("direction", (1.0, 0.0, 0.0)),
        ("direction", (math.nan, 1.0)),
        ("direction", 1.0),
    ],
)
def test_invalid_arguments_are_refused(argument: str, value: object):
    arguments: dict[str, Any] = {"amplitude": 1e-3, "period": 1e-3, argument: value}
    with pytest.raises(ParameterError, match=f"^{argument} ") as caught:
        Sinusoid(**arguments)
    assert caught.value.argument == argument


@pytest.mark.parametrize("method", ["height", "gradient", "hessian", "derivatives", "nearest"])
def test_invalid_positions_are_refused(wave: Sinusoid, method: str):
    width = 3 if method == "nearest" else 2
    argument = "points" if method == "nearest" else "xy"
    invalid: list[Any] = [
        np.zeros(width + 1),
        np.zeros((4, width + 1)),
        np.full((2, width), np.nan),
        np.full((1, width), np.inf),
        [["a"] * width],
        [[None] * width],
        5.0,
    ]
    for positions in invalid:
        with pytest.raises(ParameterError) as caught:
            getattr(wave, method)(positions)
        assert caught.value.argument == argument


def test_shapes_of_the_results(wave: Sinusoid):
    xy = np.zeros((5, 2), dtype=np.float32)
    shapes = [wave.height(xy).shape, wave.gradient(xy).shape, wave.hessian(xy).shape]
    assert shapes == [(5,), (5, 2), (5, 2, 2)]
    assert wave.nearest(np.zeros((5, 3), dtype=int)).shape == (5, 3)
    assert wave.height(np.zeros((0, 2))).shape == (0,)


def residual_in_roundings(
    psi: float, u: float, z: float, amplitude: float, peak_curvature: float
) -> float:
    """Return the residual of a closest point at ψ, in units of its rounding error."""
    with mp.workdps(60):
        p, steep, high = mp.mpf(psi), mp.sin(psi), amplitude * mp.cos(psi)
        value = p - mp.mpf(u) - peak_curvature * steep * (high - mp.mpf(z))
        rate = abs(1 + peak_curvature * (amplitude * steep**2 - mp.cos(p) * (high - z)))
        terms = p + u + abs(peak_curvature * steep) * (abs(high) + abs(z))
        return float(
            abs(value) / (2.0**-52 * (terms + (rate + peak_curvature * (amplitude + abs(z))) * p))
        )


def test_flank_root_is_accurate_in_few_evaluations(monkeypatch: pytest.MonkeyPatch):
    """Probes are at, below and far below crests, flanks and troughs of flat and steep waves."""
    evaluations = [0]

    def counting_sine(angle: float) -> float:
        evaluations[0] += 1
        return math.sin(angle)

    counting_math = SimpleNamespace(**vars(math) | {"sin": counting_sine})
    monkeypatch.setattr(sinusoid, "math", counting_math)
    rng, counts, perturbed_residuals = random.Random(5), [], []
    for _ in range(4000):
        amplitude = 10.0 ** rng.uniform(-6.0, -2.5)
        k = 2.0 * math.pi / 10.0 ** rng.uniform(-4.0, -2.0)
        u = rng.choice([rng.uniform(0.0, math.pi), 10.0 ** rng.uniform(-16.0, 0.0)])
        below = rng.choice([10.0 ** rng.uniform(-16.0, 0.0), 5.0 * rng.random(), 1e3])
        depth, peak_curvature = below * amplitude, k * k * amplitude
        z, high = amplitude * math.cos(u) - depth, min(math.pi, u + k * depth)
        evaluations[0] = 0
        psi, c, s = sinusoid.flank_root(1.0, u, high, z, amplitude, peak_curvature)
        counts.append(evaluations[0])
        assert u <= psi <= math.pi
        assert residual_in_roundings(psi, u, z, amplitude, peak_curvature) < 1.0
        assert abs(c - math.cos(psi)) <= 2.0**-51
        assert abs(s - math.sin(psi)) <= 2.0**-51
        perturbed_residuals.append(
            residual_in_roundings(psi * (1.0 + 2.0**-48), u, z, amplitude, peak_curvature)
        )
    assert (
        np.median(perturbed_residuals) > 2.0
    )  # negative control: an error of 16 roundings is detected
    assert np.mean(counts) < 2.5
    assert max(counts) < 16
