"""Negative controls: other formulas, kernels or printed values change the verdicts."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.paper.perturbations import replace_name

import asperity.reference
from asperity.analysis.energy.loop_integral import loop_work
from asperity.analysis.gain.characteristic import characteristic_number
from asperity.laws import find_law
from asperity.paper import CLAIMS, Claim, get_claim
from asperity.paper.claims import design_limits as claims_limits
from asperity.paper.claims import friction_law as claims_appendix
from asperity.paper.claims import passivity_condition as claims_passivity
from asperity.paper.claims.formula_claims import FormulaRow
from asperity.paper.claims.friction_law import PAPER_CASE, matrix_norm, random_friction_cases
from asperity.paper.probes import closest_point_derivatives, find_closest_point, generic_probes


def changed_everywhere(monkeypatch: pytest.MonkeyPatch, name: str, changed: object) -> None:
    """Replace a name in every module of the paper's claims."""
    for module, content in sys.modules.items():
        if module.startswith("asperity.paper.") and hasattr(content, name):
            monkeypatch.setattr(content, name, changed)


# A relative change of 1e-6 of a law's formula is detected.
_CHANGED = 1.0 + 1e-6
_ANOTHER = replace_name(
    "definitions of laws times 1 + 1e-6", "symbolic_force",
    lambda was: lambda law: _CHANGED * was(law), asperity.reference,
)  # fmt: skip


@pytest.mark.parametrize(
    "name",
    ["eq-6", "eq-7", "eq-8", "eq-11", "eq-14", "eq-15", "eq-17", "eq-18", "eq-19", "eq-20", "eq-21",
     "eq-22", "eq-28", "eq-38", "eq-39", "eq-44", "table-1-A", "table-1-BG", "table-1-F"],
)  # fmt: skip
def test_another_law_flips_the_verdict(name: str) -> None:
    assert get_claim(name).run().verdict in {"holds", "holds with correction"}
    with _ANOTHER.apply():
        assert get_claim(name).run().verdict == "does not hold"


@pytest.mark.parametrize("name", ["eq-12", "sentence-IV.A-energy", "eq-27"])
def test_another_work_flips_the_verdict(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def changed(*arguments: Any) -> float:
        return _CHANGED * loop_work(*arguments)

    changed_everywhere(monkeypatch, "loop_work", changed)
    assert get_claim(name).run().verdict == "does not hold"


@pytest.mark.parametrize(
    ("name", "factor"),
    [("sentence-V.A-qA", 1.02), ("eq-21", 1.001), ("sentence-VI-increase", 0.99),
     ("sentence-V.B-margin", -1.0), ("limit-5", 0.9)],
)  # fmt: skip
def test_another_number_flips_the_verdict(
    name: str, factor: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    def changed(surface: Any) -> Any:
        found = characteristic_number(surface)
        times = factor
        if factor < 0.0:  # V.B's numbers made large
            times = 10.0 if surface.texture.period > 1.5e-3 else 1.0
        return replace(found, lower=times * found.lower, upper=times * found.upper)

    changed_everywhere(monkeypatch, "characteristic_number", changed)
    assert get_claim(name).run().verdict == "does not hold"


def test_what_is_printed_right_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    for number in (4, 5):
        monkeypatch.setitem(
            claims_limits.PRINTED_LIMITS, number, claims_limits.CORRECTED_LIMITS[number]
        )
    for name in ("limit-4", "limit-5"):
        assert get_claim(name).run().verdict == "holds"


def test_a_formula_printed_correctly_holds() -> None:
    """With the corrected formula in the place of the printed one, all rows hold."""
    rows = [one.compute.__self__ for one in CLAIMS.values() if _is_row(one)]
    corrected = [row for row in rows if row.corrected]
    assert len(corrected) >= 12
    for row in corrected:
        assert replace(row, printed=row.corrected).check().verdict == "holds"
        assert replace(row, corrected=row.printed).check().verdict == "does not hold"


def _is_row(claim: Claim) -> bool:
    return isinstance(getattr(claim.compute, "__self__", None), FormulaRow)


@pytest.mark.parametrize(
    ("number", "sides"),
    [
        (1, lambda v: (v["alpha"] * v["v"] / v["l"], 1.0)),  # another dimension
        (1, lambda v: (0.5 * v["alpha"] * v["v"] * v["T"] / v["l"], 1.0)),  # another factor
        (2, lambda v: (v["l"], v["beta"] * v["delta"])),  # the other way round
        (6, lambda v: (v["v"] * v["l"], v["resonance"])),
    ],
)
def test_a_limit_printed_wrong_does_not_hold(
    number: int, sides: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(claims_limits.PRINTED_LIMITS, number, sides)
    assert get_claim(f"limit-{number}").run().verdict == "does not hold"


def test_a_third_limit_that_differed_would_count(monkeypatch: pytest.MonkeyPatch) -> None:
    other = lambda v: (v["alpha"] * (v["delta"] + v["v"] * v["T"]) / v["l"], 1.0)  # noqa: E731 - one
    monkeypatch.setitem(claims_limits.PRINTED_LIMITS, 3, other)
    assert "in 0 of 4000" not in get_claim("limit-3").run().evidence.summary


def test_a_fast_loop_would_not_contradict_the_corollary(monkeypatch: pytest.MonkeyPatch) -> None:
    """At 1 m/s damping absorbs the loop: the counter-example is one of slow motion."""
    monkeypatch.setattr(claims_passivity, "_SLOW_SPEED", 1.0)
    assert get_claim("eq-1").run().verdict == "holds"
    assert get_claim("eq-2").run().verdict == "holds"


def test_motions_on_c_gain_where_damping_is_too_small() -> None:
    """Sharp: a quarter of (1) without delay, three quarters with one sample of it."""
    assert (
        claims_passivity._max_random_gain(0, 31, 0.26)
        < 0.0
        < claims_passivity._max_random_gain(0, 31, 0.24)
    )
    assert (
        claims_passivity._max_random_gain(1, 32, 0.78)
        < 0.0
        < claims_passivity._max_random_gain(1, 32, 0.72)
    )


def test_an_appendix_with_all_terms_right_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    original = claims_appendix.expand_bound
    monkeypatch.setattr(
        claims_appendix, "expand_bound", lambda r, **_given: original(r, as_printed=False)
    )
    assert get_claim("eq-31").run().verdict == "holds"


def test_the_expansion_needs_each_of_its_corrections() -> None:
    """The corrected expression is the norm by its characteristic polynomial."""
    for r in [PAPER_CASE, *random_friction_cases(5, 99)]:
        a, b = r.sticking_entries()
        t = 1.0 + a * a + b * b
        eigenvalue = np.roots([1.0, -t, a * a]).real.max()
        assert claims_appendix.expand_bound(r, as_printed=False) ** 2 == pytest.approx(eigenvalue)
        assert matrix_norm(a, b) ** 2 == pytest.approx(eigenvalue)
        assert claims_appendix.expand_bound(r, as_printed=True) ** 2 != pytest.approx(eigenvalue)


def test_number_of_the_papers_friction_by_brute_force() -> None:
    """Over x, d and both phases, from the matrix itself."""
    draw, r, best = np.random.default_rng(1), PAPER_CASE, 0.0
    wave = 2.0 * np.pi / r.period
    for x, share in zip(
        draw.uniform(0.0, r.period, 20_000), draw.uniform(-1, 1, 20_000), strict=True
    ):
        h, slope = r.amplitude * np.sin(wave * x), r.amplitude * wave * np.cos(wave * x)
        for rate, d in ((1.0, share), (0.0, np.sign(share))):
            a = r.friction * r.depth * ((1 - h) * rate / r.deflection - slope * d)
            best = max(best, matrix_norm(a, r.friction * (1 - h) * d))
    assert best <= r.max_norm_ratio() * (1.0 + 1e-9)
    assert best == pytest.approx(r.max_norm_ratio(), rel=0.01)


def test_generic_probes_are_generic() -> None:
    """No slope, curvature or depth is small: an error in any of them shows."""
    for law in "ABCDEFG":
        for spot in generic_probes(law):
            assert abs(spot.slope) > 1e-2
            assert abs(spot.second_derivative) > 10.0
            assert spot.force()[1] > 0.0
            assert find_law(law).letter == spot.surface.law.letter


def test_closest_points_are_the_nearest() -> None:
    for spot in generic_probes("D", 6):
        closest = [float(value) for value in find_closest_point(spot.surface, spot.x, spot.z)]
        known = spot.surface.texture.nearest([[spot.x, 0.0, spot.z]])[0]
        assert closest == pytest.approx([known[0], known[2]], rel=1e-9)
        profile = spot.profile()
        for near in np.linspace(-1e-3, 1e-3, 101):
            other = np.hypot(
                spot.x - closest[0] - near, spot.z - float(profile(closest[0] + near, 0))
            )
            assert other >= spot.distance * (1.0 - 1e-12)


def test_derivatives_of_closest_points_by_coarser_differences() -> None:
    for found in closest_point_derivatives(3):
        spot, step = found.probe, 1e-8
        for name, move in (("x", (step, 0.0)), ("z", (0.0, step))):
            ahead = find_closest_point(spot.surface, spot.x + move[0], spot.z + move[1])
            behind = find_closest_point(spot.surface, spot.x - move[0], spot.z - move[1])
            rates = [float(a - b) / (2.0 * step) for a, b in zip(ahead, behind, strict=True)]
            assert rates == pytest.approx(found.derivatives[:, "xz".index(name)], rel=1e-4)
