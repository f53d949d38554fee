"""Every claim of the paper has a perturbation under which its verdict is different."""

from __future__ import annotations

import pytest
from tests.paper.claims.perturbations import (
    PERTURBATIONS,
    SCALED_FORCES,
    SCALED_JACOBIANS,
    Perturbation,
    Replacement,
    replace_name,
)
from tests.paper.claims.test_claims import CORRECTED, FAILS, HOLDS
from tests.paper.test_experiments import EXPECTED

from asperity.paper import CLAIMS, get_claim
from asperity.paper.probes import ProbePoint
from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid

VERDICTS = dict.fromkeys(CLAIMS, "undecided") | dict.fromkeys(HOLDS, "holds")
VERDICTS |= dict.fromkeys(CORRECTED, "holds with correction")
VERDICTS |= dict.fromkeys(FAILS, "does not hold") | EXPECTED


@pytest.mark.parametrize("name", CLAIMS)
def test_perturbation_changes_the_verdict(name: str) -> None:
    with PERTURBATIONS[CLAIMS[name].flips_under].apply():
        result = get_claim(name).run()
    assert result.verdict != VERDICTS[name], result.evidence.summary
    # Becoming undecided does not count as a different verdict.
    assert result.verdict != "undecided"
    assert result.flips_under == CLAIMS[name].flips_under
    assert "could not be computed" not in result.evidence.summary


def test_every_perturbation_belongs_to_a_claim() -> None:
    assert set(PERTURBATIONS) == {claim.flips_under for claim in CLAIMS.values()}


def test_scaled_kernels_change_the_claims_on_formulas() -> None:
    """A change of 0.1 % of a compiled force or Jacobian changes all claims that print one."""
    scaled = {SCALED_FORCES.description, SCALED_JACOBIANS.description}
    by_kernel = [name for name, claim in CLAIMS.items() if claim.flips_under in scaled]
    assert len(by_kernel) >= 45
    expected = "eq-6 eq-7 eq-8 eq-10 eq-11 eq-12 eq-14 eq-15 eq-17 eq-18 eq-20 eq-22 eq-23 eq-44"
    assert set(expected.split()) <= set(by_kernel)


def test_perturbation_is_reverted_after_an_error() -> None:
    surface = Surface(Sinusoid(1e-4, 1e-3), "A")
    inside = [[0.1e-3, 0.0, -1e-3]]
    before, force, method = get_claim("eq-6").run(), surface.force(inside), Surface.force

    def fails() -> None:
        assert surface.force(inside) == pytest.approx(1.001 * force)
        assert get_claim("eq-6").run().verdict == "does not hold"
        raise ZeroDivisionError

    with SCALED_FORCES.apply(), pytest.raises(ZeroDivisionError):
        fails()
    with pytest.raises(ZeroDivisionError), SCALED_FORCES.apply():
        fails()
    assert Surface.force is method
    assert surface.force(inside) == pytest.approx(force)
    assert get_claim("eq-6").run() == before


def test_caches_are_cleared_around_a_perturbation() -> None:
    """Table II is cached; it is recomputed under a perturbation and after it."""
    verdict = get_claim("table-2-A").run().verdict
    with PERTURBATIONS[CLAIMS["table-2-A"].flips_under].apply():
        assert get_claim("table-2-A").run().verdict != verdict
    assert get_claim("table-2-A").run().verdict == verdict


def test_replacement_of_an_unknown_name_is_an_error() -> None:
    with (
        pytest.raises(LookupError, match="'no_such_name'"),
        replace_name("nothing", "no_such_name", lambda _was: 1).apply(),
    ):
        pytest.fail("was applied")


def test_replacement_with_owner_affects_only_that_class() -> None:
    replacement = Replacement("norms", lambda _was: None, ProbePoint)
    with Perturbation("no norms", (replacement,)).apply():
        assert ProbePoint.norms is None
    assert callable(ProbePoint.norms)
