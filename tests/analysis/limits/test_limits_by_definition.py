"""Limits, tiers and remedies exactly at their thresholds, with numbers that are exact in binary."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from asperity.analysis import check_limits
from asperity.analysis.bounds.bound import Bound
from asperity.analysis.limits import perceptibility, spectrum
from asperity.analysis.limits.limit_rules import LIMIT_RULES, LimitCase, evaluate_limit
from asperity.analysis.limits.perceptibility import (
    MaskingSource,
    Perceptibility,
    classify_perceptibility,
)
from asperity.analysis.limits.spectrum import Spectrum, Wave
from asperity.analysis.passivity.verdict import StabilityLimit
from asperity.core.errors import ParameterError
from asperity.textures import Fourier, Profile

LENGTHS, FORCES = np.array([4.0, 2.0, 1.0]), np.array([3.0, 2.0, 1.0])
SHARES = np.array([0.5, 0.3, 0.2])
SMALLEST = math.nextafter(1.0, 2.0)


def make_case(data: dict[str, float] | None = None, **more: Any) -> LimitCase:
    plain: dict[str, Any] = {
        "speed": 1.0, "time_samples": 5.0, "position_samples": 4.0, "force_steps": 8.0,
        "wavelengths": LENGTHS, "forces": FORCES, "shares": SHARES, "gain": 2.0, "stiffness": 16.0,
    }  # fmt: skip
    return LimitCase(data or {}, **(plain | more))


# --- the six limits -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("number", "field", "value", "left", "right", "top"),
    [
        (1, "update_rate", 2.0, 5.0 / 2.0, LENGTHS, LENGTHS * 2.0 / 5.0),
        (1, "update_rate", 2.5, 2.0, LENGTHS, LENGTHS / 2.0),  # equal for the second wave
        (2, "position_resolution", 0.5, 2.0, LENGTHS, None),
        (3, "position_resolution", 0.4, 2.0, LENGTHS, None),
        (4, "force_resolution", 0.25, 2.0, FORCES, None),
        (6, "bandwidth", 0.5, 1.0 / LENGTHS, 0.5, LENGTHS * 0.5),
    ],
)
def test_limits_are_strict_inequalities_for_each_wave(
    number: int, field: str, value: float, left: Any, right: Any, top: Any
) -> None:
    rule = LIMIT_RULES[number - 1]
    evaluation = evaluate_limit(rule, make_case({field: value}))
    left, right = np.broadcast_arrays(np.atleast_1d(left), np.atleast_1d(right))
    holds = left < right
    assert 0 < holds.sum() < 3
    assert evaluation.holds is not None
    np.testing.assert_array_equal(evaluation.holds, holds)
    expected = np.where(holds, math.inf, 0.0) if top is None else top
    np.testing.assert_allclose(evaluation.top_speeds, expected, rtol=1e-15)
    worst = int(np.argmin(right / left))
    limit = evaluation.limit
    assert (limit.number, limit.device_field, limit.holds, limit.missing_data) == (
        number,
        field,
        False,
        (),
    )
    assert (limit.left, limit.right) == pytest.approx((left[worst], right[worst]), rel=1e-15)
    assert limit.wavelength == LENGTHS[worst]
    assert limit.share == pytest.approx(SHARES[holds].sum(), rel=1e-15)
    assert limit.speeds == (0.0, pytest.approx(float(np.min(expected)), rel=1e-15))
    assert evaluate_limit(rule, make_case()).limit.missing_data == (field,)
    flat = make_case(
        {field: value}, wavelengths=np.zeros(0), forces=np.zeros(0), shares=np.zeros(0)
    )
    assert evaluate_limit(rule, flat).limit.missing_data == ("waves: the surface is flat",)


def test_gain_limit_tolerates_rounding_and_needs_no_waves() -> None:
    for over, holds in ((0.0, True), (0.9e-12, True), (1.1e-12, False), (1.0, False)):
        flat = {"wavelengths": np.zeros(0), "forces": np.zeros(0), "shares": np.zeros(0)}
        for more in ({}, flat):
            evaluation = evaluate_limit(
                LIMIT_RULES[4], make_case({"max_stiffness": 32.0 / (1.0 + over)}, **more), "given"
            )
            assert (evaluation.limit.holds, evaluation.limit.inequality) == (holds, "given")
            assert evaluation.limit.left == 32.0
            assert (evaluation.limit.wavelength, evaluation.limit.share) == (None, None)
            assert evaluation.limit.speeds == (0.0, math.inf if holds else 0.0)


def test_sample_count_accepts_its_minimum() -> None:
    assert check_limits._check_sample_count("time_samples", 2.0, 2.0) == 2.0
    assert check_limits._check_sample_count("time_samples", None, 2.0) == 5.0
    with pytest.raises(ParameterError, match="at least 2"):
        check_limits._check_sample_count("time_samples", math.nextafter(2.0, 0.0), 2.0)


@pytest.mark.parametrize(
    ("delay", "lower", "upper", "symbol"),
    [
        (None, 3.0, 4.0, "q"), (math.inf, 3.0, 4.0, "q"), (0.0, 1.0, 2.0, "q⁺"),
        (1.0, 3.5 / 1.5, 5.0 / 1.5, "(q⁺/2 + d q)/(1/2 + d)"),
        (3.0, 9.5 / 3.5, 13.0 / 3.5, "(q⁺/2 + d q)/(1/2 + d)"),
    ],
)  # fmt: skip
def test_limiting_number_for_a_delay(
    delay: float | None, lower: float, upper: float, symbol: str
) -> None:
    q, plus = Bound(3.0, 4.0, "certified"), Bound(1.0, 2.0, "certified")
    result, text = check_limits._limiting_number(
        q, plus, StabilityLimit(1.0, "plausible", delay=delay)
    )
    assert (result.lower, result.upper) == pytest.approx((lower, upper), rel=1e-15)
    assert text == symbol


def test_waves_with_significant_height_or_force_are_reported() -> None:
    """The threshold is 0.1 % of either; exact sums keep all waves; each wave has each limit."""
    low = 0.9e-3
    waves = tuple(Wave(float(n), 0.1 * n, share) for n, share in ((3, low), (2, 1e-3), (1, low)))
    bands, exact = Spectrum(waves, False, ""), Spectrum(waves, True, "")
    forces = np.array([1.0, 0.0, math.sqrt(1e-3)])
    assert check_limits._significant_waves(bands, forces).tolist() == [True, True, False]
    assert (
        check_limits._significant_waves(bands, np.sqrt([0.5, 0.4989, 0.0011])).tolist()
        == [True] * 3
    )
    assert check_limits._significant_waves(bands, np.zeros(3)).tolist() == [False, True, False]
    assert check_limits._significant_waves(exact, np.zeros(3)).tolist() == [True] * 3
    remaining = np.array([True, False, True])
    two = {"wavelengths": np.array([3.0, 1.0]), "forces": np.array([7.0, 8.0]),
           "shares": np.array([low, low]), "speed": 6.0}  # fmt: skip
    limit_case = make_case({"update_rate": 16.0, "bandwidth": 4.0, "max_stiffness": 1.0}, **two)
    rendered = check_limits._rendered_waves(
        bands, remaining, limit_case, [evaluate_limit(rule, limit_case) for rule in LIMIT_RULES]
    )
    assert [(one.wavelength, one.share, one.frequency, one.force) for one in rendered] == [
        (3.0, low, 2.0, 7.0), (1.0, low, 6.0, 8.0),
    ]  # fmt: skip
    assert [one.holds for one in rendered] == [{1: True, 6: True}, {1: False, 6: False}]
    assert [one.top_speed for one in rendered] == pytest.approx([48.0 / 5.0, 16.0 / 5.0])
    (alone, _short) = check_limits._rendered_waves(bands, remaining, limit_case, [])
    assert (alone.holds, alone.top_speed) == ({}, math.inf)


# --- tiers ----------------------------------------------------------------------------------------


def assess_share(share: float, data: dict[str, float], **more: Any) -> Perceptibility:
    """Return the perceptibility of a texture whose force amplitude is ``share`` times 16 N."""
    rms = 16.0 * share / math.sqrt(2.0)
    while math.sqrt(2.0) * rms < 16.0 * share:
        rms = math.nextafter(rms, math.inf)
    return classify_perceptibility(make_case(data, **more), 99.0, rms, None)


def test_tier_thresholds_are_inclusive() -> None:
    """With friction of 8 N (or force steps of 2 N): borderline from 8 N on, felt from 16 N on."""
    levels: list[tuple[dict[str, float], MaskingSource]] = [
        ({"friction": 8.0}, MaskingSource.FRICTION),
        ({"least_friction": 8.0}, MaskingSource.FRICTION),
        ({"force_resolution": 2.0, "friction": 7.5}, MaskingSource.STEPS),
    ]
    for data, masking_source in levels:
        result = assess_share(1.0, data)
        assert (result.tier, result.masked_by, result.clear_threshold, result.remedies) == (
            "felt",
            masking_source,
            16.0,
            (),
        )
        assert assess_share(1.0 - 1e-12, data).tier == "borderline"
    assert assess_share(0.5, {"friction": 8.0}).tier == "borderline"
    assert assess_share(0.5 - 1e-12, {"friction": 8.0}).tier == "not felt"
    # Of equal masking sources the first is reported: the hand, then friction.
    even = {"force_resolution": 2.0, "friction": 8.0}
    assert assess_share(1.0, even).masked_by is MaskingSource.FRICTION
    assert assess_share(1.0, {}).missing_data == perceptibility._MASKING_FIELDS
    assert assess_share(1.0, dict.fromkeys(perceptibility._MASKING_FIELDS, 1e-9)).missing_data == ()


def test_mostly_form_requires_more_than_half_of_the_force() -> None:
    result = replace(assess_share(1.0, {}), rms=2.0, texture_rms=1.0)
    assert not result.is_mostly_form
    assert replace(result, texture_rms=math.nextafter(1.0, 0.0)).is_mostly_form
    assert result.resolved_rms == pytest.approx(result.amplitude / math.sqrt(2.0), rel=1e-15)


def test_remedies_of_a_masked_texture() -> None:
    """A better device is a remedy if the next masking source permits it; the hand has none."""
    for data, kind, value in (
        ({"friction": 8.0}, "friction", 4.0),
        ({"force_resolution": 2.0}, "force_resolution", 1.0),
        ({"friction": 8.0, "force_resolution": 1.0}, "friction", 4.0),
        ({"friction": 4.0, "force_resolution": 2.0}, "force_resolution", 1.0),
    ):
        remedies = {one.kind: one.value for one in assess_share(0.5, data).remedies}
        assert remedies[kind] == pytest.approx(value, rel=1e-12)  # type: ignore[index]  # a kind
        assert remedies["magnify"] == pytest.approx(2.0, rel=0.01)
        assert len(remedies) == 2
    both = {"friction": 8.0, "force_resolution": 1.5}
    assert [one.kind for one in assess_share(0.5, both).remedies] == ["magnify"]
    assert [one.kind for one in assess_share(1e-4, {}).remedies] == ["magnify"]


def test_required_magnification_just_reaches_the_threshold() -> None:
    for share in (0.9, 0.5, 0.01, 1e-6, 1.0 / 5e8):
        texture = 16.0 * share / math.sqrt(2.0)
        times = perceptibility._required_magnification(make_case({"friction": 8.0}), texture, 16.0)
        assert times is not None
        assert math.sqrt(2.0) * times * texture >= 16.0
        assert times == pytest.approx(1.0 / share, rel=2e-13)
    for texture in (16.0 / 2e9 / math.sqrt(2.0), 0.0):
        assert (
            perceptibility._required_magnification(make_case({"friction": 8.0}), texture, 16.0)
            is None
        )
    # A bandwidth of 0.25 Hz: magnified four times, all waves are long enough.
    slow = make_case({"bandwidth": 0.25, "friction": 8.0}, wavelengths=np.array([1.0, 1.0, 1.0]))
    times = perceptibility._required_magnification(slow, 1e3, 16.0)
    assert times == pytest.approx(4.0, rel=1e-12)


def test_weighted_quantile_is_the_value_that_completes_the_share() -> None:
    values, squares = np.array([1.0, 4.0, 2.0]), np.array([1.0, 2.0, 1.0])
    for share, expected in ((0.0, 4.0), (0.5, 4.0), (0.5000001, 2.0), (0.75, 2.0), (0.76, 1.0),
                            (1.0, 1.0), (1.0 + 1e-12, 1.0)):  # fmt: skip
        assert perceptibility._weighted_quantile(values, squares, share) == expected


def test_resolution_remedy_is_a_slower_scan_only_if_speed_matters() -> None:
    """Limits independent of speed hold for a wave at every speed or at none."""
    steps = make_case(
        {"position_resolution": 0.6}, speed=1.0, position_samples=4.0, time_samples=5.0
    )
    remedy = perceptibility._resolution_remedy(
        steps, 0.9
    )  # 2.4 m and 3 m are required: only the 4 m wave is resolved
    assert (remedy.kind, remedy.value) == ("position_resolution", 2.0 / 5.0)
    slower = perceptibility._resolution_remedy(make_case({"bandwidth": 0.125}), 0.9)
    assert (slower.kind, slower.value) == ("slower", 0.25)
    slowest = perceptibility._resolution_remedy(
        make_case({"bandwidth": 0.125, "update_rate": 0.5}), 1.0
    )
    assert (slowest.kind, slowest.value) == ("slower", pytest.approx(0.1))
    # The force is just sufficient if all of it is resolved.
    enough = assess_share(1.0, {"friction": 8.0, "bandwidth": 0.125})
    assert ("slower", 0.125) in [(one.kind, one.value) for one in enough.remedies]


# --- waves ----------------------------------------------------------------------------------------


def test_waves_that_cancel_up_to_rounding_are_omitted() -> None:
    """The threshold is 1e-12 of the largest amplitude; opposite wave vectors are one wave."""
    for rest, count in ((0.9e-12, 1), (1.1e-12, 2)):
        vectors = [[1e3, 0.0], [2e3, 0.0], [-1e3, 0.0], [0.0, 3e3]]
        texture = Fourier([1.0, 1.0, 1.0, rest], vectors, [0.0, 0.0, 0.0, 0.5])
        result = spectrum.compute_spectrum(texture)
        assert len(result.waves) == count
        assert result.waves[0].wavelength == pytest.approx(2.0 * math.pi / 2e3)
    assert result.waves[1].phase == pytest.approx(0.5)


@pytest.mark.parametrize(("count", "exact"), [(64, True), (65, False)])
def test_spectrum_is_exact_up_to_64_waves(count: int, exact: bool) -> None:
    texture = Fourier(np.ones(count) * 1e-6, [[1e3 * (n + 1), 0.0] for n in range(count)])
    assert spectrum.compute_spectrum(texture).exact is exact


def test_heights_of_rounding_size_have_no_waves() -> None:
    """A variance below 1e-24 of the squared height is zero; bands below 1e-18 of it are omitted."""
    x = np.arange(32) / 32
    for part, waves in ((1.3e-12, 0), (1.5e-12, 1)):  # its variance is half its square
        heights = 1.0 + part * np.sin(2 * np.pi * x)
        values = (heights - heights.mean()) / np.std(heights) * part / math.sqrt(2.0)
        result = spectrum.compute_spectrum(Profile(1.0 + values, 1e-3, periodic=True))
        assert min(len(result.waves), 1) == waves
    for part, waves in ((0.9e-9, 1), (1.1e-9, 2)):
        heights = np.sin(2 * np.pi * x) + part * np.sin(16 * np.pi * x)
        result = spectrum.compute_spectrum(Profile(heights, 1e-3, periodic=True))
        assert len(result.waves) == waves
