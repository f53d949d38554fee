"""The multi-precision reference, and the kernels against it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest
from scipy.ndimage import map_coordinates
from tests.helpers.exact_heights import exact_height
from tests.helpers.reference import exact_force, exact_jacobian

from asperity.laws import Law
from asperity.surface import Surface
from asperity.textures import HeightMap, Profile, Sinusoid, Texture

Check = Callable[..., Any]
LETTERS = "WABCDEFG"
ORDERS = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]

# --- the reference itself -------------------------------------------------------------------------


def exact_derivatives(texture: Texture, xy: np.ndarray) -> np.ndarray:
    h = exact_height(texture)
    with mpmath.workdps(30):
        return np.array(
            [[float(h(mpmath.mpf(x), mpmath.mpf(y), *order)) for order in ORDERS] for x, y in xy]
        )


def test_exact_height_equals_the_sampler(texture: Texture, scatter: Check):
    """Values, slopes and Hessians are compared, also beyond the border of a map."""
    xy = scatter(texture, 12, seed=1, stretch=3.0)
    exact = exact_derivatives(texture, xy)
    slope, second = texture.bounds
    scale = np.array([texture.peak_to_valley, slope, slope, second, second, second])
    assert np.abs((texture.derivatives(xy) - exact) / scale).max() < 1e-13


@pytest.mark.parametrize("texture", ["map", "periodic map", "profile"], indirect=True)
def test_splines_equal_those_of_scipy(texture: HeightMap | Profile, scatter: Check):
    xy = scatter(texture, 25, seed=2, stretch=3.0)
    u = (xy - texture.domain.origin) / np.broadcast_to(texture.pitch, (2,))
    nodes = [u[:, 0]] if texture.is_profile else [u[:, 1], u[:, 0]]
    mode = "grid-wrap" if texture.periodic else "mirror"
    expected = map_coordinates(texture.heights, nodes, order=3, mode=mode, prefilter=True)
    exact = exact_derivatives(texture, xy)[:, 0]
    np.testing.assert_allclose(exact, expected, rtol=0, atol=1e-12 * np.abs(texture.heights).max())


@pytest.mark.parametrize("order", ORDERS[1:])
def test_exact_derivatives_equal_numerical_ones(texture: Texture, order: tuple[int, int]):
    h = exact_height(texture)
    point = (mpmath.mpf("1.3137e-4"), mpmath.mpf("2.7193e-4"))
    with mpmath.workdps(40):
        numeric = mpmath.diff(lambda x, y: h(x, y, 0, 0), point, order, h=mpmath.mpf("1e-15"))
        bound = texture.bounds[sum(order) - 1]
        assert abs(h(*point, *order) - numeric) < 1e-8 * bound


def test_default_exact_height_is_consistent_between_doubles(texture: Texture):
    """A difference of values over 1e-25 m equals the slope."""
    h, formula = Texture.exact_height(texture), exact_height(texture)
    scale = (texture.peak_to_valley, *texture.bounds)
    with mpmath.workdps(60):
        x, y, step = mpmath.mpf("1.3137e-4"), mpmath.mpf("2.7193e-4"), mpmath.mpf("1e-25")
        for m, n in ORDERS:
            assert abs(h(x, y, m, n) - formula(x, y, m, n)) < 1e-12 * scale[m + n]
        for m, n in ORDERS[:3]:
            rate = (h(x + step, y, m, n) - h(x - step, y, m, n)) / (2 * step)
            assert abs(rate - h(x, y, m + 1, n)) < 1e-12 * scale[m + n + 1]
            rate = (h(x, y + step, m, n) - h(x, y - step, m, n)) / (2 * step)
            assert abs(rate - h(x, y, m, n + 1)) < 1e-12 * scale[m + n + 1]


def sampled_wave(count: int, rows: int) -> tuple[Texture, Sinusoid]:
    """Return a wave in the unit square sampled on count nodes, and the wave itself."""
    u = np.arange(count) / count
    if rows == 1:
        wave = Sinusoid(1.0, 1.0, phase=0.4)
        return Profile(wave.height(np.column_stack([u, u])), 1.0 / count, periodic=True), wave
    wave = Sinusoid(1.0, 1.0 / np.sqrt(5.0), phase=0.4, direction=(1.0, 2.0))
    xy = np.stack(np.meshgrid(u, u), -1).reshape(-1, 2)
    return HeightMap(wave.height(xy).reshape(count, count), 1.0 / count, periodic=True), wave


@pytest.mark.parametrize("rows", [1, 2], ids=["profile", "map"])
def test_spline_converges_with_orders_four_three_and_two(rows: int):
    xy = np.random.default_rng(3).random((4000, 2))
    errors = []
    for count in (96, 192):
        spline, wave = sampled_wave(count, rows)
        errors.append(np.abs(spline.derivatives(xy) - wave.derivatives(xy)).max(axis=0))
    with np.errstate(divide="ignore", invalid="ignore"):
        orders = np.log2(errors[0] / errors[1])
    expected = np.array([4.0, 3.0, 3.0, 2.0, 3.0, 2.0])
    varying = [0, 1, 3] if rows == 1 else [0, 1, 2, 3, 5]
    np.testing.assert_allclose(orders[varying], expected[varying], atol=0.1)


def test_more_digits_give_the_same_force():
    surface = Surface(Sinusoid(0.4e-3, 1.5e-3, phase=0.7, direction=(2.0, 1.0)), "D")
    point = (1e-4, 3e-4, -0.5e-3)
    for exact in (exact_force, exact_jacobian):
        low_precision, high_precision = (
            exact(surface, point, digits=20),
            exact(surface, point, digits=50),
        )
        with mpmath.workdps(60):
            assert mpmath.norm(low_precision - high_precision) < 1e-19 * mpmath.norm(high_precision)


def test_force_with_a_preload_is_zero_where_contact_begins():
    """At depth 0 the probe touches without pressing, in the reference as in the kernel."""
    law = Law("J", "step", "vertical", lambda c: c.k * (c.depth + 1e-4) * c.e_z)
    surface = Surface(Sinusoid(1e-4, 2e-3), law, 1000.0)
    for point, force in (([0.0, 0.0, 0.0], 0.0), ([0.0, 0.0, -1e-9], 0.1)):
        (kernel,) = surface.force([point])
        assert float(exact_force(surface, point)[2]) == pytest.approx(force, rel=1e-4)
        assert kernel[2] == pytest.approx(force, rel=1e-4)


def test_force_is_zero_outside():
    surface = Surface(Sinusoid(0.4e-3, 1.5e-3), "B")
    assert exact_force(surface, (0.0, 0.0, 1e-9)) == mpmath.matrix([0, 0, 0])
    assert exact_jacobian(surface, (0.0, 0.0, 1e-9)) == mpmath.zeros(3, 3)


# --- kernels against the reference ----------------------------------------------------------------


def assert_equals_reference(
    surface: Surface, points: np.ndarray, deflection: Any = None, sliding: bool = False
) -> None:
    """Assert a force error below 1e-10 k·max(|h|, |z|), a Jacobian error below 1e-9 of its norm."""
    state: dict[str, Any] = {}
    if deflection is not None:
        state = {"deflection": deflection}
    forces = surface.force(points, **state)
    if deflection is not None:
        state["sliding"] = np.full(len(points), sliding)
    jacobians = surface.jacobian(points, **state)
    heights = surface.texture.height(points[:, :2])
    for i, p in enumerate(points):
        d = (0.0, 0.0) if deflection is None else deflection[i]
        force = np.array(exact_force(surface, p, d).tolist(), dtype=float)[:, 0]
        scale = surface.stiffness * max(abs(heights[i]), abs(p[2]))
        assert np.abs(forces[i] - force).max() <= 1e-10 * scale
        jacobian = np.array(exact_jacobian(surface, p, d, sliding).tolist(), dtype=float)
        norm = np.linalg.norm(jacobian, 2)
        assert np.abs(jacobians[i] - jacobian).max() <= 1e-9 * norm
        assert norm > 0.1 * surface.stiffness


def generic_probes(texture: Texture, inside: Check, count: int, seed: int) -> np.ndarray:
    """Return shallow and deep probes: random ones, one just below the surface, one very deep."""
    size = texture.peak_to_valley
    points = inside(texture, count, seed, deepest=size)
    points[0, 2] = min(texture.height(points[:1, :2])[0], 0.0) - 1e-6 * size
    points[1, 2] -= 2.0 * size
    return np.asarray(points)


@pytest.mark.parametrize("letter", "WABCG")
def test_explicit_laws_on_every_texture(letter: str, texture: Texture, inside: Check, plain: Check):
    surface = plain(Surface(texture, letter, stiffness=700.0))
    assert_equals_reference(surface, generic_probes(texture, inside, 4, seed=31))


@pytest.mark.parametrize("letter", "DE")
@pytest.mark.parametrize(
    "texture",
    [
        "sinusoid",
        "steep sinusoid",
        "fourier",
        "fourier profile",
        "map",
        "profile",
        "periodic profile",
    ],
    indirect=True,
)
def test_god_object_laws_on_every_texture_kind(
    letter: str, texture: Texture, inside: Check, plain: Check
):
    surface = plain(Surface(texture, letter, stiffness=700.0))
    assert_equals_reference(surface, generic_probes(texture, inside, 4, seed=31))


# Combinations with compiled kernels: every law and every kind at least once.
COMPILED = [
    *(("steep sinusoid", letter) for letter in "WACEG"),
    ("fourier", "B"),
    ("map", "D"),
    ("steep map", "D"),
    ("periodic map", "D"),
    ("profile", "E"),
]


@pytest.mark.parametrize(("name", "letter"), COMPILED)
def test_compiled_laws_equal_the_reference(
    name: str, letter: str, make_texture: Check, inside: Check
):
    texture = make_texture(name)
    assert_equals_reference(
        Surface(texture, letter, stiffness=700.0), generic_probes(texture, inside, 5, seed=32)
    )


@pytest.mark.parametrize("sliding", [False, True], ids=["sticking", "sliding"])
def test_friction_on_every_texture(texture: Texture, sliding: bool, inside: Check, plain: Check):
    surface = Surface(texture, "F", friction=0.7, max_deflection=0.8e-3, modulation_depth=0.9)
    points = generic_probes(texture, inside, 4, seed=33)
    rng = np.random.default_rng(34)
    turn = rng.uniform(0.0, 2.0 * np.pi, 4)
    length = 0.8e-3 * (1.0 if sliding else rng.random(4))
    deflection = (length * np.array([np.cos(turn), np.sin(turn)])).T
    assert_equals_reference(plain(surface), points, deflection, sliding)


def test_compiled_friction_equals_the_reference(make_texture: Check, inside: Check):
    texture = make_texture("fourier")
    deflection = np.array([[0.2e-3, -0.3e-3], [-0.6e-3, 0.8e-3], [0.0, 0.0]])
    for sliding in (False, True):
        assert_equals_reference(
            Surface(texture, "F"), inside(texture, 3, 35, 1e-3), deflection, sliding
        )


@pytest.mark.parametrize("letter", "ABCDEG")
def test_laws_on_a_nearly_vertical_flank(letter: str, make_texture: Check, plain: Check):
    """The amplitude is three times the period, and the slope reaches 18.8."""
    texture = make_texture("steep sinusoid")
    along = np.array([[-0.3 / (2 * np.pi) + offset] for offset in (0.0, 0.5, 0.013)])
    xy = texture.domain.points(along)
    assert np.hypot(*texture.gradient(xy[:1])[0]) == pytest.approx(6 * np.pi, rel=1e-9)
    depth = np.array([1e-6, 0.2e-3, 1.5e-3])
    points = np.column_stack([xy, np.minimum(texture.height(xy), 0.0) - depth])
    assert_equals_reference(plain(Surface(texture, letter)), points)


# --- the god-object near the medial axis ----------------------------------------------------------


def probe_below_a_crest(
    texture: Texture, crest: np.ndarray, left: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the probe whose closest point is the crest, where 1 + δκ = left, and the crest."""
    h, hx, hy, hxx, hxy, hyy = texture.derivatives(crest[None, :])[0]
    n = np.array([-hx, -hy, 1.0]) / np.sqrt(1.0 + hx * hx + hy * hy)
    first = np.eye(2) + np.outer([hx, hy], [hx, hy])
    second = np.array([[hxx, hxy], [hxy, hyy]]) * n[2]
    sharpest = np.linalg.eigvals(np.linalg.solve(first, second)).real.min()
    assert sharpest < 0.0
    closest = np.array([*crest, h])
    return closest - (1.0 - left) / -sharpest * n, closest


def point_near_the_crest(texture: Sinusoid, angle: float) -> np.ndarray:
    """Return the point of the plane at a phase angle from the crest."""
    turns = (np.pi / 2 - texture.phase + angle) / (2 * np.pi)
    return np.asarray(texture.domain.points(np.array([[turns]]))[0])


@pytest.mark.parametrize("letter", "DE")
@pytest.mark.parametrize(
    ("name", "angle", "left"),
    [
        ("sinusoid", 0.02, 0.3),
        ("sinusoid", -0.02, 0.01),
        ("sinusoid", 0.05, 0.02),
        ("steep sinusoid", 1e-3, 0.1),
        ("steep sinusoid", -1e-3, 0.01),
    ],
)
def test_god_object_just_above_the_focal_point_of_a_crest(
    letter: str, name: str, angle: float, left: float, make_texture: Check
):
    texture = make_texture(name)
    probe, closest = probe_below_a_crest(texture, point_near_the_crest(texture, angle), left)
    np.testing.assert_allclose(texture.nearest([probe])[0], closest, rtol=0, atol=1e-13)
    surface = Surface(texture, letter)
    assert_equals_reference(surface, probe[None, :])
    norm = np.linalg.norm(surface.jacobian([probe])[0], 2) / surface.stiffness
    assert norm == pytest.approx(1.0 if letter == "E" else max(1.0, (1.0 - left) / left), rel=1e-6)


@pytest.mark.parametrize("texture", ["fourier", "map", "periodic map", "profile"], indirect=True)
def test_god_object_near_the_focal_point_of_the_highest_crest(texture: Texture, plain: Check):
    from scipy.optimize import minimize

    fractions = np.stack(np.meshgrid(*2 * [np.linspace(0, 1, 80)]), -1).reshape(-1, 2)
    xy = texture.domain.points(fractions[:, : len(texture.domain.spans)])
    start = xy[np.argmax(texture.height(xy))]
    top = minimize(lambda u: -texture.height([start + 1e-5 * u])[0] * 1e4, np.zeros(2))
    probe, closest = probe_below_a_crest(texture, start + 1e-5 * top.x + 1e-6, left=0.4)
    np.testing.assert_allclose(texture.nearest([probe])[0], closest, rtol=0, atol=1e-12)
    assert_equals_reference(plain(Surface(texture, "D")), probe[None, :])
