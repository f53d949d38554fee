"""Designs against comparisons, and against random searches."""

from __future__ import annotations

import math
import random
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import asperity as asp
from asperity.analysis.energy.straight_scan import scan_force
from asperity.analysis.limits.wave_scan import scan_forces
from asperity.core.cache import bypass_results
from asperity.core.errors import ParameterError
from asperity.devices import override_device
from asperity.envelopes.find_design import Design, design
from asperity.envelopes.searches import FORCE, RANGE, Search, Target
from asperity.envelopes.wave_borders import RenderConditions, WaveCase
from asperity.laws.clamps import CLAMPS
from asperity.perception.grip import load_grip

LAND = Path(__file__).parents[2].parent / "shared" / "data" / "sample-land.x3p"
DEVICES = ("touch", "omega.3", "pantograph", "falcon")
COUNT = 2  # python -m bench.stress.envelopes checks 200
POINTS = 300  # there 1000
FORCE_NAMES = {"RMS": "texture_force", "peak": "peak_force"}
Case = tuple[Search, Design, float, float]
"""Search, design, and by random search the greatest margin and the greatest force [N]."""


def random_search(search: Search, draw: random.Random) -> tuple[float, float]:
    """Return the greatest margin, and the greatest force that meets all other requirements."""
    force, margin, reach = search.target.texture_force or 1.0, 0.0, 0.0
    for _ in range(POINTS // 10):
        x = draw.uniform(*search.bounds)
        top = search.max_stiffness(x)
        for share in [1.0, *(10.0 ** draw.uniform(-2.0, 0.0) for _ in range(9))] if top else ():
            ratios = search.ratios(x, share * top)
            margin = max(margin, min(ratios.values()))
            if min(value for name, value in ratios.items() if name != FORCE) >= 1.0:
                reach = max(reach, ratios[FORCE] * force)
    return margin, reach


def dense_reach(search: Search, x: float, stiffness: float) -> float:
    """Return the greatest force [N] at factors and stiffnesses around those of an answer."""
    low, high = search.bounds
    near = [x + 1e-3 * step for step in range(-150, 151)]
    reach, force = 0.0, search.target.texture_force or 1.0
    for y in (x for x in [*near, high] if low <= x <= high):
        if not (top := search.max_stiffness(y)):
            continue
        top *= min(1.0, search.ratios(y, top)["leak"])
        for k in {top, *(min(top, stiffness * share) for share in (0.97, 0.99, 1.0, 1.01, 1.03))}:
            ratios = search.ratios(y, k)
            if min(value for name, value in ratios.items() if name != FORCE) >= 1.0 - 1e-9:
                reach = max(reach, ratios[FORCE] * force)
    return reach


def random_target(draw: random.Random) -> tuple[Search, float]:
    """Return a random search, and the force that its random points reach [N]; 0 for none."""
    conditions = RenderConditions(speed=10.0 ** draw.uniform(-1.5, -0.5))
    case = WaveCase(draw.choice("ABCDEFGH"), {}, asp.load_device(draw.choice(DEVICES)), conditions)
    wave = asp.Sinusoid(1e-4, 10.0 ** draw.uniform(-3.3, -2.0))
    leak = draw.choice([math.inf] * 5 + [10.0 ** draw.uniform(-6.0, -4.0)])
    support = draw.choice([0.0] * 4 + [draw.uniform(0.05, 0.95)])
    at, measure = draw.choice([("motor", "RMS"), ("motor", "peak"), ("hand", "RMS")])
    search = Search(case, wave, Target(1e-3, at, leak, support, measure))
    return search, random_search(search, draw)[1]


@cache
def random_designs(count: int, is_feasible: bool) -> list[Case]:
    """Return random designs whose target is, or is not, met by a point of a random search."""
    draw, found = random.Random(11 + is_feasible), list[Case]()
    with bypass_results():
        while len(found) < count:
            search, reach = random_target(draw)
            if not reach:
                continue
            share = draw.uniform(0.1, 0.9) if is_feasible else draw.uniform(1.5, 4.0)
            target = replace(search.target, texture_force=share * reach)
            search = replace(search, target=target)
            target, conditions = search.target, search.case.conditions
            options: Any = {FORCE_NAMES[target.measure]: target.texture_force}
            answer = design(
                search.texture,
                search.case.device,
                [search.case.law],
                at=target.at,
                max_leak=None if math.isinf(target.max_leak) else target.max_leak,
                min_support=target.min_support or None,
                speed=conditions.speed,
                **options,
            )
            found.append((search, answer, *random_search(search, draw)))
    return found


def peak_on_period(surface: asp.Surface, period: float) -> float:
    """Return the greatest oscillating force [N] at 3001 points of a period, at constant height."""
    x = np.linspace(0.0, period, 3001)[:-1]
    forces = scan_forces(surface, np.column_stack([x, 0.0 * x]))
    return float(np.linalg.norm(forces - forces.mean(axis=0), axis=1).max())


def meets_target(search: Search, answer: Design, force: float) -> bool:
    """Return whether a comparison of its own meets the requirements, with this force [N]."""
    target, surface = search.target, answer.row.surface
    wave = search.texture.single_wave
    assert wave is not None
    with bypass_results():
        row = asp.compare(
            asp.Sinusoid(answer.factor * wave.amplitude, wave.period),
            search.case.device,
            [search.case.law],
            surface.stiffness,
            speed=search.case.conditions.speed,
        ).rows[0]
    felt = row.perceptibility
    assert felt is not None
    reached = felt.texture_rms if target.at == "motor" else felt.hand_force / math.sqrt(2.0)
    if target.measure == "peak":
        reached = peak_on_period(row.surface, wave.period)
    return (
        felt.tier == "felt"
        and reached >= 0.99 * force
        and row.support >= 0.99 * target.min_support
        and row.recommended_stiffness >= 0.99 * surface.stiffness >= 0.98 * 100.0
        and row.leak.worst_per_period <= 1.01 * target.max_leak
    )


def test_feasible_targets_are_met_with_the_greatest_margin() -> None:
    for search, answer, margin, _reach in random_designs(COUNT, is_feasible=True):
        assert answer.is_feasible, answer
        assert meets_target(search, answer, search.target.texture_force or 0.0), answer
        assert min(answer.margins.values()) >= margin / 1.01, (answer, margin)


def test_targets_beyond_reach_get_the_nearest_one() -> None:
    for search, answer, margin, reach in random_designs(COUNT, is_feasible=False):
        assert not answer.is_feasible
        assert margin < 1.01
        assert answer.reachable >= reach / 1.01, (answer, answer.reachable, reach)
        assert meets_target(search, answer, answer.reachable), answer


def test_a_requirement_binds_if_and_only_if_relaxing_it_extends_the_reach() -> None:
    """Relaxed by 10 %, a requirement that binds makes more force possible.

    By little (0.1 % in one of 200) where the greatest force happens to be just beyond it.
    Another one makes at most 2 % more possible: it may admit another local optimum, as a smaller
    least stiffness did in one of 200 (1.3 %). The answer may be as much below the best of a dense
    search: the recommended stiffness is rounded down to three digits.
    """
    for search, answer, _margin, _reach in random_designs(COUNT, is_feasible=False):
        names, x = {*answer.margins} - {FORCE}, math.log(answer.factor)
        with bypass_results():
            k = answer.row.surface.stiffness
            relaxed = {name: replace(search, relaxed={name: 1.1}) for name in names}
            reach = {name: dense_reach(one, x, k) for name, one in relaxed.items()}
            base = dense_reach(search, x, k)
        assert base == pytest.approx(answer.reachable, rel=0.02), answer
        assert (RANGE in answer.binding) == (min(abs(x - end) for end in search.bounds) < 0.01)
        for name in names:
            binds, gain = name in answer.binding, reach[name] / base
            assert gain > 1.0005 if binds else gain < 1.02, (answer, answer.binding, reach, base)


def test_half_of_the_stiffness_is_a_smaller_margin() -> None:
    """The checks above detect a design that is worse by a factor of two."""
    search, answer, margin, _reach = random_designs(COUNT, is_feasible=True)[0]
    x = math.log(answer.factor)
    worse = search.ratios(x, 2.0 * answer.row.surface.stiffness)
    assert min(worse.values()) < margin / 1.01


WAVE = "sinusoid:period=2mm,amplitude=0.1mm"


STEEP = asp.Sinusoid(0.2e-3, 1e-3)
WAVES = asp.Fourier([1e-4, 5e-5], [[3000.0, 0.0], [0.0, 5000.0]], [0.0, 0.5])


@pytest.mark.parametrize(
    ("letter", "texture"), [("A", STEEP), ("B", STEEP), ("C", WAVES), ("F", STEEP), ("G", WAVES)]
)
def test_no_clamp_improves_what_a_design_requires(letter: str, texture: Any) -> None:
    """Requirements hold down to max_depth, where no clamp acts: it may add a greater gain below."""
    plain = asp.compare(texture, "touch", letter, max_depth=2e-4).rows[0]
    for clamp in CLAMPS.keys() - {plain.surface.clamp}:
        row = asp.compare(texture, "touch", letter, max_depth=2e-4, clamp=clamp).rows[0]
        assert row.recommended_stiffness <= plain.recommended_stiffness, clamp
        assert row.support <= plain.support * (1.0 + 1e-9), clamp
        assert row.leak.worst_per_period >= row.surface.stiffness / plain.surface.stiffness * (
            plain.leak.worst_per_period * (1.0 - 1e-9)
        )
        assert row.contact_lost == plain.contact_lost


def test_the_best_of_several_values_of_a_parameter_is_chosen() -> None:
    """On the hand the force of H is greatest below the limit, where more continuity adds force.

    That is at 20 Hz, so the hand is one whose thresholds are known there.
    """
    pen = load_grip()
    hand = replace(
        pen,
        frequency=(10.0, *pen.frequency),
        unnoticed=(pen.unnoticed[0], *pen.unnoticed),
        felt=(pen.felt[0], *pen.felt),
    )
    target: Any = {"texture_force": 0.1, "at": "hand", "speed": 0.02, "grip": hand}
    found = {
        c: design(STEEP, "omega.3", "H", law_parameters={"continuity": c}, **target)
        for c in (1.0, 1.5, 4.0)
    }
    margins = {c: min(one.margins.values()) for c, one in found.items()}
    assert margins[1.5] > 1.05 * max(margins[1.0], margins[4.0])
    best = design(STEEP, "omega.3", "H", law_parameters={"continuity": [1.0, 1.5, 4.0]}, **target)
    assert best.row.surface.law_parameters == {"continuity": 1.5}
    assert min(best.margins.values()) == margins[1.5]


def test_a_law_without_the_parameter_is_searched_once() -> None:
    steps: list[str] = []
    values = {"continuity": [1.0, 2.0], "friction": [0.4, 0.8]}
    design(WAVE, "touch", "CHF", law_parameters=values, progress=steps.append, texture_force=5e-3)
    assert sorted(one for one in steps if one.startswith("law")) == ["law C", "law H", "law H"]


def test_support_of_a_field_that_does_not_split_is_that_of_its_own_gain() -> None:
    """Law H with c = 3 is law D here, with q = 1."""
    one, three = (
        design(WAVE, "touch", "H", texture_force=5e-3, min_support=0.5, law_parameters=values)
        for values in ({}, {"continuity": 3.0})
    )
    assert three.row.support == pytest.approx(one.row.support, rel=1e-3)
    assert min(three.margins.values()) == pytest.approx(min(one.margins.values()), rel=1e-2)


def test_a_peak_is_that_of_the_force_on_the_scan() -> None:
    """Of law A, whose force is along z, it is the amplitude; of law C the force turns."""
    for letter, crest in (("A", math.sqrt(2.0)), ("C", None)):
        result = design(WAVE, "pantograph", letter, peak_force=5e-3)
        peak = peak_on_period(result.row.surface, 2e-3)
        assert peak == pytest.approx(5e-3 * result.margins[FORCE], rel=1e-3)
        assert result.row.perceptibility is not None
        if crest:
            assert peak == pytest.approx(crest * result.row.perceptibility.texture_rms, rel=1e-3)


def test_a_peak_excludes_form_and_waviness() -> None:
    if not LAND.exists():
        pytest.skip(f"{LAND} is missing")
    texture = asp.load_texture(LAND, magnify=20)
    part = texture.texture_part()
    assert part.nesting is not None
    case = WaveCase("C", {}, asp.load_device("omega.3"), RenderConditions())
    search = Search(case, texture, Target(1e-3, measure="peak"))
    ratios = search.compute_sample(1.0).ratios(search.target, 500.0)
    own = asp.Surface(part.texture, "C", stiffness=500.0)
    scan = scan_force(own)
    assert scan.peak > 2.0 * scan.ripple
    whole = scan_force(asp.Surface(texture, "C", stiffness=500.0))
    assert whole.peak != pytest.approx(scan.peak, rel=0.1)
    assert ratios[FORCE] == pytest.approx(500.0 * scan.peak / 1e-3, rel=1e-6)


def test_support_is_that_of_a_comparison() -> None:
    result = design(WAVE, "touch", "C", texture_force=10e-3, min_support=0.9)
    assert result.row.support == pytest.approx(0.9 * result.margins["support"], rel=1e-6)
    assert result.is_feasible
    free = design(WAVE, "touch", "C", texture_force=10e-3)
    assert free.row.support < 0.9
    assert "support" not in free.margins


def test_largest_texture_ends_at_the_border_of_the_envelope() -> None:
    result = design(WAVE, "touch", "C")
    border = asp.envelope("touch", "C", wavelengths=[2e-3])["touch"]["C"].borders[0]
    assert result.factor * 1e-4 == pytest.approx(border.felt_up_to, rel=3e-3)
    assert (result.is_feasible, {*result.binding}) == (True, {"stability", "least stiffness"})
    assert result.row.tier == "felt"


def test_best_law_has_no_curl_where_one_meets_the_target() -> None:
    result = design(WAVE, "touch", "FAC", texture_force=5e-3)
    assert result.row.law.letter == "C"
    assert result.is_feasible


def test_nothing_is_reachable_where_no_stiffness_suffices() -> None:
    result = design(WAVE, "touch", "A", texture_force=5e-3)
    assert (result.is_feasible, result.reachable) == (False, 0.0)
    assert result.margins[result.binding[0]] < 1.0


def test_measured_textures_are_magnified_in_all_directions() -> None:
    plain = asp.HeightMap(3e-5 * np.random.default_rng(8).normal(size=(12, 10)), (3e-4, 4e-4))
    result = design(plain, "omega.3", "C", texture_force=30e-3)
    scaled = result.comparison.texture
    assert scaled.peak_to_valley == pytest.approx(result.factor * plain.peak_to_valley, rel=1e-6)
    assert scaled.domain.spans == pytest.approx(result.factor * plain.domain.spans, rel=1e-6)
    assert result.is_feasible
    assert result.row.perceptibility is not None
    assert result.row.perceptibility.texture_rms >= 30e-3


@pytest.mark.parametrize("base", [asp.named_surface("knurl"), WAVES], ids=["spline", "waves"])
@pytest.mark.parametrize("letter", "CFH")
@pytest.mark.parametrize("factor", [0.2, 30.0])
def test_numbers_of_a_magnified_texture_are_those_of_the_original(
    base: Any, letter: str, factor: float
) -> None:
    case = WaveCase(letter, {}, asp.load_device("omega.3"), RenderConditions(), "search")
    search = Search(case, base, Target(1e-3))
    scaled = case.trial(search.scaled_texture(factor))
    sample = search.compute_sample(factor, "search")
    assert sample.trial.recommended.stiffness == scaled.recommended.stiffness
    assert scaled.waves is not None
    assert sample.trial.waves is not None
    components = sample.trial.waves.components
    np.testing.assert_allclose(components, scaled.waves.components, rtol=1e-6, atol=1e-12)
    lost = scan_force(scaled.surface).contact_lost
    assert sample.contact_lost == pytest.approx(lost, abs=1e-3)


def test_largest_measured_texture_states_what_is_lost() -> None:
    """E on the measured surface: half of the scan has no contact, as it is 1 mm deep at most."""
    if not LAND.exists():
        pytest.skip(f"{LAND} is missing")
    texture = asp.load_texture(LAND, magnify=20)
    result = design(texture, "omega.3", "E")
    assert (result.is_feasible, result.binding) == (True, ("contact",))
    assert 0.49 < result.row.contact_lost <= 0.5
    assert result.lost["contact"] == result.row.contact_lost
    assert result.lost["height"] == pytest.approx(
        1.0 - 1e-3 / result.comparison.texture.peak_to_valley
    )
    felt = result.row.perceptibility
    assert felt is not None
    lost = math.hypot(result.lost["texture force [N]"], felt.resolved_rms)
    assert lost == pytest.approx(felt.texture_rms, rel=1e-6)
    larger = asp.load_texture(LAND, magnify=20 * 1.03 * result.factor)
    assert asp.compare(larger, "omega.3", "E").rows[0].contact_lost > 0.5


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"at": "elbow"}, "at must be motor or hand"),
        ({"texture_force": 0.0}, "texture_force must be positive"),
        ({"max_leak": -1.0}, "max_leak must be positive"),
        ({"min_support": 2.0}, r"min_support must be in \[0, 1\]"),
        ({"peak_force": -1.0}, "peak_force must be positive"),
        ({"peak_force": 1.0, "texture_force": 1.0}, "peak_force replaces texture_force: leave one"),
        ({"peak_force": 1.0, "at": "hand"}, "peak_force is at the motor, at='hand' is not"),
        ({"law_parameters": {"continuity": [1.0]}}, "no parameter of the laws C"),
        ({"law_parameters": {"continuity": []}}, "continuity must be one or several"),
        ({"time_samples": 7.0}, "time_samples is unknown"),
        ({"device": "2diy"}, "needs max_stiffness"),
        ({"texture": asp.HeightMap(np.zeros((8, 8)), 1e-4)}, "this one is flat"),
    ],
)
def test_bad_input_names_the_argument(arguments: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        design(**{"texture": WAVE, "device": "touch", "laws": "C", **arguments})


def test_steps_of_the_device_are_a_requirement_of_their_own() -> None:
    """A margin has one meaning: what the hand feels, or what the device resolves."""
    device = replace_force_resolution(3e-3)
    result = design("sinusoid:amplitude=0.1mm,period=2mm", device, "C", texture_force=20e-3)
    felt = result.row.perceptibility
    assert felt is not None
    assert result.margins["perceptibility"] == pytest.approx(felt.level, rel=1e-6)
    amplitude = math.sqrt(2.0) * felt.texture_rms
    assert result.margins["force steps"] == pytest.approx(amplitude / (5 * 3e-3), rel=1e-3)
    assert result.margins["force steps"] < 0.5 * result.margins["perceptibility"]
    without = design("sinusoid:amplitude=0.1mm,period=2mm", "touch", "C", texture_force=20e-3)
    assert "force steps" not in without.margins


def replace_force_resolution(step: float) -> asp.Device:
    return override_device(asp.load_device("touch"), {"force_resolution": f"{step} N"})
