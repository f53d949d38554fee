"""compare(): rows, limits, verdicts, recommendation and plain data."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import asperity as asp
from asperity.core.errors import ParameterError
from asperity.core.units import format_quantity
from asperity.devices import load_device, override_device, parse_device
from asperity.laws import Law
from asperity.report.pages.comparison_columns import FULL_COLUMNS, SUMMARY_COLUMNS, comparison_table
from asperity.report.pages.comparison_report import comparison_page
from asperity.report.sentences.comparison_sentences import recommended_stiffness_text
from asperity.report.sentences.limit_sentences import force_magnitude_text, press_text
from asperity.report.sentences.passivity_sentences import stiffness_limit_text
from asperity.report.sentences.texts import leak_text as leak_cell
from asperity.report.sentences.texts import limit_text

PAPER = asp.Sinusoid(amplitude=0.8e-3, period=1e-3)


@pytest.fixture(scope="module")
def result() -> asp.Comparison:
    return asp.compare(PAPER, device="omega.3")


def test_rows_are_one_per_law_in_order(result: asp.Comparison) -> None:
    assert "".join(row.law.letter for row in result.rows) == "WABCDEFGH"


def test_stability_limit_without_known_delay_is_k0_over_q(result: asp.Comparison) -> None:
    """Every law has K₀/q, since q⁺ does not limit a loop with delay; D at large depth has zero."""
    for row in result.rows:
        assert row.stability_limit.stiffness == pytest.approx(5000.0 / row.q.value, rel=1e-15)
        basis = "plausible" if row.conservative else "wall gain"
        assert row.stability_limit.basis == (basis if row.stability_limit.stiffness else "none")
    assert result.row("D").stability_limit.stiffness == 0.0


def test_conservative_and_discontinuous_laws_match_table_ii_of_the_paper(
    result: asp.Comparison,
) -> None:
    conservative = "".join(row.law.letter for row in result.rows if row.conservative)
    jumps = "".join(row.law.letter for row in result.rows if not row.continuous)
    assert (conservative, jumps) == ("WCDH", "D")  # law H is not in the paper


def test_texture_force_is_the_ripple_at_the_recommended_stiffness(result: asp.Comparison) -> None:
    row = result.row("A")
    surface = asp.Surface(PAPER, "A", stiffness=row.recommended_stiffness)
    x = (np.arange(5000) + 0.5) / 5000 * 1e-3
    z = np.full(5000, PAPER.amplitude - result.max_depth)
    force = surface.force(np.column_stack([x, 0 * x, z]))
    assert row.texture_force == pytest.approx(math.sqrt(force.var(axis=0).sum()), rel=1e-3)


def test_leak_scales_with_the_stiffness(result: asp.Comparison) -> None:
    row = result.row("A")
    doubled = asp.compare(PAPER, laws="A", stiffness=2.0 * row.recommended_stiffness)
    assert doubled.row("A").leak.energy == pytest.approx(2 * row.leak.energy, rel=1e-12)
    assert doubled.row("A").texture_force == pytest.approx(2 * row.texture_force, rel=1e-12)
    assert doubled.row("A").stability_limit.stiffness == result.row("A").stability_limit.stiffness


def test_verdicts_describe_the_artefacts(result: asp.Comparison) -> None:
    stiff = asp.compare(PAPER, laws="A", stiffness=1000.0)
    assert "may buzz at 1000 N/m" in stiff.row("A").verdict
    assert "buzz at" not in result.row("A").verdict  # each law at its recommended stiffness
    assert "feels alive" in result.row("E").verdict
    assert "clicks" in result.row("D").verdict
    assert (
        result.row("W").verdict
        == "plausible up to 5000 N/m at the delay of the wall test; no texture; at any press"
    )
    assert "; delivers energy below v* = " in result.row("A").verdict


FORBIDDEN_FOR_CURL = ("quiet", "no buzz", "any delay", "stable up to", "stable in", "plausible")


@pytest.mark.parametrize("letter", "ABEFG")
@pytest.mark.parametrize("more", [{}, {"damping": "0.625 N*s/m", "delay_samples": 0}])
def test_no_stiffness_of_a_law_with_curl_is_called_quiet(
    letter: str, more: dict[str, object]
) -> None:
    """Its field delivers energy at any stiffness: v* and power, or what is missing, are printed."""
    rig = parse_device({"max_stiffness": "5 kN/m", "update_rate": "4 kHz", **more}, "mine")
    result = asp.compare(asp.Sinusoid(0.3e-3, 2.3e-3), device=rig, laws=letter)
    row = result.row(letter)
    for text in (row.verdict, result.recommendation, " ".join(page_texts(result))):
        assert not [words for words in FORBIDDEN_FOR_CURL if words in text.lower()]
        assert "delivers energy" in text
    speed = row.passivity.critical_speed
    if more:
        assert speed is not None
        power = format_quantity(0.625 * speed**2 / 4.0, "W")
        expected = f"v* = {format_quantity(speed, 'm/s')}, at most {power}"
    else:
        force = row.leak.absorbing.found
        expected = f"v* = {format_quantity(force, 'N')} / damping (missing)"
    assert expected in row.verdict
    assert expected in result.recommendation


def page_texts(result: asp.Comparison) -> list[str]:
    """Return the cells and notes of the row of a law in the full table."""
    columns = (*SUMMARY_COLUMNS, *FULL_COLUMNS)
    cells = [column.cell(result.rows[0], result) for column in columns]
    return [text for cell in cells for text in (cell.text, cell.note)]


def count_sentences(text: str) -> int:
    return len(re.findall(r"\.(?= [A-Z]|$)", text))


def test_recommends_a_sound_law_that_is_felt(result: asp.Comparison) -> None:
    """Two sentences: law, stiffness, depth, what is felt; what to watch. The rest are reasons."""
    assert result.recommended == "H"
    assert count_sentences(result.recommendation) == 2
    for part in (
        "at any press (texture taken at",
        "RMS is felt.",
        "keeps contact (max_depth='1.6 mm').",
    ):
        assert part in result.recommendation
    reasons = " ".join(result.reasons)
    for part in (
        "gives net energy, and its force does not jump",
        "The stiffest wall known to be stable on this device is 5000 N/m.",
        "simulated loops",
    ):
        assert part in reasons
        assert part not in result.recommendation
    assert "at the delay of the wall test, but not proved; a longer delay" in reasons
    assert result.to_dict()["reasons"] == list(result.reasons)
    assert asp.compare(PAPER, laws="WABCDEFG").recommended == "C"


def test_a_start_that_nobody_can_use_is_none_with_its_reason() -> None:
    """Nothing is felt there, or the dry friction of the device, a trusted number, is larger."""
    rig = {"max_stiffness": "400 N/m", "apparent_mass": "0.6 kg"}
    steep = asp.Sinusoid(amplitude=2e-3, period=0.5e-3)
    faint = asp.compare(steep, parse_device(rig, "mine"), "WC").row("C")
    assert faint.recommended_stiffness > 0.0
    assert recommended_stiffness_text(faint) == "none useful"
    assert "not felt at " in faint.verdict
    wave = asp.Sinusoid(amplitude=0.3e-3, period=2.3e-3)
    free = asp.compare(wave, parse_device(rig, "mine"), "WC")
    assert free.recommended == "C"
    force = free.row("C").press
    assert 0.0 < force < free.row("C").recommended_stiffness * 0.6e-3
    assert not free.row("C").holds_at_any_press
    texts = {}
    for factor in (0.9, 1.1):  # of the greatest force: below it, friction hides nothing
        stiff = {**rig, "friction": f"{factor * force:.6g} N"}
        result = asp.compare(wave, parse_device(stiff, "mine"), "WC")
        texts[factor] = recommended_stiffness_text(result.row("C"))
        assert (result.recommended == "C") == (factor < 1.0)
        assert ("less than the device's friction" in result.row("C").verdict) == (factor > 1.0)
    assert texts == {0.9: limit_text(free.row("C").recommended_stiffness), 1.1: "none useful"}
    assert result.recommendation.startswith("No law is useful on the mine at this depth")
    # A number that is not verified hides nothing, but is something to watch.
    text = asp.compare(wave, "touch", "C", max_depth=1e-4).recommendation
    assert "260 mN (not verified)" in text


def test_recommends_the_smallest_leak_if_no_sound_law_is_felt() -> None:
    steep = asp.Sinusoid(amplitude=2e-3, period=0.5e-3)
    rig = parse_device({"max_stiffness": "400 N/m", "apparent_mass": "0.6 kg"}, "mine")
    result = asp.compare(steep, device=rig, laws="WABCDEFG")
    weak = result.row("C")
    assert weak.tier == "not felt"  # the premise
    assert result.recommended != "C"
    assert "which is not felt" in " ".join(result.reasons)
    assert "is conservative and continuous" in result.recommendation
    chosen = result.row(result.recommended)
    assert chosen.tier != "not felt"
    assert chosen.continuous
    assert not chosen.conservative


def test_no_recommendation_without_a_textured_law() -> None:
    assert asp.compare(PAPER, laws="W").recommended == ""


def test_assumptions_state_every_default(result: asp.Comparison) -> None:
    text = " ".join(result.assumptions)
    for part in (
        "scanning speed 0.1 m/s",
        "max depth 1 mm",
        "friction 0.8",
        "max deflection 1 mm",
        "modulation depth 0.8",
        "K₀ = 5000",
        "update rate",
    ):
        assert part in text
    explicit = asp.compare(PAPER, laws="F", stiffness=500.0, max_depth=1e-4, friction=0.5)
    text = " ".join(explicit.assumptions)
    assert "Default max depth" not in text
    assert "Default friction" not in text
    assert "Default modulation depth" in text


@pytest.mark.parametrize("rate", ["50 Hz", "300 Hz", "20 kHz"])
def test_answer_names_the_update_rate_for_which_it_holds(rate: str) -> None:
    device = override_device(load_device("falcon"), {"update_rate": rate})
    slow = asp.compare(PAPER, device, "WC")
    usual = asp.compare(PAPER, "falcon", "WC")
    hertz = device.value("update_rate") or 0.0
    for row, other in zip(slow.rows, usual.rows, strict=True):
        expected = other.recommended_stiffness * min(1.0, hertz / 1000.0)
        assert row.recommended_stiffness == pytest.approx(expected, rel=5e-3)
        assert row.stability_limit.update_rate == min(hertz, 1000.0)
    text = "; ".join(slow.assumptions)
    assert "K₀ = 3000 N/m at 1 kHz" in text
    assert "assumed: CHAI3D states no update rate" in text
    least = format_quantity(min(hertz, 1000.0), "Hz")
    assert f"for a loop of {least} or faster" in text


def test_a_texture_that_the_loop_samples_too_coarsely_is_not_of_no_force() -> None:
    slow = override_device(load_device("falcon"), {"update_rate": "300 Hz"})
    result = asp.compare("sinusoid:amplitude=0.4mm,period=1.5mm", slow, "C")
    assert (result["C"].tier, result["C"].resolved_force) == ("borderline", 0.0)
    assert "its texture of 80 mN RMS, sampled too coarsely, is borderline" in result.recommendation
    fast = asp.compare("sinusoid:amplitude=0.4mm,period=1.5mm", "falcon", "C")
    assert "its texture of 270 mN RMS is felt" in fast.recommendation


def test_a_leak_that_cannot_be_computed_is_a_dash_and_refuses_no_law(tmp_path: Path) -> None:
    heights = 2e-3 * np.random.default_rng(3).random(1500)
    result = asp.compare(asp.Profile(heights, 1e-6, periodic=True), "touch", "WB")
    row = result["B"]
    assert math.isnan(row.leak.energy)
    assert row.table_row()["leak [J]"] is None
    assert json.loads(json.dumps(row.to_dict(), allow_nan=False))["leak"]["energy"] is None
    assert "too steep" in row.leak.description
    assert "unknown energy" in row.verdict
    assert leak_cell(row.leak) == "–"
    assert row.passivity.verdict == "undecided"
    assert result["W"].leak.energy == 0.0
    surface = asp.Surface(result.texture, "B", stiffness=0.01)
    (header, *_others) = asp.export_code(surface, tmp_path / "texture.h")
    assert "an unknown energy (the surface is too steep" in header.read_text()


def test_risk_is_the_users(result: asp.Comparison) -> None:
    risky = asp.compare(PAPER, device="omega.3", laws="WGH", risk="5%")
    assert (result.risk, risky.risk, risky.to_dict()["risk"]) == (0.01, 0.05, 0.05)
    for letter, ratio in (("W", 1.0), ("G", 0.3 / 0.05), ("H", 0.7 / 0.5)):
        starts = [one[letter].recommended_stiffness for one in (result, risky)]
        assert starts[1] == pytest.approx(ratio * starts[0], rel=1e-2)
        assert risky[letter].stability_limit == result[letter].stability_limit
    assert "8.5 % do at 5000 N/m itself" in " ".join(risky.reasons)
    with pytest.raises(ParameterError, match="risk must be 1% or 5%"):
        asp.compare(PAPER, risk="3%")


def test_to_dict_is_json_without_nan(result: asp.Comparison) -> None:
    text = json.dumps(result.to_dict(), allow_nan=False)
    data = json.loads(text)
    assert data["schema"] == 4
    god_object = data["laws"][4]
    assert god_object["law"] == "D"
    assert god_object["q"]["value"] == "inf"
    assert data["laws"][1]["q"]["value"] == pytest.approx(5.125054855, abs=1e-8)


def test_user_defined_law_has_a_row() -> None:
    stiffening = Law(
        "S",
        "stiffening",
        "vertical",
        lambda c: c.k * c.depth**3 / c.parameter("reference") ** 2 * c.w,
        parameters={"reference": 0.3e-3},
    )
    gentle = asp.Sinusoid(amplitude=0.1e-3, period=2e-3)
    row = asp.compare(gentle, laws=["C", stiffening], max_depth=0.3e-3).row("S")
    assert row.conservative
    assert row.q.method == "certified"
    # ‖J‖ at full depth by hand on a grid of phases.
    x = np.linspace(0, 2e-3, 4001)
    d = gentle.derivatives(np.column_stack([x, 0 * x]))
    depth = 0.3e-3
    xx = (3 * d[:, 1] ** 2 + depth * d[:, 3]) * depth**2 / 0.3e-3**2
    xz, zz = -3 * d[:, 1] * depth**2 / 0.3e-3**2, 3 * depth**2 / 0.3e-3**2
    matrices = np.stack([np.stack([xx, xz], -1), np.stack([xz, np.full_like(xz, zz)], -1)], -2)
    assert row.q.value == pytest.approx(np.linalg.norm(matrices, 2, axis=(1, 2)).max(), rel=1e-6)


def test_measured_profile_and_map_have_finite_rows() -> None:
    rng = np.random.default_rng(4)
    for texture in (
        asp.Profile(1e-5 * rng.normal(size=40), 1e-4),
        asp.HeightMap(1e-5 * rng.normal(size=(12, 15)), 1e-4),
    ):
        result = asp.compare(texture, laws="ABCEG", max_depth=2e-5)
        for row in result.rows:
            assert math.isfinite(row.q.value)
            assert row.q.value >= 1.0 - 1e-12
            assert row.leak.energy >= 0.0


@pytest.mark.parametrize(
    ("stiffness", "text"),
    [(975.69, "975 N/m"), (5000.0, "5000 N/m"), (0.8793, "0.879 N/m"), (12_345.0, "12300 N/m")],
)
def test_limits_are_rounded_down(stiffness: float, text: str) -> None:
    assert limit_text(stiffness) == text


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        ({"stiffness": -1.0}, "stiffness"),
        ({"stiffness": math.nan}, "stiffness"),
        ({"max_depth": 0.0}, "max_depth"),
        ({"laws": "WX"}, "law"),
        ({"laws": "WW"}, "laws"),
        ({"laws": ""}, "laws"),
        ({"device": "omega3"}, "device"),
        ({"modulation_depth": 1.5}, "modulation_depth"),
        ({"friction": -0.1}, "friction"),
        ({"max_deflection": math.inf}, "max_deflection"),
    ],
)
def test_error_names_the_invalid_argument(arguments: dict[str, object], name: str) -> None:
    with pytest.raises(ParameterError) as caught:
        asp.compare(PAPER, **arguments)
    assert caught.value.argument == name


def test_device_without_max_stiffness_raises() -> None:
    with pytest.raises(ParameterError, match="max_stiffness"):
        asp.compare(PAPER, device=parse_device({"max_force": "3 N"}, "mine"))


# --- an answer at the given stiffness, size and contact ------------------------------------------


def test_all_numbers_of_a_row_are_at_the_given_stiffness() -> None:
    result = asp.compare(PAPER, laws="CH", stiffness=400.0)
    for row in result.rows:
        assert row.surface.stiffness == 400.0
        assert row.texture_force == pytest.approx(400.0 * row.ripple)
        assert row.perceptibility is not None
        assert row.perceptibility.texture_rms == pytest.approx(row.texture_force)
    best = result.recommended_row
    assert best is not None
    start = f"{stiffness_limit_text(best.recommended_stiffness)} for a loop of 1 kHz or faster"
    assert result.recommendation.startswith(
        f"At 400 N/m use law {best.law.letter} ({best.law.name.replace('-', ' ')}) on the Force "
        f"Dimension omega.3 (recommended is a start at {start}), {press_text(best)}: its "
        f"texture of {force_magnitude_text(best.resolved_force)} RMS is felt."
    )
    headings = [str(column.header) for column in comparison_table(result, 120).columns]
    assert "at" in headings
    assert "start at" not in headings


def test_a_law_above_its_limit_is_not_recommended() -> None:
    result = asp.compare(PAPER, laws="BC", stiffness=3000.0)
    assert all(row.may_buzz for row in result.rows)
    assert result.recommended == ""
    assert "is known to be stable at 3000 N/m" in result.recommendation
    assert "can start at" in result.recommendation


def answer_text(result: asp.Comparison) -> str:
    """Return the answer and its reasons."""
    return " ".join([result.recommendation, *result.reasons])


def test_a_surface_larger_than_the_workspace_is_named() -> None:
    x = np.linspace(0.0, 0.5, 1001)
    wide = asp.Profile(2e-4 * np.sin(2 * np.pi * x / 2e-3), 0.5 / 1000)
    rig = parse_device({"max_stiffness": "1000 N/m", "workspace_radius": "50 mm"}, "mine")
    text = answer_text(asp.compare(wide, rig, "C"))
    assert "The surface is 500 mm long and the workspace 100 mm" in text
    assert "magnified 0.2 times more" in text
    tube = {"workspace_diameter": "120 mm", "workspace_length": "30 mm"}
    text = answer_text(
        asp.compare(wide, parse_device({"max_stiffness": "1000 N/m", **tube}, "mine"), "C")
    )
    assert "The surface is 500 mm long and the workspace 120 mm" in text
    narrow = asp.Profile(2e-4 * np.sin(2 * np.pi * x[:161] / 2e-3), 0.5 / 1000)
    assert "and the workspace" not in answer_text(asp.compare(narrow, rig, "C"))
    text = answer_text(asp.compare(asp.Sinusoid(2e-3, 0.2), rig, "C"))
    assert "A period is 200 mm long and the workspace 100 mm" in text
    assert "and the workspace" not in answer_text(asp.compare(asp.Sinusoid(2e-3, 0.09), rig, "C"))
    # A sum that never repeats has no end either.
    endless = asp.Fourier([1e-4, 6e-5], [[628.0, 0.0], [628.0 * 2**0.5, 0.0]], [0.3, 1.1])
    assert "and the workspace" not in answer_text(asp.compare(endless, rig, "C"))


def test_loss_of_contact_names_the_depth_that_keeps_it() -> None:
    wave = asp.Sinusoid(4e-4, 2e-3)
    lost = asp.compare(wave, "omega.3", "C", max_depth=3e-4)
    assert lost.rows[0].loses_contact
    assert "pressed to 0.8 mm it keeps contact (max_depth='0.8 mm')" in lost.recommendation
    assert not asp.compare(wave, "omega.3", "C", max_depth=8e-4).rows[0].loses_contact


def test_answer_says_how_much_calibrating_gains() -> None:
    """For law H twice: K₀ along the lightest direction needs no margin; for A nothing."""
    texture = asp.Sinusoid(amplitude=0.3e-3, period=2.3e-3)
    rig = {"max_stiffness": "2000 N/m", "update_rate": "1 kHz"}
    calibrated = {**rig, "max_stiffness": {"value": 2000.0, "lightest": 1.0}}
    before, after = (
        asp.compare(texture, parse_device(one, "mine"), "H") for one in (rig, calibrated)
    )
    assert "the factor is 1: up to 2 times stiffer." in answer_text(before)
    ratio = after.row("H").recommended_stiffness / before.row("H").recommended_stiffness
    assert ratio == pytest.approx(2.0, rel=1e-2)
    assert "calibrated" not in answer_text(after)
    assert "calibrated" not in answer_text(asp.compare(texture, parse_device(rig, "mine"), "A"))


def test_quantities_may_be_texts_and_rows_are_found_by_letter() -> None:
    wave = {"amplitude": "0.2mm", "period": "2 mm"}
    texture = asp.Sinusoid(**wave)  # type: ignore[arg-type]  # texts are accepted, not declared
    assert texture.describe() == asp.Sinusoid(0.2e-3, 2e-3).describe()
    texts: dict[str, Any] = {"stiffness": "0.5N/mm", "max_depth": "0.3mm", "speed": "5cm/s"}
    result = asp.compare(texture, "touch", "CH", **texts)
    numbers = asp.compare(texture, "touch", "CH", stiffness=500.0, max_depth=3e-4, speed=0.05)
    assert result.to_dict() == numbers.to_dict()
    assert result["C"] is result.rows[0]
    assert float(result["C"].q) == result["C"].q.upper > 1.0
    with pytest.raises(KeyError):
        result["A"]
    with pytest.raises(asp.ParameterError, match="stiffness needs a unit: write 500N/m"):
        asp.Surface(texture, "C", "500")  # type: ignore[arg-type]  # as above
    with pytest.raises(asp.ParameterError, match="unit is of another dimension"):
        asp.Surface(texture, "C", "5mm")  # type: ignore[arg-type]  # as above


def test_a_stiffness_has_one_spelling_everywhere() -> None:
    """A given one as typed; a leak in the table as in the verdict."""
    result = asp.compare(asp.Sinusoid(0.2e-3, 2e-3), "touch", "AC", stiffness=219.7)
    page = comparison_page(result)
    cells = [str(cell) for cell in comparison_table(result, 80).columns[1].cells]
    assert cells == ["219.7 N/m"] * 2
    texts = " ".join([page.answer, *result.reasons, *(row.verdict for row in result.rows)])
    texts += " ".join([value for _name, value in page.facts])
    assert "219.7 N/m" in texts
    assert not re.findall(r"\b2(?:19|20) N/m", texts)
    leak = leak_cell(result["A"].leak)
    assert f"gains up to {leak}" in result["A"].verdict
