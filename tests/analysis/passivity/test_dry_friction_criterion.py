"""The criterion that compares a device's dry friction with what a field gains per length."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest

from asperity.analysis.passivity.criteria import DRY_FRICTION, LEAK
from asperity.analysis.passivity.verdict import Passivity
from asperity.analysis.results.analyze import analyze
from asperity.devices import parse_device
from asperity.report.sentences.passivity_sentences import delivery_text
from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid

RIG = {"damping": "2 N*s/m", "update_rate": "4 kHz", "delay_samples": 0}
SURFACE = Surface(Sinusoid(0.8e-3, 2e-3), "G", 1000.0, 0.8e-3)
SLOPE = 0.8 * math.pi
BOUND = 1000.0 * 0.8e-3 * SLOPE / math.hypot(1.0, SLOPE)


def assess(surface: Surface = SURFACE, **data: str) -> Passivity:
    return analyze(surface, parse_device(RIG | data, "rig")).passivity


@pytest.mark.parametrize(("friction", "holds"), [(1.001, True), (0.999, None), (0.3, False)])
def test_criterion_holds_from_the_proved_bound_on(friction: float, holds: bool | None) -> None:
    """The greatest W/length found is 0.311 of the bound."""
    result = assess(least_friction=f"{friction * BOUND:.12g} N")
    criterion = result.criterion(DRY_FRICTION)
    assert criterion.holds is holds
    assert criterion.limit is not None
    assert criterion.limit == pytest.approx(1000.0 * friction, rel=1e-9)
    assert criterion.upper_limit == pytest.approx(criterion.limit / 0.311, rel=2e-3)
    verdict = ("undecided", DRY_FRICTION) if holds else ("not passive", LEAK)
    assert (result.verdict, result.decided_by) == verdict
    assert ("absorbs it" in delivery_text(result.loop)) is (holds is True)


def test_limit_is_never_overstated() -> None:
    """At the limit the bound is at most the friction, in exact arithmetic."""
    limit = assess(least_friction="0.1 N").criterion(DRY_FRICTION).limit
    assert limit is not None
    bound = assess(SURFACE.to_stiffness(limit)).loop.leak
    assert bound is not None
    assert Fraction(bound.absorbing.upper) <= Fraction(0.1) * (1 + Fraction(1, 10**14))


def test_friction_of_a_data_sheet_is_named_and_decides_nothing() -> None:
    criterion = assess(friction="0.26 N").criterion(DRY_FRICTION)
    assert criterion.holds is None
    assert criterion.missing == ("least_friction",)
    assert criterion.conclusion.startswith(
        "not decidable: needs least_friction; f_c* is at least 23"
    )
    assert criterion.conclusion.endswith(
        "friction 260 mN (not verified), typical or at most, may be enough"
    )
    assert assess(friction="0.1 N").criterion(DRY_FRICTION).conclusion.endswith("is not enough")
    assert assess(friction="0.8 N").criterion(DRY_FRICTION).conclusion.endswith("would be enough")


def test_conservative_law_needs_no_friction() -> None:
    criterion = assess(Surface(SURFACE.texture, "H", 1000.0, 0.8e-3)).criterion(DRY_FRICTION)
    assert (criterion.holds, criterion.limit) == (True, math.inf)
    assert criterion.conclusion == "holds: no loop gains, none is needed"
