"""The passivity criteria compared with formulas evaluated by hand."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from asperity.analysis import characteristic_number, loop_work, one_sided_number
from asperity.analysis.bounds.bound import Bound
from asperity.analysis.energy.closed_loops import (
    AbsorbingFriction,
    Leak,
    LoopKind,
    LoopOrigin,
    polygon_length,
)
from asperity.analysis.energy.leak import worst_loop
from asperity.analysis.passivity import device_loop
from asperity.analysis.passivity.criteria import Criterion
from asperity.analysis.passivity.device_loop import make_device_loop
from asperity.analysis.passivity.verdict import Passivity, passivity
from asperity.core.errors import ParameterError
from asperity.derive.facts import law_facts
from asperity.devices import Datum, Device, parse_device
from asperity.laws import Law
from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid
from asperity.textures.spline.spline_texture import HeightMap

WAVE = Sinusoid(0.1e-3, 2e-3, phase=0.4, direction=(3.0, 1.0))
STEEP = Sinusoid(0.8e-3, 1e-3)
RIG = {"damping": "2 N*s/m", "update_rate": "4 kHz"}
SIGMA, T = 2.0, 1.0 / 4000.0


def assess(surface: Surface, fields: dict[str, Any], **numbers: Bound) -> Passivity:
    q = numbers.get("q") or characteristic_number(surface)
    plus = numbers.get("plus") or one_sided_number(surface)
    leak = rectangle(surface) if surface.law.letter == "B" else worst_loop(surface)
    return passivity(surface, parse_device(fields, "mine"), q, plus, leak)


def rectangle(surface: Surface) -> Leak:
    """Return a loop below one flank, in place of the worst loop, whose search is slow for law B."""
    along = surface.texture.scan_line()
    ends = along.points(4)[:2]
    heights = -0.6 * surface.max_depth + 0.3 * surface.max_depth * np.array([-1.0, 1.0])
    corners = np.array([[*ends[i], heights[j]] for i, j in ((0, 0), (0, 1), (1, 1), (1, 0))])
    energy = loop_work(surface, corners)
    origin = LoopOrigin(LoopKind.CURL_BY_DEPTH)
    vertices = corners if energy > 0.0 else np.ascontiguousarray(corners[::-1])
    absorbing = AbsorbingFriction(
        abs(energy) / polygon_length(vertices), 1.0, abs(energy), vertices
    )
    return Leak(abs(energy), math.inf, along, "sampled", origin, vertices, None, absorbing)


def exact_bound(value: float) -> Bound:
    return Bound(value, value, "theorem", (0.0, 0.0, 0.0))


# --- limits, by hand ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("paper (1)", SIGMA / (2 * T * 3.0)),
        ("one-sided", 2 * SIGMA / (T * 2.0)),
        ("delay", SIGMA / (T * (2.0 / 2 + 2 * 3.0))),
        ("virtual damping", (SIGMA - 0.5) / (T * (2.0 / 2 + 2 * 3.0))),
        ("smooth-wall rule", 5000.0 * (0.5 / 2.5) / 3.0),
        ("wall test", 5000.0 * 0.5 / (2.0 / 2 + 2 * 3.0)),
        ("leak", math.inf),
    ],
)
def test_limit_of_each_criterion_equals_its_formula(name: str, expected: float) -> None:
    rig = {**RIG, "delay_samples": 2, "max_stiffness": "5 N/mm"}
    if name == "virtual damping":
        rig["virtual_damping"] = "0.5 N*s/m"
    if name == "wall test":
        del rig["damping"]  # otherwise both damping and delay are known
    criterion = assess(
        Surface(WAVE, "C", 500.0), rig, q=exact_bound(3.0), plus=exact_bound(2.0)
    ).criterion(name)
    assert criterion.limit == pytest.approx(expected, rel=1e-15)
    assert criterion.margin == pytest.approx(expected / 500.0, rel=1e-15)
    assert criterion.holds is (expected >= 500.0)
    if name == "smooth-wall rule":
        assert criterion.formula == "k q <= K₀ (1/2 + d₀)/(1/2 + d)"
        for delay in ({"delay_samples": 0}, {}):
            same = assess(Surface(WAVE, "C"), {"max_stiffness": "5 N/mm", **delay})
            assert same.criterion(name).formula == "k q <= K₀"
    assert criterion.missing == ()


def test_virtual_damping_without_delay_is_the_colgate_schenkel_condition() -> None:
    """The condition is b > K T/2 + |b_v| with K = k q⁺, for either sign of b_v."""
    for sign in (1.0, -1.0):
        rig = {**RIG, "delay_samples": 0, "virtual_damping": sign * 0.5}
        result = assess(Surface(WAVE, "W", 500.0), rig)
        assert result.decided_by == "virtual damping"
        assert result.stability_limit.stiffness == pytest.approx((SIGMA - 0.5) * 2 / T, rel=1e-15)


def test_virtual_damping_above_the_physical_damping_gives_zero_stiffness() -> None:
    result = assess(Surface(WAVE, "H"), {**RIG, "delay_samples": 0, "virtual_damping": 3.0})
    assert (result.verdict, result.stability_limit.stiffness) == ("not passive", 0.0)


@settings(max_examples=200, deadline=None)
@given(
    sigma=st.floats(1e-3, 1e3),
    rate=st.floats(1e2, 1e5),
    q=st.floats(1.0, 1e3),
    delay=st.integers(0, 9),
)
def test_limits_are_rounded_down_to_the_nearest_float(
    sigma: float, rate: float, q: float, delay: int
) -> None:
    rig = {"damping": sigma, "update_rate": rate, "delay_samples": delay}
    surface = Surface(WAVE, "W", 1.0)
    result = assess(surface, rig, q=exact_bound(q), plus=exact_bound(1.0))
    exact = Fraction(sigma) * Fraction(rate) / (Fraction(1, 2) + delay * Fraction(q))
    limit = result.criterion("delay").limit
    assert limit is not None
    assert Fraction(limit) <= exact < Fraction(math.nextafter(limit, math.inf))
    assert (
        assess(Surface(WAVE, "W", limit), rig, q=exact_bound(q), plus=exact_bound(1.0)).verdict
        == "passive"
    )
    above = Surface(WAVE, "W", math.nextafter(limit, math.inf))
    assert assess(above, rig, q=exact_bound(q), plus=exact_bound(1.0)).verdict != "passive"


def test_round_up_gives_the_smallest_float_not_below() -> None:
    for part in (Fraction(1, 3), Fraction(2, 3), Fraction(1, 10), Fraction(7, 8), Fraction(0)):
        result = device_loop.round_up_exactly(part)
        assert Fraction(result) >= part > Fraction(math.nextafter(result, -math.inf))


def test_verdict_is_undecided_between_the_bounds_of_a_number() -> None:
    """The upper bound proves the limit, the lower bound refutes it."""
    loose = Bound(2.0, 4.0, "certified")
    rig = {**RIG, "delay_samples": 0}
    limits = {500.0: True, 4000.0: True, 4001.0: None, 8000.0: None, 8001.0: False}
    for stiffness, holds in limits.items():
        result = assess(Surface(WAVE, "C", stiffness), rig, q=loose, plus=loose)
        assert result.criterion("one-sided").holds is holds
        verdict = {True: "passive", None: "undecided", False: "not passive"}[holds]
        assert result.verdict == verdict
        assert result.stability_limit.stiffness == 4000.0


def test_sampled_number_proves_nothing_but_can_refute() -> None:
    sampled = Bound(2.0, math.inf, "sampled")
    rig = {**RIG, "delay_samples": 0}
    small, great = (
        assess(Surface(WAVE, "C", k), rig, q=sampled, plus=sampled) for k in (10.0, 9e3)
    )
    assert (small.verdict, small.stability_limit.stiffness) == ("undecided", 8000.0)
    assert small.stability_limit.sampled
    assert small.criterion("one-sided").limit is None
    assert "only sampled" in small.reason
    assert great.verdict == "not passive"


# --- missing data ---------------------------------------------------------------------------------


def test_missing_data_are_listed_for_each_criterion() -> None:
    result = assess(Surface(WAVE, "H"), {"max_force": "3 N"})
    expected = {
        "paper (1)": ("update_rate", "damping"),
        "one-sided": ("update_rate", "damping"),
        "delay": ("update_rate", "damping", "delay_samples"),
        "virtual damping": ("update_rate", "damping", "virtual_damping"),
        "smooth-wall rule": ("max_stiffness",),
        "wall test": ("max_stiffness",),
    }
    for name, missing in expected.items():
        criterion = result.criterion(name)
        assert criterion.missing == missing
        assert (criterion.holds, criterion.limit, criterion.margin) == (None, None, None)
        assert criterion.conclusion == f"not decidable: needs {', '.join(missing)}"
    assert (result.verdict, result.stability_limit.stiffness, result.greatest_delay) == (
        "undecided",
        None,
        None,
    )


def test_unknown_delay_is_undecided_and_reports_the_largest_proved_delay() -> None:
    """At 1000 N/m, k (1/2 + d) <= σ₀/T = 8000 N/m holds for d <= 7."""
    result = assess(Surface(WAVE, "H", 1000.0), RIG)
    assert result.criterion("one-sided").holds is True
    assert (result.verdict, result.decided_by, result.greatest_delay) == ("undecided", "delay", 7)
    assert result.criterion("delay").missing == ("delay_samples",)
    assert "d <= 7" in result.criterion("delay").conclusion
    for delay, verdict in ((7, "passive"), (8, "not passive")):
        assert assess(Surface(WAVE, "H"), {**RIG, "delay_samples": delay}).verdict == verdict


def test_virtual_damping_does_not_replace_a_known_delay() -> None:
    result = assess(Surface(WAVE, "H"), {**RIG, "virtual_damping": 0.5})
    assert result.criterion("virtual damping").holds is True
    assert (result.verdict, result.decided_by) == ("undecided", "delay")
    assert assess(Surface(STEEP, "D"), RIG).verdict == "undecided"


def test_slack_direction_refutes_passivity_with_delay() -> None:
    """At d = 1, q⁺ = 1, q = 4: proved up to 8000/4.5 N/m, refuted by k q/2 > σ₀/T + b_v/T."""
    numbers = {"q": exact_bound(4.0), "plus": exact_bound(1.0)}
    cases = [
        (1777.0, 0.0, "passive"),
        (1778.0, 0.0, "undecided"),
        (3999.0, 0.0, "undecided"),
        (4001.0, 0.0, "not passive"),
        (4001.0, 0.5, "undecided"),
        (4999.0, 0.5, "undecided"),
        (5001.0, 0.5, "not passive"),
    ]
    for stiffness, virtual, verdict in cases:
        rig = {**RIG, "delay_samples": 1, "virtual_damping": virtual}
        assert assess(Surface(WAVE, "C", stiffness), rig, **numbers).verdict == verdict
    # Without delay a slack direction is harmless.
    assert (
        assess(Surface(WAVE, "C", 9000.0), {**RIG, "delay_samples": 0}, **numbers).verdict
        == "passive"
    )


def test_slack_direction_requires_q_above_q_plus() -> None:
    """If q equals the upper bound of q⁺, a stiff direction may attain it; nothing is refuted."""
    device = {**RIG, "delay_samples": 1}
    loose = Bound(0.5, 4.0, "certified")
    equal = assess(Surface(WAVE, "C", 4500.0), device, q=exact_bound(4.0), plus=loose)
    assert equal.verdict == "undecided"
    above = assess(Surface(WAVE, "C", 4500.0), device, q=exact_bound(4.01), plus=loose)
    assert above.verdict == "not passive"


def test_largest_proved_delay_includes_virtual_damping() -> None:
    """The condition is k (1/2 + d) T + b_v <= σ₀."""
    assert assess(Surface(WAVE, "H"), {**RIG, "virtual_damping": 0.5}).greatest_delay == 5
    assert assess(Surface(WAVE, "H", 16001.0), RIG).greatest_delay is None
    # k (q⁺/2 + d q) <= σ₀/T with q = 2, q⁺ = 1.5: d <= (8 - 0.75)/2.
    result = assess(Surface(WAVE, "C", 1000.0), RIG, q=exact_bound(2.0), plus=exact_bound(1.5))
    assert result.greatest_delay == 3


def test_unverified_data_are_marked_in_the_assumptions() -> None:
    verified = Datum(4000.0, "Hz", "measured", verified=True)
    unverified = Datum(2.0, "N*s/m", "a guess", verified=False)
    device = Device("x", "x", {"update_rate": verified, "damping": unverified})
    surface = Surface(WAVE, "W")
    result = passivity(surface, device, exact_bound(1.0), exact_bound(1.0), worst_loop(surface))
    line = result.criterion("one-sided").assumptions
    assert "damping 2 N·s/m (not verified)" in line
    assert "update_rate 4 kHz (not" not in line
    assert "update_rate 4 kHz" in line
    assert all("\n" not in criterion.assumptions for criterion in result.criteria)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("update_rate", 0.0),
        ("damping", -1.0),
        ("damping", math.nan),
        ("delay_samples", 0.5),
        ("virtual_damping", math.inf),
        ("max_stiffness", -5.0),
    ],
)
def test_invalid_data_of_a_device_object_raise(field: str, value: float) -> None:
    device = Device("x", "x", {field: Datum(value, "1", "", verified=True)})
    surface = Surface(WAVE, "W")
    with pytest.raises(ParameterError, match=field):
        passivity(surface, device, exact_bound(1.0), exact_bound(1.0), worst_loop(surface))


def test_arguments_of_wrong_type_raise() -> None:
    surface = Surface(WAVE, "W")
    leak = worst_loop(surface)
    for arguments, name in (
        ((WAVE, "omega.3", exact_bound(1.0), exact_bound(1.0), leak), "surface"),
        ((surface, "omega.3", 1.0, exact_bound(1.0), leak), "q"),
        ((surface, "omega.3", exact_bound(1.0), 1.0, leak), "one_sided"),
        ((surface, "omega.3", exact_bound(1.0), exact_bound(1.0), 0.0), "leak"),
    ):
        with pytest.raises(ParameterError, match=f"^{name} must be"):
            passivity(*arguments)


# --- laws that leak -------------------------------------------------------------------------------


@pytest.mark.parametrize("letter", "ABEFG")
def test_leaking_law_is_never_passive(letter: str) -> None:
    """Not even if every norm condition holds by a factor of 1000."""
    strong = {"damping": 1e6, "update_rate": 1e5, "delay_samples": 0, "max_stiffness": 1e9}
    result = assess(Surface(WAVE, letter), strong)
    assert result.criterion("paper (1)").holds is True
    assert result.criterion("smooth-wall rule").holds is True
    assert "curl" in result.criterion("paper (1)").assumptions
    assert (result.verdict, result.decided_by) == ("not passive", "leak")
    assert (result.stability_limit.basis, result.stability_limit.delay) == ("wall gain", None)
    assert result.stability_limit.stiffness == result.criterion("smooth-wall rule").limit
    for name in ("one-sided", "delay", "virtual damping", "wall test"):
        assert (result.criterion(name).holds, result.criterion(name).missing) == (None, ())
        assert result.criterion(name).conclusion.startswith(
            "not applicable: the law is not conservative"
        )


@pytest.mark.parametrize(("energy", "verdict"), [(1e-15, "not passive"), (1e-16, "undecided")])
def test_leak_below_rounding_is_undecided(energy: float, verdict: str) -> None:
    """The rounding level is 1e-12 of k · depth · length = 1000 N/m · 0.2 mm · 2 mm, 4e-16 J."""
    surface = Surface(WAVE, "A", 1000.0, 0.2e-3)
    line = WAVE.scan_line()
    assert line.length == pytest.approx(2e-3)
    leak = replace(rectangle(surface), energy=energy)
    result = passivity(surface, parse_device(RIG, "mine"), exact_bound(1.0), exact_bound(1.0), leak)
    assert result.verdict == verdict


def test_missing_damping_leaves_a_leaking_law_not_passive() -> None:
    result = assess(Surface(WAVE, "A"), {"max_stiffness": "5000 N/m"})
    assert (result.verdict, result.critical_speed) == ("not passive", None)
    assert result.criterion("leak").missing == ("damping",)
    assert "/ damping (missing)" in result.criterion("leak").conclusion


def test_zero_damping_gives_an_infinite_critical_speed() -> None:
    result = assess(Surface(WAVE, "A"), {"damping": 2.0})
    assert result.critical_speed is not None
    zero = Device("x", "x", {"damping": Datum(0.0, "N*s/m", "", verified=True)})
    surface = Surface(WAVE, "A")
    leak = worst_loop(surface)
    speed = passivity(surface, zero, exact_bound(1.0), exact_bound(1.0), leak).critical_speed
    assert speed == math.inf


def test_nonconservative_law_without_leak_is_undecided() -> None:
    flat = HeightMap(np.zeros((6, 6)), 1e-4)
    result = assess(Surface(flat, "A"), {**RIG, "delay_samples": 0, "max_stiffness": 1e6})
    assert (result.verdict, result.decided_by) == ("undecided", "leak")
    assert result.criterion("leak").holds is None


def test_law_c_under_a_lateral_clamp_is_not_passive() -> None:
    result = assess(Surface(WAVE, "C", 10.0, clamp="lateral"), {**RIG, "delay_samples": 0})
    assert (result.verdict, result.decided_by) == ("not passive", "leak")
    whole = assess(Surface(WAVE, "C", 10.0, clamp="whole"), {**RIG, "delay_samples": 0})
    assert whole.verdict == "passive"


def test_conservative_law_with_a_jump_is_undecided() -> None:
    """A force k (depth + preload) e_z is a gradient; oscillations across its step gain energy."""
    jump = Law(
        "J",
        "step",
        "nominal",
        lambda c: c.k * (c.depth + c.parameter("preload")) * c.e_z,
        parameters={"preload": 1e-4},
    )
    surface = Surface(WAVE, jump, 1.0)
    assert law_facts(jump).conservative
    result = assess(surface, {**RIG, "delay_samples": 0, "max_stiffness": 1e9})
    assert result.verdict == "undecided"
    assert "not continuous" in result.criterion("one-sided").conclusion
    # A small oscillation across the onset gains energy at any damping.
    before, after = surface.force([[0.0, 0.0, 1e-9], [0.0, 0.0, -1e-9]])
    energy = 2e-9 * (after[2] - before[2]) - 2.0 * SIGMA / T * 2e-9**2
    assert energy > 0.0


# --- the smooth wall ------------------------------------------------------------------------------


def test_wall_test_makes_limits_plausible_but_not_proved() -> None:
    """The limit K₀/q covers any delay; for a known delay it lies between K₀/q⁺ and K₀/q."""
    wall = {"max_stiffness": "5000 N/m"}
    late = {"max_stiffness": {"value": "5000 N/m", "delay_samples": 1}}
    numbers = {"q": exact_bound(4.0), "plus": exact_bound(2.0)}
    cases = [
        (1250.0, wall, "plausible"),
        (1251.0, wall, "undecided"),
        (2500.0, {**wall, "delay_samples": 0}, "plausible"),
        (2501.0, {**wall, "delay_samples": 0}, "undecided"),
        (500.0, {**wall, "delay_samples": 1}, "plausible"),
        (501.0, {**wall, "delay_samples": 1}, "undecided"),
        (1500.0, {**late, "delay_samples": 1}, "plausible"),
        (1501.0, {**late, "delay_samples": 1}, "undecided"),
    ]
    for stiffness, device, verdict in cases:
        result = assess(Surface(WAVE, "C", stiffness), device, **numbers)
        assert result.verdict == verdict, (stiffness, device)
        assert result.decided_by == "wall test"
        assert result.stability_limit.basis == "plausible"
    assert "delay_samples" in assess(Surface(WAVE, "C", 1251.0), wall, **numbers).reason
    assert result.stability_limit.stiffness == 1500.0
    assert "damping is equal in all directions" in result.criterion("wall test").assumptions


def test_wall_test_with_virtual_damping_and_delay_is_undecided() -> None:
    wall = {"max_stiffness": "5000 N/m", "virtual_damping": 0.5}
    for delay, verdict in ((0, "plausible"), (1, "undecided")):
        result = assess(Surface(WAVE, "W"), {**wall, "delay_samples": delay})
        assert result.verdict == verdict
    assert assess(Surface(WAVE, "W"), wall).stability_limit.stiffness is None


def test_law_d_with_delay_is_not_passive_at_any_damping() -> None:
    for device in ({"delay_samples": 1}, {**RIG, "delay_samples": 2}):
        result = assess(Surface(STEEP, "D", 1e-3), device)
        assert result.verdict == "not passive"
        assert "whatever the damping" in result.reason
    assert assess(Surface(STEEP, "D"), {**RIG, "delay_samples": 0}).verdict == "passive"


# --- output formats -------------------------------------------------------------------------------


def test_to_dict_is_json_without_infinities() -> None:
    result = assess(Surface(WAVE, "C"), {**RIG, "delay_samples": 0})
    text = json.dumps(result.to_dict(), allow_nan=False)
    read = json.loads(text)
    assert read["criteria"][-1]["limit"] == "inf"
    assert read["decided_by"] == "one-sided"
    assert [c["name"] for c in read["criteria"]] == [c.name for c in result.criteria]


def test_notebook_table_escapes_html() -> None:
    page = assess(Surface(WAVE, "H"), RIG)._repr_html_()
    assert "k q⁺ &lt;= 2σ₀/T" in page
    assert page.count("<tr") == 10


def test_unknown_criterion_raises_a_key_error() -> None:
    result = assess(Surface(WAVE, "W"), RIG)
    assert isinstance(result.criterion("delay"), Criterion)
    with pytest.raises(KeyError):
        result.criterion("magic")


def test_quantization_step_of_three_axes_is_rounded_up() -> None:
    """The length of √3 steps is rounded up by at most 1e-16."""
    device = parse_device({**RIG, "position_resolution": "3 um", "force_resolution": "0.1 N"}, "x")
    loop = make_device_loop(Surface(WAVE, "C"), device, exact_bound(1.0), exact_bound(1.0), None)
    for field, length in (
        ("position_resolution", loop.position_step),
        ("force_resolution", loop.force_step),
    ):
        square = 3 * Fraction(device.value(field) or 0.0) ** 2
        assert 0 < square < length**2 < square * (1 + Fraction(1, 10**16))
