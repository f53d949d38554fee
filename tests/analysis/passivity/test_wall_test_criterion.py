"""A wall that held on a device: what follows from it, and what never does."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from asperity.analysis.analyze import analyze
from asperity.analysis.bounds.bound import Bound
from asperity.analysis.check_limits import limits
from asperity.analysis.compare import compare
from asperity.analysis.energy.leak import worst_loop
from asperity.analysis.passivity.assess_passivity import passivity
from asperity.analysis.passivity.verdict import Passivity
from asperity.core.errors import ParameterError
from asperity.devices import Device, parse_device
from asperity.surface import Surface
from asperity.textures import Fourier, Profile, Sinusoid, Texture

WAVE = Sinusoid(0.1e-3, 2e-3)
LEAKS = {letter: worst_loop(Surface(WAVE, letter, 1.0)) for letter in "WCDHA"}


def exactly(value: float) -> Bound:
    return Bound(value, value, "theorem", (0.0, 0.0, 0.0))


def judge(
    fields: dict[str, Any], stiffness: float, q: float = 1.0, plus: float = 1.0, law: str = "C"
) -> Passivity:
    surface = Surface(WAVE, law, stiffness)
    device = parse_device(fields, "mine")
    return passivity(surface, device, exactly(q), exactly(plus), LEAKS[law])


# --- the pairs of damping and delay that a test admits --------------------------------------------


@settings(max_examples=100, deadline=None)
@given(
    held=st.floats(100.0, 1e4),
    plus=st.floats(1.0, 20.0),
    more=st.floats(1.0, 5.0),
    delay=st.none() | st.integers(0, 8),
    damping=st.none() | st.floats(0.05, 20.0),
)
def test_the_limit_is_the_least_over_all_admissible_pairs(
    held: float, plus: float, more: float, delay: int | None, damping: float | None
) -> None:
    """By search: every pair (σ₀/T, d) with σ₀/T >= K₀ (1/2 + d), σ₀ or d fixed where known."""
    rate, q = 4000.0, plus * more
    known = {"delay_samples": delay, "damping": damping}
    fields: dict[str, Any] = {k: v for k, v in known.items() if v is not None}
    fields |= {"max_stiffness": held, "update_rate": rate}
    limit = judge(fields, 1.0, q, plus).criterion("wall test").limit
    delays = [0.125 * i for i in range(4000)] if delay is None else [float(delay)]
    allowed = []
    for d in delays:
        loss = held * (0.5 + d)
        if damping is not None and delay is None and damping * rate < loss:
            continue  # this delay would have made the wall cycle
        if damping is not None and delay is not None:
            loss = min(loss, damping * rate)  # the pair is known
        allowed.append(loss / (0.5 * plus + d * q))
    if not allowed:
        assert limit is None
        return
    assert limit is not None
    assert limit <= min(allowed) * (1.0 + 1e-12)
    # No stricter than the worst pair: K₀/q is what ever longer delays tend to.
    if delay is None or damping is None:
        assert limit >= held / q * (1.0 - 1e-12)
    if delay is not None:
        assert limit == pytest.approx(min(allowed), rel=1e-12)
    elif damping is None:
        assert limit == pytest.approx(held / q, rel=1e-12)


def test_the_binding_pair_is_named() -> None:
    wall = {"max_stiffness": "2 kN/m", "update_rate": "10 kHz"}
    assert judge(wall, 1000.0).stability_limit.delay == math.inf
    assert "with any delay" not in judge(wall, 1000.0).reason  # it names the formula instead
    damped = judge({**wall, "damping": "1.157 N*s/m"}, 1000.0)
    assert damped.stability_limit.delay == pytest.approx(1.157e4 / 2000.0 - 0.5)
    assert judge({**wall, "delay_samples": 3}, 1000.0).stability_limit.delay == 3.0


def test_no_pair_fits_a_wall_that_asks_for_more_damping_than_there_is() -> None:
    found = judge({"max_stiffness": 5000, "update_rate": 1000.0, "damping": 1.0}, 100.0)
    assert found.verdict == "undecided"
    assert found.stability_limit.stiffness is None
    assert "no delay fits" in found.criterion("wall test").assumptions


def test_the_lightest_direction_and_the_rate_of_the_test_count() -> None:
    wall = {"value": "2 kN/m", "lightest": 0.7, "update_rate": "4 kHz", "directions": ["y"]}
    fields = {"max_stiffness": wall, "update_rate": "2 kHz"}
    found = judge(fields, 100.0, 2.0, 2.0)
    assert found.safe_stiffness == pytest.approx(2000.0 * 0.7 * 0.5 / 2.0, rel=1e-12)
    assert "no direction is damped less than 0.7" in found.criterion("wall test").assumptions
    # The wall itself pulls along the direction in which it was tried, and no other.
    assert judge(fields, 100.0, law="W").safe_stiffness == pytest.approx(1000.0, rel=1e-12)
    # A faster loop than the one that was tested is never allowed more.
    fields["update_rate"] = "40 kHz"
    assert judge(fields, 100.0, law="W").safe_stiffness == 2000.0


@pytest.mark.parametrize("law", sorted(set(LEAKS) - {"W"}))
def test_every_law_that_feels_the_texture_meets_the_lightest_direction(law: str) -> None:
    """A and H too, whose formulas lack the slope: the force of H acts sideways all the same."""
    whole, share = (
        {"max_stiffness": {"value": "2 kN/m", **more}} for more in ({}, {"lightest": 0.7})
    )
    expected = 0.7 * (judge(whole, 100.0, law=law).stability_limit.stiffness or 0.0)
    assert judge(share, 100.0, law=law).stability_limit.stiffness == pytest.approx(
        expected, rel=1e-12
    )
    assert expected > 0.0


def test_a_wall_that_cycled_refutes_whatever_damping_and_delay_are() -> None:
    test = {"value": 1000, "cycled": "1500 N/m", "positions": "exact"}
    found = judge({"max_stiffness": test}, 1500.0)
    assert (found.verdict, found.decided_by) == ("not passive", "wall test")
    assert "a smooth wall of 1500 N/m cycled" in found.reason
    assert judge({"max_stiffness": test}, 750.0, 2.0, 2.0).verdict == "not passive"
    assert judge({"max_stiffness": test}, 1499.0).verdict == "undecided"
    # Steps of an encoder make walls cycle too: then it shows nothing about the damping.
    for other in ({**test, "positions": "stepped"}, {"value": 1000, "cycled": "1500 N/m"}):
        assert judge({"max_stiffness": other}, 1500.0).verdict == "undecided"


def test_damping_and_delay_that_prove_a_cycling_wall_passive_are_contradicted() -> None:
    test = {"value": 1000, "cycled": "1500 N/m", "positions": "exact"}
    rig = {"max_stiffness": test, "update_rate": "1 kHz", "damping": 5.0, "delay_samples": 1}
    found = judge(rig, 100.0)
    assert found.verdict == "undecided"
    assert "one is wrong" in found.reason
    assert found.stability_limit.basis == "plausible"  # what held, held
    assert judge({**rig, "damping": 2.0}, 100.0).verdict == "passive"


# --- a datum more never turns a proof round -------------------------------------------------------

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
NONE_UNLESS_GIVEN: dict[str, st.SearchStrategy[Any]] = {
    "virtual_damping": st.floats(-5.0, 5.0),
    "position_resolution": st.floats(1e-7, 1e-4),
    "force_resolution": st.floats(1e-4, 0.1),
    "least_friction": st.floats(0.0, 1.0),
}
OPPOSITE = {
    "passive": {"not passive"}, "bounded": {"not passive"},
    "not passive": {"passive", "bounded", "plausible"},
}  # fmt: skip


@settings(max_examples=400, deadline=None)
@given(
    rig=st.fixed_dictionaries(FIELDS, optional=NONE_UNLESS_GIVEN),
    share=st.none() | st.floats(1.01, 3.0),
    stiffness=st.floats(10.0, 2e4),
    plus=st.floats(1.0, 10.0),
    more=st.floats(1.0, 4.0),
    law=st.sampled_from("WCDHA"),
)
def test_leaving_out_a_datum_never_reverses_what_is_proved(
    rig: dict[str, Any], share: float | None, stiffness: float, plus: float, more: float, law: str
) -> None:
    """Each datum left out in turn; of what counts as none unless given, none is what is left."""
    if share is not None:
        wall = rig["max_stiffness"]
        rig["max_stiffness"] = {**wall, "cycled": share * wall["value"]}
    whole = judge(rig, stiffness, plus * more, plus, law).verdict
    for field in FIELDS:
        part = {name: value for name, value in rig.items() if name != field}
        verdict = judge(part, stiffness, plus * more, plus, law).verdict
        assert whole not in OPPOSITE.get(verdict, set()), field
    for field in ("virtual_damping", "least_friction"):
        part = {name: value for name, value in rig.items() if name != field}
        zero = judge({**part, field: 0.0}, stiffness, plus * more, plus, law)
        left = judge(part, stiffness, plus * more, plus, law)
        assert (zero.verdict, zero.safe_stiffness) == (left.verdict, left.safe_stiffness), field


def test_the_old_rule_fails_that_test() -> None:
    """Negative control: K₀/q⁺ called a proof is reversed by the delay alone."""
    rig = {"max_stiffness": 2000, "update_rate": 1e4, "damping": 1.157}
    assert judge(rig, 2000.0).verdict == "plausible"  # "passive", once
    assert judge({**rig, "delay_samples": 6}, 2000.0).verdict == "not passive"


# --- steps and friction ---------------------------------------------------------------------------

RIG = {"damping": "2 N*s/m", "update_rate": "4 kHz", "delay_samples": 1}


def test_steps_leave_a_bounded_buzz_and_friction_silences_it() -> None:
    """MATH section 7 by hand, with |δ| = √3 δ."""
    k, q, plus, step = 1000.0, 2.0, 1.5, 2e-5
    phi = k * q * math.sqrt(3.0) * step / 2
    margin = 2.0 * 4000.0 - k * (plus / 2 + q)
    rig = {**RIG, "position_resolution": step}
    for friction, verdict in ((0.0, "bounded"), (0.9 * phi, "bounded"), (1.001 * phi, "passive")):
        found = judge({**rig, "least_friction": friction}, k, q, plus)
        assert found.verdict == verdict
        excess = max(phi - friction, 0.0)
        assert found.buzz is not None
        assert found.buzz.speed == pytest.approx(excess * 4000.0 / margin, rel=1e-9)
        assert found.buzz.power == pytest.approx(excess**2 * 4000.0 / (4 * margin), rel=1e-9)
    # Steps of the force count by half; a friction that is only felt is no friction at least.
    found = judge({**RIG, "force_resolution": 0.01}, k, q, plus)
    assert found.buzz is not None
    assert found.buzz.speed == pytest.approx(math.sqrt(3.0) * 0.005 * 4000.0 / margin, rel=1e-9)
    assert judge({**rig, "friction": 5.0}, k, q, plus).verdict == "bounded"


def test_the_stiffness_that_is_proved_is_one_that_is_called_passive() -> None:
    """Steps count in it; a wall that held is the stronger evidence where friction is small."""
    rig = {**RIG, "position_resolution": 2e-5, "least_friction": 0.02}
    found = judge(rig, 100.0, 2.0, 1.5).stability_limit
    assert (found.basis, found.proved_stiffness) == ("proved", found.stiffness)
    assert found.stiffness == pytest.approx(0.02 / (2.0 * math.sqrt(3.0) * 1e-5), rel=1e-9)
    assert judge(rig, found.stiffness, 2.0, 1.5).verdict == "passive"
    assert judge(rig, 1.000001 * found.stiffness, 2.0, 1.5).verdict == "bounded"
    more = judge({**rig, "max_stiffness": 3000}, 100.0, 2.0, 1.5).stability_limit
    assert (more.basis, more.proved_stiffness) == ("plausible", found.stiffness)
    assert more.stiffness == pytest.approx(3000 * 1.5 / 2.75, rel=1e-12)
    silent = judge({**RIG, "position_resolution": 2e-5}, 100.0, 2.0, 1.5).stability_limit
    assert (silent.basis, silent.proved_stiffness) == ("bounded", 0.0)
    assert silent.stiffness == pytest.approx(8000.0 / 2.75 / 2.0, rel=1e-12)


def test_a_test_with_stepped_positions_contradicts_exact_ones() -> None:
    wall = {"value": 1000, "positions": "stepped"}
    found = judge({**RIG, "max_stiffness": wall}, 100.0)
    assert (found.verdict, found.decided_by) == ("undecided", "steps and friction")
    assert found.criterion("steps and friction").missing == ("position_resolution",)
    assert found.stability_limit.basis == "plausible"
    known = {**RIG, "max_stiffness": wall, "position_resolution": 1e-5, "least_friction": 1.0}
    assert judge(known, 100.0).verdict == "passive"


@pytest.mark.parametrize(
    "content",
    [
        {"position_resolution": "1e200 m"},
        {"update_rate": {"value": 1e30, "unit": "kHz"}},
        {"max_stiffness": {"value": 1, "cycled": 1e40}},
        {"max_stiffness": {"value": 1, "update_rate": 1e-40}},
    ],
)
def test_numbers_that_no_device_has_are_refused(content: dict[str, Any]) -> None:
    """Products of such numbers leave the range of floats."""
    with pytest.raises(ParameterError, match=r"1e[+-]30"):
        judge({**RIG, **content}, 100.0)


def test_steps_of_the_force_alone_are_silenced_at_any_stiffness_or_none() -> None:
    """Half a step along three axes is √3 · 5 mN = 8.66 mN, whatever the stiffness."""
    rig = {**RIG, "force_resolution": "10 mN"}
    for friction, limit in ((8.6e-3, 0.0), (8.7e-3, math.inf)):
        found = judge({**rig, "least_friction": friction}, 100.0).criterion("steps and friction")
        assert (found.limit, found.upper_limit, found.holds) == (limit, limit, limit > 0.0)
    # With steps of the position too, what is left of the friction sets the limit, never below 0.
    both = {**rig, "position_resolution": 1e-6}
    for friction, limit in ((0.0, 0.0), (8e-3, 0.0), (0.02, (0.02 / math.sqrt(3.0) - 5e-3) * 2e6)):
        found = judge({**both, "least_friction": friction}, 100.0).criterion("steps and friction")
        assert found.limit == pytest.approx(limit, rel=1e-9)


def test_virtual_damping_makes_steps_louder() -> None:
    rig = {**RIG, "position_resolution": 2e-5, "virtual_damping": -0.5}
    found = judge(rig, 1000.0, 2.0, 1.5)
    phi = (1000.0 * 2.0 / 2 + 0.5 * 4000.0) * math.sqrt(3.0) * 2e-5
    margin = 1.5 * 4000.0 - 1000.0 * 2.75
    assert found.buzz is not None
    assert found.buzz.speed == pytest.approx(phi * 4000.0 / margin, rel=1e-9)


def test_without_a_lipschitz_constant_there_is_no_bound_of_the_buzz() -> None:
    rig = {**RIG, "delay_samples": 0, "position_resolution": 2e-5}
    found = judge(rig, 1000.0, math.inf, 1.0, "D")
    assert (found.verdict, found.decided_by) == ("undecided", "steps and friction")
    assert found.buzz is None
    assert "no bound of the buzz is known" in found.reason


# --- one function decides -------------------------------------------------------------------------

DEVICES: tuple[dict[str, Any], ...] = (
    {"max_stiffness": "5 kN/m"},
    {"max_stiffness": {"value": 800, "lightest": 0.8}, "delay_samples": 2},
    {"damping": 1.5, "update_rate": 3000.0, "delay_samples": 1, "max_stiffness": 900},
    {"damping": 1.5, "update_rate": 3000.0, "delay_samples": 0, "position_resolution": "20 um"},
)


def agrees(texture: Texture, law: str, device: Device, stiffness: float, depth: float) -> Passivity:
    """Return the judgement, after comparison, analysis and limits gave the same."""
    (row,) = compare(texture, device, law, stiffness, depth).rows
    surface = Surface(texture, law, stiffness, depth)
    judged = analyze(surface, device).passivity
    assert row.passivity == judged
    assert row.safe_stiffness == (judged.stability_limit.stiffness or 0.0)
    assert limits(
        texture, device, law=law, stiffness=stiffness, max_depth=depth
    ).stability_limit == (judged.stability_limit)
    return judged


def test_three_harmonics_get_one_answer() -> None:
    """It was 903 N/m and "sound" from the one, 576 N/m and "undecided" from the other."""
    waves = 1e-3 * np.array([0.1, 0.04, 0.02])
    texture = Fourier(waves, 2e3 * math.pi * np.array([1.0, 2.0, 3.0]), [math.pi / 2] * 3)
    device = parse_device(DEVICES[0], "mine")
    found = agrees(texture, "C", device, 800.0, 0.5e-3)
    assert found.stability_limit.stiffness == pytest.approx(
        5000.0 / 8.685, rel=1e-3
    )  # MATH section 4
    assert (found.verdict, found.decided_by) == ("undecided", "wall test")


@pytest.mark.parametrize("seed", range(8))
def test_comparison_analysis_and_limits_never_disagree(seed: int) -> None:
    rng = np.random.default_rng(seed)
    length = float(rng.uniform(0.5e-3, 3e-3))
    texture: Texture = Sinusoid(length * float(rng.uniform(0.02, 0.4)), length)
    if seed % 2:
        texture = Profile(2e-5 * rng.normal(size=12), length / 12)
    device = parse_device(DEVICES[seed % 4], "mine")
    stiffness = float(10.0 ** rng.uniform(1.0, 3.7))
    depth = texture.peak_to_valley * float(rng.uniform(0.2, 1.0))
    agrees(texture, "CHADCHEG"[seed], device, stiffness, depth)
