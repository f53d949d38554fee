"""The medial axis below crests, and jumps of the force there."""

from __future__ import annotations

import math

import numpy as np
import pytest

from asperity.analysis import characteristic_number
from asperity.analysis.energy.continuity import continuity
from asperity.analysis.gain.medial_axis import crest_curvature, sharpest_crest
from asperity.surface import Surface
from asperity.textures.kinds.fourier import Fourier
from asperity.textures.kinds.sinusoid import Sinusoid
from asperity.textures.spline.spline_texture import HeightMap, Profile

WAVE = Sinusoid(0.1e-3, 2e-3)
RADIUS = 2e-3**2 / (4 * math.pi**2 * 0.1e-3)


def test_crest_curvature_of_a_sphere() -> None:
    """For h = √(R² - r²) every principal curvature is -1/R, also away from the top."""
    radius, x, y = 2.0, 0.7, -0.9
    h = math.sqrt(radius**2 - x * x - y * y)
    row = [h, -x / h, -y / h, -1 / h - x * x / h**3, -x * y / h**3, -1 / h - y * y / h**3]
    assert crest_curvature(np.array([row]))[0] == pytest.approx(1 / radius, rel=1e-7)


def test_sharpest_crest_of_a_sinusoid_and_of_its_fourier_form() -> None:
    exact = sharpest_crest(WAVE)
    sampled = sharpest_crest(Fourier([0.1e-3], [math.pi * 1e3]))
    assert exact is not None
    assert sampled is not None
    assert exact.radius == pytest.approx(RADIUS, rel=1e-12)
    assert sampled.radius == pytest.approx(RADIUS, rel=1e-9)


def test_jacobian_of_law_d_attains_the_number_above_the_onset() -> None:
    depth = 0.9 * RADIUS
    surface = Surface(WAVE, "D", stiffness=1.0, max_depth=depth)
    bound = characteristic_number(surface)
    assert bound.value == pytest.approx(9.0, rel=1e-9)
    jacobian = surface.jacobian([bound.at])[0]
    assert np.linalg.norm(jacobian, 2) == pytest.approx(9.0, rel=1e-9)


def test_number_of_law_d_is_infinite_from_the_onset_on() -> None:
    bound = characteristic_number(Surface(WAVE, "D", max_depth=1.01 * RADIUS))
    assert bound.upper == math.inf
    assert bound.at == pytest.approx((0.5e-3, 0.0, 0.1e-3 - RADIUS), rel=1e-9)


def test_ball_of_the_sharpest_crest_contains_no_surface() -> None:
    """Also on a lip above a ditch, no other surface point is nearer to the centre."""
    x = np.linspace(0.0, 1.0, 201)
    ditch = np.where((x > 0.47) & (x < 0.53), -0.4, 0.0) + 0.02 * np.sin(6 * np.pi * x)
    from scipy.ndimage import gaussian_filter1d

    profile = Profile(1e-3 * gaussian_filter1d(ditch, 1.5), 5e-6)
    crest = sharpest_crest(profile)
    assert crest is not None
    distance = np.linalg.norm(np.array(crest.centre) - profile.nearest([crest.centre])[0])
    assert distance == pytest.approx(crest.radius, rel=2e-3)


def test_number_of_law_d_on_gentle_maps_is_one_by_theorem() -> None:
    y, x = np.mgrid[:20, :20]
    bumps = HeightMap(1e-6 * np.sin(0.5 * x) * np.cos(0.4 * y), 1e-4)
    bound = characteristic_number(Surface(bumps, "D", max_depth=1e-6))
    assert (bound.value, bound.method) == (1.0, "theorem")


@pytest.mark.parametrize(
    ("letter", "depth", "expected"),
    [
        ("D", 1.5, False),
        ("D", 0.5, True),
        ("E", 1.5, True),
        ("C", 1.5, True),
        ("F", 1.5, True),
        ("H", 1.5, True),
    ],
)
def test_only_law_d_beyond_the_onset_is_discontinuous(
    letter: str, depth: float, expected: bool
) -> None:
    surface = Surface(WAVE, letter, max_depth=depth * RADIUS)
    assert continuity(surface, characteristic_number(surface)).continuous is expected


def test_force_of_law_d_jumps_only_below_the_onset() -> None:
    surface = Surface(WAVE, "D", stiffness=1.0)
    for depth, jumps in ((1.3, True), (0.9, False)):
        z = 0.1e-3 - depth * RADIUS
        left, right = surface.force([[0.5e-3 - 1e-12, 0, z], [0.5e-3 + 1e-12, 0, z]])
        assert bool(np.linalg.norm(right - left) > 0.1 * RADIUS) is jumps


def test_law_with_a_preload_is_not_continuous() -> None:
    from asperity.laws import Law

    step = Law(
        "J",
        "step",
        "nominal",
        lambda c: c.k * (c.depth + c.parameter("preload")) * c.e_z,
        parameters={"preload": 1e-4},
    )
    surface = Surface(WAVE, step)
    result = continuity(surface, characteristic_number(surface))
    assert not result.continuous
    assert "where contact begins" in result.reason


def test_number_and_continuity_agree_at_the_onset() -> None:
    """Rounding may put the onset above or below the depth, and K times the depth at or beside 1."""
    rng, infinite_cases = np.random.default_rng(2), set()
    for _ in range(40):
        wave = Sinusoid(rng.uniform(0.05e-3, 0.3e-3), rng.uniform(0.5e-3, 3e-3))
        crest = sharpest_crest(wave)
        assert crest is not None
        for depth in (crest.radius, 1.0 / wave.bounds[1]):
            surface = Surface(wave, "D", max_depth=depth)
            q = characteristic_number(surface)
            infinite_cases.add(depth * wave.bounds[1] == 1.0 and math.isinf(q.upper))
            if depth * wave.bounds[1] >= 1.0:
                assert continuity(surface, q).continuous is math.isfinite(q.upper)
    assert True in infinite_cases
