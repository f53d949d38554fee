"""The shares at which to begin are those that the simulated onsets gave."""

from __future__ import annotations

import pytest
from bench.margins import LOOPS, SURFACES, factor, lightest, ratio_to_wall, setup, wall_onset

from asperity.analysis.passivity.judgement import Allowed
from asperity.analysis.passivity.margin import NO_MARGIN, margin, margins
from asperity.devices import parse_device
from asperity.laws import LAWS, Law, find_law
from asperity.surface import Surface
from asperity.textures import Sinusoid

PLAUSIBLE = Allowed(1000.0, "plausible", "wall test")


@pytest.mark.parametrize("letter", ["E", "H"])
def test_the_binding_loop_gives_the_share(letter: str) -> None:
    """``python -m bench.margins`` writes the table; here its least cases are simulated again."""
    known = margins()[find_law(letter)]
    case = setup(known.loop, known.surface)
    ratio = ratio_to_wall(case.with_law(letter), known.delay, wall_onset(case, known.delay))
    assert factor(ratio) == known.factor


def test_every_law_that_feels_the_texture_has_a_share() -> None:
    for along in (False, True):
        known = margins(along_lightest=along)
        assert {law.letter for law in known} == set(LAWS) - {"W"}
        for one in known.values():
            assert 0.0 < one.factor <= 1.0
            assert one.loop in LOOPS
            assert one.surface in SURFACES


def test_where_the_lightest_direction_is_known_less_is_taken_off() -> None:
    surface = Surface(Sinusoid(1e-4, 1e-3), "H")
    blind = parse_device({"max_stiffness": "1 kN/m"}, "blind")
    seen = parse_device({"max_stiffness": {"value": 1000.0, "lightest": 0.7}}, "seen")
    assert margin(surface, blind, PLAUSIBLE) == margins()[surface.law]
    assert margin(surface, seen, PLAUSIBLE) == margins(along_lightest=True)[surface.law]
    assert margin(surface, seen, PLAUSIBLE).factor > margin(surface, blind, PLAUSIBLE).factor
    assert lightest("pantograph at (37.5, 100) mm, held") == pytest.approx(0.655, abs=1e-3)


def test_nothing_is_taken_off_a_proof_or_the_wall_and_most_off_an_unknown_law() -> None:
    device = parse_device({"max_stiffness": "1 kN/m"}, "mine")
    texture = Sinusoid(1e-4, 1e-3)
    proved = Allowed(1000.0, "proved", "delay", proved=1000.0)
    assert margin(Surface(texture, "H"), device, proved) == NO_MARGIN
    assert margin(Surface(texture, "W"), device, PLAUSIBLE) == NO_MARGIN
    own = Law("V", "own", "vertical", lambda c: c.k * c.depth * c.w)
    least = min(one.factor for one in margins().values())
    assert margin(Surface(texture, own), device, PLAUSIBLE).factor == least
