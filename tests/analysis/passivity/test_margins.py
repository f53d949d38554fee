"""The safety margins equal those of the simulated onsets of cycling."""

from __future__ import annotations

import pytest
from bench.margins import (
    LOOPS,
    SURFACES,
    lightest_direction_ratio,
    make_case,
    ratio_to_wall,
    round_down_factor,
    wall_onset,
)

from asperity.analysis.passivity.verdict import (
    NO_MARGIN,
    StabilityLimit,
    load_margins,
    safety_margin,
)
from asperity.devices import parse_device
from asperity.laws import LAWS, Law, find_law
from asperity.surface import Surface
from asperity.textures import Sinusoid

PLAUSIBLE = StabilityLimit(1000.0, "plausible", "wall test")


@pytest.mark.parametrize("letter", ["E", "H"])
def test_binding_loop_reproduces_the_safety_factor(letter: str) -> None:
    """``python -m bench.margins`` writes the table; this test repeats the binding cases."""
    margin = load_margins()[find_law(letter)]
    case = make_case(margin.loop, margin.surface)
    ratio = ratio_to_wall(case.with_law(letter), margin.delay, wall_onset(case, margin.delay))
    assert round_down_factor(ratio) == margin.factor


def test_every_textured_law_has_a_safety_factor() -> None:
    for along in (False, True):
        margins = load_margins(along_lightest=along)
        assert {law.letter for law in margins} == set(LAWS) - {"W"}
        for margin in margins.values():
            assert 0.0 < margin.factor <= 1.0
            assert margin.loop in LOOPS
            assert margin.surface in SURFACES


def test_known_lightest_direction_allows_a_larger_factor() -> None:
    surface = Surface(Sinusoid(1e-4, 1e-3), "H")
    unknown = parse_device({"max_stiffness": "1 kN/m"}, "blind")
    measured = parse_device({"max_stiffness": {"value": 1000.0, "lightest": 0.7}}, "seen")
    assert safety_margin(surface, unknown, PLAUSIBLE) == load_margins()[surface.law]
    assert (
        safety_margin(surface, measured, PLAUSIBLE)
        == load_margins(along_lightest=True)[surface.law]
    )
    assert (
        safety_margin(surface, measured, PLAUSIBLE).factor
        > safety_margin(surface, unknown, PLAUSIBLE).factor
    )
    assert lightest_direction_ratio("pantograph at (37.5, 100) mm, held") == pytest.approx(
        0.655, abs=1e-3
    )


def test_margins_of_proved_limits_the_wall_and_user_defined_laws() -> None:
    device = parse_device({"max_stiffness": "1 kN/m"}, "mine")
    texture = Sinusoid(1e-4, 1e-3)
    proved = StabilityLimit(1000.0, "proved", "delay", proved_stiffness=1000.0)
    assert safety_margin(Surface(texture, "H"), device, proved) == NO_MARGIN
    assert safety_margin(Surface(texture, "W"), device, PLAUSIBLE) == NO_MARGIN
    user_law = Law("V", "own", "vertical", lambda c: c.k * c.depth * c.w)
    least = min(one.factor for one in load_margins().values())
    assert safety_margin(Surface(texture, user_law), device, PLAUSIBLE).factor == least
