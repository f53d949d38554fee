"""Jumps of the force compared with closest points computed by hand, and their absence elsewhere."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from asperity.analysis import characteristic_number
from asperity.analysis.bounds.bound import Bound
from asperity.analysis.energy import continuity as module
from asperity.analysis.energy.continuity import Continuity, continuity, find_jumps
from asperity.laws import Law
from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid
from asperity.textures.spline.spline_texture import HeightMap
from asperity.textures.texture import Texture

WAVE = Sinusoid(0.1e-3, 2e-3)
RADIUS = 2e-3**2 / (4 * math.pi**2 * 0.1e-3)


def analyze_continuity(surface: Surface) -> Continuity:
    return continuity(surface, characteristic_number(surface))


def min_span(texture: Texture) -> float:
    return float(np.linalg.norm(texture.domain.spans, axis=1).min())


# --- how large a jump is --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("amplitude", "period", "depth"),
    [
        (0.2e-3, 1e-3, 0.4e-3),
        (0.2e-3, 1e-3, 20e-3),
        (3e-3, 1e-3, 1e-3),
        (1e-6, 1e-3, 0.1),
        (0.1e-3, 2e-3, 1.001 * RADIUS),
    ],
)
def test_jumps_of_law_d_on_a_sinusoid_equal_the_distance_of_the_closest_points(
    amplitude: float, period: float, depth: float
) -> None:
    """The closest points lie at ±s from the crest; their normals meet below it at the depth."""
    texture = Sinusoid(amplitude, period, phase=0.3, direction=(1.0, 2.0))
    surface = Surface(texture, "D", 700.0, depth)
    wave = 2.0 * math.pi / period

    def depth_of(s: float) -> float:
        slope = amplitude * wave * math.sin(wave * s)
        return s * math.sqrt(1.0 + slope**2) / slope

    jumps = find_jumps(surface)
    radius = 1.0 / (amplitude * wave**2)
    expected = radius + (depth - radius) * np.arange(1, 9) / 8
    assert [jump.depth for jump in jumps] == pytest.approx(expected, rel=2e-9)
    for jump in jumps:
        target = jump.depth
        s = brentq(
            lambda s, d=target: depth_of(s) - d,
            1e-9 * period,
            0.5 * period * (1 - 1e-12),
            xtol=1e-22,
            rtol=1e-14,
        )
        assert jump.size == pytest.approx(2.0 * 700.0 * s, rel=1e-5)
        # Below the crest: on the line where the phase is a quarter turn.
        along = np.dot(jump.before[:2], texture.direction)
        assert along == pytest.approx(period * (0.25 - 0.3 / (2 * math.pi)), abs=1e-9 * period)


def test_jump_grows_as_the_square_root_beyond_the_onset() -> None:
    """Just beyond the onset s² is about linear in the depth."""
    sizes = []
    for part in (1e-3, 4e-3):
        surface = Surface(WAVE, "D", 1.0, (1.0 + part) * RADIUS)
        sizes.append(find_jumps(surface, levels=1)[0].size)
    assert sizes[1] / sizes[0] == pytest.approx(2.0, rel=0.01)


# --- witnesses on any texture ---------------------------------------------------------------------


def test_witnesses_of_law_d_reproduce_their_jump(texture: Texture) -> None:
    surface = Surface(texture, "D", 300.0, 0.9 * texture.peak_to_valley)
    result = analyze_continuity(surface)
    jumps = result.jumps
    # A direct call searches again, independent of the result of continuity.
    assert result.continuous is (len(find_jumps(surface, levels=1)) == 0)
    if not jumps:
        return
    assert len(jumps) == 8
    assert jumps[-1].depth == pytest.approx(surface.max_depth, rel=2e-9)
    assert np.all(np.diff([jump.depth for jump in jumps]) > 0.0)
    for jump in jumps:
        pair = np.array([jump.before, jump.after])
        assert np.linalg.norm(pair[1] - pair[0]) <= 1e-9 * min_span(texture)
        before, after = surface.force(pair)
        assert np.linalg.norm(after - before) == jump.size
        closest_points = texture.nearest(pair)
        distances = np.linalg.norm(closest_points - pair, axis=1)
        assert distances == pytest.approx(jump.depth, rel=1e-6)
        # The force of D is k times the vector to the closest point, and jumps with it.
        assert 300.0 * np.linalg.norm(closest_points[1] - closest_points[0]) == pytest.approx(
            jump.size, rel=1e-6
        )
        assert jump.size > 1e-3 * 300.0 * jump.depth


def test_both_closest_points_of_a_witness_against_brute_force(make_texture: Any) -> None:
    texture = make_texture("map")
    jump = find_jumps(Surface(texture, "D", 1.0), levels=2)[0]
    probe = np.array(jump.before)
    first, second = texture.nearest([jump.before, jump.after])
    ticks = np.linspace(-1.2, 1.2, 1201) * jump.depth
    x, y = (grid.ravel() for grid in np.meshgrid(ticks, ticks))
    xy = probe[:2] + np.column_stack([x, y])
    distance = np.hypot(np.hypot(x, y), texture.height(xy) - probe[2])
    assert distance.min() == pytest.approx(jump.depth, rel=1e-5)
    # All other points are farther than the two closest points.
    away = np.minimum(*(np.hypot(*(xy - closest_point[:2]).T) for closest_point in (first, second)))
    assert distance[away > 0.3 * jump.depth].min() > 1.0005 * jump.depth
    near = [
        np.hypot(*(xy - closest_point[:2]).T) < 0.02 * jump.depth
        for closest_point in (first, second)
    ]
    assert max(distance[part].min() for part in near) < 1.001 * jump.depth


def test_ridge_of_an_asymmetric_profile_drifts_with_depth(make_texture: Any) -> None:
    """Without symmetry the medial axis does not stay vertically below its crest."""
    jumps = find_jumps(Surface(make_texture("periodic profile"), "D", 1.0, 1e-3))
    drift = np.diff([jump.before[0] for jump in jumps])
    assert np.abs(drift).max() > 1e-5


# --- absence of jumps -----------------------------------------------------------------------------


@pytest.mark.parametrize("letter", "WABCEFGH")
def test_other_laws_are_continuous_where_law_d_jumps(letter: str) -> None:
    texture = Sinusoid(0.2e-3, 1e-3, phase=0.3, direction=(1.0, 2.0))
    witnesses = find_jumps(Surface(texture, "D", 1000.0))
    surface = Surface(texture, letter, 1000.0)
    result = analyze_continuity(surface)
    assert result.continuous
    assert result.jumps == find_jumps(surface) == ()
    assert result.lipschitz is not None
    for jump in witnesses:
        before, after = surface.force([jump.before, jump.after])
        # The points are 1e-14 m apart.
        assert np.linalg.norm(after - before) <= 1e-10
        assert jump.size > 0.1


def test_law_d_is_continuous_above_the_onset() -> None:
    result = analyze_continuity(Surface(WAVE, "D", 1000.0, 0.999 * RADIUS))
    assert result.continuous
    assert result.jumps == ()
    below = analyze_continuity(Surface(WAVE, "D", 1000.0, 1.001 * RADIUS))
    assert (below.continuous, below.lipschitz) == (False, None)
    assert "at depths from 1.01 mm" in below.reason  # 1.0132 mm, never overstated
    assert (
        "at depths from 1.01 mm"
        in analyze_continuity(Surface(WAVE, "D", max_depth=2.0 * RADIUS)).reason
    )


def test_no_crest_search_above_the_smallest_radius_of_curvature(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The free set has a reach of at least 1/K."""

    def refuse(*_: Any) -> None:
        raise AssertionError("searched")

    monkeypatch.setattr(module, "sharpest_crest", refuse)
    # A user-defined law on the nearest contact that depends on the slope.
    user_law = Law("N", "normal", "nearest", lambda c: c.k * c.depth * c.normal)
    bound = Bound(1.0, math.inf, "sampled")
    assert continuity(Surface(WAVE, user_law, max_depth=0.99 * RADIUS), bound).continuous
    with pytest.raises(AssertionError, match="searched"):
        continuity(Surface(WAVE, user_law, max_depth=1.01 * RADIUS), bound)


def test_jumps_are_located_on_first_access(monkeypatch: pytest.MonkeyPatch) -> None:
    surface = Surface(WAVE, "D", max_depth=2.0 * RADIUS)
    q = characteristic_number(surface)
    calls = []
    monkeypatch.setattr(module, "find_jumps", lambda s: calls.append(s) or ())
    result = continuity(surface, q)
    assert calls == []
    assert result.jumps == result.jumps == ()
    assert calls == [surface]
    smooth = Surface(WAVE, "C")
    assert continuity(smooth, characteristic_number(smooth)).jumps == ()
    assert calls == [surface]


# --- Lipschitz ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("letter", "depth"),
    [("B", 0.2e-3), ("C", 0.2e-3), ("E", 5e-3), ("D", 0.8 * RADIUS), ("H", 5e-3)],
)
def test_lipschitz_constant_bounds_force_changes_and_is_attained(letter: str, depth: float) -> None:
    surface = Surface(WAVE, letter, 1000.0, depth)
    slope = analyze_continuity(surface).lipschitz
    assert slope is not None
    rng = np.random.default_rng(2)
    x = rng.uniform(0.0, 2e-3, 4000)
    top = WAVE.height(np.column_stack([x, 0 * x]))
    z = top - depth * rng.uniform(0.0, 0.9, 4000)
    first = np.column_stack([x, 0 * x, z])
    second = first + 10.0 ** rng.uniform(-9, -5, (4000, 1)) * rng.normal(size=(4000, 3))
    moved = np.linalg.norm(second - first, axis=1)
    changed = np.linalg.norm(surface.force(second) - surface.force(first), axis=1)
    assert (changed <= slope.upper * moved + 1e-15).all()
    # Attained: the Jacobian next to the witness has this norm.
    at = np.array(slope.at)
    jacobian = surface.jacobian([at - [0, 0, 1e-12]])[0]
    assert np.linalg.norm(jacobian, 2) == pytest.approx(slope.lower, rel=1e-6)


def test_lipschitz_constant_is_k_q_rounded_outwards() -> None:
    q = Bound(1.1, 1.3, "certified", (0.0, 0.0, 0.0), "a note")
    slope = continuity(Surface(WAVE, "C", 7.0), q).lipschitz
    assert slope is not None
    assert slope.lower == pytest.approx(7.7)
    assert slope.upper == math.nextafter(7.0 * 1.3, math.inf)
    assert (slope.method, slope.at) == ("certified", q.at)
    assert "a note" in slope.note
    result = continuity(Surface(WAVE, "C", 1000.0), Bound(1.0, 1.2341, "certified"))
    assert "at most 1240 N/m" in result.reason
    unknown = continuity(Surface(WAVE, "C"), Bound(1.0, math.inf, "sampled"))
    assert "Lipschitz" not in unknown.reason


# --- user-defined laws ----------------------------------------------------------------------------


def step_law(contact: Any) -> Law:
    return Law(
        "J",
        "step",
        contact,
        lambda c: c.k * (c.depth + c.parameter("preload")) * c.e_z,
        parameters={"preload": 1e-4},
    )


@pytest.mark.parametrize("contact", ["nominal", "vertical"])
def test_force_with_preload_jumps_where_contact_begins(contact: str) -> None:
    surface = Surface(WAVE, step_law(contact), 1000.0)
    result = analyze_continuity(surface)
    assert not result.continuous
    assert "where contact begins" in result.reason
    (jump,) = result.jumps
    assert (jump.depth, jump.size) == (0.0, pytest.approx(0.1, rel=1e-6))
    outside, inside = surface.force([jump.before, jump.after])
    assert not outside.any()
    assert np.linalg.norm(inside - outside) == jump.size
    assert np.linalg.norm(np.subtract(jump.before, jump.after)) <= 1e-9 * min_span(WAVE)


def test_zero_preload_gives_no_jump() -> None:
    """Negative control: with preload 0 this surface's force has no step; with 1e-9 m it has one."""
    surface = Surface(WAVE, step_law("nominal"), 1000.0, law_parameters={"preload": 0.0})
    assert find_jumps(surface) == ()
    surface = Surface(WAVE, step_law("nominal"), 1000.0, law_parameters={"preload": 1e-9})
    assert find_jumps(surface)[0].size == pytest.approx(1e-6, rel=1e-3)


def test_jumps_of_user_defined_laws_on_the_nearest_contact() -> None:
    """Twice the force of D has twice the jump; a function of the distance alone has none."""
    twice = Law("T", "twice", "nearest", lambda c: 2 * c.k * c.depth * c.normal)
    texture, depth = Sinusoid(0.2e-3, 1e-3), 0.4e-3
    mine, d = (find_jumps(Surface(texture, law, 500.0, depth)) for law in (twice, "D"))
    assert [j.size for j in mine] == pytest.approx([2.0 * j.size for j in d], rel=1e-6)
    result = continuity(Surface(texture, twice, 500.0, depth), Bound(2.0, math.inf, "sampled"))
    assert not result.continuous
    assert "at depths from 126 µm" in result.reason
    up = Law("U", "upward", "nearest", lambda c: c.k * c.depth * c.e_z)
    assert find_jumps(Surface(texture, up, 500.0, depth)) == ()
    assert continuity(Surface(texture, up), Bound(1.0, 1.0, "theorem")).continuous


def test_reason_says_whether_the_crest_is_proved(monkeypatch: pytest.MonkeyPatch) -> None:
    user_law = Law("N", "normal", "nearest", lambda c: c.k * c.depth * c.normal)
    y, x = np.mgrid[:12, :12]
    bumps = HeightMap(2e-5 * np.sin(0.9 * x + 0.3) * np.cos(0.8 * y), 1e-4)
    crest = module.sharpest_crest(bumps)
    assert crest is not None
    bound = Bound(1.0, math.inf, "sampled")
    proved = continuity(Surface(bumps, user_law, max_depth=0.999 * crest.min_radius), bound)
    assert proved.continuous
    assert "no crest is so sharp" in proved.reason
    monkeypatch.setattr(module, "sharpest_crest", lambda _texture: None)
    unproved = continuity(Surface(bumps, user_law, max_depth=0.999 * crest.min_radius), bound)
    assert "no medial axis found" in unproved.reason


def test_continuity_to_dict_is_json_serializable() -> None:
    surface = Surface(Sinusoid(0.2e-3, 1e-3), "D")
    read = json.loads(json.dumps(analyze_continuity(surface).to_dict(), allow_nan=False))
    assert read["lipschitz"] is None
    assert len(read["jumps"]) == 8
    assert read["jumps"][0]["before"] == list(find_jumps(surface)[0].before)
    smooth = json.loads(
        json.dumps(analyze_continuity(Surface(WAVE, "H")).to_dict(), allow_nan=False)
    )
    assert smooth["lipschitz"]["upper"] == pytest.approx(1000.0)


def test_sharpest_direction_is_that_of_an_oblique_wave() -> None:
    """Off the axes, where the mixed second derivative of the heights is not zero."""
    wave = Sinusoid(0.2e-3, 1e-3, direction=(2.0, 1.0))
    crest = module.sharpest_crest(wave)
    assert crest is not None
    found = module._sharpest_direction(wave, crest)
    assert abs(found @ [2.0, 1.0, 0.0]) / math.sqrt(5.0) == pytest.approx(1.0, abs=1e-9)


def test_no_ridge_is_found_where_the_closest_point_is_continuous() -> None:
    """A descent that starts half-way to the centre of curvature finds no ridge."""
    crest = module.sharpest_crest(WAVE)
    assert crest is not None
    middle = tuple(0.5 * (f + c) for f, c in zip(crest.point, crest.centre, strict=True))
    early = replace(crest, radius=0.5 * RADIUS, centre=middle)
    assert module._Ridge(WAVE, early).descend(0.9 * RADIUS) is None
    assert module._Ridge(WAVE, crest).descend(1.1 * RADIUS) is not None


class ThreePoints:
    """A surface of three points, which is all that the search for a ridge asks of a texture.

    Its medial axis below the first two is the line x = 0; a second ridge, with a greater jump of
    the closest point, is at ``offset``.
    """

    def __init__(self, offset: float) -> None:
        self.points = 1e-3 * np.array([[-0.1, 0, 0], [0.1, 0, 0], [2.0 * offset - 0.1, 0, 0]])

    def nearest(self, probes: Any) -> Any:
        distances = np.linalg.norm(np.asarray(probes)[:, None] - self.points, axis=2)
        return self.points[np.argmin(distances, axis=1)]


@pytest.mark.parametrize("run", [0.0, 0.2, -0.2])
def test_ridge_is_bracketed_within_twice_the_step(run: float) -> None:
    """The ridge is near the end of the step: a greater jump farther away is another ridge."""
    ridge: Any = object.__new__(module._Ridge)
    ridge.texture = ThreePoints(offset=2.5 * abs(run) or 0.4)
    ridge.extent, ridge.wavelength = 1e-3, 2e-3
    ridge.position, ridge.across = np.array([0.0, 0.0, -2e-3]), np.array([1.0, 0.0, 0.0])
    ridge._update_direction(np.array([0.0, 0.0, 1.0]))
    pair = ridge._advance(1e-3 * run)
    assert pair is not None
    assert abs(pair.mean(axis=0)[0]) <= np.linalg.norm(pair[1] - pair[0]) <= 1e-14
    assert ridge.depth == pytest.approx(1e-3 * math.hypot(2.0 + run, 0.1), rel=1e-9)
