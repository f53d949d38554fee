"""Whether a texture is felt: the levels, what the device resolves, and the cures."""

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


def felt(
    amplitude: float, known: Device, period: float = LONG, stiffness: float = 1000.0, **how: Any
) -> Perceptibility:
    """Return the tier of law A on a sinusoid: it pushes with k times the amplitude."""
    wave = Sinusoid(amplitude, period)
    surface = Surface(wave, "A", stiffness, 1e-3)
    rms = stiffness * amplitude * RMS
    return assess_perceptibility(surface, known, TexturePart(wave), rms=rms, **how)


@pytest.mark.parametrize(
    ("fields", "level", "clear", "hides"),
    [
        ({}, HAND_THRESHOLD, CLEAR_RATIO * HAND_THRESHOLD, MaskingSource.HAND),
        ({"friction": "50 mN"}, 0.05, CLEAR_RATIO * 0.05, MaskingSource.FRICTION),
        ({"least_friction": "50 mN"}, 0.05, CLEAR_RATIO * 0.05, MaskingSource.FRICTION),
        ({"force_resolution": "15 mN"}, 0.015, 5.0 * 0.015, MaskingSource.STEPS),
        ({"force_resolution": "15 mN", "friction": "60 mN"}, 0.06, 0.12, MaskingSource.FRICTION),
    ],
)
def test_the_tiers_turn_at_their_levels(
    fields: dict[str, str], level: float, clear: float, hides: MaskingSource
) -> None:
    """A wave of amplitude a pushes with k a: just below and just above each of the levels."""
    known, k = device(**fields), 1000.0
    for share, tier in ((0.99 * level, "not felt"), (1.01 * level, "borderline"),
                        (0.99 * clear, "borderline"), (1.01 * clear, "felt")):  # fmt: skip
        found = felt(share / k, known)
        assert (found.tier, found.masked_by) == (tier, hides)
        assert found.amplitude == pytest.approx(share, rel=1e-6)
        assert (found.detection_threshold, found.clear_threshold) == pytest.approx((level, clear))


@pytest.mark.parametrize("amplitude", [1e-6, 8e-6, 15e-6])
@pytest.mark.parametrize("fields", [{}, {"friction": "60 mN"}, {"force_resolution": "20 mN"}])
def test_each_cure_cures(amplitude: float, fields: dict[str, str]) -> None:
    known = device(update_rate="1 kHz", position_resolution="10 um", bandwidth="200 Hz", **fields)
    for period in (LONG, SHORT):
        found = felt(amplitude, known, period)
        assert found.tier != "felt"
        assert found.remedies
        for cure in found.remedies:
            g = cure.value * (1.0 + 1e-9)  # rounding of the forces
            if cure.kind == "magnify":
                again = felt(g * amplitude, known, g * period)
                less = felt(0.9 * g * amplitude, known, 0.9 * g * period)
            elif cure.kind == "slower":
                again = felt(amplitude, known, period, speed=0.999 * cure.value)
                less = felt(amplitude, known, period, speed=1.01 * g)
            else:
                data = {
                    **known.data,
                    cure.kind: replace(known.data[cure.kind], value=cure.value * (1 - 1e-9)),
                }
                again = felt(amplitude, replace(known, data=data), period)
                data[cure.kind] = replace(known.data[cure.kind], value=1.1 * g)
                less = felt(amplitude, replace(known, data=data), period)
            assert again.tier == "felt", cure
            assert less.tier != "felt", cure


def test_where_no_speed_helps_finer_steps_of_position_do() -> None:
    """Steps of 1 mm on waves of 2 mm: no slower scan is named, and what is named cures."""
    known = device(update_rate="1 kHz", position_resolution="1 mm")
    (cure,) = (one for one in felt(1e-4, known).remedies if one.kind != "magnify")
    assert cure.kind == "position_resolution"
    for value, tier in ((cure.value * (1.0 - 1e-9), True), (1.1 * cure.value, False)):
        data = {**known.data, cure.kind: replace(known.data[cure.kind], value=value)}
        assert (felt(1e-4, replace(known, data=data)).tier == "felt") is tier


def test_waves_that_arrive_distorted_are_borderline_and_a_slower_scan_helps() -> None:
    """At 1 kHz and 0.1 m/s a wave of 0.3 mm has three updates: more than 2, less than 5."""
    known = device(update_rate="1 kHz")
    found = felt(1e-4, known, SHORT)
    assert (found.tier, found.resolved, found.resolved_rms) == ("borderline", 0.0, 0.0)
    assert found.remedies[1].kind == "slower"
    assert found.remedies[1].value == pytest.approx(SHORT * 1000.0 / 5.0)
    assert felt(1e-4, known, SHORT, speed=0.3).tier == "not felt"  # one update in a wave
    assert felt(1e-4, known, SHORT, speed=0.05).tier == "felt"


def test_only_the_waves_that_come_through_count() -> None:
    """Two waves of one force each: above 100 Hz nothing is transmitted."""
    wave = Fourier([1e-4, 1e-4], [[2 * math.pi / LONG, 0.0], [2 * math.pi / SHORT, 0.0]])
    surface = Surface(wave, "A", 500.0, 1e-3)
    rms = 500.0 * 1e-4
    found = assess_perceptibility(surface, device(bandwidth="100 Hz"), TexturePart(wave), rms=rms)
    assert found.resolved == pytest.approx(0.5, rel=1e-6)
    assert found.resolved_rms == pytest.approx(rms * RMS, rel=1e-6)


def test_a_slower_scan_brings_the_share_through_that_is_needed() -> None:
    """Of three waves, 1/2, 1/3 and 1/6 of the variance: of an amplitude the square."""
    lengths, shares = np.array([4e-3, 2e-3, 1e-3]), np.array([1 / 2, 1 / 3, 1 / 6])
    rms = 1.0
    whole = math.sqrt(2.0) * rms
    for part, expected in ((0.6, 4e-3), (0.75, 2e-3), (0.93, 1e-3)):
        known = device(bandwidth="100 Hz", friction=f"{0.5 * part * whole} N")
        values = {name: datum.value for name, datum in known.data.items()}
        case = LimitCase(values, lengths, np.sqrt(shares), shares, speed=1.0)
        found = classify_perceptibility(case, rms, rms, None)
        assert found.clear_threshold == pytest.approx(part * whole)
        (slower,) = (cure for cure in found.remedies if cure.kind == "slower")
        # part² of the variance lies in waves of that length and more; 100 Hz let them through.
        assert slower.value == pytest.approx(expected * 100.0)


def test_form_is_no_texture() -> None:
    """A bowl of 2 mm over 40 mm with waves of 20 µm: felt as a shape, with little texture."""
    x = np.linspace(0.0, 40e-3, 400)
    bowl = 2e-3 * ((x - 20e-3) / 20e-3) ** 2
    heights = bowl + 20e-6 * np.sin(2 * np.pi * x / 1e-3) + np.zeros((400, 1))
    result = compare(HeightMap(heights, 40e-3 / 399), device(), "A", max_depth=1e-3)
    found = result.row("A").perceptibility
    assert found is not None
    k = result.row("A").recommended_stiffness
    assert found.is_mostly_form
    assert found.nesting_index == 8e-3
    assert found.rms > 0.3 * k * 1e-3 / 3
    assert found.texture_rms == pytest.approx(k * 20e-6 * RMS, rel=0.1)
    assert "of which" in texture_amount_text(found)
    assert "--form 2 and --l-cutoff remove it" in result.recommendation
    assert "L-filter of 8 mm" in " ".join(result.assumptions)


def test_what_was_written_down_has_no_form() -> None:
    assert Sinusoid(1e-3, 20e-3).texture_part().nesting is None


def test_sentences_name_the_masking_source_and_the_remedies() -> None:
    known = device(friction="60 mN", force_resolution="20 mN")
    found = felt(80e-6, known)
    assert masking_text(found, known) == (
        "felt from 85 mN RMS on, for the device's dry friction of 60 mN"
    )
    assert remedies_text(found) == "To feel it, magnify 1.5 times."
    steps = device(force_resolution="20 mN")
    assert "force steps of 20 mN" in masking_text(felt(80e-6, steps), steps)
    assert remedies_text(felt(80e-6, steps)) == (
        "To feel it, magnify 1.3 times, or use a device with force steps below 16 mN."
    )


def test_compare_and_limits_agree() -> None:
    texture = Sinusoid(1e-4, 1e-3)
    for name in ("touch", "inverse3", "pantograph", "falcon"):
        result = compare(texture, name, "ACH")
        for row in result.rows:
            request = limits(texture, name, law=row.law)
            assert request.perceptibility == row.perceptibility
            assert request.surface.stiffness == row.recommended_stiffness


def test_an_imperceptible_law_is_not_recommended() -> None:
    result = compare(Sinusoid(1e-6, 1e-3), "touch")
    assert result.recommended == ""
    sound = [row for row in result.rows if row.conservative and row.continuous]
    assert result.nearest_row is max(sound, key=lambda row: row.resolved_force)
    assert result.recommendation.startswith("Nothing of this texture will be felt")
    assert "magnify" in result.recommendation
    # Limits asks about the law that comes nearest.
    assert limits(Sinusoid(1e-6, 1e-3), "touch").surface.law is result.nearest_row.law


def test_of_equals_one_that_jumps_at_no_depth_is_taken() -> None:
    """Shallower than its focal depth D is as good as C and H; pressed deeper it would click."""
    result = compare(Sinusoid(1e-4, 1.5e-3), "omega.3", "CDH", max_depth=1e-4)
    shown = {row.law.letter: row.resolved_force for row in result.rows}
    assert shown["D"] > 0.8 * max(shown.values())
    assert result.row("D").continuous
    assert result.recommended in {"C", "H"}


def test_a_form_of_rounding_size_counts_as_none() -> None:
    found = felt(1e-4, device(), SHORT)
    known = replace(found, nesting_index=8e-3)
    (text,) = form_removal_sentences(known, 3e-6, 1.8e-21)
    assert text.endswith("L-filter of 8 mm; they take form 3 µm high and no waviness")
    assert form_removal_sentences(replace(found, nesting_index=None), 3e-6, 1e-6) == []
