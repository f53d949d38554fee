"""The criteria of passivity against arithmetic, eigenvalues, simulated hands and adversaries."""

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
from asperity.analysis.energy.leak import Leak, worst_loop
from asperity.analysis.passivity import criteria
from asperity.analysis.passivity.assess_passivity import passivity
from asperity.analysis.passivity.criteria import Criterion
from asperity.analysis.passivity.device_loop import make_device_loop
from asperity.analysis.passivity.verdict import Passivity
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


def judge(surface: Surface, fields: dict[str, Any], **numbers: Bound) -> Passivity:
    q = numbers.get("q") or characteristic_number(surface)
    plus = numbers.get("plus") or one_sided_number(surface)
    leak = rectangle(surface) if surface.law.letter == "B" else worst_loop(surface)
    return passivity(surface, parse_device(fields, "mine"), q, plus, leak)


def rectangle(surface: Surface) -> Leak:
    """Return a loop below one flank, in place of the worst, which takes long to find for B."""
    along = surface.texture.scan_line()
    ends = along.points(4)[:2]
    heights = -0.6 * surface.max_depth + 0.3 * surface.max_depth * np.array([-1.0, 1.0])
    corners = np.array([[*ends[i], heights[j]] for i, j in ((0, 0), (0, 1), (1, 1), (1, 0))])
    energy = loop_work(surface, corners)
    turned = corners if energy > 0.0 else np.ascontiguousarray(corners[::-1])
    return Leak(abs(energy), math.inf, along, "sampled", "a rectangle", turned, None)


def exactly(value: float) -> Bound:
    return Bound(value, value, "theorem", (0.0, 0.0, 0.0))


# --- limits, by hand ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("paper (1)", SIGMA / (2 * T * 3.0)),
        ("one-sided", 2 * SIGMA / (T * 2.0)),
        ("delay", SIGMA / (T * (2.0 / 2 + 2 * 3.0))),
        ("virtual damping", (SIGMA - 0.5) / (T * (2.0 / 2 + 2 * 3.0))),
        ("smooth-wall rule", 5000.0 / 3.0),
        ("wall test", 5000.0 * 2.5 / (2.0 / 2 + 2 * 3.0)),
        ("leak", math.inf),
    ],
)
def test_every_limit_is_the_formula_s(name: str, expected: float) -> None:
    rig = {**RIG, "delay_samples": 2, "max_stiffness": "5 N/mm"}
    if name == "virtual damping":
        rig["virtual_damping"] = "0.5 N*s/m"
    if name == "wall test":
        del rig["damping"]  # else the pair of damping and delay is known
    found = judge(Surface(WAVE, "C", 500.0), rig, q=exactly(3.0), plus=exactly(2.0)).criterion(name)
    assert found.limit == pytest.approx(expected, rel=1e-15)
    assert found.margin == pytest.approx(expected / 500.0, rel=1e-15)
    assert found.holds is (expected >= 500.0)
    assert found.missing == ()


def test_colgate_and_schenkel_without_delay() -> None:
    """It is b > K T/2 + |b_v| with K = k q⁺, whatever the sign of b_v."""
    for sign in (1.0, -1.0):
        rig = {**RIG, "delay_samples": 0, "virtual_damping": sign * 0.5}
        found = judge(Surface(WAVE, "W", 500.0), rig)
        assert found.decided_by == "virtual damping"
        assert found.safe_stiffness == pytest.approx((SIGMA - 0.5) * 2 / T, rel=1e-15)


def test_more_virtual_damping_than_physical_leaves_no_stiffness() -> None:
    found = judge(Surface(WAVE, "H"), {**RIG, "delay_samples": 0, "virtual_damping": 3.0})
    assert (found.verdict, found.safe_stiffness) == ("not passive", 0.0)


@settings(max_examples=200, deadline=None)
@given(
    sigma=st.floats(1e-3, 1e3),
    rate=st.floats(1e2, 1e5),
    q=st.floats(1.0, 1e3),
    delay=st.integers(0, 9),
)
def test_limits_are_the_greatest_floats_that_are_not_overstated(
    sigma: float, rate: float, q: float, delay: int
) -> None:
    rig = {"damping": sigma, "update_rate": rate, "delay_samples": delay}
    surface = Surface(WAVE, "W", 1.0)
    found = judge(surface, rig, q=exactly(q), plus=exactly(1.0))
    exact = Fraction(sigma) * Fraction(rate) / (Fraction(1, 2) + delay * Fraction(q))
    limit = found.criterion("delay").limit
    assert limit is not None
    assert Fraction(limit) <= exact < Fraction(math.nextafter(limit, math.inf))
    assert (
        judge(Surface(WAVE, "W", limit), rig, q=exactly(q), plus=exactly(1.0)).verdict == "passive"
    )
    above = Surface(WAVE, "W", math.nextafter(limit, math.inf))
    assert judge(above, rig, q=exactly(q), plus=exactly(1.0)).verdict != "passive"


def test_a_bound_of_a_buzz_is_the_least_float_that_is_not_below() -> None:
    for part in (Fraction(1, 3), Fraction(2, 3), Fraction(1, 10), Fraction(7, 8), Fraction(0)):
        found = criteria._round_up(part)
        assert Fraction(found) >= part > Fraction(math.nextafter(found, -math.inf))


def test_between_the_bounds_of_a_number_nothing_is_claimed() -> None:
    """The limit is proved with the upper end, refuted with the lower one."""
    loose = Bound(2.0, 4.0, "certified")
    rig = {**RIG, "delay_samples": 0}
    limits = {500.0: True, 4000.0: True, 4001.0: None, 8000.0: None, 8001.0: False}
    for stiffness, holds in limits.items():
        found = judge(Surface(WAVE, "C", stiffness), rig, q=loose, plus=loose)
        assert found.criterion("one-sided").holds is holds
        verdict = {True: "passive", None: "undecided", False: "not passive"}[holds]
        assert found.verdict == verdict
        assert found.safe_stiffness == 4000.0


def test_a_sampled_number_proves_no_limit_but_can_refute() -> None:
    sampled = Bound(2.0, math.inf, "sampled")
    rig = {**RIG, "delay_samples": 0}
    small, great = (judge(Surface(WAVE, "C", k), rig, q=sampled, plus=sampled) for k in (10.0, 9e3))
    assert (small.verdict, small.safe_stiffness) == ("undecided", 8000.0)
    assert small.stability_limit.sampled
    assert small.criterion("one-sided").limit is None
    assert "only sampled" in small.reason
    assert great.verdict == "not passive"


# --- what is missing is named ---------------------------------------------------------------------


def test_missing_data_is_named_and_never_guessed() -> None:
    found = judge(Surface(WAVE, "H"), {"max_force": "3 N"})
    expected = {
        "paper (1)": ("update_rate", "damping"),
        "one-sided": ("update_rate", "damping"),
        "delay": ("update_rate", "damping", "delay_samples"),
        "virtual damping": ("update_rate", "damping", "virtual_damping"),
        "smooth-wall rule": ("max_stiffness",),
        "wall test": ("max_stiffness",),
    }
    for name, missing in expected.items():
        criterion = found.criterion(name)
        assert criterion.missing == missing
        assert (criterion.holds, criterion.limit, criterion.margin) == (None, None, None)
        assert criterion.conclusion == f"not decidable: needs {', '.join(missing)}"
    assert (found.verdict, found.safe_stiffness, found.greatest_delay) == ("undecided", None, None)


def test_an_unknown_delay_decides_nothing_but_proved_delays_are_stated() -> None:
    """It is k (1/2 + d) <= σ₀/T = 8000 N/m at 1000 N/m: d <= 7."""
    found = judge(Surface(WAVE, "H", 1000.0), RIG)
    assert found.criterion("one-sided").holds is True
    assert (found.verdict, found.decided_by, found.greatest_delay) == ("undecided", "delay", 7)
    assert found.criterion("delay").missing == ("delay_samples",)
    assert "d <= 7" in found.criterion("delay").conclusion
    for delay, verdict in ((7, "passive"), (8, "not passive")):
        assert judge(Surface(WAVE, "H"), {**RIG, "delay_samples": delay}).verdict == verdict


def test_virtual_damping_does_not_stand_in_for_a_known_delay() -> None:
    found = judge(Surface(WAVE, "H"), {**RIG, "virtual_damping": 0.5})
    assert found.criterion("virtual damping").holds is True
    assert (found.verdict, found.decided_by) == ("undecided", "delay")
    assert judge(Surface(STEEP, "D"), RIG).verdict == "undecided"


def test_a_slack_direction_refutes_with_delay() -> None:
    """At d = 1, q⁺ = 1, q = 4: proved to 8000/4.5 N/m, refuted by k q/2 > σ₀/T + b_v/T."""
    numbers = {"q": exactly(4.0), "plus": exactly(1.0)}
    cases = [(1777.0, 0.0, "passive"), (1778.0, 0.0, "undecided"), (3999.0, 0.0, "undecided"),
             (4001.0, 0.0, "not passive"), (4001.0, 0.5, "undecided"), (4999.0, 0.5, "undecided"),
             (5001.0, 0.5, "not passive")]  # fmt: skip
    for stiffness, virtual, verdict in cases:
        rig = {**RIG, "delay_samples": 1, "virtual_damping": virtual}
        assert judge(Surface(WAVE, "C", stiffness), rig, **numbers).verdict == verdict
    # Without delay a slack direction is harmless.
    assert (
        judge(Surface(WAVE, "C", 9000.0), {**RIG, "delay_samples": 0}, **numbers).verdict
        == "passive"
    )


def test_only_a_number_above_q_plus_tells_a_slack_direction() -> None:
    """Where q is the upper end of q⁺ a stiff direction may attain it: nothing is refuted."""
    device = {**RIG, "delay_samples": 1}
    loose = Bound(0.5, 4.0, "certified")
    equal = judge(Surface(WAVE, "C", 4500.0), device, q=exactly(4.0), plus=loose)
    assert equal.verdict == "undecided"
    above = judge(Surface(WAVE, "C", 4500.0), device, q=exactly(4.01), plus=loose)
    assert above.verdict == "not passive"


def test_the_greatest_delay_counts_virtual_damping() -> None:
    """It is k (1/2 + d) T + b_v <= σ₀."""
    assert judge(Surface(WAVE, "H"), {**RIG, "virtual_damping": 0.5}).greatest_delay == 5
    assert judge(Surface(WAVE, "H", 16001.0), RIG).greatest_delay is None
    # k (q⁺/2 + d q) <= σ₀/T with q = 2, q⁺ = 1.5: d <= (8 - 0.75)/2.
    found = judge(Surface(WAVE, "C", 1000.0), RIG, q=exactly(2.0), plus=exactly(1.5))
    assert found.greatest_delay == 3


def test_unverified_data_are_named() -> None:
    known = Datum(4000.0, "Hz", "measured", verified=True)
    guess = Datum(2.0, "N*s/m", "a guess", verified=False)
    device = Device("x", "x", {"update_rate": known, "damping": guess})
    surface = Surface(WAVE, "W")
    found = passivity(surface, device, exactly(1.0), exactly(1.0), worst_loop(surface))
    line = found.criterion("one-sided").assumptions
    assert "damping 2 N·s/m (not verified)" in line
    assert "update_rate 4 kHz (not" not in line
    assert "update_rate 4 kHz" in line
    assert all("\n" not in criterion.assumptions for criterion in found.criteria)


@pytest.mark.parametrize(
    ("field", "value"),
    [("update_rate", 0.0), ("damping", -1.0), ("damping", math.nan), ("delay_samples", 0.5),
     ("virtual_damping", math.inf), ("max_stiffness", -5.0)],
)  # fmt: skip
def test_a_device_built_by_hand_is_checked(field: str, value: float) -> None:
    device = Device("x", "x", {field: Datum(value, "1", "", verified=True)})
    surface = Surface(WAVE, "W")
    with pytest.raises(ParameterError, match=field):
        passivity(surface, device, exactly(1.0), exactly(1.0), worst_loop(surface))


def test_arguments_of_another_kind_are_refused() -> None:
    surface = Surface(WAVE, "W")
    leak = worst_loop(surface)
    for arguments, name in (
        ((WAVE, "omega.3", exactly(1.0), exactly(1.0), leak), "surface"),
        ((surface, "omega.3", 1.0, exactly(1.0), leak), "q"),
        ((surface, "omega.3", exactly(1.0), 1.0, leak), "one_sided"),
        ((surface, "omega.3", exactly(1.0), exactly(1.0), 0.0), "leak"),
    ):
        with pytest.raises(ParameterError, match=f"^{name} must be"):
            passivity(*arguments)


# --- laws that leak -------------------------------------------------------------------------------


@pytest.mark.parametrize("letter", "ABEFG")
def test_a_law_that_leaks_is_never_called_passive(letter: str) -> None:
    """Even where every norm condition holds by a factor of a thousand."""
    strong = {"damping": 1e6, "update_rate": 1e5, "delay_samples": 0, "max_stiffness": 1e9}
    found = judge(Surface(WAVE, letter), strong)
    assert found.criterion("paper (1)").holds is True
    assert found.criterion("smooth-wall rule").holds is True
    assert "curl" in found.criterion("paper (1)").assumptions
    assert (found.verdict, found.decided_by) == ("not passive", "leak")
    assert (found.stability_limit.basis, found.stability_limit.delay) == (
        "quiet against buzz",
        None,
    )
    assert found.safe_stiffness == found.criterion("smooth-wall rule").limit
    for name in ("one-sided", "delay", "virtual damping", "wall test"):
        assert (found.criterion(name).holds, found.criterion(name).missing) == (None, ())
        assert found.criterion(name).conclusion.startswith(
            "not applicable: the law is not conservative"
        )


@pytest.mark.parametrize(("energy", "verdict"), [(1e-15, "not passive"), (1e-16, "undecided")])
def test_a_leak_counts_above_rounding(energy: float, verdict: str) -> None:
    """Rounding is 1e-12 of k · depth · length = 1000 N/m · 0.2 mm · 2 mm, 4e-16 J."""
    surface = Surface(WAVE, "A", 1000.0, 0.2e-3)
    line = WAVE.scan_line()
    assert line.length == pytest.approx(2e-3)
    leak = replace(rectangle(surface), energy=energy)
    found = passivity(surface, parse_device(RIG, "mine"), exactly(1.0), exactly(1.0), leak)
    assert found.verdict == verdict


def test_without_damping_the_speed_is_missing_but_the_field_still_pumps() -> None:
    found = judge(Surface(WAVE, "A"), {"max_stiffness": "5000 N/m"})
    assert (found.verdict, found.critical_speed) == ("not passive", None)
    assert found.criterion("leak").missing == ("damping",)
    assert "not decidable: needs damping" in found.criterion("leak").conclusion


def test_zero_damping_absorbs_the_leak_at_no_speed() -> None:
    found = judge(Surface(WAVE, "A"), {"damping": 2.0})
    assert found.critical_speed is not None
    zero = Device("x", "x", {"damping": Datum(0.0, "N*s/m", "", verified=True)})
    surface = Surface(WAVE, "A")
    leak = worst_loop(surface)
    speed = passivity(surface, zero, exactly(1.0), exactly(1.0), leak).critical_speed
    assert speed == math.inf


def test_a_law_with_curl_that_shows_no_leak_stays_undecided() -> None:
    flat = HeightMap(np.zeros((6, 6)), 1e-4)
    found = judge(Surface(flat, "A"), {**RIG, "delay_samples": 0, "max_stiffness": 1e6})
    assert (found.verdict, found.decided_by) == ("undecided", "leak")
    assert found.criterion("leak").holds is None


def test_a_lateral_clamp_makes_c_a_law_that_is_not_conservative() -> None:
    found = judge(Surface(WAVE, "C", 10.0, clamp="lateral"), {**RIG, "delay_samples": 0})
    assert (found.verdict, found.decided_by) == ("not passive", "leak")
    whole = judge(Surface(WAVE, "C", 10.0, clamp="whole"), {**RIG, "delay_samples": 0})
    assert whole.verdict == "passive"


def test_a_conservative_law_that_jumps_is_not_called_passive() -> None:
    """A force k (depth + preload) e_z is a gradient; across its step a shaking hand gains."""
    jump = Law("J", "step", "nominal", lambda c: c.k * (c.depth + c.parameter("preload")) * c.e_z,
               parameters={"preload": 1e-4})  # fmt: skip
    surface = Surface(WAVE, jump, 1.0)
    assert law_facts(jump).conservative
    found = judge(surface, {**RIG, "delay_samples": 0, "max_stiffness": 1e9})
    assert found.verdict == "undecided"
    assert "not continuous" in found.criterion("one-sided").conclusion
    # It does gain: a small step across the onset, to and fro, however strong the damping.
    before, after = surface.force([[0.0, 0.0, 1e-9], [0.0, 0.0, -1e-9]])
    gained = 2e-9 * (after[2] - before[2]) - 2.0 * SIGMA / T * 2e-9**2
    assert gained > 0.0


# --- the smooth wall ------------------------------------------------------------------------------


def test_a_wall_that_held_is_plausible_and_never_a_proof() -> None:
    """K₀/q covers any delay; a delay that is known lies between K₀/q⁺ and K₀/q."""
    wall = {"max_stiffness": "5000 N/m"}
    numbers = {"q": exactly(4.0), "plus": exactly(2.0)}
    cases = [(1250.0, wall, "plausible"), (1251.0, wall, "undecided"),
             (2500.0, {**wall, "delay_samples": 0}, "plausible"),
             (2501.0, {**wall, "delay_samples": 0}, "undecided"),
             (1500.0, {**wall, "delay_samples": 1}, "plausible"),
             (1501.0, {**wall, "delay_samples": 1}, "undecided")]  # fmt: skip
    for stiffness, device, verdict in cases:
        found = judge(Surface(WAVE, "C", stiffness), device, **numbers)
        assert found.verdict == verdict, (stiffness, device)
        assert found.decided_by == "wall test"
        assert found.stability_limit.basis == "plausible"
    assert "delay_samples" in judge(Surface(WAVE, "C", 1251.0), wall, **numbers).reason
    assert found.safe_stiffness == 1500.0
    assert "damping is equal in all directions" in found.criterion("wall test").assumptions


def test_the_wall_test_decides_nothing_with_virtual_damping_and_delay() -> None:
    wall = {"max_stiffness": "5000 N/m", "virtual_damping": 0.5}
    for delay, verdict in ((0, "plausible"), (1, "undecided")):
        found = judge(Surface(WAVE, "W"), {**wall, "delay_samples": delay})
        assert found.verdict == verdict
    assert judge(Surface(WAVE, "W"), wall).stability_limit.stiffness is None


def test_d_with_delay_is_not_passive_at_any_damping() -> None:
    for device in ({"delay_samples": 1}, {**RIG, "delay_samples": 2}):
        found = judge(Surface(STEEP, "D", 1e-3), device)
        assert found.verdict == "not passive"
        assert "whatever the damping" in found.reason
    assert judge(Surface(STEEP, "D"), {**RIG, "delay_samples": 0}).verdict == "passive"


# --- what a table needs ---------------------------------------------------------------------------


def test_plain_data_is_json_without_infinities() -> None:
    found = judge(Surface(WAVE, "C"), {**RIG, "delay_samples": 0})
    text = json.dumps(found.to_dict(), allow_nan=False)
    read = json.loads(text)
    assert read["criteria"][-1]["limit"] == "inf"
    assert read["decided_by"] == "one-sided"
    assert [c["name"] for c in read["criteria"]] == [c.name for c in found.criteria]


def test_notebook_table_is_escaped() -> None:
    page = judge(Surface(WAVE, "H"), RIG)._repr_html_()
    assert "k q⁺ &lt;= 2σ₀/T" in page
    assert page.count("<tr") == 9


def test_an_unknown_name_is_a_key_error() -> None:
    found = judge(Surface(WAVE, "W"), RIG)
    assert isinstance(found.criterion("delay"), Criterion)
    with pytest.raises(KeyError):
        found.criterion("magic")


def test_a_step_along_three_axes_at_once_is_never_understated() -> None:
    """√3 steps, rounded up by less than any number of a device is."""
    device = parse_device({**RIG, "position_resolution": "3 um", "force_resolution": "0.1 N"}, "x")
    loop = make_device_loop(Surface(WAVE, "C"), device, exactly(1.0), exactly(1.0), None)
    for field, long in (
        ("position_resolution", loop.position_step),
        ("force_resolution", loop.force_step),
    ):
        square = 3 * Fraction(device.value(field) or 0.0) ** 2
        assert 0 < square < long**2 < square * (1 + Fraction(1, 10**16))
