"""Law H: the statements of MATH section 6, each with a law for which it fails.

Some statements hold for C or D too: both have zero force outside contact, the stiffness of a
flat wall and no energy gain in loops. There another law is the negative control.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from asperity.analysis import characteristic_number, loop_work, one_sided_number
from asperity.analysis.energy.field_energy import split_state
from asperity.core.errors import ParameterError
from asperity.laws import Law
from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid
from asperity.textures.spline.spline_texture import HeightMap, Profile
from asperity.textures.texture import Texture

K, PERIOD = 800.0, 1e-3


def _profile(shape: Callable[[np.ndarray], np.ndarray]) -> Profile:
    """Return a periodic profile of 20 nodes, whose spline rounds corners over one node spacing."""
    return Profile(0.5e-3 * shape(np.arange(20) / 20), 0.05e-3, periodic=True)


TEXTURES: dict[str, Texture] = {
    "gentle": Sinusoid(0.05 * PERIOD, PERIOD),
    "middle": Sinusoid(0.4 * PERIOD, PERIOD, phase=-1.1),
    "steep": Sinusoid(3.0 * PERIOD, PERIOD, phase=0.4, direction=(1.0, 2.0)),
    "triangle": _profile(lambda t: np.abs(2.0 * t - 1.0)),
    "square": _profile(lambda t: np.where(t < 0.5, 1.0, 0.0)),
    "sawtooth": _profile(lambda t: t),
    "noise": Profile(1e-4 * np.random.default_rng(2).normal(size=30), 0.1e-3, periodic=True),
}
SOME = ["steep", "noise", "sawtooth"]


def _probes(texture: Texture, count: int, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    xy = rng.uniform(0.0, 2e-3, (count, 2))
    depth = texture.peak_to_valley * 10 ** rng.uniform(-3, 0.3, count)
    return np.column_stack([xy, texture.height(xy) - depth])


def _god_object_energy(texture: Texture, points: np.ndarray) -> np.ndarray:
    """Return φ, half the squared distance to the free set [m²]."""
    square = np.sum((texture.nearest(points) - points) ** 2, axis=1)
    return 0.5 * np.where(texture.height(points[:, :2]) > points[:, 2], square, 0.0)


# --- outside contact; bounds of the energy --------------------------------------------------------


def _outside(texture: Texture) -> np.ndarray:
    points = _probes(texture, 400)
    points[:, 2] = 2.0 * texture.height(points[:, :2]) - points[:, 2]
    touching = points.copy()
    touching[:, 2] = texture.height(points[:, :2])
    return np.concatenate([points, touching])


@pytest.mark.parametrize("name", TEXTURES)
def test_force_energy_and_jacobian_are_zero_outside_contact(name: str) -> None:
    surface = Surface(TEXTURES[name], "H", K)
    points = _outside(surface.texture)
    state = split_state(surface, points)
    assert not surface.force(points).any()
    assert not state.potential.any()
    assert not state.atoms.any()
    assert not surface.jacobian(points).any()


@pytest.mark.parametrize("letter", "WG")
def test_wall_laws_have_a_force_outside_the_texture(letter: str) -> None:
    surface = Surface(TEXTURES["steep"], letter, K)
    assert surface.force(_outside(surface.texture)).any()


@pytest.mark.parametrize("name", TEXTURES)
@pytest.mark.parametrize("c", [0.5, 1.0, 3.0])
def test_energy_lies_between_its_bounds(name: str, c: float) -> None:
    """Checks (1 - μ) φ <= U <= φ and that the gap certifies U."""
    texture = TEXTURES[name]
    points = _probes(texture, 400)
    phi = K * _god_object_energy(texture, points)
    state = split_state(Surface(texture, "H", K, continuity=c), points)
    # Positions are rounded: a distance is accurate to 1e-15 of the coordinates.
    size = np.abs(points).sum(axis=1) + texture.peak_to_valley
    rounding = 2e-15 * size * np.sqrt(2.0 * K * phi)
    assert (state.potential <= phi + rounding).all()
    assert (state.potential >= c / (1.0 + c) * phi - rounding).all()
    assert (state.gap <= rounding).all()


def test_energy_of_law_c_exceeds_the_upper_bound() -> None:
    texture = TEXTURES["noise"]
    points = _probes(texture, 400)
    vertical = 0.5 * K * (texture.height(points[:, :2]) - points[:, 2]) ** 2
    assert (vertical > 1.1 * K * _god_object_energy(texture, points)).any()


# --- the force is the gradient of the energy ------------------------------------------------------


def _gradient(surface: Surface, points: np.ndarray, step: float) -> np.ndarray:
    ahead = [split_state(surface, points + step * axis).potential for axis in np.eye(3)]
    behind = [split_state(surface, points - step * axis).potential for axis in np.eye(3)]
    return (np.stack(ahead, axis=-1) - np.stack(behind, axis=-1)) / (2.0 * step)


@pytest.mark.parametrize("name", TEXTURES)
@pytest.mark.parametrize("c", [1.0, 4.0])
def test_force_is_minus_the_gradient_of_the_energy(name: str, c: float) -> None:
    surface = Surface(TEXTURES[name], "H", K, continuity=c)
    points = _probes(surface.texture, 150)
    step = 1e-4 * surface.texture.peak_to_valley
    error = np.linalg.norm(_gradient(surface, points, step) + surface.force(points), axis=1)
    # The Hessian is at most k max(1, c): a central difference has an error of half a step of it.
    assert error.max() <= 0.5 * math.sqrt(3.0) * K * max(1.0, c) * step


@pytest.mark.parametrize("letter", "CD")
def test_forces_of_laws_c_and_d_are_not_this_gradient(letter: str) -> None:
    surface = Surface(TEXTURES["steep"], "H", K)
    points = _probes(surface.texture, 150)
    other = Surface(surface.texture, letter, K).force(points)
    error = np.linalg.norm(_gradient(surface, points, 6e-7) + other, axis=1)
    assert error.max() > 100.0 * K * 6e-7


def test_loops_across_the_medial_axis_gain_no_energy() -> None:
    """Negative control: laws A and E gain energy."""
    texture = TEXTURES["noise"]
    rng = np.random.default_rng(3)
    scale = 0.5 * K * 1e-6
    for _ in range(2):
        loop = rng.uniform(0.5e-3, 1.5e-3, (4, 3)) - [0.0, 0.0, 1.4e-3]
        assert abs(loop_work(Surface(texture, "H", K), loop)) < 1e-9 * scale
        for letter in "AE":
            assert abs(loop_work(Surface(texture, letter, K), loop)) > 1e-4 * scale


# --- continuity -----------------------------------------------------------------------------------


@cache
def _pairs(name: str, count: int = 1500) -> tuple[np.ndarray, np.ndarray]:
    """Return random pairs of all distances, and pairs that straddle jumps of the nearest point.

    The latter come from bisection between two points whose nearest points are far apart.
    """
    texture = TEXTURES[name]
    rng = np.random.default_rng(1)
    a = _probes(texture, count)
    b = a + rng.normal(size=a.shape) * 10 ** rng.uniform(-9, -4, (count, 1))
    low, high = a.copy(), a + rng.normal(size=a.shape) * [2e-4, 2e-4, 0.0]
    point_low, point_high = texture.nearest(low), texture.nearest(high)
    for _ in range(26):
        middle = 0.5 * (low + high)
        closest_point = texture.nearest(middle)
        to_low = np.linalg.norm(closest_point - point_low, axis=1, keepdims=True)
        left = to_low < np.linalg.norm(closest_point - point_high, axis=1, keepdims=True)
        low, point_low = np.where(left, middle, low), np.where(left, closest_point, point_low)
        high, point_high = np.where(left, high, middle), np.where(left, point_high, closest_point)
    return np.concatenate([a, low]), np.concatenate([b, high])


def _excess(surface: Surface, name: str, gain: float) -> np.ndarray:
    """Return |Δf| - k gain |Δp| (1 + 1e-6), over k l."""
    a, b = _pairs(name)
    change = np.linalg.norm(surface.force(b) - surface.force(a), axis=1)
    allowed = K * gain * np.linalg.norm(b - a, axis=1) * (1.0 + 1e-6)
    return (change - allowed) / (K * PERIOD)


@pytest.mark.parametrize("name", TEXTURES)
@pytest.mark.parametrize("c", [1.0, 4.0])
def test_force_is_lipschitz_across_ridges(name: str, c: float) -> None:
    surface = Surface(TEXTURES[name], "H", K, continuity=c)
    assert _excess(surface, name, max(1.0, c)).max() <= 1e-10


@pytest.mark.parametrize("name", ["middle", "steep", "triangle", "square", "sawtooth", "noise"])
@pytest.mark.parametrize("letter", "CD")
def test_forces_of_laws_c_and_d_are_not_lipschitz(name: str, letter: str) -> None:
    surface = Surface(TEXTURES[name], letter, K)
    assert _excess(surface, name, 1.0).max() > 1e-3


def test_lipschitz_bound_is_sharp() -> None:
    """The largest measured ratio equals the bound to 1e-9."""
    surface = Surface(TEXTURES["middle"], "H", K)
    a, b = _pairs("middle")
    far = np.linalg.norm(b - a, axis=1) > 1e-7
    change = np.linalg.norm(surface.force(b) - surface.force(a), axis=1)[far]
    assert change.max() > 0.0
    ratio = change / (K * np.linalg.norm(b - a, axis=1)[far])
    x = 0.25 * PERIOD * (1.0 + 1.1 * 2.0 / math.pi)  # straight below a crest, deep: J_xx = c k
    line = np.array([[x - 1e-5, 0.0, -1e-3], [x + 1e-5, 0.0, -1e-3]])
    along = np.diff(surface.force(line)[:, 0])[0] / (2e-5 * K)
    assert max(along, ratio.max()) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("name", TEXTURES)
def test_jacobian_against_differences_and_bounds(name: str) -> None:
    c = 2.0
    surface = Surface(TEXTURES[name], "H", K, continuity=c)
    points = _probes(surface.texture, 200)
    step = 1e-7 * PERIOD
    numeric = np.stack(
        [
            (surface.force(points + step * v) - surface.force(points - step * v)) / (2 * step)
            for v in np.eye(3)
        ],
        axis=-1,
    )
    exact = surface.jacobian(points)
    error = np.linalg.norm(exact - numeric, axis=(1, 2)) / K
    # Between one atom and two the Jacobian jumps: a few pairs straddle that.
    assert np.quantile(error, 0.97) < 1e-5
    np.testing.assert_allclose(exact, np.swapaxes(exact, 1, 2), atol=1e-9 * K)
    values = np.linalg.eigvalsh(-exact / K)
    assert values.max() <= 1.0 + 1e-9
    assert values.min() >= -c - 1e-9


def test_jacobians_of_laws_c_and_d_exceed_the_bounds() -> None:
    steep, gentle = TEXTURES["steep"], TEXTURES["gentle"]
    values = np.linalg.eigvalsh(-Surface(steep, "C", K).jacobian(_probes(steep, 200)) / K)
    assert values.max() > 1.1
    # Below a crest, at 0.9 of its radius of curvature: 0.9/(1 - 0.9).
    depth = 0.9 / gentle.bounds[1]
    crest = [[0.25 * PERIOD, 0.0, 0.05 * PERIOD - depth]]
    values = np.linalg.eigvalsh(-Surface(gentle, "D", K).jacobian(crest) / K)
    assert values.min() == pytest.approx(-9.0)


# --- relation to other laws -----------------------------------------------------------------------


def test_flat_wall_has_the_nominal_stiffness() -> None:
    flat = Profile(np.zeros(8), 1e-3)
    points = [[1e-3, 0.0, -2e-4], [2e-3, 1.0, 1e-4]]
    expected = [[0.0, 0.0, 2e-4 * K], [0.0, 0.0, 0.0]]
    surface = Surface(flat, "H", K, max_depth=1e-3)
    np.testing.assert_allclose(surface.force(points), expected, atol=1e-15 * K)
    np.testing.assert_allclose(surface.jacobian(points)[0], np.diag([0, 0, -K]), atol=1e-9)
    stiffening = Law("S", "stiffening", "vertical", lambda c: c.k * c.depth**2 * c.w / 1e-3)
    other = Surface(flat, stiffening, K, max_depth=1e-3)
    assert not np.allclose(other.force(points), expected, atol=0.1 * K * 1e-4)


@pytest.mark.parametrize("c", [0.5, 1.0, 3.0])
def test_law_h_equals_law_d_up_to_a_fraction_of_the_crest_radius(c: float) -> None:
    """Below a crest of radius R law H equals D down to c/(1 + c) R; deeper, it is softer."""
    gentle = TEXTURES["gentle"]
    radius = PERIOD**2 / (4 * math.pi**2 * 0.05 * PERIOD)
    limit = c / (1.0 + c) * radius
    split, single = Surface(gentle, "H", K, continuity=c), Surface(gentle, "D", K)
    x = 0.25 * PERIOD
    above = [[x, 0.0, 0.05 * PERIOD - 0.999 * limit]]
    below = [[x, 0.0, 0.05 * PERIOD - 1.2 * limit]]
    np.testing.assert_allclose(split.force(above), single.force(above), rtol=1e-9, atol=1e-12)
    assert split_state(split, below).atoms[0] == 2
    assert split.force(below)[0, 2] < single.force(below)[0, 2] * (1 - 1e-3)


@pytest.mark.parametrize("name", SOME)
def test_law_h_equals_law_d_where_the_closest_point_does_not_change(name: str) -> None:
    """H equals D wherever an extension by 1/c has the same nearest point; C does not."""
    texture = TEXTURES[name]
    points, c = _probes(texture, 400), 2.0
    closest_points = texture.nearest(points)
    extended = points - (closest_points - points) / c
    is_unchanged = np.linalg.norm(texture.nearest(extended) - closest_points, axis=1) < 1e-9
    single, split = (Surface(texture, law, K, continuity=c).force(points) for law in "DH")
    error = np.linalg.norm(split - single, axis=1) / np.linalg.norm(single, axis=1)
    assert 20 < is_unchanged.sum() < 380
    assert error[is_unchanged].max() < 1e-6  # relative to a depth with rounding error
    assert error[~is_unchanged].max() > 1e-2
    vertical = Surface(texture, "C", K).force(points)
    assert np.linalg.norm(vertical - single, axis=1)[is_unchanged].max() > 1e-2 * K * PERIOD


def test_law_h_converges_to_law_d_with_continuity() -> None:
    texture = TEXTURES["noise"]
    points = _probes(texture, 300)
    reference = Surface(texture, "D", K).force(points)

    def distance(letter: str, c: float = 1.0) -> float:
        force = Surface(texture, letter, K, continuity=c).force(points)
        return float(np.mean(np.linalg.norm(force - reference, axis=1)))

    # |z̄ - p_h| decreases as 1/c on average, because the split region does.
    near = [distance("H", c) for c in (1.0, 10.0, 100.0, 1000.0)]
    assert all(b < 0.2 * a for a, b in pairwise(near))
    assert distance("C") > 2.0 * near[1]


@pytest.mark.parametrize("name", SOME)
def test_laws_with_at_most_its_gain_store_no_more_energy(name: str) -> None:
    """Item 4: U_1 is the largest potential of a law with q <= 1 that is free of force outside.

    Candidates: C divided by its gain, and H with less continuity. D and undivided C are larger.
    """
    texture = TEXTURES[name]
    points = _probes(texture, 300)
    largest = split_state(Surface(texture, "H", 1.0), points).potential
    depth = texture.height(points[:, :2]) - points[:, 2]
    slope, hessian = texture.bounds
    # The derivative bound of MATH section 4 for C, down to the deepest probe.
    gain = 1.0 + slope**2 + depth.max() * hessian
    assert (0.5 * depth**2 / gain <= largest * (1.0 + 1e-9)).all()
    gentler = split_state(Surface(texture, "H", 1.0, continuity=0.3), points).potential
    assert (gentler <= largest * (1.0 + 1e-9)).all()
    assert (0.5 * depth**2 > 1.01 * largest).any()
    assert (_god_object_energy(texture, points) > 1.01 * largest).any()


@pytest.mark.parametrize("name", ["steep", "sawtooth", "triangle"])
def test_lateral_force_oscillation_attains_its_bound(name: str) -> None:
    """Item 5: with ‖J‖ <= k the RMS of one component is at most k l/(4√3); law D has twice that."""
    texture = TEXTURES[name]
    line = texture.scan_line()
    xy = line.points(2000)
    deep = np.full(2000, texture.extremes[0] - 1.5e-3)
    scan = np.column_stack([xy, deep])
    limit = K * line.length / (4 * math.sqrt(3))

    def oscillation(letter: str) -> float:
        return float((Surface(texture, letter, K).force(scan)[:, :2] @ line.direction).std())

    assert 0.99 * limit < oscillation("H") <= limit * (1.0 + 1e-9)
    assert oscillation("D") > 1.9 * limit
    assert oscillation("C") > 1.5 * limit


# --- numbers, limits, invalid input ---------------------------------------------------------------


def test_numbers_of_law_h_follow_from_theorems() -> None:
    surface = Surface(TEXTURES["steep"], "H", continuity=2.5)
    for bound, value in ((characteristic_number(surface), 2.5), (one_sided_number(surface), 1.0)):
        assert (bound.lower, bound.upper, bound.method) == (value, value, "theorem")


@pytest.mark.parametrize("c", [0.0, -1.0, math.inf, math.nan])
def test_invalid_continuity_raises(c: float) -> None:
    with pytest.raises(ParameterError) as caught:
        Surface(TEXTURES["gentle"], "H", continuity=c)
    assert caught.value.argument == "continuity"


@pytest.mark.parametrize("name", ["steep", "noise"])
def test_force_far_below_the_surface_at_extreme_continuity(name: str) -> None:
    """The body below a height function is unbounded, so there is a force at any depth."""
    texture = TEXTURES[name]
    for c in (0.1, 1e3, 1e6):
        surface = Surface(texture, "H", K, continuity=c)
        points = _probes(texture, 20)
        points[:, 2] = texture.extremes[0] - 5e-3
        force = surface.force(points)
        # Between the distances to the lowest and the highest point of the surface.
        assert (force[:, 2] >= K * 5e-3).all()
        assert (force[:, 2] <= K * (5e-3 + texture.peak_to_valley)).all()


def test_split_state_requires_the_split_contact() -> None:
    with pytest.raises(ParameterError, match="split contact"):
        split_state(Surface(TEXTURES["gentle"], "D"), [[0.0, 0.0, 0.0]])


def test_search_that_newtons_method_leads_astray_converges() -> None:
    """Once the solver ended here with a duality gap of 2.6 % of the potential."""
    noise = gaussian_filter(np.random.default_rng(20240607).standard_normal((1024, 1024)), 6.0)
    part = (0.1e-3 * noise / noise.std())[180:330, 150:320]
    texture = HeightMap(part, (50e-6, 50e-6), origin=(150 * 50e-6, 180 * 50e-6))
    state = split_state(Surface(texture, "H", 1.0), [[0.0117, 0.01265, -0.00048646]])
    assert state.potential[0] == pytest.approx(1.5423771349e-07, rel=1e-9)
