"""Limits, tiers and remedies exactly at their thresholds, with numbers that are exact in binary."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.limits import perceptibility, spectrum, wave_scan
from asperity.analysis.limits.limit_rules import (
    LIMIT_RULES,
    LimitCase,
    check_sample_count,
    evaluate_limit,
)
from asperity.analysis.limits.perceptibility import (
    MaskingSource,
    Perceptibility,
    WaveScan,
    assess_perceptibility,
    classify_perceptibility,
    respond,
)
from asperity.analysis.limits.spectrum import Spectrum, Wave
from asperity.analysis.passivity.recommended_stiffness import StabilityLimit
from asperity.analysis.results import check_limits
from asperity.core.errors import ParameterError
from asperity.devices import parse_device
from asperity.perception.grip import Grip
from asperity.report.sentences.limit_sentences import unverified_text
from asperity.surface import Surface
from asperity.textures import Fourier, Profile, Sinusoid
from asperity.textures.texture import TexturePart

LENGTHS, FORCES = np.array([4.0, 2.0, 1.0]), np.array([3.0, 2.0, 1.0])
SHARES = np.array([0.5, 0.3, 0.2])
SMALLEST = math.nextafter(1.0, 2.0)


def make_case(data: dict[str, float] | None = None, **more: Any) -> LimitCase:
    plain: dict[str, Any] = {
        "speed": 1.0,
        "time_samples": 5.0,
        "position_samples": 4.0,
        "force_steps": 8.0,
        "wavelengths": LENGTHS,
        "forces": FORCES,
        "shares": SHARES,
        "gain": 2.0,
        "stiffness": 16.0,
    }
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
    assert check_sample_count("time_samples", 2.0) == 2.0
    assert check_sample_count("time_samples", None) == 5.0
    with pytest.raises(ParameterError, match="at least 2"):
        check_sample_count("time_samples", math.nextafter(2.0, 0.0))


@pytest.mark.parametrize(
    ("delay", "lower", "upper", "symbol"),
    [
        (None, 3.0, 4.0, "q"),
        (math.inf, 3.0, 4.0, "q"),
        (0.0, 1.0, 2.0, "q⁺"),
        (1.0, 3.5 / 1.5, 5.0 / 1.5, "(q⁺/2 + d q)/(1/2 + d)"),
        (3.0, 9.5 / 3.5, 13.0 / 3.5, "(q⁺/2 + d q)/(1/2 + d)"),
    ],
)
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
    bands, exact = Spectrum(waves, exact=False), Spectrum(waves, exact=True)
    forces = np.array([1.0, 0.0, math.sqrt(1e-3)])
    assert check_limits._significant_waves(bands, forces).tolist() == [True, True, False]
    assert (
        check_limits._significant_waves(bands, np.sqrt([0.5, 0.4989, 0.0011])).tolist()
        == [True] * 3
    )
    assert check_limits._significant_waves(bands, np.zeros(3)).tolist() == [False, True, False]
    assert check_limits._significant_waves(exact, np.zeros(3)).tolist() == [True] * 3
    remaining = np.array([True, False, True])
    two = {
        "wavelengths": np.array([3.0, 1.0]),
        "forces": np.array([7.0, 8.0]),
        "shares": np.array([low, low]),
        "speed": 6.0,
    }
    limit_case = make_case({"update_rate": 16.0, "bandwidth": 4.0, "max_stiffness": 1.0}, **two)
    rendered = check_limits._rendered_waves(
        bands, remaining, limit_case, [evaluate_limit(rule, limit_case) for rule in LIMIT_RULES]
    )
    assert [(one.wavelength, one.share, one.frequency, one.force) for one in rendered] == [
        (3.0, low, 2.0, 7.0),
        (1.0, low, 6.0, 8.0),
    ]
    assert [one.holds for one in rendered] == [{1: True, 6: True}, {1: False, 6: False}]
    assert [one.top_speed for one in rendered] == pytest.approx([48.0 / 5.0, 16.0 / 5.0])
    (alone, _short) = check_limits._rendered_waves(bands, remaining, limit_case, [])
    assert (alone.holds, alone.top_speed) == ({}, math.inf)


# --- tiers ----------------------------------------------------------------------------------------

FLAT = Grip("flat", 1.0, 0.0, 0.0, (1e-8, 1e3), (1.0, 1.0), (4.0, 4.0), {})
"""At low frequencies one metre per newton; one metre is noticed and four metres are felt."""


def scan_waves(forces: float, data: dict[str, float], **more: Any) -> WaveScan:
    """Return a scan, slow enough for statics, of three equal waves along the wall."""
    each = np.full(3, forces / math.sqrt(3.0))
    case = make_case(data, forces=each, **({"speed": 1e-6} | more))
    return WaveScan(case, np.column_stack([each, np.zeros(3)]), FLAT, 16.0)


def assess_forces(forces: float, data: dict[str, float], **more: Any) -> Perceptibility:
    waves = scan_waves(forces, data, **more)
    return classify_perceptibility(waves, {}, 99.0, forces / math.sqrt(2.0), None)


ABOVE, BELOW = 1.0 + 1e-9, 1.0 - 1e-9


def test_tiers_change_at_the_thresholds_of_the_hand() -> None:
    for force, tier in (
        (4.0 * ABOVE, "felt"),
        (4.0 * BELOW, "borderline"),
        (ABOVE, "borderline"),
        (BELOW, "not felt"),
    ):
        result = assess_forces(force, {})
        assert (result.tier, result.masked_by) == (tier, MaskingSource.HAND)
        assert result.level == pytest.approx(force / 4.0)
        assert result.hand_motion == pytest.approx(force)
        assert result.hand_force == pytest.approx(force)  # 1 N/m


def test_force_steps_need_their_number_for_each_tier() -> None:
    """With γ = 8 steps of 2 N: felt from 16 N on, not felt below 2 N."""
    for force, tier in (
        (16.0 * ABOVE, "felt"),
        (16.0 * BELOW, "borderline"),
        (2.0 * ABOVE, "borderline"),
        (2.0 * BELOW, "not felt"),
    ):
        result = assess_forces(force, {"force_resolution": 2.0})
        assert result.tier == tier
        assert (result.masked_by is MaskingSource.STEPS) is (force < 16.0)


def test_contact_stiffness_holds_the_tool_along_the_normal_alone() -> None:
    waves = scan_waves(17.0, {})
    normal = replace(waves, components=waves.components[:, ::-1])
    assert respond(waves).motions == pytest.approx(17.0 / math.sqrt(3.0), rel=1e-6)
    assert respond(normal).motions == pytest.approx(1.0 / math.sqrt(3.0), rel=1e-6)


def test_dry_friction_damps_across_the_stroke() -> None:
    speed, friction = 2.0, 30.0
    normal = scan_waves(1.0, {"friction": friction}, speed=speed)
    normal = replace(normal, components=normal.components[:, ::-1])
    omega = 2.0 * math.pi * speed / LENGTHS
    impedance = np.abs(17.0 - 0.1 * omega**2 + 1j * omega * friction / speed)
    np.testing.assert_allclose(respond(normal).motions, 1.0 / math.sqrt(3.0) / impedance)


def test_waves_beyond_the_device_are_not_felt() -> None:
    """A bandwidth below the frequency of two waves leaves a third of the variance."""
    result = assess_forces(9.0, {"bandwidth": 0.3e-6})
    assert result.resolved == pytest.approx(1.0 / 3.0)
    assert result.level == pytest.approx(9.0 / 4.0 / math.sqrt(3.0))
    assert not assess_forces(9.0, {"bandwidth": 1e-7}).level


def test_missing_and_unverified_data_are_listed() -> None:
    fields = (*wave_scan.MASKING_FIELDS, *perceptibility._HAND_FIELDS)
    assert assess_forces(1.0, {}).missing_data == fields
    assert assess_forces(1.0, dict.fromkeys(fields, 1e-9)).missing_data == ()


def test_doubtful_numbers_never_hide_a_texture() -> None:
    doubtful = {"force_resolution": 9.0, "bandwidth": 1e3}
    result = classify_perceptibility(scan_waves(8.0, {}), doubtful, 99.0, 8.0, None)
    assert (result.tier, result.unverified) == ("felt", ("force_resolution",))
    words = "If the unverified force resolution of this device is right, less is felt."
    assert unverified_text(result) == words
    trusted = classify_perceptibility(scan_waves(8.0, doubtful), {}, 99.0, 8.0, None)
    assert (trusted.tier, unverified_text(trusted)) == ("not felt", "")


@pytest.mark.parametrize(
    ("step", "tier"),
    [
        ({"value": 90.0, "unit": "mN", "verified": True, "source": "test"}, "not felt"),
        ("90 mN", "not felt"),  # the user's own
        ({"value": 90.0, "unit": "mN", "verified": False, "source": "remembered"}, "felt"),
    ],
)
def test_only_numbers_from_unverified_sources_are_doubtful(step: Any, tier: str) -> None:
    rig = parse_device({"max_stiffness": "1000 N/m", "force_resolution": step}, "mine")
    wave = Sinusoid(8e-5, 2e-3)
    surface = Surface(wave, "A", 1000.0, 1e-3)
    rms = 0.08 / math.sqrt(2.0)
    assert assess_perceptibility(surface, rig, TexturePart(wave), rms=rms).tier == tier


def test_mostly_form_requires_more_than_half_of_the_force() -> None:
    result = replace(assess_forces(1.0, {}), rms=2.0, texture_rms=1.0)
    assert not result.is_mostly_form
    assert replace(result, texture_rms=math.nextafter(1.0, 0.0)).is_mostly_form
    assert result.resolved_rms == pytest.approx(result.amplitude / math.sqrt(2.0), rel=1e-15)


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
