"""Surfaces: contact, force, Jacobian, clamps and state, and invalid arguments."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from asperity.core.errors import ParameterError
from asperity.surface import Surface
from asperity.textures import Sinusoid, Texture

Check = Callable[..., Any]
LETTERS = "WABCDEFG"
NOMINAL = "WFG"
D = 0.2e-3  # the depth of the clamps
STATE = {"friction": 0.7, "max_deflection": 0.8e-3}
CLAMPS = ["none", "whole", "lateral", "backed"]


# --- contact --------------------------------------------------------------------------------------


@pytest.mark.parametrize("letter", LETTERS)
def test_force_is_exactly_zero_outside(letter: str, wave: Sinusoid, scatter: Check):
    xy = scatter(wave, 40, seed=1)
    zero = 0.0 * xy[:, 0] if letter in NOMINAL else wave.height(xy)
    surface = Surface(wave, letter)
    for above in (0.0, 1e-12, 1e-3):
        points = np.column_stack([xy, zero + above])
        assert not surface.force(points).any()
        assert not surface.jacobian(points).any()


@pytest.mark.parametrize("letter", LETTERS)
def test_force_is_nonzero_from_a_depth_of_one_nanometre(
    letter: str, wave: Sinusoid, scatter: Check
):
    xy = scatter(wave, 40, seed=2)
    zero = 0.0 * xy[:, 0] if letter in NOMINAL else wave.height(xy)
    surface = Surface(wave, letter)
    for depth in (1e-9, 1e-3):
        points = np.column_stack([xy, zero - depth])
        assert (surface.force(points)[:, 2] > 0.0).all()
        assert (np.abs(surface.jacobian(points)).max(axis=(1, 2)) > 100.0).all()


@pytest.mark.parametrize("letter", NOMINAL)
def test_nominal_contact_does_not_depend_on_the_height(letter: str, wave: Sinusoid):
    crest = wave.domain.points(np.array([[0.25 - 0.7 / (2 * math.pi)]]))
    below_the_crest = np.column_stack([crest, [0.1e-3]])
    assert wave.height(crest)[0] == pytest.approx(0.4e-3)
    assert not Surface(wave, letter).force(below_the_crest).any()
    assert Surface(wave, "B").force(below_the_crest).any()


# --- force and Jacobian ---------------------------------------------------------------------------


def contact_arguments(surface: Surface, p: np.ndarray) -> dict[str, Any]:
    """Return the contact arguments of the explicit formulas for one probe inside."""
    texture = surface.texture
    xy = (
        texture.nearest(p[None, :])[:, :2] if surface.law.contact.name == "nearest" else p[None, :2]
    )
    h, hx, hy, hxx, hxy, hyy = texture.derivatives(xy)[0]
    low, high = texture.extremes
    half = (high - low) / 2
    depth = {
        "nominal": -p[2],
        "vertical": h - p[2],
        "nearest": float(np.linalg.norm([*(xy[0] - p[:2]), h - p[2]])),
    }[surface.law.contact.name]
    return {
        "k": surface.stiffness,
        "depth": depth,
        "g": (hx, hy),
        "hessian": np.array([[hxx, hxy], [hxy, hyy]]),
        "m": (1 + surface.modulation_depth * (h - (low + high) / 2) / half) / 2,
        "m_slope": surface.modulation_depth * np.array([hx, hy]) / half / 2,
    }


def expected_force(surface: Surface, p: np.ndarray, d: np.ndarray, by_hand: Check) -> np.ndarray:
    arguments = contact_arguments(surface, p)
    arguments = {name: arguments[name] for name in ("k", "depth", "g", "m")}
    return np.asarray(by_hand(surface.law.letter, **arguments, d=d, **STATE))


def deflections(count: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    turn = rng.uniform(0, 2 * np.pi, count)
    length = STATE["max_deflection"] * np.sqrt(rng.random(count))
    return np.column_stack([length * np.cos(turn), length * np.sin(turn)])


def state_of(letter: str, deflection: np.ndarray) -> dict[str, Any]:
    return {"deflection": deflection} if letter == "F" else {}


@pytest.mark.parametrize("texture", ["sinusoid", "fourier", "periodic map"], indirect=True)
@pytest.mark.parametrize("letter", LETTERS)
def test_force_equals_the_formula(
    letter: str, texture: Texture, inside: Check, plain: Check, force_by_hand: Check
):
    surface = plain(Surface(texture, letter, stiffness=650.0, modulation_depth=0.6, **STATE))
    points, d = inside(texture, 6, 3, 1e-3), deflections(6, 4)
    forces = surface.force(points, **state_of(letter, d))
    for i, p in enumerate(points):
        expected = expected_force(surface, p, d[i], force_by_hand)
        assert np.abs(forces[i] - expected).max() <= 1e-12 * np.linalg.norm(expected)


@pytest.mark.parametrize("texture", ["sinusoid", "fourier", "periodic map"], indirect=True)
@pytest.mark.parametrize("letter", LETTERS)
def test_jacobian_equals_the_closed_form(
    letter: str, texture: Texture, inside: Check, plain: Check, jacobian_by_hand: Check
):
    surface = plain(Surface(texture, letter, stiffness=650.0, modulation_depth=0.6, **STATE))
    points, d = inside(texture, 6, 3, 1e-3), deflections(6, 4)
    for sliding in (False, True) if letter == "F" else (False,):
        state = state_of(letter, d)
        if letter == "F":
            state["sliding"] = np.full(6, sliding)
        jacobians = surface.jacobian(points, **state)
        for i, p in enumerate(points):
            arguments = contact_arguments(surface, p)
            if letter == "F":
                arguments |= {"d": d[i], "sliding": sliding, **STATE}
            else:
                del arguments["m"], arguments["m_slope"]
            expected = jacobian_by_hand(letter, **arguments)
            error = np.abs(jacobians[i] - expected).max()
            assert error <= 1e-9 * np.linalg.norm(expected, 2)


@pytest.mark.parametrize("texture", ["sinusoid", "fourier", "map"], indirect=True)
@pytest.mark.parametrize("letter", LETTERS)
def test_jacobian_equals_differences_of_the_force(
    letter: str, texture: Texture, inside: Check, plain: Check, differences: Check
):
    surface = plain(Surface(texture, letter, modulation_depth=0.6, **STATE))
    points, d = inside(texture, 4, 5, 0.3e-3), 0.9 * deflections(4, 6)
    anchor = points[:, :2] - d

    def force(moved: np.ndarray) -> np.ndarray:
        return np.asarray(surface.force(moved, **state_of(letter, moved[:, :2] - anchor)))

    jacobian = surface.jacobian(points, **state_of(letter, d))
    numeric = differences(force, points, step=3e-7)
    norms = np.linalg.norm(jacobian, 2, axis=(1, 2))
    assert (np.abs(numeric - jacobian).max(axis=(1, 2)) <= 2e-8 * norms).all()


def test_jacobian_of_a_sliding_anchor_follows_its_circle(wave: Sinusoid, differences: Check):
    surface = Surface(wave, "F", **STATE)
    points = np.array([[1e-4, 2e-4, -0.3e-3]])
    d = np.array([[0.48e-3, -0.64e-3]])
    anchor = points[:, :2] - d

    def force(moved: np.ndarray) -> np.ndarray:
        pulled = moved[:, :2] - anchor
        length = np.hypot(*pulled.T)[:, None]
        return np.asarray(surface.force(moved, deflection=0.8e-3 * pulled / length))

    numeric = differences(force, points, step=3e-7)
    sliding = surface.jacobian(points, deflection=d, sliding=[True])
    sticking = surface.jacobian(points, deflection=d, sliding=[False])
    np.testing.assert_allclose(sliding, numeric, rtol=0, atol=1e-8 * np.abs(numeric).max())
    u = d[0] / np.hypot(*d[0])
    across = np.array([-u[1], u[0]])
    lateral = (sticking - sliding)[0, :2, :2]
    assert np.abs(lateral @ across).max() < 1e-12 * np.abs(lateral).max()
    # Without a deflection there is no direction to slide in.
    np.testing.assert_array_equal(
        surface.jacobian(points, sliding=[True]), surface.jacobian(points, sliding=[False])
    )


@pytest.mark.parametrize("clamp", CLAMPS)
@pytest.mark.parametrize("letter", LETTERS)
def test_force_and_jacobian_are_linear_in_the_stiffness(
    letter: str, clamp: str, wave: Sinusoid, inside: Check, plain: Check
):
    points = inside(wave, 5, 7, 1e-3)
    soft, hard = (
        plain(Surface(wave, letter, stiffness=k, clamp=clamp, max_depth=D)) for k in (250.0, 1000.0)
    )
    np.testing.assert_array_equal(hard.force(points), 4.0 * soft.force(points))
    np.testing.assert_allclose(hard.jacobian(points), 4.0 * soft.jacobian(points), rtol=1e-14)


# --- clamps ---------------------------------------------------------------------------------------


def expected_clamped_force(
    surface: Surface, p: np.ndarray, d: np.ndarray, by_hand: Check
) -> np.ndarray:
    arguments = contact_arguments(surface, p)
    arguments = {name: arguments[name] for name in ("k", "depth", "g", "m")}
    letter, clamp = surface.law.letter, surface.clamp
    free = by_hand(letter, **arguments, d=d, **STATE)
    clamped = by_hand(letter, **(arguments | {"depth": min(arguments["depth"], D)}), d=d, **STATE)
    if clamp == "none":
        return np.asarray(free)
    if clamp == "lateral":
        return np.array([clamped[0], clamped[1], free[2]])
    if clamp == "backed":
        low = -D if letter in NOMINAL else surface.texture.extremes[0] - D
        clamped = clamped + np.array([0.0, 0.0, surface.stiffness * max(low - p[2], 0.0)])
    return np.asarray(clamped)


def shallow_and_deep(texture: Texture, nominal: bool, scatter: Check) -> np.ndarray:
    """Return probes above and below the clamp's depth and above and below the backing wall."""
    xy = scatter(texture, 9, seed=8)
    top = np.zeros(9) if nominal else texture.height(xy)
    points = np.column_stack([xy, top - D * np.tile([0.3, 0.95, 1.5], 3)])
    points[6:, 2] = min(texture.extremes[0], 0.0) - np.array([1.01, 1.5, 8.0]) * D
    return points


@pytest.mark.parametrize("clamp", CLAMPS)
@pytest.mark.parametrize("letter", "ABCFG")
def test_clamped_force_equals_the_formula(
    letter: str, clamp: Any, make_texture: Check, scatter: Check, plain: Check, force_by_hand: Check
):
    texture = make_texture("fourier")
    surface = plain(Surface(texture, letter, max_depth=D, clamp=clamp, **STATE))
    points, d = shallow_and_deep(texture, letter in NOMINAL, scatter), deflections(9, 9)
    forces = surface.force(points, **state_of(letter, d))
    for i, p in enumerate(points):
        expected = expected_clamped_force(surface, p, d[i], force_by_hand)
        assert np.abs(forces[i] - expected).max() <= 1e-12 * np.linalg.norm(expected)


@pytest.mark.parametrize("clamp", CLAMPS[1:])
@pytest.mark.parametrize("letter", "ABCFG")
def test_clamped_jacobian_equals_differences_of_the_force(
    letter: str, clamp: Any, make_texture: Check, scatter: Check, plain: Check, differences: Check
):
    texture = make_texture("fourier")
    surface = plain(Surface(texture, letter, max_depth=D, clamp=clamp, **STATE))
    points, d = shallow_and_deep(texture, letter in NOMINAL, scatter), deflections(9, 10) / 2
    anchor = points[:, :2] - d

    def force(moved: np.ndarray) -> np.ndarray:
        return np.asarray(surface.force(moved, **state_of(letter, moved[:, :2] - anchor)))

    jacobian = surface.jacobian(points, **state_of(letter, d))
    error = np.abs(differences(force, points, step=3e-7) - jacobian).max(axis=(1, 2))
    assert (error <= 1e-8 * 1000.0).all()


@pytest.mark.parametrize("clamp", CLAMPS[1:])
@pytest.mark.parametrize("letter", "WDE")
def test_clamp_has_no_effect_on_bounded_laws(
    letter: str, clamp: Any, wave: Sinusoid, scatter: Check
):
    points = shallow_and_deep(wave, letter in NOMINAL, scatter)
    free, clamped = Surface(wave, letter), Surface(wave, letter, max_depth=D, clamp=clamp)
    np.testing.assert_array_equal(clamped.force(points), free.force(points))
    np.testing.assert_array_equal(clamped.jacobian(points), free.jacobian(points))


@pytest.mark.parametrize(("name", "letter"), [("sinusoid", "C"), ("sinusoid", "F"), ("map", "G")])
@pytest.mark.parametrize("clamp", ["lateral", "backed"])
def test_compiled_clamps_equal_interpreted_ones(
    name: str, letter: str, clamp: Any, make_texture: Check, scatter: Check, plain: Check
):
    texture = make_texture(name)
    points = shallow_and_deep(texture, letter in NOMINAL, scatter)
    surface = Surface(texture, letter, max_depth=D, clamp=clamp)
    forces, jacobians = surface.force(points), surface.jacobian(points)
    interpreted = plain(Surface(make_texture(name), letter, max_depth=D, clamp=clamp))
    np.testing.assert_allclose(interpreted.force(points), forces, rtol=0, atol=1e-15)
    np.testing.assert_allclose(interpreted.jacobian(points), jacobians, rtol=0, atol=1e-10)


def curl(surface: Surface, points: np.ndarray, differences: Check) -> np.ndarray:
    jacobian = differences(surface.force, points, step=3e-7)
    return np.asarray(np.abs(jacobian - jacobian.transpose(0, 2, 1)).max(axis=(1, 2)))


@pytest.mark.parametrize(
    ("clamp", "conservative"),
    [("none", True), ("whole", True), ("backed", True), ("lateral", False)],
)
def test_only_the_lateral_clamp_gives_law_c_a_curl(
    clamp: Any,
    conservative: bool,
    make_texture: Check,
    scatter: Check,
    plain: Check,
    differences: Check,
):
    texture = make_texture("fourier")
    surface = plain(Surface(texture, "C", max_depth=D, clamp=clamp))
    deep = shallow_and_deep(texture, False, scatter)[2:]
    deep = deep[texture.height(deep[:, :2]) - deep[:, 2] > D]
    curls = curl(surface, deep, differences)
    assert len(deep) >= 5
    assert (curls < 1e-6).all() if conservative else (curls > 10.0).all()


def test_backing_wall_adds_a_force_below_the_clamped_depth(wave: Sinusoid, scatter: Check):
    """The clamp "whole" alone saturates at k D, which a strong hand exceeds."""
    xy = scatter(wave, 10, seed=11)
    points = np.column_stack([xy, np.full(10, -5e-3)])
    whole = Surface(wave, "B", max_depth=D, clamp="whole").force(points)
    backed = Surface(wave, "B", max_depth=D, clamp="backed").force(points)
    assert np.linalg.norm(whole, axis=1) == pytest.approx(1000.0 * D)
    np.testing.assert_allclose((backed - whole)[:, 2], 1000.0 * (5e-3 - 0.4e-3 - D), rtol=1e-12)
    assert not (backed - whole)[:, :2].any()


@pytest.mark.parametrize(("letter", "floor"), [("C", -0.4e-3 - D), ("G", -D), ("F", -D)])
def test_floor_of_the_backing_wall(letter: str, floor: float, wave: Sinusoid):
    assert Surface(wave, letter, max_depth=D, clamp="backed").floor == pytest.approx(floor)


# --- friction: deflection and trace ---------------------------------------------------------------


def test_friction_is_zero_without_a_deflection(wave: Sinusoid, inside: Check):
    points = inside(wave, 5, 12, 1e-3)
    surface = Surface(wave, "F")
    forces = surface.force(points)
    np.testing.assert_array_equal(forces, surface.force(points, deflection=np.zeros((5, 2))))
    assert not forces[:, :2].any()
    np.testing.assert_allclose(forces[:, 2], -1000.0 * points[:, 2])


def test_deflection_may_have_at_most_the_maximum_length(wave: Sinusoid):
    surface = Surface(wave, "F", max_deflection=0.8e-3)
    turn = np.linspace(0.0, 2 * np.pi, 100)
    longest = 0.8e-3 * np.column_stack([np.cos(turn), np.sin(turn)])
    points = np.tile([1e-4, 0.0, -1e-4], (100, 1))
    assert np.isfinite(surface.force(points, deflection=longest)).all()
    for method in (surface.force, surface.jacobian):
        with pytest.raises(ParameterError, match="max_deflection") as error:
            method(points, deflection=longest * (1 + 1e-9))
        assert error.value.argument == "deflection"


@pytest.mark.parametrize("letter", LETTERS.replace("F", ""))
def test_law_without_state_refuses_state_arguments(letter: str, wave: Sinusoid):
    surface, point = Surface(wave, letter), [[0.0, 0.0, -1e-3]]
    for call in (
        lambda: surface.force(point, deflection=[[0.0, 0.0]]),
        lambda: surface.jacobian(point, deflection=[[0.0, 0.0]]),
        lambda: surface.jacobian(point, sliding=[False]),
    ):
        with pytest.raises(ParameterError, match="meaningless"):
            call()


class Anchor:
    """Stick and slip step by step: the probe drags an anchor at a fixed maximum distance."""

    def __init__(self, length: float) -> None:
        self.length = length
        self.place: complex | None = None

    def deflection(self, x: float, y: float, touching: bool) -> complex:
        if not touching:
            self.place = None
            return 0j
        here = complex(x, y)
        if self.place is None:
            self.place = here
        if abs(here - self.place) > self.length:
            self.place = here - self.length * (here - self.place) / abs(here - self.place)
        return here - self.place


def wandering_path(count: int, seed: int) -> np.ndarray:
    """Return a path that slides, reverses, leaves the surface and returns."""
    rng = np.random.default_rng(seed)
    steps = (
        rng.normal(size=(count, 2)) * 0.15e-3 + 0.05e-3 * np.sin(np.arange(count) / 40.0)[:, None]
    )
    heights = 0.4e-3 * np.sin(np.arange(count) / 25.0) - 0.1e-3
    return np.column_stack([np.cumsum(steps, axis=0), heights])


def test_trace_of_friction_propagates_the_anchor(
    make_texture: Check, plain: Check, force_by_hand: Check
):
    texture = make_texture("fourier")
    surface = plain(Surface(texture, "F", modulation_depth=0.6, **STATE))
    path = wandering_path(400, seed=13)
    traced = surface.trace(path)
    anchor, dragged, touched = Anchor(STATE["max_deflection"]), 0, 0
    for i, p in enumerate(path):
        d = anchor.deflection(p[0], p[1], p[2] < 0.0)
        dragged += abs(d) > 0.999 * STATE["max_deflection"]
        touched += p[2] < 0.0
        expected = np.zeros(3)
        if p[2] < 0.0:
            expected = expected_force(surface, p, np.array([d.real, d.imag]), force_by_hand)
        assert np.abs(traced[i] - expected).max() <= 1e-12
    assert 50 < dragged < touched - 50  # the path sticks and slips
    assert touched < 350  # and loses contact


def test_compiled_trace_equals_the_interpreted_one(make_texture: Check, plain: Check):
    path = wandering_path(400, seed=14)
    compiled = Surface(make_texture("sinusoid"), "F", **STATE).trace(path)
    interpreted = plain(Surface(make_texture("sinusoid"), "F", **STATE)).trace(path)
    np.testing.assert_allclose(compiled, interpreted, rtol=0, atol=1e-15)


def test_anchor_is_released_when_contact_is_lost(wave: Sinusoid):
    surface = Surface(wave, "F")
    push, lift = [0.0, 0.0, -1e-4], [0.2e-3, 0.0, 0.0]
    path = [push, [0.3e-3, 0.0, -1e-4], lift, [0.4e-3, 0.0, -1e-4], [0.5e-3, 0.0, -1e-4]]
    friction = surface.trace(path)[:, 0]
    assert friction[0] == friction[2] == friction[3] == 0.0  # set, released, set again
    assert friction[1] < 0.0
    assert friction[4] < 0.0


def test_every_trace_starts_without_an_anchor(wave: Sinusoid):
    surface = Surface(wave, "F")
    path = np.array([[0.0, 0.0, -1e-4], [0.3e-3, 0.0, -1e-4]])
    np.testing.assert_array_equal(surface.trace(path), surface.trace(path))
    assert not surface.trace(path + np.array([1.0, 2.0, 0.0]))[0, :2].any()


@pytest.mark.parametrize("letter", LETTERS.replace("F", ""))
def test_trace_without_state_equals_the_force(letter: str, wave: Sinusoid):
    path = wandering_path(60, seed=15)
    surface = Surface(wave, letter)
    np.testing.assert_array_equal(surface.trace(path), surface.force(path))


def test_empty_path_has_an_empty_trace(wave: Sinusoid):
    for letter in "CF":
        surface = Surface(wave, letter)
        assert surface.trace(np.zeros((0, 3))).shape == (0, 3)
        assert surface.force(np.zeros((0, 3))).shape == (0, 3)
        assert surface.jacobian(np.zeros((0, 3))).shape == (0, 3, 3)
