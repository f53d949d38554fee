"""The shares at which to begin are those that the simulated onsets gave."""

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
def test_the_binding_loop_gives_the_share(letter: str) -> None:
    """``python -m bench.margins`` writes the table; here its least cases are simulated again."""
    known = load_margins()[find_law(letter)]
    case = make_case(known.loop, known.surface)
    ratio = ratio_to_wall(case.with_law(letter), known.delay, wall_onset(case, known.delay))
    assert round_down_factor(ratio) == known.factor


def test_every_law_that_feels_the_texture_has_a_share() -> None:
    for along in (False, True):
        known = load_margins(along_lightest=along)
        assert {law.letter for law in known} == set(LAWS) - {"W"}
        for one in known.values():
            assert 0.0 < one.factor <= 1.0
            assert one.loop in LOOPS
            assert one.surface in SURFACES


def test_where_the_lightest_direction_is_known_less_is_taken_off() -> None:
    surface = Surface(Sinusoid(1e-4, 1e-3), "H")
    blind = parse_device({"max_stiffness": "1 kN/m"}, "blind")
    seen = parse_device({"max_stiffness": {"value": 1000.0, "lightest": 0.7}}, "seen")
    assert safety_margin(surface, blind, PLAUSIBLE) == load_margins()[surface.law]
    assert safety_margin(surface, seen, PLAUSIBLE) == load_margins(along_lightest=True)[surface.law]
    assert (
        safety_margin(surface, seen, PLAUSIBLE).factor
        > safety_margin(surface, blind, PLAUSIBLE).factor
    )
    assert lightest_direction_ratio("pantograph at (37.5, 100) mm, held") == pytest.approx(
        0.655, abs=1e-3
    )


def test_nothing_is_taken_off_a_proof_or_the_wall_and_most_off_an_unknown_law() -> None:
    device = parse_device({"max_stiffness": "1 kN/m"}, "mine")
    texture = Sinusoid(1e-4, 1e-3)
    proved = StabilityLimit(1000.0, "proved", "delay", proved_stiffness=1000.0)
    assert safety_margin(Surface(texture, "H"), device, proved) == NO_MARGIN
    assert safety_margin(Surface(texture, "W"), device, PLAUSIBLE) == NO_MARGIN
    own = Law("V", "own", "vertical", lambda c: c.k * c.depth * c.w)
    least = min(one.factor for one in load_margins().values())
    assert safety_margin(Surface(texture, own), device, PLAUSIBLE).factor == least
