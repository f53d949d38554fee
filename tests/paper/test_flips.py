"""Every claim of the paper has a change that turns its verdict: it is made, and seen to do so."""

from __future__ import annotations

import pytest
from tests.paper.test_claims import CORRECTED, FAILS, HOLDS
from tests.paper.test_experiments import EXPECTED

from asperity.paper import CLAIMS, claim, plane
from asperity.paper.changes import FORCES, JACOBIANS, Change, Swap, instead
from asperity.paper.claim import OBSERVED
from asperity.paper.registry import register
from asperity.surface import Surface
from asperity.textures.sinusoid import Sinusoid

PINNED = dict.fromkeys(CLAIMS, "undecided") | dict.fromkeys(HOLDS, "holds")
PINNED |= dict.fromkeys(CORRECTED, "holds with correction") | dict.fromkeys(FAILS, "does not hold")
PINNED |= EXPECTED


@pytest.mark.parametrize("name", CLAIMS)
def test_the_verdict_turns_under_the_change_that_is_named(name: str) -> None:
    change = CLAIMS[name].flipped_by
    assert change is not None, "name what would turn it: @judges(..., flipped_by=...)"
    with change.made():
        found = claim(name).run()
    assert found.verdict != PINNED[name], found.evidence.summary
    # A verdict that is lost is no other verdict.
    assert found.verdict != "undecided"
    assert found.flips_under == change.says
    assert "could not be computed" not in found.evidence.summary


def test_scaled_kernels_turn_the_claims_on_formulas() -> None:
    """A thousandth more of a compiled force or Jacobian is seen by all that print one."""
    by_kernel = [name for name, one in CLAIMS.items() if one.flipped_by in (FORCES, JACOBIANS)]
    assert len(by_kernel) >= 45
    wanted = "eq-6 eq-7 eq-8 eq-10 eq-11 eq-12 eq-14 eq-15 eq-17 eq-18 eq-20 eq-22 eq-23 eq-44"
    assert set(wanted.split()) <= set(by_kernel)


def test_a_change_is_taken_back_even_after_an_error() -> None:
    surface = Surface(Sinusoid(1e-4, 1e-3), "A")
    inside = [[0.1e-3, 0.0, -1e-3]]
    before, force, method = claim("eq-6").run(), surface.force(inside), Surface.force

    def fails() -> None:
        assert surface.force(inside) == pytest.approx(1.001 * force)
        assert claim("eq-6").run().verdict == "does not hold"
        raise ZeroDivisionError

    with FORCES.made(), pytest.raises(ZeroDivisionError):
        fails()
    with pytest.raises(ZeroDivisionError), FORCES.made():
        fails()
    assert Surface.force is method
    assert surface.force(inside) == pytest.approx(force)
    assert claim("eq-6").run() == before


def test_what_was_kept_is_forgotten() -> None:
    """Table II is computed once; under a change, and after it, anew."""
    held = claim("table-2-A").run().verdict
    change = CLAIMS["table-2-A"].flipped_by
    assert change is not None
    with change.made():
        assert claim("table-2-A").run().verdict != held
    assert claim("table-2-A").run().verdict == held


def test_a_change_of_what_no_claim_uses_is_an_error() -> None:
    with (
        pytest.raises(LookupError, match="'no_such_name'"),
        instead("nothing", "no_such_name", 1).made(),
    ):
        pytest.fail("was made")


def test_a_change_of_one_class_leaves_the_others() -> None:
    swap = Swap("norms", lambda _was: None, plane.Spot)
    with Change("no norms", (swap,)).made():
        assert plane.Spot.norms is None
    assert callable(plane.Spot.norms)


def test_nobody_was_asked() -> None:
    """What people feel is undecided until somebody observes it."""
    assert OBSERVED == {}


def test_every_claim_of_the_paper_names_one() -> None:
    assert [name for name, one in CLAIMS.items() if one.flipped_by is None] == []


def test_a_claim_of_a_user_may_go_without() -> None:
    own = register(type(claim("eq-6"))("own", (), "mine", "Mine.", claim("eq-6").compute))
    try:
        assert own.run().flips_under == ""
    finally:
        del CLAIMS["own"]
