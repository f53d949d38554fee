"""Certified numbers: no sample exceeds ``upper``, ``lower`` is attained, and the gap is exact.

The random surfaces are those of the long benchmark ``python -m bench.speed.certificates --random
10000``.
"""

from __future__ import annotations

import importlib.util
import itertools
import math
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.analysis.gain.bound_checks import (
    MEASURES,
    as_fourier,
    check_bound,
    deterministic_settings,
)
from tests.helpers.reference import exact_jacobian

from asperity.analysis import characteristic_number, one_sided_number
from asperity.analysis.bounds.bound import CURL, NORM, ONE_SIDED, Bound, precise_norm
from asperity.analysis.gain import proofs
from asperity.analysis.gain.characteristic import certify, curl_number
from asperity.analysis.gain.medial_axis import SearchOptions
from asperity.analysis.gain.proofs import largest_singular_value
from asperity.analysis.gain.theorems import derivative_bound
from asperity.surface import Surface
from asperity.textures import Fourier, HeightMap, Profile, Sinusoid, Texture

_PATH = Path(__file__).parents[3] / "bench" / "stress" / "random_surfaces.py"
WAVE = Sinusoid(0.3e-3, 1e-3, 0.4, (1.0, 2.0))


@pytest.fixture(scope="module")
def random_surfaces() -> ModuleType:
    spec = importlib.util.spec_from_file_location("random_surfaces", _PATH)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    module.WORK_LIMIT = 40_000
    return module


# --- random surfaces ------------------------------------------------------------------------------


def test_bounds_on_random_surfaces_are_correct_and_tight(random_surfaces: ModuleType) -> None:
    seen = set()

    @deterministic_settings(12)  # python -m bench.speed.certificates --random COUNT
    @given(st.integers(0, 2**32))
    def holds(seed: int) -> None:
        trial = random_surfaces.run_trial(seed, "ABCDFG", points=60)
        assert trial.is_correct, trial
        assert trial.is_tight, trial
        seen.add((trial.kind, trial.name, trial.bound.method))

    holds()
    assert len(seen) > 8


def test_trials_detect_wrong_bounds(
    random_surfaces: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Negative control: upper bounds 1 % too low and lower bounds too high by 1e-9 are detected."""

    def low(surface: Surface, **_options: Any) -> Bound:
        bound = characteristic_number(surface)
        assert bound.at is not None
        at = (bound.at[0], bound.at[1], bound.at[2] * 1.01)
        return Bound(bound.lower * (1.0 + 1e-9), 0.99 * bound.upper, "certified", at)

    monkeypatch.setitem(random_surfaces.NUMBERS, "q", (low, precise_norm))
    monkeypatch.setattr(random_surfaces, "NUMBERS", {"q": random_surfaces.NUMBERS["q"]})
    # The sample points do not target the supremum: half of them are near the witness.
    wrong = [random_surfaces.run_trial(seed, "BG", points=200) for seed in range(8)]
    assert all(result.missed > 1e-10 for result in wrong)
    assert sum(result.excess > 1e-12 for result in wrong) >= 4


# --- closed-form suprema --------------------------------------------------------------------------


CLOSED_FORMS = [
    ("A", "norm", proofs.q_a),
    ("B", "norm", proofs.q_b),
    ("C", "norm", proofs.q_c),
    ("D", "norm", proofs.q_d),
    ("G", "norm", proofs.q_g),
    ("A", "one-sided", proofs.one_sided_a),
    ("C", "one-sided", proofs.q_c),
    ("A", "curl", proofs.curl_a),
    ("E", "curl", proofs.curl_e),
]
shapes = st.tuples(st.floats(-2.5, 1.0), st.floats(-2.0, 1.0), st.floats(-8.0, 3.0))


@pytest.mark.parametrize(("letter", "name", "exact"), CLOSED_FORMS)
def test_closed_forms_lie_inside_certified_bounds(letter: str, name: str, exact: Any) -> None:
    """An upper bound lowered by twice the gap is below the closed form, so the gap is exact."""

    @deterministic_settings(12)
    @given(shapes)
    def holds(shape: tuple[float, float, float]) -> None:
        length = 10.0 ** shape[2]
        wave = Sinusoid(length * 10.0 ** shape[0], length, 0.7, (2.0, -1.0))
        depth = length * 10.0 ** shape[1]
        y = 4 * math.pi**2 * wave.amplitude * depth / length**2
        if letter == "D" and y > 0.99:
            depth *= 0.7 / y
        value = exact(wave, depth)
        surface = Surface(as_fourier(wave), letter, max_depth=depth)
        number = MEASURES[name][0]
        # The probe's height is rounded to 2**-53 of the wave's; y/(1 - y) of law D amplifies the
        # relative change of the depth by 1 + q, the other formulas by 1 at most.
        rounding = 1e-12 + 2.0**-52 * wave.amplitude / depth * (1.0 + value)
        for tolerance in (1e-3, 1e-6):
            bound = number(surface, tolerance=tolerance)
            assert bound.method in {"certified", "theorem"}
            assert bound.lower <= value * (1.0 + rounding)
            assert value <= bound.upper * (1.0 + 1e-13)
            if bound.upper > 1e-6:
                check_bound(surface, bound, name, tolerance)
                lowered = bound.upper - 2.0 * max(bound.upper - bound.lower, 1e-13 * bound.upper)
                assert lowered < value
        closed = number(Surface(wave, letter, max_depth=depth))
        assert closed.method == "closed form"
        assert closed.upper == value
        check_bound(Surface(wave, letter, max_depth=depth), closed, name, 1e-9)

    holds()


def test_number_of_law_f_against_a_dense_scan_of_its_definition() -> None:
    """The number is a 1-D maximum over the phase; MATH gives 2.4863 < 2.84."""
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
    for result, gap in ((bound, 1e-9), (at_once, 1e-6)):
        assert result.lower <= best * (1.0 + 1e-12)
        assert best <= result.upper
        assert result.gap <= gap
        assert result.upper - 2.0 * (result.upper - result.lower) < best
    check_bound(surface, bound, "norm", 1e-6)
    assert "tangents" in at_once.note
    assert "cells" in bound.note


@pytest.mark.parametrize("count", [2, 5, 1024])
def test_half_circle_polygon_corners_lie_on_the_tangents(count: int) -> None:
    """The polygon encloses half the circle: each corner lies on the tangents on both sides."""
    touch, corner, radius = proofs._half_circle(count)
    np.testing.assert_allclose(touch[[0, -1]], [-0.5 * math.pi, 0.5 * math.pi], rtol=1e-15)
    assert (len(touch), len(corner)) == (count + 1, count)
    for side in (touch[:-1], touch[1:]):
        np.testing.assert_allclose(radius * np.cos(corner - side), 1.0, rtol=1e-14)


@pytest.mark.parametrize("modulation", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("name", ["norm", "one-sided"])
def test_tangent_and_cell_bounds_of_law_f_agree(modulation: float, name: str) -> None:
    for amplitude, phase in ((1e-6, 0.0), (0.4e-3, 2.0), (3e-3, -9.0)):
        wave = Sinusoid(amplitude, 1.5e-3, phase, (1.0, 3.0))
        options = {"max_depth": 0.7e-3, "max_deflection": 0.2e-3, "modulation_depth": modulation}
        number = MEASURES[name][0]
        once = number(Surface(wave, "F", friction=1.3, **options), tolerance=1e-4)
        cells = number(Surface(as_fourier(wave), "F", friction=1.3, **options), tolerance=1e-7)
        assert once.lower <= cells.upper * (1.0 + 1e-13)
        assert cells.lower <= once.upper
        assert once.gap < 1e-6
        check_bound(Surface(wave, "F", friction=1.3, **options), once, name, 1e-6)


def test_numbers_of_law_c_on_sharp_crests_against_math() -> None:
    waves = 2.0 * math.pi * np.array([1.0, 2.0, 3.0])
    surface = Surface(Fourier([0.1, 0.04, 0.02], waves, [math.pi / 2] * 3), "C", max_depth=0.5)
    q, plus = characteristic_number(surface), one_sided_number(surface)
    assert q.lower <= 8.685 + 5e-4
    assert q.upper >= 8.685 - 5e-4
    assert plus.upper == pytest.approx(5.533, abs=5e-4)
    check_bound(surface, q, "norm", 1e-6)
    check_bound(surface, plus, "one-sided", 1e-6)


def test_witness_attains_the_lower_bound_in_forty_digits() -> None:
    """The symbolic definition shares no code with the kernels or cells."""
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
    random_surfaces: ModuleType, kind: str, letter: str, name: str
) -> None:
    texture = KINDS[kind]
    surface = Surface(texture, letter, max_depth=0.3 * texture.peak_to_valley)
    number, measure = MEASURES[name]
    gap = {"three phases": 1e-4}.get(kind, 1e-3 if "map" in kind else 1e-6)
    bound = number(surface, tolerance=gap)
    check_bound(surface, bound, name, gap)
    assert bound.at is not None
    contacts = random_surfaces.random_contacts(
        np.random.default_rng(1), surface, 4000, bound.at[:2]
    )
    # Heights of 300 m leave fewer digits to a depth of a tenth of a millimetre.
    rounding = 1e-8 if "mountain" in kind else 1e-12
    values = measure(contacts.jacobians(surface))
    assert values.max() <= bound.upper * (1.0 + rounding)
    assert values.max() >= 0.5 * bound.lower  # the samples come close to the bound


def test_numbers_of_a_flat_surface_are_those_of_a_wall() -> None:
    waves = Fourier([0.0, 0.0], [[1e3, 0.0], [0, 5e2]])
    # Waves: one law on each contact.
    for texture, letters in ((HeightMap(np.zeros((6, 6)), 1e-3), "WABCDEGH"), (waves, "WBDH")):
        for letter in letters:
            surface = Surface(texture, letter, max_depth=1e-3)
            for number in (characteristic_number, one_sided_number):
                bound = number(surface)
                # The fast norm has half of the digits, enough for the tolerance of 1e-3 of a map.
                assert (bound.lower, bound.upper) == pytest.approx((1.0, 1.0), rel=2e-7)
            assert curl_number(surface).upper <= 1e-8
        friction = Surface(texture, "F", max_depth=1e-3)
        stick = largest_singular_value(np.array([0.4]), np.array([0.4]))
        assert characteristic_number(friction).upper == pytest.approx(float(stick[0]), rel=1e-9)


def test_number_of_five_hundred_waves_is_certified() -> None:
    multiples = RNG.integers(-6, 7, (500, 2))
    multiples[~multiples.any(axis=1)] = 1
    waves = multiples @ np.array([[900.0, 100.0], [-300.0, 800.0]])
    texture = Fourier(2e-6 * RNG.normal(size=500), waves, RNG.uniform(0, 7, 500))
    surface = Surface(texture, "A", max_depth=1e-4)
    bound = characteristic_number(surface, tolerance=1e-4)
    check_bound(surface, bound, "norm", 1e-4)
    slopes = np.hypot(*texture.gradient(RNG.random((3000, 2))).T)
    assert np.hypot(1.0, slopes.max()) <= bound.upper


# --- tolerance, work limit, extent, clamps --------------------------------------------------------


def test_bounds_reach_their_tolerance_and_overlap() -> None:
    surface = Surface(KINDS["periodic sum"], "B", max_depth=0.3e-3)
    wide, narrow = (characteristic_number(surface, tolerance=t) for t in (1e-2, 1e-8))
    check_bound(surface, wide, "norm", 1e-2)
    check_bound(surface, narrow, "norm", 1e-8)
    assert wide.lower <= narrow.upper
    assert narrow.lower <= wide.upper


@pytest.mark.parametrize("limit", [1, 500, 5000])
def test_bounds_at_the_work_limit_are_valid_and_noted(limit: int) -> None:
    surface = Surface(KINDS["three phases"], "B", max_depth=0.3e-3)
    bound = characteristic_number(surface, tolerance=1e-9, work_limit=limit)
    assert "work limit" in bound.note
    fine = characteristic_number(surface)
    assert "work limit" not in fine.note
    assert bound.lower <= fine.upper
    assert fine.lower <= bound.upper
    assert bound.gap > 1e-9


def test_five_independent_waves_are_certified_on_an_extent_only() -> None:
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
            assert whole.upper == derivative_bound(surface, NORM)
        check_bound(surface, part, "norm", 1e-6)
        assert part.at is not None
        margin = surface.max_depth if letter == "D" else 1e-15
        assert -margin <= part.at[0] <= extent[0] + margin
        assert -margin <= part.at[1] <= extent[1] + margin
        depth = surface.max_depth * rng.random(3000)
        z = -depth if letter in "FG" else texture.height(xy) - depth
        state = ([[-1e-3, 0.0]] * 3000,) if letter == "F" else ()
        values = precise_norm(surface.jacobian(np.column_stack([xy, z]), *state))
        assert values.max() <= surface.stiffness * part.upper * (1.0 + 1e-12)


@pytest.mark.parametrize("letter", "ABCFG")
def test_four_independent_waves_are_certified_on_the_whole_plane(letter: str) -> None:
    rng = np.random.default_rng(7)
    texture = Fourier(6e-5 * rng.normal(size=4), 3e3 * rng.normal(size=(4, 2)), rng.normal(size=4))
    assert len(texture.waves.lattice[0]) == 4
    surface = Surface(texture, letter, max_depth=0.1e-3)
    whole, part = (characteristic_number(surface, extent=side) for side in (None, (5e-3, 5e-3)))
    check_bound(surface, whole, "norm", 1e-3)
    assert part.lower <= whole.upper <= derivative_bound(surface, NORM) * (1.0 + 1e-12)
    xy, depth = rng.uniform(-1.0, 1.0, (5000, 2)), surface.max_depth * rng.random(5000)
    z = -depth if letter in "FG" else texture.height(xy) - depth
    values = precise_norm(surface.jacobian(np.column_stack([xy, z])))
    assert values.max() <= surface.stiffness * whole.upper * (1.0 + 1e-12)


def test_work_limit_on_four_independent_waves_gives_a_certified_bound() -> None:
    rng = np.random.default_rng(7)
    texture = Fourier(6e-5 * rng.normal(size=4), 3e3 * rng.normal(size=(4, 2)), rng.normal(size=4))
    surface = Surface(texture, "C", max_depth=0.1e-3)
    bound = characteristic_number(surface, work_limit=1)
    assert "work limit" in bound.note
    assert bound.method == "certified"
    assert characteristic_number(surface).lower <= bound.upper <= derivative_bound(surface, NORM)


def test_extent_restricts_the_number_of_a_sinusoid() -> None:
    """The extent contains only a trough; the steepest flank is outside."""
    wave = Sinusoid(0.8e-3, 4e-3, phase=-math.pi / 2)
    surface = Surface(wave, "A", max_depth=1e-3)
    part = characteristic_number(surface, extent=(0.2e-3, 1e-3))
    slope = float(wave.gradient([[0.2e-3, 0.0]])[0, 0])
    assert part.method == "certified"
    assert part.upper == pytest.approx(math.hypot(1.0, slope), rel=2e-6)
    assert part.upper < 0.9 * characteristic_number(surface).upper


def test_derivative_bounds_are_above_certified_lower_bounds() -> None:
    for texture in (KINDS["periodic sum"], KINDS["map"], KINDS["profile"]):
        for letter in "ABCFG":
            surface = Surface(texture, letter, max_depth=0.2e-3)
            for number in (NORM, ONE_SIDED, CURL):
                if letter == "F" and number is CURL:
                    continue
                if letter == "C" and number is CURL:
                    continue
                bound = certify(surface, number, SearchOptions(1e-3))
                assert bound.lower <= derivative_bound(surface, number) * (1.0 + 1e-12)


@pytest.mark.parametrize("clamp", ["whole", "lateral", "backed"])
@pytest.mark.parametrize("letter", "ABCFG")
def test_witness_under_a_clamp_attains_the_number(letter: str, clamp: Any) -> None:
    surface = Surface(WAVE, letter, max_depth=0.3e-3, clamp=clamp)
    free = characteristic_number(Surface(WAVE, letter, max_depth=0.3e-3))
    bound = characteristic_number(surface)
    # The zone of the clamp may raise the numbers of B and G (lateral, backed).
    if (letter, clamp) in set(itertools.product("BG", ("lateral", "backed"))):
        assert bound.upper > free.upper
    else:
        assert bound.upper == free.upper
    check_bound(surface, bound, "norm", 2e-6)
