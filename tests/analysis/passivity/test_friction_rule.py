"""The rules of passivity with friction: k (q⁺/2 + d q) + (3d + 1)/2 κ, exact and in closed form."""

from __future__ import annotations

import math

import pytest

from asperity.analysis import characteristic_number, one_sided_number
from asperity.analysis.energy.closed_loops import energy_balance
from asperity.analysis.energy.leak import worst_loop
from asperity.analysis.energy.straight_scan import friction_scan
from asperity.analysis.passivity import criteria
from asperity.analysis.passivity.verdict import Passivity, passivity
from asperity.analysis.results.analyze import analyze
from asperity.analysis.results.compare import compare
from asperity.devices import Device, parse_device
from asperity.report.sentences.analysis_text import bound_notes
from asperity.surface import Surface
from asperity.textures import Sinusoid

WAVE = Sinusoid(amplitude=1e-4, period=1e-3)
# σ₀/T = 8000 N/m
DAMPED = {"damping": "2 N*s/m", "update_rate": "4 kHz"}


def rig(delay: int = 0, **fields: str) -> Device:
    return parse_device({**DAMPED, "delay_samples": delay, **fields}, "mine")


def judge(surface: Surface, device: Device) -> Passivity:
    numbers = characteristic_number(surface), one_sided_number(surface)
    return passivity(surface, device, *numbers, worst_loop(surface))


@pytest.mark.parametrize("delay", [0, 1, 3, 6])
def test_delay_rule_adds_the_presliding_stiffness(delay: int) -> None:
    """Law H has q = q⁺ = 1; the default is κ = k/4."""
    weight = (3 * delay + 1) / 2
    share = judge(Surface(WAVE, "H", friction=0.4), rig(delay))
    limit = share.evaluated[criteria.DELAY].limit
    assert limit == pytest.approx(8000.0 / (0.5 + delay + weight / 4), rel=1e-12)
    fixed = judge(Surface(WAVE, "H", friction=0.4, presliding_stiffness=300.0), rig(delay))
    limit = fixed.evaluated[criteria.DELAY].limit
    assert limit == pytest.approx((8000.0 - weight * 300.0) / (0.5 + delay), rel=1e-12)
    assert "+ (3d + 1)/2 κ <=" in fixed.evaluated[criteria.DELAY].formula


@pytest.mark.parametrize("delay", [0, 1, 6])
def test_friction_of_a_smooth_wall_is_free_up_to_two_thirds(delay: int) -> None:
    plain = judge(Surface(WAVE, "W"), rig(delay)).stability_limit.stiffness
    assert plain == pytest.approx(8000.0 / (0.5 + delay))
    assert judge(Surface(WAVE, "W", friction=0.9), rig(delay)).stability_limit.stiffness == plain
    weight = (3 * delay + 1) / 2
    at_most = {"friction": 0.9, "presliding_stiffness": 8000.0 / weight * (1 - 1e-9)}
    assert judge(Surface(WAVE, "W", **at_most), rig(delay)).stability_limit.stiffness == plain  # type: ignore[arg-type]  # by name
    above = {"friction": 0.9, "presliding_stiffness": 8000.0 / weight * (1 + 1e-9)}
    assert not judge(Surface(WAVE, "W", **above), rig(delay)).stability_limit.stiffness  # type: ignore[arg-type]  # by name


def test_greatest_delay_counts_friction() -> None:
    for law, kappa in (("H", 250.0), ("W", 2000.0 / 3.0), ("H", 0.0)):
        surface = Surface(WAVE, law, friction=0.4 if kappa else 0.0)
        greatest = judge(surface, rig(0)).greatest_delay
        assert greatest is not None
        for delay, holds in ((greatest, True), (greatest + 1, False)):
            wall = 1000.0 * (0.5 + delay)
            slide = kappa * (3 * delay + 1) / 2
            total = max(wall, slide) if law == "W" else wall + slide
            assert (total <= 8000.0) is holds


@pytest.mark.parametrize(("delay", "factor"), [(0, 1.0), (2, 4.0)])
def test_steps_of_position_count_with_the_presliding_stiffness(delay: int, factor: float) -> None:
    """φ = k q ε + 2 κ ε, 8 κ ε with delay; ε is half of √3 steps."""
    device = rig(delay, position_resolution="10 um", least_friction="20 mN")
    surface = Surface(WAVE, "H", friction=0.4, presliding_stiffness=200.0)
    step = math.sqrt(3.0) * 1e-5
    limit = judge(surface, device).evaluated[criteria.QUANTIZATION].limit
    assert limit == pytest.approx(max(20e-3 - factor * step * 200.0, 0.0) / (step / 2), rel=1e-9)
    plain = judge(surface.without_friction(), device).evaluated[criteria.QUANTIZATION].limit
    assert plain == pytest.approx(20e-3 / (step / 2), rel=1e-9)
    buzz = judge(surface.to_stiffness(1000.0), device).buzz
    weight = (3 * delay + 1) / 2
    margin = 8000.0 - 1000.0 * (0.5 + delay) - weight * 200.0
    excess = 1000.0 * step / 2 + factor * step * 200.0 - 20e-3
    assert buzz is not None
    assert buzz.speed == pytest.approx(max(excess, 0.0) * 4000.0 / margin, rel=1e-9)


def test_papers_criterion_counts_the_slope_of_the_slip_limit() -> None:
    surface = Surface(WAVE, "W", friction=0.4, friction_modulation=0.5, presliding_stiffness=100.0)
    slope = 0.4 * (1.0 + 0.5 * 0.5 * 2.0 * math.pi * 1e-4 / 1e-3 * surface.max_depth / 1e-4)
    limit = judge(surface, rig()).evaluated[criteria.PAPER].limit
    assert limit == pytest.approx((8000.0 - 200.0) / (2.0 + 2.0 * slope), rel=1e-6)


def test_presliding_stiffness_above_what_the_device_allows_is_said() -> None:
    surface = Surface(WAVE, "H", friction=0.4, presliding_stiffness=20_000.0)
    words = "the presliding stiffness, 20000 N/m, is more than the device allows"
    for device in (rig(0), "omega.3"):
        result = analyze(surface, device)
        assert words in result.passivity.criterion(result.passivity.decided_by).conclusion
        assert not result.passivity.stability_limit.stiffness


def test_verdict_and_starts_follow() -> None:
    assert energy_balance(Surface(WAVE, "H")) == "conservative"
    result = analyze(Surface(WAVE, "H", friction=0.4), "omega.3")
    data = result.to_dict()
    assert (data["energy_balance"], data["friction"]["coefficient"]) == ("dissipative", 0.4)
    assert "dissipative: friction takes energy" in bound_notes(result)[-1]
    rows = compare(WAVE, "omega.3", "HWFA", friction=0.4)
    balances = [row.energy_balance for row in rows.rows]
    assert balances == ["dissipative", "dissipative", "leaking", "leaking"]
    assert "H (split god object) with friction 0.4" in rows.recommendation
    plain = compare(WAVE, "omega.3", "HWFA")
    ratios = [
        with_friction.recommended_stiffness / without.recommended_stiffness
        for with_friction, without in zip(rows.rows, plain.rows, strict=True)
    ]
    assert ratios == pytest.approx([8.0 / 11.0, 1.0, ratios[2], 1.0], rel=5e-3)
    assert "law W with friction 0.36 and friction modulation 0.889" in str(rows.assumptions)
    assert "law W with friction 0.72 and friction modulation 0.889" in str(plain.assumptions)


def test_friction_on_a_scan_is_stated_with_what_the_presliding_stiffness_keeps() -> None:
    """Law W at 0.2 mm: κ of half the slope of the limit keeps 0.79 of its oscillation."""
    slope = 0.4 * 1000.0 * 2e-4 * 0.5 * 2.0 * math.pi / 1e-3
    options = {"friction": 0.4, "friction_modulation": 1.0, "presliding_stiffness": slope / 2.0}
    scan = friction_scan(Surface(WAVE, "W", 1000.0, 2e-4, **options))  # type: ignore[arg-type]  # by name
    assert scan is not None
    assert 0.03 < scan.mean < 0.04  # a spring that is too soft does not reach the limit everywhere
    assert scan.remaining == pytest.approx(0.79, abs=0.01)
    assert friction_scan(Surface(WAVE, "W")) is None
    row = compare(WAVE, "omega.3", "W", friction=0.4).row("W")
    assert row.to_dict()["friction_force"]["remaining"] == 1.0
    assert "constant friction of 400 mN" in row.verdict
