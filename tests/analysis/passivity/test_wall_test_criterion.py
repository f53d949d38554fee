"""The wall-test criterion: conclusions from a smooth wall that was stable on a device."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.energy.leak import worst_loop
from asperity.analysis.passivity.recommended_stiffness import recommend_stiffness, render_on_device
from asperity.analysis.passivity.verdict import Passivity, passivity
from asperity.analysis.results.analyze import analyze
from asperity.analysis.results.check_limits import limits
from asperity.analysis.results.compare import compare
from asperity.core.arguments import FIELD
from asperity.core.errors import ParameterError
from asperity.devices import Device, device_names, load_device, override_device, parse_device
from asperity.surface import Surface
from asperity.textures import Fourier, Profile, Sinusoid, Texture

WAVE = Sinusoid(0.1e-3, 2e-3)
LEAKS = {letter: worst_loop(Surface(WAVE, letter, 1.0)) for letter in "WCDHA"}


def exact_bound(value: float) -> Bound:
    return Bound(value, value, "theorem", (0.0, 0.0, 0.0))


def assess(
    fields: dict[str, Any], stiffness: float, q: float = 1.0, plus: float = 1.0, law: str = "C"
) -> Passivity:
    surface = Surface(WAVE, law, stiffness)
    device = parse_device(fields, "mine")
    return passivity(surface, device, exact_bound(q), exact_bound(plus), LEAKS[law])


# --- pairs of damping and delay admitted by a wall test -------------------------------------------


@settings(max_examples=100, deadline=None)
@given(
    held=st.floats(100.0, 1e4),
    plus=st.floats(1.0, 20.0),
    more=st.floats(1.0, 5.0),
    delay=st.none() | st.integers(0, 8),
    tested=st.none() | st.integers(0, 8),
    damping=st.none() | st.floats(0.05, 20.0),
)
def test_wall_test_limit_is_the_minimum_over_all_admissible_pairs(
    held: float,
    plus: float,
    more: float,
    delay: int | None,
    tested: int | None,
    damping: float | None,
) -> None:
    """Searches the pairs (σ₀/T, d) with σ₀/T >= K₀ (1/2 + d₀), with σ₀, d or d₀ fixed if known.

    Where d is unknown it is d₀; where d is known and d₀ is not, d₀ is 0.
    """
    rate, q = 4000.0, plus * more
    optional = {"delay_samples": delay, "damping": damping}
    fields: dict[str, Any] = {k: v for k, v in optional.items() if v is not None}
    wall = {"value": held} if tested is None else {"value": held, "delay_samples": tested}
    fields |= {"max_stiffness": wall, "update_rate": rate}
    limit = assess(fields, 1.0, q, plus).criterion("wall test").limit
    delays = [0.125 * i for i in range(4000)]
    if delay is not None or tested is not None:
        delays = [float(delay if delay is not None else tested or 0)]
    allowed = []
    for d in delays:
        loss = held * (0.5 + (d if delay is None else tested or 0))
        if damping is not None and len(delays) > 1 and damping * rate < loss:
            continue  # this delay would have made the wall cycle
        if damping is not None:
            loss = min(loss, damping * rate)
        allowed.append(loss / (0.5 * plus + d * q))
    if not allowed:  # damping alone, without delay
        allowed.append(damping * rate / (0.5 * plus) if damping is not None else 0.0)
    assert limit is not None
    assert limit <= min(allowed) * (1.0 + 1e-12)
    # No stricter than the worst pair: K₀/q is the limit for increasing delays.
    if delay is None and damping is None:
        assert limit >= held / q * (1.0 - 1e-12)
    if len(delays) == 1:
        assert limit == pytest.approx(min(allowed), rel=1e-12)
    elif damping is None:
        assert limit == pytest.approx(held / q, rel=1e-12)


def test_stability_limit_reports_the_binding_delay() -> None:
    wall = {"max_stiffness": "2 kN/m", "update_rate": "10 kHz"}
    assert assess(wall, 1000.0).stability_limit.delay == math.inf
    assert "for any delay" not in assess(wall, 1000.0).reason  # it gives the formula instead
    damped = assess({**wall, "damping": "1.157 N*s/m"}, 1000.0)
    assert damped.stability_limit.delay == pytest.approx(1.157e4 / 2000.0 - 0.5)
    assert assess({**wall, "delay_samples": 3}, 1000.0).stability_limit.delay == 3.0


def test_wall_that_requires_more_damping_than_available_is_limited_by_the_damping() -> None:
    """The wall of 5000 N/m is refused, 2 σ₀/T = 2000 N/m is offered in its place."""
    fields = {"max_stiffness": 5000, "update_rate": 1000.0, "damping": 1.0}
    assert assess(fields, 2001.0, law="W").verdict != "plausible"
    result = assess(fields, 2000.0, law="W")
    assert result.verdict == "plausible"
    assert result.stability_limit.stiffness == 2000.0
    assert "needs more damping than the device has" in result.criterion("wall test").assumptions
    late = assess({**fields, "delay_samples": 1}, 100.0, law="W")
    assert late.stability_limit.stiffness == pytest.approx(1000.0 / 1.5)


def test_limit_depends_on_lightest_direction_and_rate_of_the_test() -> None:
    wall = {"value": "2 kN/m", "lightest": 0.7, "update_rate": "4 kHz", "directions": ["y"]}
    fields = {"max_stiffness": wall, "update_rate": "2 kHz"}
    result = assess(fields, 100.0, 2.0, 2.0)
    assert result.stability_limit.stiffness == pytest.approx(2000.0 * 0.7 * 0.5 / 2.0, rel=1e-12)
    assert (
        "damping is at least 0.7 of the tested in all directions"
        in result.criterion("wall test").assumptions
    )
    # The force of the wall itself acts only along the tested direction.
    assert assess(fields, 100.0, law="W").stability_limit.stiffness == pytest.approx(
        1000.0, rel=1e-12
    )
    assert result.stability_limit.update_rate == 2000.0
    # A faster loop than the tested one has no larger limit.
    fields["update_rate"] = "40 kHz"
    limit = assess(fields, 100.0, law="W").stability_limit
    assert (limit.stiffness, limit.update_rate) == (2000.0, 4000.0)
    # A limit of the device's own damping holds from its own rate on.
    damped = {"damping": 1.0, "update_rate": "40 kHz", "delay_samples": 0}
    assert assess(damped, 100.0).stability_limit.update_rate == 40_000.0


@pytest.mark.parametrize(("rate", "expected"), [(100, 300), (300, 900), (1000, 3000), (4000, 3000)])
@pytest.mark.parametrize("law", ["W", "A"])
def test_wall_of_the_falcon_falls_with_the_update_rate(
    rate: float, expected: float, law: str
) -> None:
    """f₀ = 1 kHz stays that of the wall test when the loop is another one."""
    device = override_device(load_device("falcon"), {"update_rate": f"{rate} Hz"})
    numbers = exact_bound(1.0), exact_bound(1.0)
    surface = Surface(WAVE, law)
    recommended = recommend_stiffness(surface, device, *numbers)
    assert recommended.wall_stiffness == expected
    assert recommended.stability_limit.stiffness == expected
    assert recommended.stability_limit.update_rate == min(rate, 1000.0)
    # Twice one sample of delay: K₀ (1/2)/(1/2 + 1).
    late = override_device(device, {"delay_samples": 1})
    assert recommend_stiffness(surface, late, *numbers).wall_stiffness == pytest.approx(
        expected / 3.0
    )


def test_own_file_keeps_the_rate_of_its_wall_test() -> None:
    own = {"max_stiffness": "2 kN/m", "update_rate": "4 kHz"}
    for fields, rate in ((own, 4000.0), ({"max_stiffness": "2 kN/m"}, 1000.0)):
        device = parse_device(fields, "mine")
        test = override_device(device, {"update_rate": "500 Hz"}).wall_test
        assert test is not None
        assert test.update_rate == rate
    # A wall that is given anew was tried in the loop that is given with it.
    both = override_device(parse_device(own, "mine"), {"max_stiffness": "1 kN/m"}).wall_test
    assert both is not None
    assert both.update_rate is None


def test_every_wall_of_the_catalogue_states_its_rate_and_source() -> None:
    for name in device_names():
        test = load_device(name).wall_test
        assert test is None or (test.update_rate and test.rate_source)


@pytest.mark.parametrize("law", sorted(set(LEAKS) - {"W"}))
def test_lightest_direction_reduces_the_limit_of_every_textured_law(law: str) -> None:
    """Includes A and H, whose formulas lack the slope; the force of H has a lateral component."""
    whole, share = (
        {"max_stiffness": {"value": "2 kN/m", **more}} for more in ({}, {"lightest": 0.7})
    )
    expected = 0.7 * (assess(whole, 100.0, law=law).stability_limit.stiffness or 0.0)
    assert assess(share, 100.0, law=law).stability_limit.stiffness == pytest.approx(
        expected, rel=1e-12
    )
    assert expected > 0.0


def test_cycling_wall_refutes_passivity_for_any_damping_and_delay() -> None:
    test = {"value": 1000, "cycled": "1500 N/m", "positions": "exact"}
    result = assess({"max_stiffness": test}, 1500.0)
    assert (result.verdict, result.decided_by) == ("not passive", "wall test")
    assert "a smooth wall of 1500 N/m cycled" in result.reason
    assert assess({"max_stiffness": test}, 750.0, 2.0, 2.0).verdict == "not passive"
    assert assess({"max_stiffness": test}, 1499.0).verdict == "undecided"
    # Encoder steps can also make walls cycle; the test then gives no evidence about damping.
    for other in ({**test, "positions": "stepped"}, {"value": 1000, "cycled": "1500 N/m"}):
        assert assess({"max_stiffness": other}, 1500.0).verdict == "undecided"


def test_damping_that_proves_a_cycling_wall_passive_is_contradicted() -> None:
    test = {"value": 1000, "cycled": "1500 N/m", "positions": "exact"}
    rig = {"max_stiffness": test, "update_rate": "1 kHz", "damping": 5.0, "delay_samples": 1}
    result = assess(rig, 100.0)
    assert result.verdict == "undecided"
    assert "one is wrong" in result.reason
    assert result.stability_limit.basis == "plausible"  # the stable wall remains evidence
    assert assess({**rig, "damping": 2.0}, 100.0).verdict == "passive"


# --- additional data never reverse a verdict ------------------------------------------------------

FIELDS: dict[str, st.SearchStrategy[Any]] = {
    "damping": st.floats(0.01, 20.0),
    "update_rate": st.floats(500.0, 2e4),
    "delay_samples": st.integers(0, 8),
    "max_stiffness": st.fixed_dictionaries(
        {"value": st.floats(50.0, 1e4)},
        optional={
            "positions": st.sampled_from(["exact", "stepped"]),
            "lightest": st.floats(0.2, 1.0),
            "directions": st.sampled_from([["x"], ["y", "z"]]),
        },
    ),
}
ZERO_BY_DEFAULT: dict[str, st.SearchStrategy[Any]] = {
    "virtual_damping": st.floats(-5.0, 5.0),
    "position_resolution": st.floats(1e-7, 1e-4),
    "force_resolution": st.floats(1e-4, 0.1),
    "least_friction": st.floats(0.0, 1.0),
}
OPPOSITE = {
    "passive": {"not passive"},
    "bounded": {"not passive"},
    "not passive": {"passive", "bounded", "plausible"},
}


@settings(max_examples=400, deadline=None)
@given(
    rig=st.fixed_dictionaries(FIELDS, optional=ZERO_BY_DEFAULT),
    share=st.none() | st.floats(1.01, 3.0),
    stiffness=st.floats(10.0, 2e4),
    plus=st.floats(1.0, 10.0),
    more=st.floats(1.0, 4.0),
    law=st.sampled_from("WCDHA"),
)
def test_omitting_a_datum_never_reverses_a_verdict(
    rig: dict[str, Any], share: float | None, stiffness: float, plus: float, more: float, law: str
) -> None:
    """Each datum is omitted in turn; fields that default to zero give the same result as zero."""
    if share is not None:
        wall = rig["max_stiffness"]
        rig["max_stiffness"] = {**wall, "cycled": share * wall["value"]}
    whole = assess(rig, stiffness, plus * more, plus, law).verdict
    for field in FIELDS:
        part = {name: value for name, value in rig.items() if name != field}
        verdict = assess(part, stiffness, plus * more, plus, law).verdict
        assert whole not in OPPOSITE.get(verdict, set()), field
    for field in ("virtual_damping", "least_friction"):
        part = {name: value for name, value in rig.items() if name != field}
        zero = assess({**part, field: 0.0}, stiffness, plus * more, plus, law)
        omitted = assess(part, stiffness, plus * more, plus, law)
        assert (zero.verdict, zero.stability_limit.stiffness) == (
            omitted.verdict,
            omitted.stability_limit.stiffness,
        ), field


def test_former_wall_rule_is_reversed_by_a_known_delay() -> None:
    """Negative control: with K₀/q⁺ as a proof, the delay alone would reverse the verdict."""
    rig = {"max_stiffness": 2000, "update_rate": 1e4, "damping": 1.157}
    assert assess(rig, 2000.0).verdict == "plausible"  # "passive" under the former rule
    assert assess({**rig, "delay_samples": 6}, 2000.0).verdict == "not passive"


# --- steps and friction ---------------------------------------------------------------------------

RIG = {"damping": "2 N*s/m", "update_rate": "4 kHz", "delay_samples": 1}


def test_steps_give_a_bounded_buzz_that_friction_silences() -> None:
    """MATH section 7 by hand, with |δ| = √3 δ."""
    k, q, plus, step = 1000.0, 2.0, 1.5, 2e-5
    phi = k * q * math.sqrt(3.0) * step / 2
    margin = 2.0 * 4000.0 - k * (plus / 2 + q)
    rig = {**RIG, "position_resolution": step}
    for friction, verdict in ((0.0, "bounded"), (0.9 * phi, "bounded"), (1.001 * phi, "passive")):
        result = assess({**rig, "least_friction": friction}, k, q, plus)
        assert result.verdict == verdict
        excess = max(phi - friction, 0.0)
        assert result.buzz is not None
        assert result.buzz.speed == pytest.approx(excess * 4000.0 / margin, rel=1e-9)
        assert result.buzz.power == pytest.approx(excess**2 * 4000.0 / (4 * margin), rel=1e-9)
    # Force steps count by half; "friction" is not a guaranteed minimum, unlike "least_friction".
    result = assess({**RIG, "force_resolution": 0.01}, k, q, plus)
    assert result.buzz is not None
    assert result.buzz.speed == pytest.approx(math.sqrt(3.0) * 0.005 * 4000.0 / margin, rel=1e-9)
    assert assess({**rig, "friction": 5.0}, k, q, plus).verdict == "bounded"


def test_proved_stiffness_has_a_passive_verdict() -> None:
    """It includes quantization; above it the bound of the buzz is the limit, whatever the wall."""
    rig = {**RIG, "position_resolution": 2e-5, "least_friction": 0.02}
    stability_limit = assess(rig, 100.0, 2.0, 1.5).stability_limit
    assert stability_limit.basis == "bounded"
    proved = stability_limit.proved_stiffness
    assert proved == pytest.approx(0.02 / (2.0 * math.sqrt(3.0) * 1e-5), rel=1e-9)
    assert assess(rig, proved, 2.0, 1.5).verdict == "passive"
    assert assess(rig, 1.000001 * proved, 2.0, 1.5).verdict == "bounded"
    more = assess({**rig, "max_stiffness": 3000}, 100.0, 2.0, 1.5).stability_limit
    assert more == stability_limit
    firm = assess({**rig, "least_friction": 0.2}, 100.0, 2.0, 1.5).stability_limit
    assert (firm.basis, firm.stiffness) == ("proved", pytest.approx(8000.0 / 2.75, rel=1e-12))
    silent = assess({**RIG, "position_resolution": 2e-5}, 100.0, 2.0, 1.5).stability_limit
    assert (silent.basis, silent.proved_stiffness) == ("bounded", 0.0)
    slope = 2.0 * math.sqrt(3.0) * 1e-5 * 4000.0 + 0.01 * 2.75
    assert silent.stiffness == pytest.approx(0.01 * 8000.0 / slope, rel=1e-9)


def test_stepped_positions_in_the_wall_test_require_the_resolution() -> None:
    wall = {"value": 1000, "positions": "stepped"}
    result = assess({**RIG, "max_stiffness": wall}, 100.0)
    assert (result.verdict, result.decided_by) == ("undecided", "steps and friction")
    assert result.criterion("steps and friction").missing == ("position_resolution",)
    assert result.stability_limit.basis == "plausible"
    optional = {**RIG, "max_stiffness": wall, "position_resolution": 1e-5, "least_friction": 1.0}
    assert assess(optional, 100.0).verdict == "passive"


@pytest.mark.parametrize(
    "content",
    [
        {"position_resolution": "1e200 m"},
        {"update_rate": {"value": 1e30, "unit": "kHz"}},
        {"max_stiffness": {"value": 1, "cycled": 1e40}},
        {"max_stiffness": {"value": 1, "update_rate": 1e-40}},
    ],
)
def test_unphysical_device_numbers_raise(content: dict[str, Any]) -> None:
    """Products of such numbers overflow the range of floats."""
    with pytest.raises(ParameterError, match=r"1e[+-]30"):
        assess({**RIG, **content}, 100.0)


def test_force_steps_are_silenced_at_every_stiffness_or_none() -> None:
    """Half a step along three axes is √3 · 5 mN = 8.66 mN at any stiffness."""
    rig = {**RIG, "force_resolution": "10 mN"}
    for friction, limit in ((8.6e-3, 0.0), (8.7e-3, math.inf)):
        criterion = assess({**rig, "least_friction": friction}, 100.0).criterion(
            "steps and friction"
        )
        assert (criterion.limit, criterion.upper_limit, criterion.holds) == (
            limit,
            limit,
            limit > 0.0,
        )
    # With position steps too, the remaining friction sets the limit, which is at least 0.
    both = {**rig, "position_resolution": 1e-6}
    for friction, limit in ((0.0, 0.0), (8e-3, 0.0), (0.02, (0.02 / math.sqrt(3.0) - 5e-3) * 2e6)):
        criterion = assess({**both, "least_friction": friction}, 100.0).criterion(
            "steps and friction"
        )
        assert criterion.limit == pytest.approx(limit, rel=1e-9)


def test_virtual_damping_increases_the_buzz_bound() -> None:
    rig = {**RIG, "position_resolution": 2e-5, "virtual_damping": -0.5}
    result = assess(rig, 1000.0, 2.0, 1.5)
    phi = (1000.0 * 2.0 / 2 + 0.5 * 4000.0) * math.sqrt(3.0) * 2e-5
    margin = 1.5 * 4000.0 - 1000.0 * 2.75
    assert result.buzz is not None
    assert result.buzz.speed == pytest.approx(phi * 4000.0 / margin, rel=1e-9)


def test_no_buzz_bound_without_a_lipschitz_constant() -> None:
    rig = {**RIG, "delay_samples": 0, "position_resolution": 2e-5}
    result = assess(rig, 1000.0, math.inf, 1.0, "D")
    assert (result.verdict, result.decided_by) == ("undecided", "steps and friction")
    assert result.buzz is None
    assert "no bound of the buzz is known" in result.reason


# --- consistency ----------------------------------------------------------------------------------

DEVICES: tuple[dict[str, Any], ...] = (
    {"max_stiffness": "5 kN/m"},
    {"max_stiffness": {"value": 800, "lightest": 0.8}, "delay_samples": 2},
    {"damping": 1.5, "update_rate": 3000.0, "delay_samples": 1, "max_stiffness": 900},
    {"damping": 1.5, "update_rate": 3000.0, "delay_samples": 0, "position_resolution": "20 um"},
)


def checked_passivity(
    texture: Texture, law: str, device: Device, stiffness: float, depth: float
) -> Passivity:
    """Return the passivity result, after checking that compare, analyze and limits agree on it."""
    (row,) = compare(texture, device, law, stiffness, depth).rows
    surface = render_on_device(Surface(texture, law, stiffness, depth), device, FIELD)
    result = analyze(surface, device).passivity
    assert row.passivity == result
    assert row.stability_limit == result.stability_limit
    assert limits(
        texture, device, law=law, stiffness=stiffness, max_depth=depth
    ).stability_limit == (result.stability_limit)
    return result


def test_all_functions_agree_on_three_harmonics() -> None:
    """Regression test: two functions once gave 903 N/m and 576 N/m for the same surface."""
    waves = 1e-3 * np.array([0.1, 0.04, 0.02])
    texture = Fourier(waves, 2e3 * math.pi * np.array([1.0, 2.0, 3.0]), [math.pi / 2] * 3)
    device = parse_device(DEVICES[0], "mine")
    result = checked_passivity(texture, "C", device, 800.0, 0.5e-3)
    assert result.stability_limit.stiffness == pytest.approx(
        5000.0 / 8.685, rel=1e-3
    )  # MATH section 4
    assert (result.verdict, result.decided_by) == ("undecided", "wall test")


@pytest.mark.parametrize("seed", range(8))
def test_compare_analyze_and_limits_agree_on_random_surfaces(seed: int) -> None:
    rng = np.random.default_rng(seed)
    length = float(rng.uniform(0.5e-3, 3e-3))
    texture: Texture = Sinusoid(length * float(rng.uniform(0.02, 0.4)), length)
    if seed % 2:
        texture = Profile(2e-5 * rng.normal(size=12), length / 12)
    device = parse_device(DEVICES[seed % 4], "mine")
    stiffness = float(10.0 ** rng.uniform(1.0, 3.7))
    depth = texture.peak_to_valley * float(rng.uniform(0.2, 1.0))
    checked_passivity(texture, "CHADCHEG"[seed], device, stiffness, depth)


@pytest.mark.parametrize(("delay", "count"), [(1, "1 sample"), (2, "2 samples")])
def test_assumptions_name_a_delay_that_the_wall_test_did_not_have(delay: int, count: str) -> None:
    device = parse_device({"max_stiffness": 1800.0, "delay_samples": delay}, "mine")
    sentences = compare(WAVE, device, "W").assumptions
    wall = f"{1800.0 * 0.5 / (0.5 + delay):g} N/m"
    assert f"A delay of {count}, 0 in the test of K₀, allows a wall of {wall}" in sentences
