"""The six limits computed by hand; crossing one limit fails exactly that limit."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.analysis.limits.bench_limits import A, D, L, V, default_limits, device, verdicts

from asperity.analysis import characteristic_number, one_sided_number
from asperity.analysis.energy.straight_scan import merit
from asperity.analysis.results.check_limits import limits
from asperity.analysis.results.compare import compare
from asperity.core.errors import ParameterError
from asperity.devices import parse_device
from asperity.surface import Surface
from asperity.textures import Fourier, HeightMap, Noise, Profile, Sinusoid

ALL = dict.fromkeys(range(1, 7), True)


def test_both_sides_of_each_limit_by_hand() -> None:
    result = default_limits(time_samples=6.0, position_samples=7.0, force_steps=8.0)
    q = math.hypot(1.0, 2 * math.pi * A / L)
    expected = {
        1: (6 * V / 2000.0, L, "m"),
        2: (7 * 20e-6, L, "m"),
        3: (6 * 20e-6, L, "m"),
        4: (8 * 2e-3, 500.0 * A, "N"),
        5: (q * 500.0, 900.0, "N/m"),
        6: (V / L, 300.0, "Hz"),
    }
    for limit in result.limits:
        left, right, unit = expected[limit.number]
        assert (limit.left, limit.right) == (pytest.approx(left), pytest.approx(right))
        assert limit.unit == unit
        assert limit.missing_data == ()
    assert verdicts(result) == ALL
    assert [limit.number for limit in result.limits] == [1, 2, 3, 4, 5, 6]
    assert result.answer.startswith("Yes: all six limits hold at 0.12 m/s.")


# Changes of the texture, the scan or the device that cross exactly one limit:
# the limit, the change, and the value at which the two sides are equal.
CROSSINGS: dict[str, tuple[int, Any, float]] = {
    # A short wave is too short for the updates at this speed: l = α v T.
    "texture: updates": (
        1,
        lambda x: ({"texture": Sinusoid(A, 1 / x)}, {"bandwidth": 1e5}),
        1.0 / (5 * V / 2000.0),
    ),
    "speed: updates": (1, lambda x: ({"speed": x}, {"bandwidth": 1e5}), L * 2000.0 / 5),
    "device: updates": (1, lambda x: ({}, {"update_rate": 1 / x}), L / (5 * V)),
    # A short wave is too short for the position steps: l = β δ, with fewer samples in time.
    "texture: position": (
        2,
        lambda x: (
            {"texture": Sinusoid(A, 1 / x), "time_samples": 4.0},
            {"bandwidth": 1e5, "update_rate": 1e5, "max_stiffness": 1e4},
        ),
        1.0 / (5 * 20e-6),
    ),
    "samples: position": (2, lambda x: ({"position_samples": x}, {}), L / 20e-6),
    # l = α δ, slow enough for the updates.
    "texture: fast position": (
        3,
        lambda x: (
            {"texture": Sinusoid(A, 1 / x), "position_samples": 4.0},
            {"bandwidth": 1e5, "update_rate": 1e5, "max_stiffness": 1e4},
        ),
        1.0 / (5 * 20e-6),
    ),
    "samples: fast position": (3, lambda x: ({"time_samples": x}, {"update_rate": 1e5}), L / 20e-6),
    # The force of a small wave is below γ force steps: k A = γ b.
    "texture: force": (4, lambda x: ({"texture": Sinusoid(1 / x, L)}, {}), 500.0 / (5 * 2e-3)),
    "device: force": (4, lambda x: ({}, {"force_resolution": x}), 500.0 * A / 5),
    "samples: force": (4, lambda x: ({"force_steps": x}, {}), 500.0 * A / 2e-3),
    # A steep texture multiplies the stiffness too much: √(1 + (2πA/l)²) k = K₀.
    "texture: gain": (
        5,
        lambda x: ({"texture": Sinusoid(x, L), "max_depth": 1e-3}, {}),
        math.sqrt((900.0 / 500.0) ** 2 - 1) * L / (2 * math.pi),
    ),
    "stiffness: gain": (
        5,
        lambda x: ({"stiffness": x}, {}),
        900.0 / math.hypot(1.0, 2 * math.pi * A / L),
    ),
    # A short wave is too fast for the structure: v/l = F₀.
    "texture: bandwidth": (
        6,
        lambda x: ({"texture": Sinusoid(A, 1 / x)}, {"update_rate": 1e4}),
        300.0 / V,
    ),
    "speed: bandwidth": (6, lambda x: ({"speed": x}, {"update_rate": 1e4}), 300.0 * L),
    "device: bandwidth": (6, lambda x: ({}, {"bandwidth": 1 / x}), L / V),
}


@pytest.mark.parametrize("name", list(CROSSINGS))
def test_exceeding_one_limit_fails_exactly_that_limit(name: str) -> None:
    number, change, value = CROSSINGS[name]
    for factor, expected in ((1.0 - 1e-6, ALL), (1.0 + 1e-6, {**ALL, number: False})):
        arguments, of_device = change(value * factor)
        result = default_limits(device=device(**of_device), **arguments)
        assert verdicts(result) == expected, factor
    limit = result.limit(number)
    assert limit.left == pytest.approx(limit.right, rel=1e-5)
    assert f"limit {number} ({limit.name}) fails" in result.answer
    assert result.answer.count("fails") == 1


NEEDS = {
    "update_rate": {1},
    "position_resolution": {2, 3},
    "force_resolution": {4},
    "max_stiffness": {5},
    "bandwidth": {6},
}


@pytest.mark.parametrize("field", list(NEEDS))
def test_missing_device_data_leave_limits_undecided(field: str) -> None:
    whole, result = default_limits(), default_limits(device=device(**{field: None}))
    for limit in result.limits:
        if limit.number in NEEDS[field]:
            assert (limit.holds, limit.missing_data) == (None, (field,))
            assert (limit.left, limit.right, limit.speeds, limit.share) == (None,) * 4
        else:
            assert limit == whole.limit(limit.number)
        assert limit.device_field in NEEDS
    assert f"missing: {field}" in result.answer
    assert "Yes" not in result.answer
    assert all(set(wave.holds) == {1, 2, 3, 4, 6} - NEEDS[field] for wave in result.waves)


def test_device_without_data_decides_no_limit() -> None:
    result = default_limits(device=parse_device({}, "none"))
    assert verdicts(result) == dict.fromkeys(range(1, 7))
    assert result.answer.startswith("No limit can be decided.")
    assert result.stability_limit.stiffness is None
    assert result.perceptibility.missing_data == (
        "force_resolution",
        "friction",
        "bandwidth",
        "update_rate",
        "position_resolution",
        "apparent_mass",
        "damping",
    )


def test_speed_range_of_each_limit() -> None:
    result = default_limits()
    tops = {limit.number: limit.speeds for limit in result.limits}
    assert tops[1] == (0.0, pytest.approx(L * 2000.0 / 5))
    assert tops[6] == (0.0, pytest.approx(L * 300.0))
    assert all(tops[number] == (0.0, math.inf) for number in (2, 3, 4, 5))
    assert result.speeds == (0.0, pytest.approx(0.24))


@pytest.mark.parametrize("number", [1, 6])
def test_limit_holds_below_its_top_speed_only(number: int) -> None:
    top = default_limits().limit(number).speeds[1]
    assert default_limits(speed=top * (1 - 1e-9)).limit(number).holds
    assert not default_limits(speed=top * (1 + 1e-9)).limit(number).holds


def test_no_speed_satisfies_a_limit_independent_of_speed() -> None:
    result = default_limits(force_steps=50.0)
    assert result.limit(4).speeds == (0.0, 0.0)
    assert result.speeds == (0.0, 0.0)
    assert "No speed satisfies limit 4" in result.answer


def test_answer_states_the_speed_below_which_limits_hold() -> None:
    result = default_limits(speed=0.3)
    assert verdicts(result) == {**ALL, 6: False}
    assert "Below 0.24 m/s they hold." in result.answer


TWO = Fourier([5e-5, 2.4e-5], [2 * math.pi / 0.8e-3, 2 * math.pi / 0.32e-3], [0.2, 1.0])
LONG = 5.0**2 / (5.0**2 + 2.4**2)  # share of the long wave


def test_waves_of_a_sum_have_individual_wavelengths_and_forces() -> None:
    result = default_limits(TWO)
    assert [wave.wavelength for wave in result.waves] == pytest.approx([0.8e-3, 0.32e-3])
    assert [wave.force for wave in result.waves] == pytest.approx([0.025, 0.012], rel=1e-6)
    assert [wave.frequency for wave in result.waves] == pytest.approx([V / 0.8e-3, V / 0.32e-3])
    # For the short wave α v T = 0.3 mm and γ b = 10 mN are lower, but 375 Hz exceeds 300 Hz.
    whole = {1: True, 2: True, 3: True, 4: True, 6: True}
    assert [wave.holds for wave in result.waves] == [whole, {**whole, 6: False}]
    assert result.limit(6).wavelength == pytest.approx(0.32e-3)
    assert result.limit(6).speeds == (0.0, pytest.approx(0.32e-3 * 300.0))
    assert result.limit(1).speeds == (0.0, pytest.approx(0.32e-3 * 2000.0 / 5))
    assert result.limit(6).share == pytest.approx(LONG)
    assert result.waves[1].top_speed == pytest.approx(0.32e-3 * 300.0)


def test_sum_fails_a_limit_if_one_of_its_waves_fails() -> None:
    """The short wave exceeds the bandwidth; the long one alone does not."""
    result = default_limits(TWO)
    assert verdicts(result) == {**ALL, 6: False}
    assert result.resolved_share == pytest.approx(LONG)
    assert "only waves with 81.3 % of the height variance" in result.answer
    assert verdicts(default_limits(Sinusoid(5e-5, 0.8e-3))) == ALL


@settings(max_examples=8, deadline=None)
@given(
    scale=st.floats(0.2, 5.0),
    lengths=st.lists(st.floats(0.3e-3, 2e-3), min_size=1, max_size=3, unique=True),
    seed=st.integers(0, 1000),
)
def test_verdicts_do_not_depend_on_the_unit_of_length(
    scale: float, lengths: list[float], seed: int
) -> None:
    """Scaling all lengths, the speed and the force steps leaves every ratio of sides unchanged."""
    rng = np.random.default_rng(seed)
    k, a = 2 * np.pi / np.array(lengths), rng.uniform(1e-5, 4e-5, len(lengths))
    one = default_limits(Fourier(a, k), max_depth=3e-4)
    bench = device(
        position_resolution=20e-6 * scale, force_resolution=2e-3 * scale, friction=5e-3 * scale
    )
    other = default_limits(
        Fourier(scale * a, k / scale), device=bench, speed=V * scale, max_depth=3e-4 * scale
    )
    for first, second in zip(one.limits, other.limits, strict=True):
        assert first.left is not None
        assert second.left is not None
        assert first.left / first.right == pytest.approx(second.left / second.right, rel=1e-4)


def test_default_stiffness_is_the_recommended_stiffness() -> None:
    result = default_limits(stiffness=None)
    q = math.hypot(1.0, 2 * math.pi * A / L)
    assert result.stability_limit.stiffness == pytest.approx(900.0 / q, rel=1e-12)
    assert result.margin.law == "A"
    assert result.surface.stiffness == pytest.approx(900.0 / q * result.margin.factor, rel=1e-2)
    assert result.surface.stiffness <= 900.0 / q * result.margin.factor
    assert (result.gain_symbol, result.limit(5).holds) == ("q", True)
    assert result.limit(5).inequality == "q k ≤ K₀"
    assert any("no stable stiffness: below a speed v*" in words for words in result.assumptions)


def test_conservative_law_with_known_delay_has_a_gain_below_q() -> None:
    deep = Sinusoid(4e-4, 1e-3)
    result = default_limits(
        deep, law="D", stiffness=None, max_depth=1e-3, device=device(delay_samples=0)
    )
    assert (result.gain_symbol, result.gain.value) == ("q⁺", 1.0)
    assert result.stability_limit.stiffness == 900.0
    assert result.limit(5).inequality == "q⁺ k ≤ K₀"
    assert result.limit(5).holds
    steep = Sinusoid(1e-4, 1e-3, phase=0.3)
    result = default_limits(
        steep, law="C", stiffness=None, max_depth=4e-4, device=device(delay_samples=2)
    )
    q = characteristic_number(result.surface).upper
    plus = one_sided_number(result.surface).upper
    assert result.gain_symbol == "(q⁺/2 + d q)/(1/2 + d)"
    assert result.gain.value == pytest.approx((plus / 2 + 2 * q) / 2.5, rel=1e-12)
    wall = 900.0 * 0.5 / 2.5  # tested without delay
    assert result.stability_limit.stiffness == pytest.approx(wall / result.gain.value, rel=1e-12)


@pytest.mark.parametrize("law", ["A", "C", "G", "H"])
@pytest.mark.parametrize("delay", [None, 0, 2])
def test_limits_agree_with_compare(law: str, delay: int | None) -> None:
    texture, rig = Sinusoid(4e-4, 1e-3), device(delay_samples=delay)
    row = compare(texture, rig, law, max_depth=1e-3).rows[0]
    result = limits(texture, rig, law=law, max_depth=1e-3)
    assert result.stability_limit == row.stability_limit
    assert result.stability_limit.stiffness == pytest.approx(
        row.stability_limit.stiffness, rel=1e-12
    )
    assert result.perceptibility == row.perceptibility
    assert result.perceptibility.rms == pytest.approx(row.texture_force, rel=1e-9)


def test_without_max_stiffness_the_default_stiffness_is_used() -> None:
    result = default_limits(stiffness=None, device=device(max_stiffness=None))
    assert result.surface.stiffness == 1000.0
    assert any("a default: no stable stiffness is known" in words for words in result.assumptions)


def test_infinite_q_gives_no_stable_stiffness() -> None:
    result = default_limits(Sinusoid(4e-4, 1e-3), law="D", stiffness=None, max_depth=1e-3)
    assert (result.stability_limit.stiffness, result.surface.stiffness) == (0.0, 900.0)  # at K₀
    assert not result.limit(5).holds
    assert result.to_dict()["limits"][4]["left"] == "inf"
    assert any("no stable stiffness is known" in words for words in result.assumptions)


def test_perceptibility_of_a_sum_of_two_waves() -> None:
    """The RMS of law A is k √(Σ a²/2), and only the long wave is below 300 Hz."""
    perceptibility = default_limits(TWO).perceptibility
    rms = 500.0 * math.sqrt((5e-5**2 + 2.4e-5**2) / 2)
    assert perceptibility.rms == perceptibility.texture_rms == pytest.approx(rms, rel=1e-3)
    assert perceptibility.rms == pytest.approx(500.0 * merit(Surface(TWO, "A", 500.0, D)).ripple)
    assert perceptibility.resolved == pytest.approx(LONG, rel=1e-6)
    assert perceptibility.resolved_rms == pytest.approx(500.0 * 5e-5 / math.sqrt(2), rel=1e-3)
    assert perceptibility.missing_data == ("apparent_mass", "damping")
    words = "20 mN RMS of texture, of which the device resolves 18 mN at 0.12 m/s: felt."
    assert default_limits(TWO).answer.endswith(words)


def test_force_below_a_step_is_not_felt() -> None:
    for factor, hidden in ((0.999, False), (1.001, True)):
        result = default_limits(device=device(force_resolution=500.0 * A * factor))
        assert (result.perceptibility.tier == "not felt") is hidden
        assert (": not felt;" in result.answer) is hidden


def test_force_above_the_bandwidth_is_not_felt() -> None:
    perceptibility = default_limits(speed=1.0).perceptibility
    assert (perceptibility.resolved, perceptibility.resolved_rms, perceptibility.tier) == (
        0.0,
        0.0,
        "not felt",
    )


def test_map_of_a_wave_has_the_limits_of_the_wave() -> None:
    x = np.arange(64) / 64
    heights = np.tile(A * np.sin(2 * np.pi * 4 * x), (16, 1))
    result = default_limits(HeightMap(heights, 4 * L / 64, periodic=True))
    exact = default_limits()
    assert [wave.wavelength for wave in result.waves] == pytest.approx([L], rel=1e-9)
    assert [wave.amplitude for wave in result.waves] == pytest.approx([A], rel=1e-9)
    for number in (1, 2, 3, 6):
        assert result.limit(number).left == pytest.approx(exact.limit(number).left)
        assert result.limit(number).right == pytest.approx(exact.limit(number).right)
    assert result.limit(4).right == pytest.approx(500.0 * A, rel=1e-6)
    assert not result.spectrum.exact


def test_bands_with_negligible_variance_are_ignored() -> None:
    """A short wave with less than 0.1 % of the variance is omitted; the assumptions state it."""
    x = np.arange(1024) / 1024
    for ratio, remaining in ((0.02, 1), (0.05, 2)):
        heights = A * (np.sin(2 * np.pi * x) + ratio * np.sin(2 * np.pi * 100 * x))
        stiff = device(max_stiffness=1e4)
        result = default_limits(Profile(heights, L / 1024, periodic=True), device=stiff)
        assert len(result.waves) == remaining
        left_out = [words for words in result.assumptions if "left out" in words]
        assert bool(left_out) is (remaining == 1)
    assert verdicts(result) == {**ALL, 1: False, 2: False, 3: False, 4: False, 6: False}


def test_low_waves_with_significant_force_are_included() -> None:
    """Force shading follows slopes: a low short wave can have as much force as a high long one."""
    x = np.arange(1024) / 1024
    heights = A * (np.sin(2 * np.pi * x) + 0.02 * np.sin(2 * np.pi * 100 * x))
    texture = Profile(heights, L / 1024, periodic=True)
    assert len(default_limits(texture, law="G").waves) > len(default_limits(texture, law="A").waves)


def test_limits_of_noise_on_a_real_device() -> None:
    result = limits(Noise(rms=20e-6, size=5e-3, seed=3), "pantograph", law="A")
    assert result.limit(2).holds
    assert result.limit(4).missing_data == ("force_resolution",)
    assert len(result.waves) > 5
    assert sum(wave.share for wave in result.waves) > 0.98


INVALID = [
    ({"speed": 0.0}, "speed must be positive"),
    ({"speed": -1.0}, "speed must be positive"),
    ({"speed": math.nan}, "speed must be finite"),
    ({"speed": True}, "speed must be a number"),
    ({"time_samples": 1.9}, "time_samples must be at least 2"),
    ({"position_samples": 0.0}, "position_samples must be at least 2"),
    ({"force_steps": 0.5}, "force_steps must be at least 1"),
    ({"force_steps": math.inf}, "force_steps must be finite"),
    ({"stiffness": 0.0}, "stiffness must be positive"),
    ({"max_depth": -1.0}, "max_depth must be positive"),
    ({"law": "X"}, "law"),
    ({"device": "nothing"}, "device is unknown"),
]


@pytest.mark.parametrize(("arguments", "message"), INVALID, ids=str)
def test_error_messages_name_the_invalid_argument(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        default_limits(**arguments)


def test_minimum_sample_counts_are_accepted() -> None:
    result = default_limits(time_samples=2.0, position_samples=2.0, force_steps=1.0)
    assert (result.time_samples, result.position_samples, result.force_steps) == (2.0, 2.0, 1.0)


def test_unknown_limit_number_raises_a_key_error() -> None:
    with pytest.raises(KeyError):
        default_limits().limit(7)


def test_share_is_relative_to_the_significant_waves() -> None:
    """Insignificant bands are in neither numerator nor denominator, so the share can reach 1."""
    rng = np.random.default_rng(2)
    smooth = np.cumsum(np.cumsum(rng.normal(size=400)))
    result = default_limits(Profile(1e-5 * smooth / np.abs(smooth).max(), 1e-4), speed=1e-4)
    assert len(result.waves) < len(result.spectrum.waves)
    remaining = sum(wave.share for wave in result.waves)
    assert remaining < 1.0
    assert result.limit(1).holds
    assert result.limit(1).share == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("depth", [0.3e-3, 0.8e-3])
def test_loss_of_contact_on_the_scan_is_stated(depth: float) -> None:
    """Pressed to less than its height of 0.8 mm, the scan is partly in the air."""
    result = limits(Sinusoid(4e-4, 2e-3), "omega.3", max_depth=depth)
    stated = [words for words in result.assumptions if words.startswith("No contact on")]
    assert len(stated) == (depth < 0.8e-3)
