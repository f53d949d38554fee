"""Law H: the statements of MATH section 6, each with a law that fails it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from asperity.analysis import characteristic_number, loop_work, one_sided_number
from asperity.analysis.split import split_state
from asperity.errors import ParameterError
from asperity.surface import Surface
from asperity.textures.profile import Profile
from asperity.textures.sinusoid import Sinusoid
from asperity.textures.texture import Texture

K, PERIOD = 800.0, 1e-3


def _noise() -> Profile:
    rng = np.random.default_rng(2)
    return Profile(1e-4 * rng.normal(size=30), 0.1e-3, periodic=True)


def _sawtooth() -> Profile:
    return Profile(0.5e-3 * (np.arange(40) % 20) / 20, 0.05e-3, periodic=True)


TEXTURES = {
    "gentle": Sinusoid(0.05 * PERIOD, PERIOD),
    "steep": Sinusoid(3.0 * PERIOD, PERIOD, phase=0.4, direction=(1.0, 2.0)),
    "noise": _noise(),
    "sawtooth": _sawtooth(),
}


def _probes(texture: Texture, count: int, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    xy = rng.uniform(0.0, 2e-3, (count, 2))
    depth = texture.peak_to_valley * 10 ** rng.uniform(-3, 0.3, count)
    return np.column_stack([xy, texture.height(xy) - depth])


@pytest.mark.parametrize("texture", TEXTURES.values(), ids=list(TEXTURES))
@pytest.mark.parametrize("c", [1.0, 4.0])
def test_force_is_minus_the_gradient_of_the_potential(texture: Texture, c: float) -> None:
    surface = Surface(texture, "H", K, continuity=c)
    points = _probes(texture, 300)
    step = 1e-4 * texture.peak_to_valley
    gradient = np.stack(
        [
            (
                split_state(surface, points + step * axis).potential
                - split_state(surface, points - step * axis).potential
            )
            / (2 * step)
            for axis in np.eye(3)
        ],
        axis=-1,
    )
    inside = texture.height(points[:, :2]) - points[:, 2] > 2 * step * 20
    # The Hessian is at most k max(1, c): a central difference errs by at most half a step of it.
    error = np.linalg.norm(gradient + surface.force(points), axis=1)[inside]
    assert error.max() <= K * max(1.0, c) * step


@pytest.mark.parametrize("texture", TEXTURES.values(), ids=list(TEXTURES))
def test_potential_lies_between_its_bounds(texture: Texture) -> None:
    """(1 - μ) φ <= U <= φ, and the gap certifies the potential."""
    points = _probes(texture, 500)
    phi = 0.5 * K * np.sum((texture.nearest(points) - points) ** 2, axis=1)
    for c in (0.5, 1.0, 3.0):
        state = split_state(Surface(texture, "H", K, continuity=c), points)
        mu = 1.0 / (1.0 + c)
        assert (state.potential <= phi * (1 + 1e-12)).all()
        assert (state.potential >= (1.0 - mu) * phi * (1 - 1e-12)).all()
        # Shallow probes: positions are rounded to 1e-16 of 2 mm, 1e-13 of the depth.
        assert (state.gap <= 1e-11 * phi).all()


@pytest.mark.parametrize("texture", TEXTURES.values(), ids=list(TEXTURES))
def test_force_is_lipschitz_across_ridges(texture: Texture) -> None:
    """|Δf| <= k max(1, c) |Δp| for random and for adversarial pairs."""
    rng = np.random.default_rng(1)
    a = _probes(texture, 4000)
    b = a + rng.normal(size=a.shape) * 10 ** rng.uniform(-9, -4, (len(a), 1))
    for c in (1.0, 4.0):
        surface = Surface(texture, "H", K, continuity=c)
        change = np.linalg.norm(surface.force(b) - surface.force(a), axis=1)
        allowed = K * max(1.0, c) * np.linalg.norm(b - a, axis=1)
        assert (change <= allowed * (1 + 1e-6) + 1e-10 * K * PERIOD).all()


@pytest.mark.parametrize("letter", "DC")
def test_the_lipschitz_test_has_teeth(letter: str) -> None:
    texture = TEXTURES["steep"]
    a = _probes(texture, 4000)
    b = a + np.random.default_rng(1).normal(size=a.shape) * 1e-5
    surface = Surface(texture, letter, K)
    change = np.linalg.norm(surface.force(b) - surface.force(a), axis=1)
    assert (change > 2.0 * K * np.linalg.norm(b - a, axis=1)).any()


@pytest.mark.parametrize("texture", TEXTURES.values(), ids=list(TEXTURES))
def test_jacobian_against_differences_and_bounds(texture: Texture) -> None:
    c = 2.0
    surface = Surface(texture, "H", K, continuity=c)
    points = _probes(texture, 400)
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


def test_flat_wall_has_the_stiffness() -> None:
    flat = Profile(np.zeros(8), 1e-3)
    surface = Surface(flat, "H", K, max_depth=1e-3)
    points = [[1e-3, 0.0, -2e-4], [2e-3, 1.0, 1e-4]]
    np.testing.assert_allclose(surface.force(points), [[0, 0, 2e-4 * K], [0, 0, 0]], atol=1e-15 * K)
    np.testing.assert_allclose(surface.jacobian(points)[0], np.diag([0, 0, -K]), atol=1e-9)


def test_equals_d_up_to_its_fraction_of_the_way_to_the_medial_axis() -> None:
    """Below a crest of radius R: to c/(1 + c) R law D, beyond it softer, and no jump."""
    gentle = TEXTURES["gentle"]
    radius = PERIOD**2 / (4 * math.pi**2 * 0.05 * PERIOD)
    for c in (1.0, 3.0):
        limit = c / (1.0 + c) * radius
        split, single = Surface(gentle, "H", K, continuity=c), Surface(gentle, "D", K)
        x = 0.25 * PERIOD
        above = [[x, 0.0, 0.05 * PERIOD - 0.999 * limit]]
        below = [[x, 0.0, 0.05 * PERIOD - 1.2 * limit]]
        np.testing.assert_allclose(split.force(above), single.force(above), rtol=1e-9, atol=1e-12)
        assert split_state(split, below).atoms[0] == 2
        assert split.force(below)[0, 2] < single.force(below)[0, 2] * (1 - 1e-3)


def test_tends_to_d_as_c_grows() -> None:
    texture = TEXTURES["noise"]
    points = _probes(texture, 300)
    reference = Surface(texture, "D", K).force(points)
    distances = [
        np.median(np.linalg.norm(Surface(texture, "H", K, continuity=c).force(points) - reference))
        for c in (1.0, 10.0, 100.0)
    ]
    assert distances[0] > distances[1] > distances[2]


def test_loops_gain_nothing_across_the_medial_axis() -> None:
    texture = TEXTURES["noise"]
    rng = np.random.default_rng(3)
    for _ in range(3):
        loop = rng.uniform(0.5e-3, 1.5e-3, (4, 3)) - [0.0, 0.0, 1.4e-3]
        scale = 0.5 * K * 1e-6
        assert abs(loop_work(Surface(texture, "H", K), loop)) < 1e-9 * scale
        assert abs(loop_work(Surface(texture, "E", K), loop)) > 1e-4 * scale


def test_numbers_are_theorems() -> None:
    surface = Surface(TEXTURES["steep"], "H", continuity=2.5)
    for bound, value in ((characteristic_number(surface), 2.5), (one_sided_number(surface), 1.0)):
        assert (bound.lower, bound.upper, bound.method) == (value, value, "theorem")


def test_oscillation_saturates_at_depth() -> None:
    """MATH section 6, item 5: the RMS of one component is at most k l/(4√3), and nears it."""
    steep = Sinusoid(3.0 * PERIOD, PERIOD)
    surface = Surface(steep, "H", K)
    x = (np.arange(2000) + 0.5) / 2000 * PERIOD
    deep = np.column_stack([x, 0 * x, np.full(2000, -4.5 * PERIOD)])
    force = surface.force(deep)[:, 0]
    limit = K * PERIOD / (4 * math.sqrt(3))
    assert 0.99 * limit < force.std() < limit


@pytest.mark.parametrize("c", [0.0, -1.0, math.inf, math.nan])
def test_bad_continuity(c: float) -> None:
    with pytest.raises(ParameterError) as caught:
        Surface(TEXTURES["gentle"], "H", continuity=c)
    assert caught.value.argument == "continuity"


def test_state_is_of_the_split_contact_only() -> None:
    with pytest.raises(ParameterError, match="split contact"):
        split_state(Surface(TEXTURES["gentle"], "D"), [[0.0, 0.0, 0.0]])
