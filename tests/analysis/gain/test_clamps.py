"""Facts, numbers and leaks of a law under a depth clamp describe the rendered force."""

from __future__ import annotations

import math
from itertools import product
from typing import Any

import numpy as np
import pytest

from asperity.analysis import characteristic_number, curl_number, loop_work, one_sided_number
from asperity.analysis.bounds.bound import CURL, NORM, ONE_SIDED
from asperity.analysis.energy.continuity import continuity
from asperity.analysis.energy.leak import worst_loop
from asperity.analysis.gain import characteristic
from asperity.analysis.passivity.verdict import passivity
from asperity.derive.facts import law_facts
from asperity.devices import parse_device
from asperity.laws import LAWS, Law
from asperity.laws.clamps import NONE
from asperity.surface import Surface
from asperity.textures.kinds.fourier import Fourier
from asperity.textures.kinds.sinusoid import Sinusoid
from asperity.textures.spline.spline_texture import HeightMap
from asperity.textures.texture import Texture

K, D, L = 500.0, 0.4e-3, 1e-3
KEY = 2 * math.pi / L
CLAMPS: tuple[str, ...] = ("whole", "lateral", "backed")
WAVE = Sinusoid(0.2e-3, L, 0.4)
# Sharpest on a flank, where the number of law C is exceeded below max_depth.
SUM = Fourier([0.1e-3, 0.04e-3, 0.02e-3], [KEY, 2 * KEY, 3 * KEY], [0.2, 1.0, 0.4])
EGGS = Fourier([0.05e-3, 0.05e-3], [[KEY, 0.0], [0.5 * KEY, KEY]])
MAP = HeightMap(5e-5 * np.random.default_rng(3).normal(size=(8, 9)), 0.2e-3, periodic=True)
TEXTURES: dict[str, Texture] = {"wave": WAVE, "sum": SUM, "eggs": EGGS, "map": MAP}
NUMBERS = {NORM: characteristic_number, ONE_SIDED: one_sided_number, CURL: curl_number}
# A potential k δ²/2 (1 + h/s): conservative, but its z component varies with position.
WEIGHTED = Law(
    "V",
    "weighted",
    "vertical",
    lambda c: (
        c.k * c.depth * (1 + c.h / c.parameter("size")) * c.w
        - c.k * c.depth**2 / (2 * c.parameter("size")) * c.tangential(c.slope)
    ),
    clampable=True,
    parameters={"size": 1e-3},
)
CUBED = Law(
    "Q",
    "cubed",
    "vertical",
    lambda c: c.k * c.depth**3 / c.parameter("size") ** 2 * c.w,
    clampable=True,
    parameters={"size": 1e-3},
)


def spread(letters: str, names: tuple[str, ...]) -> list[tuple[str, str, str]]:
    """Return each law with each clamp, on textures in turn, so that each meets each law and clamp.

    Every law, clamp and texture is a kernel of its own to be compiled.
    """
    pairs = product(enumerate(letters), enumerate(CLAMPS))
    return [(names[(i + j) % len(names)], letter, clamp) for (i, letter), (j, clamp) in pairs]


def clamped(texture: Texture, law: str | Law, clamp: str) -> Surface:
    return Surface(texture, law, K, D, clamp=clamp)


def analyzed_depth(surface: Surface) -> float:
    """Return the depth down to which a number holds; 4 z_b where it is unlimited."""
    return (1.0 if surface.clamp == "lateral" else 4.0) * surface.clamped_depth


def random_probes(surface: Surface, count: int, seed: int) -> np.ndarray:
    """Return random probes, half of them around max_depth, where the clamp begins to act."""
    rng = np.random.default_rng(seed)
    xy = rng.uniform(0.0, 2 * L, (count, 2))
    depth = rng.uniform(0.0, 1.0, count) * analyzed_depth(surface)
    depth[::2] = surface.max_depth * rng.uniform(0.9, 1.1, len(depth[::2]))
    depth = np.minimum(depth, analyzed_depth(surface))
    return np.column_stack([xy, surface.law.contact.contact_height(surface.texture, xy) - depth])


def largest_secants(surface: Surface, count: int = 20_000) -> tuple[float, float]:
    """Return the largest |Δf|/|Δp| and -Δf·Δp/|Δp|² of pairs of probes, over k."""
    first, rng = random_probes(surface, count, 1), np.random.default_rng(2)
    step = rng.normal(size=first.shape) * 10.0 ** rng.uniform(-8.0, -5.0, (count, 1))
    second = first + step
    # A bound down to a depth does not cover a line segment that leaves the region.
    near = surface.law.contact.depth(surface.texture, second) <= analyzed_depth(surface)
    step, change = step[near], (surface.force(second) - surface.force(first))[near]
    length = np.linalg.norm(step, axis=1)
    steep = np.linalg.norm(change, axis=1) / length
    return float(steep.max()) / K, float((-(change * step).sum(axis=1) / length**2).max()) / K


@pytest.mark.parametrize(("name", "letter", "clamp"), spread("ABCG", ("wave", "sum", "eggs")))
def test_secants_do_not_exceed_their_bounds(name: str, letter: str, clamp: str) -> None:
    surface = clamped(TEXTURES[name], letter, clamp)
    steep, stiff = largest_secants(surface)
    assert steep <= characteristic_number(surface).upper * (1 + 1e-6)
    assert stiff <= one_sided_number(surface).upper * (1 + 1e-6)


@pytest.mark.parametrize(("letter", "clamp"), [("B", "lateral"), ("C", "whole"), ("G", "backed")])
def test_secants_do_not_exceed_their_bounds_on_a_map(letter: str, clamp: str) -> None:
    test_secants_do_not_exceed_their_bounds("map", letter, clamp)


@pytest.mark.parametrize("clamp", ["whole", "backed"])
def test_bound_that_ignores_the_clamp_zone_is_exceeded(
    clamp: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Negative control: law C on a texture that is sharpest on a flank."""
    surface = clamped(SUM, "C", clamp)
    correct = characteristic_number(surface).upper
    monkeypatch.setattr(characteristic, "include_clamp", lambda _s, _n, _search, above: above)
    ignored = characteristic_number(surface).upper
    assert ignored * (1 + 1e-2) < largest_secants(surface)[0] <= correct * (1 + 1e-6)


def test_lateral_clamp_of_law_g_is_certified_below_max_depth() -> None:
    """Its vertical force changes with x and y the more, the deeper the probe is."""
    texture = Fourier([1e-4, 0.6e-4], [[6283.0, 0.0], [6283.0 * 2**0.5, 0.0]], [0.3, 1.1])
    surface = Surface(texture, "G", 1.0, 9.6e-5, clamp="lateral")
    low, high = texture.extremes
    assert surface.clamped_depth == pytest.approx(9.6e-5 + high - low, rel=1e-12)
    rng = np.random.default_rng(0)
    points = np.column_stack([*rng.uniform(0.0, 0.01, (2, 20_000)), np.full(20_000, -3 * 9.6e-5)])
    worst = float(np.linalg.norm(surface.jacobian(points), 2, axis=(1, 2)).max())
    assert 1.2 < worst <= characteristic_number(surface).upper
    # Negative control: the number of the law above max_depth.
    assert characteristic_number(Surface(texture, "G", 1.0, 9.6e-5)).upper < worst


@pytest.mark.parametrize(("name", "letter", "clamp"), spread("ABCFG", ("wave", "sum")))
def test_jacobians_in_the_clamp_zone_do_not_exceed_the_numbers(
    name: str, letter: str, clamp: str
) -> None:
    """Includes Jacobians that the search of the zone omits; the gap is small."""
    surface = clamped(TEXTURES[name], letter, clamp)
    points = random_probes(surface, 20_000, 5)
    state = ()
    if surface.law.stateful:
        turn = np.random.default_rng(0).uniform(0.0, 2 * math.pi, len(points))
        deflection = surface.max_deflection * np.column_stack([np.cos(turn), np.sin(turn)])
        state = (deflection, turn > 3.0)
    jacobians = surface.jacobian(points, *state) / K
    for number, find in NUMBERS.items():
        if number is CURL and (surface.law.stateful or surface.facts.conservative):
            continue
        bound = find(surface)
        worst = float(number.accurate(jacobians).max())
        assert worst <= bound.upper * (1 + 1e-9)
        assert worst >= 0.9 * bound.upper
        assert bound.upper <= bound.lower * (1 + 2e-6)


@pytest.mark.parametrize(("letter", "clamp"), list(product("ABCFG", CLAMPS)))
def test_only_law_c_stays_conservative_under_whole_and_backed_clamps(
    letter: str, clamp: str
) -> None:
    surface = clamped(WAVE, letter, clamp)
    assert surface.facts.conservative == (letter == "C" and clamp != "lateral")
    never = Surface(WAVE, "H", K, D, clamp=clamp)
    assert (never.effective_clamp, never.clamped_depth) == (NONE, D)
    assert never.facts.conservative


@pytest.mark.parametrize(
    ("law", "remaining"),
    [(CUBED, {"whole", "backed"}), (WEIGHTED, set())],
    ids=["cubed", "weighted"],
)
def test_facts_of_user_defined_laws_are_derived_for_each_clamp(
    law: Law, remaining: set[str]
) -> None:
    assert Surface(WAVE, law, K, D).facts.conservative
    for clamp in CLAMPS:
        surface = clamped(WAVE, law, clamp)
        assert surface.facts.conservative == (clamp in remaining)
        assert (clamp in surface.facts.reason) != (clamp in remaining)


def random_loops(surface: Surface, count: int) -> list[np.ndarray]:
    """Return random triangles in the plane y = 0 within one period, through the clamp zone."""
    rng = np.random.default_rng(7)
    low = surface.law.contact.extremes(surface.texture)[0] - surface.max_depth
    result = []
    for _ in range(count):
        x, z = rng.uniform(0.0, L, 3), rng.uniform(low, 0.3e-3, 3)
        z[rng.integers(3)] = low
        result.append(np.column_stack([x, 0 * x, z]))
    return result


EVERY: list[str | Law] = [*"ABCG", "W", "D", "E", "H", CUBED, WEIGHTED]


@pytest.mark.parametrize("clamp", CLAMPS)
@pytest.mark.parametrize("law", EVERY, ids=str)
def test_work_of_random_loops_does_not_exceed_the_leak(law: str | Law, clamp: str) -> None:
    surface = clamped(WAVE, law, clamp)
    works = [abs(loop_work(surface, loop, 1e-10)) for loop in random_loops(surface, 12)]
    size = K * D * L
    if surface.facts.conservative:
        assert max(works) < 1e-8 * size
        assert worst_loop(surface).energy == 0.0
        return
    result = worst_loop(surface)
    assert max(works) > 1e-3 * size
    assert result.energy == pytest.approx(loop_work(surface, result.vertices), rel=1e-4)
    if math.isfinite(result.upper_per_period):
        assert max(works) <= result.upper_per_period * (1 + 1e-9)
        assert result.upper_per_period <= result.energy * 1.05


def test_law_c_under_a_lateral_clamp_is_not_conservative(monkeypatch: pytest.MonkeyPatch) -> None:
    """A loop down on one side of a flank and up on the higher side gains 160 µJ."""
    surface = Surface(Sinusoid(0.4e-3, 1e-3), "C", 500.0, 0.1e-3, clamp="lateral")
    corners = np.array([[0, 0, -1], [0.25, 0, -1], [0.25, 0, -0.2], [0, 0, -0.2]]) * 1e-3
    assert loop_work(surface, corners) == pytest.approx(160e-6, rel=1e-12)
    loop = worst_loop(surface)
    # k h' over 2A of depth, on a flank that rises by 2A.
    assert loop.method == "certified"
    exact = 500.0 * (2 * 0.4e-3) ** 2
    assert exact * (1 - 1e-3) < loop.energy <= exact <= loop.upper_per_period < exact * (1 + 1e-3)
    assert curl_number(surface).upper == pytest.approx(KEY * 0.4e-3, rel=1e-5)
    rig = parse_device(
        {
            "damping": "50 N*s/m",
            "update_rate": "4 kHz",
            "delay_samples": 0,
            "max_stiffness": "9 N/mm",
        },
        "rig",
    )
    numbers = characteristic_number(surface), one_sided_number(surface)
    result = passivity(surface, rig, *numbers, loop)
    assert (result.verdict, result.decided_by) == ("not passive", "leak")
    # Negative control: the facts of the law alone give no leak.
    monkeypatch.setattr(Surface, "facts", law_facts(surface.law))
    assert worst_loop(surface).energy == 0.0


def test_whole_clamp_adds_the_curl_of_the_normal_to_the_leak() -> None:
    """Below max_depth the force of law B is k D n at every depth, with curl k D |n_z'|."""
    surface = clamped(WAVE, "B", "whole")
    shallow, result = worst_loop(Surface(WAVE, "B", K, D)), worst_loop(surface)
    assert surface.clamped_depth == pytest.approx(D + 0.4e-3, rel=1e-12)
    x = (np.arange(200_000) + 0.5) * L / 200_000
    z = WAVE.height(np.column_stack([x, 0 * x])) - 1.5 * D
    jacobian = surface.jacobian(np.column_stack([x, 0 * x, z]))
    curl = jacobian[:, 0, 2] - jacobian[:, 2, 0]
    sides = [float(np.maximum(sign * curl, 0.0).mean()) * L * 0.4e-3 for sign in (1.0, -1.0)]
    # Both sides are equal on a wave; the zone adds to each.
    assert result.upper_per_period <= (shallow.upper_per_period + max(sides)) * (1 + 1e-3)
    assert result.energy > shallow.energy * 1.1


def test_lipschitz_constant_under_a_clamp_is_k_q() -> None:
    surface = clamped(SUM, "C", "backed")
    q = characteristic_number(surface)
    smooth = continuity(surface, q)
    assert smooth.lipschitz is not None
    assert smooth.lipschitz.upper == pytest.approx(K * q.upper, rel=1e-12)
    assert q.note.startswith("where the backed clamp acts")
    assert q.at is not None
    size = np.linalg.norm(surface.jacobian([q.at])[0], 2)
    assert float(size) / K == pytest.approx(q.lower, rel=1e-12)


def test_witness_lies_just_below_the_start_of_the_clamp() -> None:
    """The backing of law G is equally stiff at every depth; the nearest witness is reported."""
    shallow = 0.05e-3
    for number in (characteristic_number, one_sided_number):
        bound = number(Surface(WAVE, "G", K, shallow, clamp="backed"), 1e-3)
        assert bound.at is not None
        assert shallow < -bound.at[2] < shallow * (1.0 + 1e-8)


PULLED = Law(
    "S",
    "pulled",
    "nominal",
    lambda c: c.k * c.depth * (c.e_z - c.tangential(c.deflection) / 1e-3),
    clampable=True,
    stateful=True,
    parameters={"max_deflection": 1e-3},
)


def test_user_defined_law_with_state_under_a_clamp_is_sampled() -> None:
    above = characteristic_number(Surface(WAVE, PULLED, K, D), 0.1)
    bound = characteristic_number(clamped(WAVE, PULLED, "backed"), 0.1)
    assert above.method == "certified"
    assert (bound.method, bound.upper) == ("sampled", math.inf)


@pytest.mark.parametrize("clamp", CLAMPS)
def test_law_not_affine_in_depth_is_bounded_in_the_zone(clamp: str) -> None:
    surface = clamped(SUM, CUBED, clamp)
    bound = characteristic_number(surface)
    assert bound.method == "certified"
    assert largest_secants(surface)[0] <= bound.upper * (1 + 1e-6)
    assert bound.lower >= bound.upper * (1 - 2e-3)


def test_law_that_is_stiffest_inside_the_zone_is_bounded_there() -> None:
    """The slope of δ + (s - δ/3) (δ/s)² is 1 + δ (2 s - δ)/s², largest at δ = s."""

    def force(c: Any) -> Any:
        size = c.parameter("size")
        return c.k * (c.depth + (size - c.depth / 3) * (c.depth / size) ** 2) * c.e_z

    law = Law("P", "peak", "vertical", force, clampable=True, parameters={"size": 1.5 * D})
    surface = clamped(WAVE, law, "lateral")
    bound = characteristic_number(surface)
    assert bound.at is not None
    depth = WAVE.height(np.array([bound.at])[:, :2])[0] - bound.at[2]
    assert depth == pytest.approx(1.5 * D, rel=0.05)
    assert largest_secants(surface)[0] <= bound.upper * (1 + 1e-6)
    assert bound.lower >= bound.upper * (1 - 2e-3)


def test_all_clampable_laws_are_covered() -> None:
    assert {law.letter for law in LAWS.values() if law.clampable} == set("ABCFG")
    assert characteristic.include_clamp is characteristic.include_clamp
