"""Perceptibility of a texture: thresholds, what the device resolves, and remedies."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from asperity.analysis.check_limits import limits
from asperity.analysis.compare import compare
from asperity.analysis.limits.limit_rules import LimitCase
from asperity.analysis.limits.perceptibility import (
    CLEAR_RATIO,
    HAND_THRESHOLD,
    MaskingSource,
    Perceptibility,
    assess_perceptibility,
    classify_perceptibility,
    form_removal_sentences,
    masking_text,
    remedies_text,
    texture_amount_text,
)
from asperity.devices import Device, parse_device
from asperity.surface import Surface
from asperity.textures import Fourier, HeightMap, Sinusoid
from asperity.textures.texture import TexturePart

RMS = 1.0 / math.sqrt(2.0)
LONG, SHORT = 2e-3, 0.3e-3


def device(**fields: Any) -> Device:
    return parse_device({"max_stiffness": "1000 N/m", **fields}, "mine")


def assess_wave(
    amplitude: float,
    own_device: Device,
    period: float = LONG,
    stiffness: float = 1000.0,
    **options: Any,
) -> Perceptibility:
    """Return the perceptibility of law A on a sinusoid: its force is k times the amplitude."""
    wave = Sinusoid(amplitude, period)
    surface = Surface(wave, "A", stiffness, 1e-3)
    rms = stiffness * amplitude * RMS
    return assess_perceptibility(surface, own_device, TexturePart(wave), rms=rms, **options)


@pytest.mark.parametrize(
    ("fields", "level", "clear", "masking_source"),
    [
        ({}, HAND_THRESHOLD, CLEAR_RATIO * HAND_THRESHOLD, MaskingSource.HAND),
        ({"friction": "50 mN"}, 0.05, CLEAR_RATIO * 0.05, MaskingSource.FRICTION),
        ({"least_friction": "50 mN"}, 0.05, CLEAR_RATIO * 0.05, MaskingSource.FRICTION),
        ({"force_resolution": "15 mN"}, 0.015, 5.0 * 0.015, MaskingSource.STEPS),
        ({"force_resolution": "15 mN", "friction": "60 mN"}, 0.06, 0.12, MaskingSource.FRICTION),
    ],
)
def test_tiers_change_at_their_thresholds(
    fields: dict[str, str], level: float, clear: float, masking_source: MaskingSource
) -> None:
    """Force amplitudes k a just below and just above each threshold."""
    own_device, k = device(**fields), 1000.0
    for share, tier in ((0.99 * level, "not felt"), (1.01 * level, "borderline"),
                        (0.99 * clear, "borderline"), (1.01 * clear, "felt")):  # fmt: skip
        result = assess_wave(share / k, own_device)
        assert (result.tier, result.masked_by) == (tier, masking_source)
        assert result.amplitude == pytest.approx(share, rel=1e-6)
        assert (result.detection_threshold, result.clear_threshold) == pytest.approx((level, clear))


@pytest.mark.parametrize("amplitude", [1e-6, 8e-6, 15e-6])
@pytest.mark.parametrize("fields", [{}, {"friction": "60 mN"}, {"force_resolution": "20 mN"}])
def test_each_remedy_makes_the_texture_felt(amplitude: float, fields: dict[str, str]) -> None:
    own_device = device(
        update_rate="1 kHz", position_resolution="10 um", bandwidth="200 Hz", **fields
    )
    for period in (LONG, SHORT):
        result = assess_wave(amplitude, own_device, period)
        assert result.tier != "felt"
        assert result.remedies
        for remedy in result.remedies:
            g = remedy.value * (1.0 + 1e-9)  # rounding of the forces
            if remedy.kind == "magnify":
                remedied = assess_wave(g * amplitude, own_device, g * period)
                less = assess_wave(0.9 * g * amplitude, own_device, 0.9 * g * period)
            elif remedy.kind == "slower":
                remedied = assess_wave(amplitude, own_device, period, speed=0.999 * remedy.value)
                less = assess_wave(amplitude, own_device, period, speed=1.01 * g)
            else:
                data = {
                    **own_device.data,
                    remedy.kind: replace(
                        own_device.data[remedy.kind], value=remedy.value * (1 - 1e-9)
                    ),
                }
                remedied = assess_wave(amplitude, replace(own_device, data=data), period)
                data[remedy.kind] = replace(own_device.data[remedy.kind], value=1.1 * g)
                less = assess_wave(amplitude, replace(own_device, data=data), period)
            assert remedied.tier == "felt", remedy
            assert less.tier != "felt", remedy


def test_position_resolution_is_the_remedy_where_no_speed_helps() -> None:
    """For steps of 1 mm on waves of 2 mm the only remedy besides magnifying is resolution."""
    own_device = device(update_rate="1 kHz", position_resolution="1 mm")
    (remedy,) = (one for one in assess_wave(1e-4, own_device).remedies if one.kind != "magnify")
    assert remedy.kind == "position_resolution"
    for value, tier in ((remedy.value * (1.0 - 1e-9), True), (1.1 * remedy.value, False)):
        data = {**own_device.data, remedy.kind: replace(own_device.data[remedy.kind], value=value)}
        assert (assess_wave(1e-4, replace(own_device, data=data)).tier == "felt") is tier


def test_undersampled_waves_are_borderline_and_need_a_slower_scan() -> None:
    """At 1 kHz and 0.1 m/s a wave of 0.3 mm has three updates, between 2 and 5."""
    own_device = device(update_rate="1 kHz")
    result = assess_wave(1e-4, own_device, SHORT)
    assert (result.tier, result.resolved, result.resolved_rms) == ("borderline", 0.0, 0.0)
    assert result.remedies[1].kind == "slower"
    assert result.remedies[1].value == pytest.approx(SHORT * 1000.0 / 5.0)
    assert (
        assess_wave(1e-4, own_device, SHORT, speed=0.3).tier == "not felt"
    )  # one update in a wave
    assert assess_wave(1e-4, own_device, SHORT, speed=0.05).tier == "felt"


def test_only_waves_within_the_bandwidth_are_resolved() -> None:
    """Of two waves with equal force one is above the bandwidth of 100 Hz."""
    wave = Fourier([1e-4, 1e-4], [[2 * math.pi / LONG, 0.0], [2 * math.pi / SHORT, 0.0]])
    surface = Surface(wave, "A", 500.0, 1e-3)
    rms = 500.0 * 1e-4
    result = assess_perceptibility(surface, device(bandwidth="100 Hz"), TexturePart(wave), rms=rms)
    assert result.resolved == pytest.approx(0.5, rel=1e-6)
    assert result.resolved_rms == pytest.approx(rms * RMS, rel=1e-6)


def test_slower_scan_resolves_the_required_share_of_variance() -> None:
    """Three waves have 1/2, 1/3 and 1/6 of the variance; the amplitude is its square root."""
    lengths, shares = np.array([4e-3, 2e-3, 1e-3]), np.array([1 / 2, 1 / 3, 1 / 6])
    rms = 1.0
    whole = math.sqrt(2.0) * rms
    for part, expected in ((0.6, 4e-3), (0.75, 2e-3), (0.93, 1e-3)):
        own_device = device(bandwidth="100 Hz", friction=f"{0.5 * part * whole} N")
        values = {name: datum.value for name, datum in own_device.data.items()}
        case = LimitCase(values, lengths, np.sqrt(shares), shares, speed=1.0)
        result = classify_perceptibility(case, rms, rms, None)
        assert result.clear_threshold == pytest.approx(part * whole)
        (slower,) = (remedy for remedy in result.remedies if remedy.kind == "slower")
        # part² of the variance lies in waves of at least that length, resolved at 100 Hz.
        assert slower.value == pytest.approx(expected * 100.0)


def test_form_is_separated_from_texture() -> None:
    """A 2 mm deep bowl with waves of 20 µm has mostly form and little texture."""
    x = np.linspace(0.0, 40e-3, 400)
    bowl = 2e-3 * ((x - 20e-3) / 20e-3) ** 2
    heights = bowl + 20e-6 * np.sin(2 * np.pi * x / 1e-3) + np.zeros((400, 1))
    result = compare(HeightMap(heights, 40e-3 / 399), device(), "A", max_depth=1e-3)
    perceptibility = result.row("A").perceptibility
    assert perceptibility is not None
    k = result.row("A").recommended_stiffness
    assert perceptibility.is_mostly_form
    assert perceptibility.nesting_index == 8e-3
    assert perceptibility.rms > 0.3 * k * 1e-3 / 3
    assert perceptibility.texture_rms == pytest.approx(k * 20e-6 * RMS, rel=0.1)
    assert "of which" in texture_amount_text(perceptibility)
    assert "--form 2 and --l-cutoff remove it" in result.recommendation
    assert "L-filter of 8 mm" in " ".join(result.assumptions)


def test_analytic_texture_has_no_nesting_index() -> None:
    assert Sinusoid(1e-3, 20e-3).texture_part().nesting is None


def test_sentences_name_the_masking_source_and_the_remedies() -> None:
    own_device = device(friction="60 mN", force_resolution="20 mN")
    result = assess_wave(80e-6, own_device)
    assert masking_text(result, own_device) == (
        "felt from 85 mN RMS on, for the device's dry friction of 60 mN"
    )
    assert remedies_text(result) == "To feel it, magnify 1.5 times."
    steps = device(force_resolution="20 mN")
    assert "force steps of 20 mN" in masking_text(assess_wave(80e-6, steps), steps)
    assert remedies_text(assess_wave(80e-6, steps)) == (
        "To feel it, magnify 1.3 times, or use a device with force steps below 16 mN."
    )


def test_compare_and_limits_give_the_same_perceptibility() -> None:
    texture = Sinusoid(1e-4, 1e-3)
    for name in ("touch", "inverse3", "pantograph", "falcon"):
        result = compare(texture, name, "ACH")
        for row in result.rows:
            single = limits(texture, name, law=row.law)
            assert single.perceptibility == row.perceptibility
            assert single.surface.stiffness == row.recommended_stiffness


def test_imperceptible_laws_are_not_recommended() -> None:
    result = compare(Sinusoid(1e-6, 1e-3), "touch")
    assert result.recommended == ""
    sound = [row for row in result.rows if row.conservative and row.continuous]
    assert result.nearest_row is max(sound, key=lambda row: row.resolved_force)
    assert result.recommendation.startswith("Nothing of this texture will be felt")
    assert "magnify" in result.recommendation
    # limits() uses the law nearest to being felt.
    assert limits(Sinusoid(1e-6, 1e-3), "touch").surface.law is result.nearest_row.law


def test_laws_continuous_at_every_depth_are_preferred() -> None:
    """Above its focal depth D is as good as C and H, but at larger depths its force jumps."""
    result = compare(Sinusoid(1e-4, 1.5e-3), "omega.3", "CDH", max_depth=1e-4)
    forces = {row.law.letter: row.resolved_force for row in result.rows}
    assert forces["D"] > 0.8 * max(forces.values())
    assert result.row("D").continuous
    assert result.recommended in {"C", "H"}


def test_waviness_of_rounding_size_is_reported_as_none() -> None:
    result = assess_wave(1e-4, device(), SHORT)
    own_device = replace(result, nesting_index=8e-3)
    (text,) = form_removal_sentences(own_device, 3e-6, 1.8e-21)
    assert text.endswith("L-filter of 8 mm; they take form 3 µm high and no waviness")
    assert form_removal_sentences(replace(result, nesting_index=None), 3e-6, 1e-6) == []
