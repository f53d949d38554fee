"""The start where damping and delay are known: chosen for a bound of the buzz."""

from __future__ import annotations

import pytest

import asperity as asp
from asperity.analysis import characteristic_number, one_sided_number, worst_loop
from asperity.analysis.passivity.device_loop import BUZZ_SPEED, buzz_limited_stiffness
from asperity.analysis.passivity.verdict import Passivity, passivity
from asperity.devices import load_device, parse_device
from asperity.devices.device_file import override_device
from asperity.surface import Surface

TEXTURE = asp.Sinusoid(0.3e-3, 2.3e-3)
RIG = {
    "damping": "0.625 N*s/m",
    "delay_samples": 0,
    "update_rate": "4 kHz",
    "max_stiffness": "5 kN/m",
    "position_resolution": "10 um",
}


def assess(law: str, stiffness: float, **changes: object) -> Passivity:
    surface = Surface(TEXTURE, law, stiffness, 0.6e-3)
    numbers = characteristic_number(surface), one_sided_number(surface)
    device = parse_device({**RIG, **changes}, "rig")
    return passivity(surface, device, *numbers, worst_loop(surface))


@pytest.mark.parametrize("law", "CHW")
def test_omega_with_known_damping_starts_where_the_buzz_is_bounded_by_10_mm_per_s(law: str) -> None:
    """It started law C at 2600 N/m with a bound of 1.06 m/s; half of that has 69 mm/s."""
    omega = override_device(load_device("omega.3"), {"damping": "0.625 N*s/m", "delay_samples": 0})
    row = asp.compare(TEXTURE, device=omega, laws=law).row(law)
    assert row.passivity.verdict == "bounded"
    assert row.stability_limit.basis == "bounded"
    assert row.passivity.buzz is not None
    assert 0.97 * BUZZ_SPEED < row.passivity.buzz.speed <= BUZZ_SPEED
    assert row.recommended_stiffness <= (row.stability_limit.stiffness or 0.0) < 1300.0


def test_start_is_chosen_for_the_speed_that_the_user_sets() -> None:
    changes = {"damping": "0.625 N*s/m", "delay_samples": 0, "max_buzz": "50 mm/s"}
    result = asp.compare(TEXTURE, device=override_device(load_device("omega.3"), changes), laws="C")
    buzz = result.row("C").passivity.buzz
    assert buzz is not None
    assert 0.97 * 0.05 < buzz.speed <= 0.05
    assert "within the 50 mm/s for which starts are chosen" in result.recommendation


@pytest.mark.parametrize("law", "CH")
@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"delay_samples": 2},
        {"force_resolution": "0.01 mN"},
        {"virtual_damping": "0.02 N*s/m"},
        {"least_friction": "1 mN"},
    ],
)
def test_bound_at_the_limit_is_the_speed_asked_for(law: str, changes: dict[str, object]) -> None:
    loop = assess(law, 100.0, **changes).loop
    for speed in (BUZZ_SPEED, 0.1):
        limit = buzz_limited_stiffness(loop, speed)
        assert limit is not None
        below, above = (assess(law, limit * by, **changes).buzz for by in (1.0, 1.001))
        assert below is not None
        assert below.speed <= speed
        assert below.speed == pytest.approx(speed, rel=1e-9)
        assert above is not None
        assert above.speed > speed


def test_start_is_that_of_the_formula_by_hand() -> None:
    """φ = k q |δ|/2 + |b|/2 - f_c, m = (2 σ₀ - k q⁺)/(2 T) without delay: law C, all terms."""
    changes = {"force_resolution": "2 mN", "least_friction": "1.2 mN"}
    result = assess("C", 100.0, **changes)
    q, one_sided = result.loop.q.upper, result.loop.one_sided.upper
    rate, step, force = 4000.0, 3.0**0.5 * 10e-6 / 2.0, 3.0**0.5 * 2e-3 / 2.0 - 1.2e-3
    budget = 0.625 * rate
    expected = (BUZZ_SPEED * budget - force * rate) / (
        q * step * rate + BUZZ_SPEED * 0.5 * one_sided
    )
    assert force > 0.0
    assert result.stability_limit.stiffness == pytest.approx(expected, rel=1e-9)
    assert result.stability_limit.proved_stiffness == 0.0


def test_device_that_feeds_more_than_it_damps_has_no_bound() -> None:
    fed = {"virtual_damping": "0.625 N*s/m"}
    assert buzz_limited_stiffness(assess("C", 100.0, **fed).loop) is None


def test_limit_without_steps_or_with_friction_is_the_proof() -> None:
    exact = assess("H", 100.0, position_resolution="1e-15 m")
    assert exact.stability_limit.stiffness == pytest.approx(5000.0, rel=1e-6)
    rough = assess("H", 100.0, least_friction="1 N").stability_limit
    assert (rough.basis, rough.stiffness) == ("proved", 5000.0)


def test_steps_of_force_that_exceed_the_bound_alone_are_bounded_by_twice_what_they_cause() -> None:
    """At any stiffness they cause c/(T G), c = |b|/2 and G = 2 σ₀/T; the start continues in b."""
    limits = []
    for force in (0.5, 1.0, 1.04, 1.05, 1.1, 2.0, 50.0, 1e5):
        passivity_ = assess("H", 100.0, force_resolution=f"{force} mN")
        limit = passivity_.stability_limit
        assert limit.basis == "bounded"
        assert limit.stiffness is not None
        limits.append(limit.stiffness)
        buzz = assess("H", limit.stiffness, force_resolution=f"{force} mN").buzz
        assert buzz is not None
        alone = 3.0**0.5 * 0.5e-3 * force * 4000.0 / (0.625 * 4000.0)
        assert buzz.speed == pytest.approx(max(BUZZ_SPEED, 2.0 * alone), rel=1e-9)
    assert min(limits) > 50.0
    assert limits[-1] == pytest.approx(2500.0, rel=1e-3)  # half of the delay rule
    # Virtual damping of steps of position does not grow with the stiffness either.
    virtual = {"virtual_damping": "0.05 N*s/m"}
    limit = assess("H", 100.0, **virtual).stability_limit.stiffness
    assert limit is not None
    buzz = assess("H", limit, **virtual).buzz
    alone = 3.0**0.5 * 10e-6 * 0.05 * 4000.0**2 / ((0.625 - 0.05) * 4000.0)
    assert buzz is not None
    assert buzz.speed == pytest.approx(2.0 * alone, rel=1e-9)
    omega = override_device(
        load_device("omega.3"),
        {"damping": "0.625 N*s/m", "delay_samples": 0, "force_resolution": "30 mN"},
    )
    text = asp.compare(TEXTURE, device=omega, laws="H").recommendation
    assert ", more than the 10 mm/s for which starts are chosen." in text


def test_law_with_ridges_in_reach_and_unknown_damping_have_no_bound() -> None:
    deep = Surface(asp.Sinusoid(0.8e-3, 1e-3), "D", max_depth=1e-3)
    numbers = characteristic_number(deep), one_sided_number(deep)
    late = parse_device({**RIG, "delay_samples": 1}, "late")
    assert buzz_limited_stiffness(passivity(deep, late, *numbers, worst_loop(deep)).loop) is None
    unknown = {name: value for name, value in RIG.items() if name != "damping"}
    loop = passivity(deep, parse_device(unknown, "x"), *numbers, worst_loop(deep)).loop
    assert buzz_limited_stiffness(loop) is None
