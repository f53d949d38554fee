"""Surfaces of shipped and user-defined laws against the reference, and invalid arguments."""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sympy as sp
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tests.helpers.reference import exact_force

from asperity.contacts.symbols import ContactSymbols
from asperity.core.errors import LawError, ParameterError
from asperity.laws import LAWS, REGISTERED_LAWS, Law
from asperity.surface import Surface
from asperity.textures import Fourier, HeightMap, Profile, Sinusoid, Texture

Check = Callable[..., Any]
LETTERS = "WABCDEFG"
D = 0.2e-3  # the depth of the clamps


# --- compiled = plain = reference -----------------------------------------------------------------

COMBINATIONS = [
    *(("sinusoid", letter) for letter in LETTERS),
    ("fourier", "B"),
    ("fourier", "F"),
    ("map", "D"),
    ("map", "G"),
    ("profile", "E"),
]
any_place = st.tuples(*2 * [st.floats(-1.5, 2.5)], st.floats(-0.5, 2.0))


@pytest.mark.parametrize(("name", "letter"), COMBINATIONS)
def test_compiled_plain_and_reference_values_agree(
    name: str, letter: str, make_texture: Check, plain: Check
):
    compiled = Surface(make_texture(name), letter)
    interpreted = plain(Surface(make_texture(name), letter))
    spans, origin = compiled.texture.domain.spans, compiled.texture.domain.origin
    size = compiled.texture.peak_to_valley

    @settings(
        max_examples=25,
        deadline=None,
        derandomize=True,
        database=None,
        suppress_health_check=list(HealthCheck),
    )
    @given(any_place)
    def check_agreement(place: tuple[float, float, float]) -> None:
        xy = origin + np.array(place[: len(spans)]) @ spans
        h = compiled.texture.height(xy[None, :])[0]
        p = np.array([*xy, min(h, 0.0) - place[2] * size])
        d = (0.3e-3, -0.2e-3)
        state = {"deflection": np.array([d])} if letter == "F" else {}
        force = compiled.force([p], **state)[0]
        scale = 1000.0 * max(abs(h), abs(p[2]))
        if letter not in "DE" or name == "sinusoid":  # else too slow; see test_nearest.py
            assert np.abs(force - interpreted.force([p], **state)[0]).max() <= 1e-12 * scale
        exact = np.array(exact_force(compiled, p, d).tolist(), dtype=float)[:, 0]
        assert np.abs(force - exact).max() <= 1e-10 * scale

    check_agreement()


# --- user-defined laws --------------------------------------------------------------------------


def user_defined_law(contact: Any, force: Callable[[ContactSymbols], Any], **options: Any) -> Law:
    return Law("V", "own", contact, force, **options)


def test_user_defined_law_with_a_parameter(wave: Sinusoid, inside: Check, plain: Check):
    law = user_defined_law(
        "vertical",
        lambda c: c.k * c.depth * (1 + c.parameter("hardening") * c.depth) * c.normal,
        parameters={"hardening": 2000.0},
    )
    points = inside(wave, 5, 16, 1e-3)
    depth = wave.height(points[:, :2]) - points[:, 2]
    plain_b = plain(Surface(wave, "B")).force(points)
    for law_parameters, value in ((None, 2000.0), ({"hardening": 500.0}, 500.0)):
        forces = plain(Surface(wave, law, law_parameters=law_parameters)).force(points)
        expected = plain_b * (1.0 + value * depth)[:, None]
        np.testing.assert_allclose(forces, expected, rtol=1e-12)


@pytest.mark.parametrize("contact", ["nominal", "vertical", "nearest"])
def test_relative_height_is_from_minus_one_to_one(contact: Any, wave: Sinusoid, plain: Check):
    law = user_defined_law(contact, lambda c: c.k * c.depth * (2 + c.relative_height) * c.e_z)
    turns = np.array([[0.25], [0.75]]) - 0.7 / (2 * math.pi)
    xy = wave.domain.points(turns)  # a crest and a trough
    shallow = np.zeros(2) if contact == "nominal" else wave.height(xy)
    forces = plain(Surface(wave, law)).force(np.column_stack([xy, shallow - 1e-6]))
    np.testing.assert_allclose(forces[:, 2], [3e-3, 1e-3], rtol=1e-9)


@pytest.mark.parametrize("contact", ["nominal", "vertical"])
@pytest.mark.parametrize("clamp", ["whole", "lateral"])
def test_jacobian_of_a_clamped_user_defined_law(
    contact: Any, clamp: Any, make_texture: Check, inside: Check, plain: Check, differences: Check
):
    texture = make_texture("fourier")
    law = user_defined_law(contact, lambda c: c.k * c.depth * c.normal, clampable=True)
    surface = plain(Surface(texture, law, max_depth=0.1e-3, clamp=clamp))
    points = inside(texture, 4, 17, 0.4e-3)
    numeric = differences(surface.force, points, step=3e-7)
    np.testing.assert_allclose(surface.jacobian(points), numeric, rtol=0, atol=1e-5)


@pytest.mark.parametrize("contact", ["vertical", "nearest", "split"])
def test_law_with_state_needs_the_nominal_contact(contact: Any):
    """The anchor is held while z < 0, which means contact only on the nominal contact."""
    with pytest.raises(LawError, match="nominal contact"):
        user_defined_law(contact, lambda c: c.k * c.e_z, stateful=True)


@pytest.mark.parametrize("contact", ["nearest", "split"])
def test_law_on_the_nearest_or_split_contact_cannot_be_clampable(contact: Any):
    with pytest.raises(LawError, match="not clamped"):
        user_defined_law(contact, lambda c: c.k * c.e_z, clampable=True)


def test_default_parameter_of_a_user_defined_law(wave: Sinusoid):
    law = user_defined_law(
        "nominal",
        lambda c: c.k * c.depth * c.parameter("friction") * c.e_z,
        parameters={"friction": 0.3},
    )
    assert Surface(wave, law).law_parameters == {"friction": 0.3}


def test_user_defined_law_may_reuse_a_letter(wave: Sinusoid, plain: Check):
    law = Law("C", "not-the-shipped-one", "nominal", lambda c: 2 * c.k * c.depth * c.e_z)
    force = plain(Surface(wave, law)).force([[0.0, 0.0, -1e-3]])
    np.testing.assert_allclose(force, [[0.0, 0.0, 2.0]])


def test_piecewise_law_has_a_kernel(wave: Sinusoid, plain: Check):
    law = user_defined_law("nominal", lambda c: c.k * sp.Min(c.depth, D) * c.e_z)
    forces = plain(Surface(wave, law)).force([[0.0, 0.0, -D / 2], [0.0, 0.0, -3 * D]])
    np.testing.assert_allclose(forces[:, 2], [500.0 * D, 1000.0 * D])


def test_law_with_state_needs_max_deflection(wave: Sinusoid):
    law = user_defined_law("nominal", lambda c: c.k * c.depth * c.e_z, stateful=True)
    with pytest.raises(LawError, match="needs the parameter max_deflection"):
        Surface(wave, law).force([[0.0, 0.0, -1e-3]])


# --- arguments ------------------------------------------------------------------------------------


def test_default_arguments_of_a_surface():
    surface = Surface(Sinusoid(0.2e-3, 1e-3))
    assert (surface.law, surface.stiffness, surface.clamp) == (LAWS["C"], 1000.0, "none")
    assert (surface.friction, surface.max_deflection, surface.modulation_depth) == (0.0, 1e-3, 0.8)
    assert surface.to_law("F").friction == 0.8
    assert surface.max_depth == 0.4e-3


@pytest.mark.parametrize(
    ("texture", "depth"),
    [
        (Sinusoid(0.2e-3, 1e-3), 0.4e-3),
        (Sinusoid(0.8e-3, 1e-3), 1e-3),  # at most 1 mm
        (Fourier([1e-4, 2e-4], [1e3, math.sqrt(2) * 1e3]), 0.6e-3),
        (HeightMap(np.full((4, 4), 1e-3), 1e-3), 1e-3),  # flat
        (Profile(np.zeros(4), 1e-3), 1e-3),
    ],
)
def test_default_depth_is_the_height_up_to_one_millimetre(texture: Texture, depth: float):
    assert Surface(texture, "A").max_depth == pytest.approx(depth)


def test_flat_texture_does_not_modulate_the_friction(plain: Check):
    flat = Profile(np.zeros(4), 1e-3)
    point, d = [[0.0, 0.0, -1e-3]], [[0.5e-3, 0.0]]
    force = plain(Surface(flat, "F")).force(point, deflection=d)
    np.testing.assert_allclose(force, [[-0.8 * 0.5 * 0.5, 0.0, 1.0]])


INVALID_ARGUMENTS: list[tuple[str, Any]] = [
    *[("texture", value) for value in (None, 3.0, np.zeros((4, 4)))],
    *[("law", value) for value in ("X", "", None, 1)],
    *[("stiffness", value) for value in (0.0, -1.0, math.nan, math.inf, "500 N", None, True)],
    *[("max_depth", value) for value in (0.0, -1e-3, math.nan, "1 kg")],
    *[("friction", value) for value in (-0.1, math.nan, math.inf, "high")],
    *[("max_deflection", value) for value in (0.0, -1e-3, math.nan)],
    *[("modulation_depth", value) for value in (-0.01, 1.01, math.nan, "0.5")],
    *[("clamp", value) for value in ("", "hole", "None", None, 1)],
    *[("law_parameters", value) for value in ({"gain": 1.0}, {"Friction": 0.5})],
]


@pytest.mark.parametrize(("argument", "value"), INVALID_ARGUMENTS)
def test_invalid_arguments_are_refused(argument: str, value: Any, wave: Sinusoid):
    arguments: dict[str, Any] = {"texture": wave, "law": "F", argument: value}
    with pytest.raises(ParameterError, match=f"^{argument} ") as error:
        Surface(**arguments)
    assert error.value.argument == argument


@pytest.mark.parametrize("value", [0.0, 1.0])
def test_limits_of_modulation_depth_and_friction_are_valid(value: float, wave: Sinusoid):
    assert Surface(wave, "F", modulation_depth=value).modulation_depth == value
    assert Surface(wave, "F", friction=0.0).friction == 0.0


def test_parameters_of_a_law_without_parameters_are_refused(wave: Sinusoid):
    with pytest.raises(ParameterError, match="it has none"):
        Surface(wave, "B", law_parameters={"friction": 0.5})


def test_law_parameter_must_be_a_finite_number(wave: Sinusoid):
    for value in (math.nan, "0.5", None):
        with pytest.raises(ParameterError) as error:
            Surface(wave, "F", law_parameters={"friction": value})
        assert error.value.argument == "friction"


INVALID_POINTS: list[Any] = [
    0.0,
    [],
    [0.0, 0.0, math.nan],
    [[0.0, 0.0]],
    [[0.0, 0.0, 0.0, 0.0]],
    np.zeros((2, 2, 3)),
    [[0.0, 0.0, math.nan]],
    [[math.inf, 0.0, 0.0]],
    [[0.0, 0.0, 0.0], [0.0, 0.0]],
    [["a", "b", "c"]],
    [[None, 0.0, 0.0]],
    None,
    np.array([[1.0 + 2.0j, 0.0, 0.0]]),
    np.ones((1, 3), dtype="datetime64[s]"),
]


@pytest.mark.parametrize("points", INVALID_POINTS, ids=repr)
def test_invalid_points_are_refused(points: Any, wave: Sinusoid):
    for letter in "CF":
        surface = Surface(wave, letter)
        for method, argument in (("force", "points"), ("jacobian", "points"), ("trace", "path")):
            with pytest.raises(ParameterError) as error:
                getattr(surface, method)(points)
            assert error.value.argument == argument


def test_force_does_not_depend_on_the_memory_layout_of_points(wave: Sinusoid):
    points = np.random.default_rng(18).normal(size=(6, 3)) * 1e-3
    surface = Surface(wave, "B")
    expected = surface.force(points)
    layouts = [points.tolist(), np.asfortranarray(points), points[::-1][::-1], points.astype(">f8")]
    for layout in layouts:
        np.testing.assert_array_equal(surface.force(layout), expected)
    read_only = points.copy()
    read_only.setflags(write=False)
    np.testing.assert_array_equal(surface.force(read_only), expected)


@pytest.mark.parametrize(
    ("argument", "value"),
    [
        ("deflection", np.zeros((2, 2))),
        ("deflection", np.zeros((3, 3))),
        ("deflection", np.zeros(3)),
        ("deflection", np.full((3, 2), math.nan)),
        ("deflection", [["a", "b"]] * 3),
        ("sliding", [True, False]),
        ("sliding", [0, 1, 0]),
        ("sliding", [[True], [False], [True]]),
        ("sliding", True),
    ],
)
def test_invalid_state_is_refused(argument: str, value: Any, wave: Sinusoid):
    surface = Surface(wave, "F")
    with pytest.raises(ParameterError) as error:
        surface.jacobian(np.zeros((3, 3)) - 1e-4, **{argument: value})
    assert error.value.argument == argument


def test_repr_of_a_surface_has_its_arguments(wave: Sinusoid):
    text = repr(Surface(wave, "B", stiffness=500.0, max_depth=D, clamp="backed"))
    for part in ("Sinusoid(", "law='B'", "stiffness=500.0", "max_depth=0.0002", "clamp='backed'"):
        assert part in text


# --- pickling -------------------------------------------------------------------------------------


@pytest.mark.parametrize("law", "WCFH")
def test_surface_can_be_pickled(law: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Values given for other laws are pickled; a user-defined law must be registered."""
    surface = Surface(Sinusoid(0.3e-3, 1.1e-3), law, 345.6, 0.7e-3, friction=0.4, continuity=2.0)
    points = np.array([[0.1e-3, 0.0, 0.0], [0.4e-3, 0.2e-3, -0.2e-3]])
    before = surface.force(points)
    copy = pickle.loads(pickle.dumps(surface))
    np.testing.assert_array_equal(copy.force(points), before)
    assert repr(copy) == repr(surface)
    assert copy.law is surface.law
    assert copy.law_parameters == surface.law_parameters
    assert copy.to_law("F").law_parameters["friction"] == 0.4
    assert copy.to_law("H").law_parameters["continuity"] == 2.0
    law_u = Law("U", "own", "vertical", lambda c: c.k * c.depth * c.e_z)
    with pytest.raises((TypeError, AttributeError, pickle.PicklingError)):
        pickle.dumps(surface.to_law(law_u))
    monkeypatch.setitem(REGISTERED_LAWS, "U", law_u)
    assert pickle.loads(pickle.dumps(surface.to_law(law_u))).law is law_u
