"""Certified numbers: nothing exceeds ``upper``, ``lower`` is attained, and the gap is not idle.

The random surfaces are those of the long run, ``python -m bench.certificates --random 10000``.
"""

from __future__ import annotations

import importlib.util
import math
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from asperity.analysis import characteristic_number, one_sided_number
from asperity.analysis.bounds.bound import Bound
from asperity.analysis.bounds.measures import (
    CURL,
    NORM,
    ONE_SIDED,
    curl,
    precise_norm,
    precise_one_sided,
)
from asperity.analysis.gain import closed_forms
from asperity.analysis.gain.certificate import certified
from asperity.analysis.gain.characteristic import curl_number
from asperity.analysis.gain.friction import largest_singular_value
from asperity.analysis.gain.medial_axis import sharpest_crest
from asperity.analysis.gain.search import Search
from asperity.analysis.gain.theorems import safe_bound
from asperity.definition import exact_jacobian
from asperity.errors import ParameterError
from asperity.laws import Law
from asperity.surface import Surface
from asperity.textures import Fourier, HeightMap, Profile, Sinusoid, Texture

_PATH = Path(__file__).parents[2] / "bench" / "random_surfaces.py"


def fixed(examples: int) -> settings:
    """Return the profile of every test here: the same examples in every run."""
    return settings(
        max_examples=examples,
        deadline=None,
        derandomize=True,
        database=None,
        suppress_health_check=list(HealthCheck),
    )


MEASURES = {
    "norm": (characteristic_number, precise_norm),
    "one-sided": (one_sided_number, precise_one_sided),
    "curl": (curl_number, curl),
}


@pytest.fixture(scope="module")
def chance() -> ModuleType:
    spec = importlib.util.spec_from_file_location("random_surfaces", _PATH)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    module.WORK_LIMIT = 40_000
    return module


def evaluated(surface: Surface, bound: Bound, name: str) -> float:
    """Return what the surface's own Jacobian gives at the witness."""
    state: tuple[Any, ...] = ()
    if bound.deflection is not None:
        state = (np.array([bound.deflection]), np.array([bound.sliding]))
    jacobian = surface.jacobian([bound.at], *state) / surface.stiffness
    return float(MEASURES[name][1](jacobian)[0])


def check(surface: Surface, bound: Bound, name: str, gap: float) -> None:
    """Check what every bound promises."""
    assert bound.lower <= bound.upper
    assert evaluated(surface, bound, name) == pytest.approx(bound.lower, rel=1e-12)
    assert bound.gap <= 1.01 * gap


# --- random surfaces ------------------------------------------------------------------------------


def test_random_surfaces(chance: ModuleType) -> None:
    seen = set()

    @fixed(45)
    @given(st.integers(0, 2**32))
    def holds(seed: int) -> None:
        found = chance.trial(seed, "ABCDFG", points=60)
        assert found.right, found
        assert found.tight, found
        seen.add((found.kind, found.name, found.bound.method))

    holds()
    assert len(seen) > 18


def test_a_wrong_bound_is_noticed(chance: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    """The negative control: upper bounds 1 per cent too low, witnesses 1e-9 off."""

    def low(surface: Surface, **_options: Any) -> Bound:
        bound = characteristic_number(surface)
        assert bound.at is not None
        at = (bound.at[0], bound.at[1], bound.at[2] * 1.01)
        return Bound(bound.lower * (1.0 + 1e-9), 0.99 * bound.upper, "certified", at)

    monkeypatch.setitem(chance.NUMBERS, "q", (low, precise_norm))
    monkeypatch.setattr(chance, "NUMBERS", {"q": chance.NUMBERS["q"]})
    # The points that are tried are not made for the supremum: half of them are near the witness.
    wrong = [chance.trial(seed, "BG", points=200) for seed in range(8)]
    assert all(found.missed > 1e-10 for found in wrong)
    assert sum(found.excess > 1e-12 for found in wrong) >= 4


# --- where the supremum is known ------------------------------------------------------------------


def as_sum(texture: Sinusoid) -> Fourier:
    """Return the same surface as a sum, for which there is no closed form."""
    k = 2.0 * math.pi / texture.period
    vector = [[k * texture.direction[0], k * texture.direction[1]]]
    return Fourier([texture.amplitude], vector, [texture.phase])


KNOWN = [
    ("A", "norm", closed_forms.q_a),
    ("B", "norm", closed_forms.q_b),
    ("C", "norm", closed_forms.q_c),
    ("D", "norm", closed_forms.q_d),
    ("G", "norm", closed_forms.q_g),
    ("A", "one-sided", closed_forms.one_sided_a),
    ("C", "one-sided", closed_forms.q_c),
    ("A", "curl", closed_forms.curl_a),
    ("E", "curl", closed_forms.curl_e),
]
shapes = st.tuples(st.floats(-2.5, 1.0), st.floats(-2.0, 1.0), st.floats(-8.0, 3.0))


@pytest.mark.parametrize(("letter", "name", "exact"), KNOWN)
def test_closed_forms_lie_inside_certified_bounds(letter: str, name: str, exact: Any) -> None:
    """And an upper bound lowered by twice the gap would not hold them: the gap is what it says."""

    @fixed(12)
    @given(shapes)
    def holds(shape: tuple[float, float, float]) -> None:
        length = 10.0 ** shape[2]
        wave = Sinusoid(length * 10.0 ** shape[0], length, 0.7, (2.0, -1.0))
        depth = length * 10.0 ** shape[1]
        y = 4 * math.pi**2 * wave.amplitude * depth / length**2
        if letter == "D" and y > 0.99:
            depth *= 0.7 / y
        value = exact(wave, depth)
        surface = Surface(as_sum(wave), letter, max_depth=depth)
        number = MEASURES[name][0]
        for tolerance in (1e-3, 1e-6):
            bound = number(surface, tolerance=tolerance)
            assert bound.method in {"certified", "theorem"}
            assert bound.lower <= value * (1.0 + 1e-12)
            assert value <= bound.upper * (1.0 + 1e-13)
            if bound.upper > 1e-6:
                check(surface, bound, name, tolerance)
                lowered = bound.upper - 2.0 * max(bound.upper - bound.lower, 1e-13 * bound.upper)
                assert lowered < value
        closed = number(Surface(wave, letter, max_depth=depth))
        assert closed.method == "closed form"
        assert closed.upper == value
        check(Surface(wave, letter, max_depth=depth), closed, name, 1e-9)

    holds()


def test_law_f_against_the_definition_of_its_number() -> None:
    """1-D maximum over the phase, by a dense scan and golden section; MATH: 2.4863 < 2.84."""
    wave = Sinusoid(0.8e-3, 1e-3)
    surface = Surface(wave, "F", max_depth=1e-3)

    def number(phase: Any) -> Any:
        still = 0.5 * (1.0 - 0.8 * np.sin(phase))
        slope = 0.5 * 0.8 * 2.0 * np.pi / 1e-3 * np.abs(np.cos(phase))
        a = 0.8 * 1e-3 * (still / 1e-3 + slope)
        return largest_singular_value(a, 0.8 * still)

    phases = np.linspace(-math.pi, math.pi, 2_000_001)
    best = float(number(phases).max())
    bound, at_once = characteristic_number(surface), characteristic_number(surface, tolerance=1e-5)
    assert best == pytest.approx(2.4863, abs=5e-5)
    for found, gap in ((bound, 1e-9), (at_once, 1e-6)):
        assert found.lower <= best * (1.0 + 1e-12)
        assert best <= found.upper
        assert found.gap <= gap
        assert found.upper - 2.0 * (found.upper - found.lower) < best
    check(surface, bound, "norm", 1e-6)
    assert "tangents" in at_once.note
    assert "cells" in bound.note


@pytest.mark.parametrize("modulation", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("name", ["norm", "one-sided"])
def test_law_f_at_once_and_by_cells_are_one(modulation: float, name: str) -> None:
    for amplitude, phase in ((1e-6, 0.0), (0.4e-3, 2.0), (3e-3, -9.0)):
        wave = Sinusoid(amplitude, 1.5e-3, phase, (1.0, 3.0))
        options = {"max_depth": 0.7e-3, "max_deflection": 0.2e-3, "modulation_depth": modulation}
        number = MEASURES[name][0]
        once = number(Surface(wave, "F", friction=1.3, **options), tolerance=1e-4)  # type: ignore[arg-type]  # one kind of values
        cells = number(Surface(as_sum(wave), "F", friction=1.3, **options), tolerance=1e-7)  # type: ignore[arg-type]  # one kind of values
        assert once.lower <= cells.upper * (1.0 + 1e-13)
        assert cells.lower <= once.upper
        assert once.gap < 1e-6
        check(Surface(wave, "F", friction=1.3, **options), once, name, 1e-6)  # type: ignore[arg-type]  # one kind of values


def test_c_on_sharp_crests_has_the_two_numbers_of_the_theory() -> None:
    waves = 2.0 * math.pi * np.array([1.0, 2.0, 3.0])
    surface = Surface(Fourier([0.1, 0.04, 0.02], waves, [math.pi / 2] * 3), "C", max_depth=0.5)
    q, plus = characteristic_number(surface), one_sided_number(surface)
    assert q.lower <= 8.685 + 5e-4
    assert q.upper >= 8.685 - 5e-4
    assert plus.upper == pytest.approx(5.533, abs=5e-4)
    check(surface, q, "norm", 1e-6)
    check(surface, plus, "one-sided", 1e-6)


def test_the_witness_attains_in_forty_digits() -> None:
    """Evaluated by the definition, which shares no code with kernels or cells."""
    waves = Fourier([2e-4, 1e-4], [[2100.0, 300.0], [-500.0, 1700.0]], [0.4, 1.1])
    for letter in "BG":
        surface = Surface(waves, letter, stiffness=1.0, max_depth=0.3e-3)
        bound = characteristic_number(surface)
        assert bound.at is not None
        with mpmath.workdps(40):
            matrix = exact_jacobian(surface, bound.at, digits=40)
            largest = max(mpmath.svd(matrix, compute_uv=False))
        assert float(largest) == pytest.approx(bound.lower, rel=1e-12)
        assert largest <= bound.upper


# --- kinds of surfaces ----------------------------------------------------------------------------

RNG = np.random.default_rng(99)
ROUGH = RNG.normal(size=(9, 11))
KINDS: dict[str, Texture] = {
    "map": HeightMap(1e-4 * ROUGH, (3e-4, 5e-4), origin=(-1e-3, 2e-3)),
    "periodic map": HeightMap(1e-4 * ROUGH, 3e-4, periodic=True),
    "sharp map": HeightMap(1e-2 * ROUGH, 1e-4),
    "map on a mountain": HeightMap(1e-4 * ROUGH + 300.0, 3e-4),
    "profile": Profile(1e-4 * ROUGH[0], 3e-4, origin=7e-3),
    "periodic profile": Profile(1e-3 * ROUGH[1], 3e-4, periodic=True),
    "periodic sum": Fourier([2e-4, 1e-4], [[2e3, 3e2], [-5e2, 1e3]], [0.4, 1.1]),
    "three phases": Fourier([9e-5, 8e-5, 7e-5], 1e3 * RNG.normal(size=(3, 2))),
    "nanometres": Fourier([1e-9, 1e-9], 2e9 * RNG.normal(size=(2, 2))),
    "kilometres": Fourier([1e2, 1e2], 1e-3 * RNG.normal(size=(2, 2))),
    "far phases": Fourier([1e-4, 1e-4], 2e3 * RNG.normal(size=(2, 2)), [1e6, -3e5]),
}


@pytest.mark.parametrize(
    ("letter", "name"), [("B", "norm"), ("B", "one-sided"), ("B", "curl"), ("G", "norm")]
)
@pytest.mark.parametrize("kind", KINDS)
def test_no_dense_sample_exceeds_the_upper_bound(
    chance: ModuleType, kind: str, letter: str, name: str
) -> None:
    texture = KINDS[kind]
    surface = Surface(texture, letter, max_depth=0.3 * texture.peak_to_valley)
    number, measure = MEASURES[name]
    gap = {"three phases": 1e-4}.get(kind, 1e-3 if "map" in kind else 1e-6)
    bound = number(surface, tolerance=gap)
    check(surface, bound, name, gap)
    assert bound.at is not None
    contacts = chance.random_contacts(np.random.default_rng(1), surface, 4000, bound.at[:2])
    # Heights of 300 m leave fewer digits to a depth of a tenth of a millimetre.
    rounding = 1e-8 if "mountain" in kind else 1e-12
    values = measure(contacts.jacobians(surface))
    assert values.max() <= bound.upper * (1.0 + rounding)
    assert values.max() >= 0.5 * bound.lower  # the points are worth something


def test_a_flat_surface_has_the_numbers_of_a_wall() -> None:
    for texture in (HeightMap(np.zeros((6, 6)), 1e-3), Fourier([0.0, 0.0], [[1e3, 0.0], [0, 5e2]])):
        for letter in "WABCDEGH":
            surface = Surface(texture, letter, max_depth=1e-3)
            for number in (characteristic_number, one_sided_number):
                bound = number(surface)
                # The quick way to a norm has half the digits, enough for a map's 1e-3.
                assert (bound.lower, bound.upper) == pytest.approx((1.0, 1.0), rel=2e-7)
            assert curl_number(surface).upper <= 1e-8
        friction = Surface(texture, "F", max_depth=1e-3)
        stick = largest_singular_value(np.array([0.4]), np.array([0.4]))
        assert characteristic_number(friction).upper == pytest.approx(float(stick[0]), rel=1e-9)


def test_five_hundred_waves() -> None:
    multiples = RNG.integers(-6, 7, (500, 2))
    multiples[~multiples.any(axis=1)] = 1
    waves = multiples @ np.array([[900.0, 100.0], [-300.0, 800.0]])
    texture = Fourier(2e-6 * RNG.normal(size=500), waves, RNG.uniform(0, 7, 500))
    surface = Surface(texture, "A", max_depth=1e-4)
    bound = characteristic_number(surface, tolerance=1e-4)
    check(surface, bound, "norm", 1e-4)
    slopes = np.hypot(*texture.gradient(RNG.random((3000, 2))).T)
    assert np.hypot(1.0, slopes.max()) <= bound.upper


# --- the medial axis ------------------------------------------------------------------------------


def test_law_d_around_the_depths_where_its_number_changes() -> None:
    """Of y it leaves 1 at 1/2, and becomes infinite at 1."""
    wave = Sinusoid(0.2e-3, 2e-3, 0.3)
    radius = wave.period**2 / (4 * math.pi**2 * wave.amplitude)
    for texture, method in ((wave, "closed form"), (as_sum(wave), "certified")):
        for y in (0.3, 0.5 - 1e-9, 0.5 + 1e-6, 0.9, 0.999):
            surface = Surface(texture, "D", max_depth=y * radius)
            bound = characteristic_number(surface, tolerance=1e-6)
            expected = max(1.0, y / (1.0 - y))
            assert bound.lower <= expected * (1.0 + 1e-9)
            assert expected * (1.0 - 1e-9) <= bound.upper
            check(surface, bound, "norm", 1e-6)
        for y in (1.0 + 1e-9, 3.0):
            bound = characteristic_number(Surface(texture, "D", max_depth=y * radius))
            assert (bound.lower, bound.upper, bound.method) == (math.inf, math.inf, method)
            assert bound.at == pytest.approx(sharpest_crest(wave).centre, rel=1e-6)  # type: ignore[union-attr]  # it has crests


def test_at_the_very_centre_of_curvature_the_number_is_one_or_the_other() -> None:
    for scale in (1.0 - 4e-16, 1.0, 1.0 + 4e-16):
        wave = Sinusoid(0.8e-3, 1e-3)
        depth = scale * wave.period**2 / (4 * math.pi**2 * wave.amplitude)
        bound = characteristic_number(Surface(wave, "D", max_depth=depth))
        assert bound.upper > 1e12
        assert bound.lower > 1e12
        assert bound.method == "closed form"


ridged = st.lists(st.floats(-1.0, 1.0), min_size=8, max_size=24)


@fixed(30)
@given(ridged, st.booleans())
def test_down_to_the_least_radius_every_foot_is_the_nearest_point(
    heights: list[float], periodic: bool
) -> None:
    """The ball below the sharpest crest is free, and so is every ball of that radius."""
    texture = Profile(1e-4 * np.array(heights), 1e-4, periodic=periodic)
    crest = sharpest_crest(texture)
    if crest is None:
        return
    x = np.concatenate([texture.domain.points(np.linspace(0, 1, 200)[:, None]), [crest.foot[:2]]])
    h, slope = texture.height(x), texture.gradient(x)[:, 0]
    normal = np.column_stack([-slope, 0 * slope, np.ones(len(x))])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    radius = crest.least_radius
    feet = np.column_stack([x, h])
    for share in (0.5, 1.0 - 1e-9):
        below = feet - share * radius * normal
        away = np.linalg.norm(texture.nearest(below) - below, axis=1)
        assert (away >= share * radius * (1.0 - 1e-9)).all()


def test_beyond_the_least_radius_a_foot_is_none() -> None:
    """The negative control of the theorem: 5 per cent deeper than the sharpest crest allows."""
    texture = Profile(1e-4 * ROUGH[0], 1e-4)
    crest = sharpest_crest(texture)
    assert crest is not None
    below = np.array([crest.foot]) + 1.05 * (np.array([crest.centre]) - np.array([crest.foot]))
    away = float(np.linalg.norm(texture.nearest(below) - below))
    assert away < 1.05 * crest.radius * (1.0 - 1e-4)


@pytest.mark.parametrize("continuity", [0.5, 1.0, 3.0])
def test_law_h_has_the_number_of_law_d_until_it_splits(continuity: float) -> None:
    wave = Sinusoid(0.2e-3, 2e-3, 0.3)
    radius = wave.period**2 / (4 * math.pi**2 * wave.amplitude)
    for y in (0.1, 0.6, 0.7, 2.0):
        surface = Surface(wave, "H", max_depth=y * radius, continuity=continuity)
        bound = characteristic_number(surface)
        alone = y / (1.0 - y) if y < 1.0 else math.inf
        expected = max(1.0, min(alone, continuity))
        assert bound.method == "theorem"
        assert bound.upper == pytest.approx(expected, rel=1e-9)
        check(surface, bound, "norm", 1e-6)


# --- laws of one's own ----------------------------------------------------------------------------


def own(force: Any, contact: Any = "vertical", **options: Any) -> Law:
    return Law("Own", "own", contact, force, **options)


WAVE = Sinusoid(0.3e-3, 1e-3, 0.4, (1.0, 2.0))


def test_a_copy_of_a_shipped_law_has_its_number() -> None:
    """By branch and bound over depth or not, against the closed form of the shipped one."""
    copies = {
        "A": own(lambda c: c.k * c.depth * c.e_z),
        "B": own(lambda c: c.k * c.depth * c.normal),
        "C": own(lambda c: c.k * c.depth * c.w),
        "G": own(lambda c: c.k * c.depth * c.normal, "nominal"),
    }
    for letter, law in copies.items():
        expected = characteristic_number(Surface(WAVE, letter, max_depth=0.2e-3)).upper
        surface = Surface(WAVE, law, max_depth=0.2e-3)
        bound = characteristic_number(surface, tolerance=1e-5)
        assert bound.method == "certified"
        assert bound.lower <= expected * (1.0 + 1e-12)
        assert expected <= bound.upper * (1.0 + 1e-12)
        check(surface, bound, "norm", 1e-5)


def test_a_copy_of_law_d_has_its_number_above_the_medial_axis() -> None:
    law = own(lambda c: c.k * c.toward, "nearest")
    radius = WAVE.period**2 / (4 * math.pi**2 * WAVE.amplitude)
    surface = Surface(WAVE, law, max_depth=0.7 * radius)
    bound = characteristic_number(surface)
    assert bound.lower <= 7.0 / 3.0 * (1.0 + 1e-9)
    assert bound.upper >= 7.0 / 3.0
    check(surface, bound, "norm", 1e-3)
    beyond = characteristic_number(Surface(WAVE, law, max_depth=1.2 * radius))
    assert (beyond.upper, beyond.method) == (math.inf, "sampled")
    assert "medial axis" in beyond.note
    assert beyond.lower > 100.0


def test_a_stiffening_law_is_greatest_inside_the_depth_range() -> None:
    """f_z = k δ (1 - δ/D)²: its derivative is greatest at an end, its curl is not."""

    def soft(c: Any) -> Any:
        return c.k * c.depth * (1 - c.depth / c.parameter("depth_0")) ** 2 * c.e_z

    surface = Surface(WAVE, own(soft, parameters={"depth_0": 1e-3}), max_depth=1e-3)
    slope = 2 * math.pi * 0.3
    bound = curl_number(surface)
    assert bound.upper == pytest.approx(slope, rel=2e-3)  # at depth zero
    check(surface, bound, "curl", 1e-3)
    hard = Surface(WAVE, own(lambda c: c.k * 1e3 * c.depth**2 * c.e_z), max_depth=1e-3)
    assert curl_number(hard).upper == pytest.approx(2.0 * slope, rel=2e-3)


def test_an_own_law_with_state_over_all_sticks_and_slips() -> None:
    def sticky(c: Any) -> Any:
        return c.k * c.depth * (c.e_z - c.tangential(c.deflection) / c.parameter("max_deflection"))

    law = own(sticky, "nominal", stateful=True, parameters={"max_deflection": 1e-3})
    surface = Surface(WAVE, law, max_depth=0.5e-3)
    # Every phase and angle is as bad as every other: no cell can be dropped early.
    bound = characteristic_number(surface, tolerance=2e-2)
    # a = D/d_max = 1/2 and b = 1.
    exact = float(largest_singular_value(np.array([0.5]), np.array([1.0]))[0])
    assert bound.lower <= exact * (1.0 + 1e-12)
    assert exact <= bound.upper
    assert bound.deflection is not None
    check(surface, bound, "norm", 2e-2)


@pytest.mark.parametrize(
    ("force", "contact", "reason"),
    [
        (lambda c: c.k * c.depth * sp.Max(c.depth, 1e-4) * c.e_z, "vertical", "in pieces"),
        (lambda c: c.k * c.depth * sp.Abs(c.h) * 1e3 * c.e_z, "vertical", "equal"),
        (lambda c: c.k * c.depth * (2 + c.position[0]) * c.e_z, "vertical", "position"),
        (lambda c: c.k * c.depth * (2 + sp.erf(c.h)) * c.e_z, "vertical", "erf"),
        (lambda c: c.k * c.depth * 2 ** (c.h * 1e3) * c.e_z, "vertical", "pow"),
    ],
)
def test_what_has_no_interval_kernel_is_sampled_and_says_so(
    force: Any, contact: Any, reason: str
) -> None:
    surface = Surface(WAVE, own(force, contact), max_depth=0.2e-3)
    bound = characteristic_number(surface)
    assert (bound.method, bound.upper) == ("sampled", math.inf)
    assert reason in bound.note
    assert evaluated(surface, bound, "norm") == pytest.approx(bound.lower, rel=1e-12)


def test_a_force_that_is_no_number_somewhere_is_not_certified() -> None:
    law = own(lambda c: c.k * c.depth * (c.h / 1e-3) ** sp.Rational(3, 2) * c.e_z)
    surface = Surface(WAVE, law, max_depth=0.2e-3)
    bound = characteristic_number(surface, work_limit=20_000)
    assert bound.upper == math.inf
    assert "limit" in bound.note


# --- tolerance, work limit, extent, clamps --------------------------------------------------------


def test_the_tolerance_is_reached_and_a_smaller_one_lies_inside() -> None:
    surface = Surface(KINDS["periodic sum"], "B", max_depth=0.3e-3)
    wide, narrow = (characteristic_number(surface, tolerance=t) for t in (1e-2, 1e-8))
    check(surface, wide, "norm", 1e-2)
    check(surface, narrow, "norm", 1e-8)
    assert wide.lower <= narrow.upper
    assert narrow.lower <= wide.upper


@pytest.mark.parametrize("limit", [1, 500, 5000])
def test_at_the_work_limit_bounds_are_valid_and_say_so(limit: int) -> None:
    surface = Surface(KINDS["three phases"], "B", max_depth=0.3e-3)
    bound = characteristic_number(surface, tolerance=1e-9, work_limit=limit)
    assert "work limit" in bound.note
    fine = characteristic_number(surface)
    assert "work limit" not in fine.note
    assert bound.lower <= fine.upper
    assert fine.lower <= bound.upper
    assert bound.gap > 1e-9


def test_four_phases_keep_the_safe_bound_and_an_extent_certifies() -> None:
    rng = np.random.default_rng(3)
    texture = Fourier(1e-4 * rng.normal(size=5), 2e3 * rng.normal(size=(5, 2)), rng.normal(size=5))
    extent = (4e-3, 2e-3)
    xy = rng.random((3000, 2)) * extent
    for letter in "ABCDFG":
        surface = Surface(texture, letter, max_depth=0.1e-3)
        whole = characteristic_number(surface)
        part = characteristic_number(surface, extent=extent)
        assert part.upper <= whole.upper * (1.0 + 1e-12)
        if letter != "D":
            assert "need an extent" in whole.note
            assert whole.upper == safe_bound(surface, NORM)
        check(surface, part, "norm", 1e-6)
        assert part.at is not None
        margin = surface.max_depth if letter == "D" else 1e-15
        assert -margin <= part.at[0] <= extent[0] + margin
        assert -margin <= part.at[1] <= extent[1] + margin
        depth = surface.max_depth * rng.random(3000)
        z = -depth if letter in "FG" else texture.height(xy) - depth
        state = ([[-1e-3, 0.0]] * 3000,) if letter == "F" else ()
        values = precise_norm(surface.jacobian(np.column_stack([xy, z]), *state))
        assert values.max() <= surface.stiffness * part.upper * (1.0 + 1e-12)


def test_an_extent_of_a_sinusoid_is_looked_at_too() -> None:
    """Around a trough only: the steepest flank is outside."""
    wave = Sinusoid(0.8e-3, 4e-3, phase=-math.pi / 2)
    surface = Surface(wave, "A", max_depth=1e-3)
    part = characteristic_number(surface, extent=(0.2e-3, 1e-3))
    slope = float(wave.gradient([[0.2e-3, 0.0]])[0, 0])
    assert part.method == "certified"
    assert part.upper == pytest.approx(math.hypot(1.0, slope), rel=2e-6)
    assert part.upper < 0.9 * characteristic_number(surface).upper


def test_safe_bounds_are_safe() -> None:
    for texture in (KINDS["periodic sum"], KINDS["map"], KINDS["profile"]):
        for letter in "ABCFG":
            surface = Surface(texture, letter, max_depth=0.2e-3)
            for number in (NORM, ONE_SIDED, CURL):
                if letter == "F" and number is CURL:
                    continue
                if letter == "C" and number is CURL:
                    continue
                bound = certified(surface, number, Search(1e-3))
                assert bound.lower <= safe_bound(surface, number) * (1.0 + 1e-12)


@pytest.mark.parametrize("clamp", ["whole", "lateral", "backed"])
@pytest.mark.parametrize("letter", "ABCFG")
def test_a_clamp_does_not_move_the_witness_out_of_reach(letter: str, clamp: Any) -> None:
    surface = Surface(WAVE, letter, max_depth=0.3e-3, clamp=clamp)
    free = characteristic_number(Surface(WAVE, letter, max_depth=0.3e-3))
    bound = characteristic_number(surface)
    assert bound.upper == free.upper
    check(surface, bound, "norm", 2e-6)


# --- bad arguments --------------------------------------------------------------------------------


@pytest.mark.parametrize("number", [characteristic_number, one_sided_number, curl_number])
@pytest.mark.parametrize(
    ("options", "argument"),
    [
        ({"tolerance": 0.0}, "tolerance"),
        ({"tolerance": -1e-3}, "tolerance"),
        ({"tolerance": math.nan}, "tolerance"),
        ({"tolerance": "fine"}, "tolerance"),
        ({"work_limit": 0}, "work_limit"),
        ({"work_limit": math.inf}, "work_limit"),
        ({"extent": 5.0}, "extent"),
        ({"extent": (1.0,)}, "extent"),
        ({"extent": (1.0, 2.0, 3.0)}, "extent"),
        ({"extent": "ab"}, "extent"),
        ({"extent": ("a", 1.0)}, "extent"),
        ({"extent": (1.0, 0.0)}, "extent"),
        ({"extent": (math.inf, 1.0)}, "extent"),
    ],
)
def test_bad_arguments_are_named(number: Any, options: dict[str, Any], argument: str) -> None:
    with pytest.raises(ParameterError, match=argument + " must"):
        number(Surface(WAVE, "B"), **options)


@pytest.mark.parametrize("number", [characteristic_number, one_sided_number, curl_number])
def test_a_texture_is_no_surface(number: Any) -> None:
    with pytest.raises(ParameterError, match=r"^surface must be a Surface"):
        number(WAVE)


def test_laws_without_such_a_number_are_refused() -> None:
    with pytest.raises(ParameterError, match="has state"):
        curl_number(Surface(WAVE, "F"))
    split = own(lambda c: 2 * c.k * c.toward, "split", parameters={"continuity": 1.0})
    with pytest.raises(ParameterError, match="split contact"):
        characteristic_number(Surface(WAVE, split))
