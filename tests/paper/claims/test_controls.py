"""Negative controls: changed formulas, kernels or printed values change the verdicts."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.paper.claims.perturbations import replace_name

import asperity.paper.reference
from asperity.analysis.energy.field_energy import loop_work
from asperity.analysis.gain.characteristic import characteristic_number
from asperity.laws import find_law
from asperity.paper import CLAIMS, Claim, get_claim
from asperity.paper.cases import PAPER_CASE, matrix_norm, random_friction_cases
from asperity.paper.claim import CATALOGUE
from asperity.paper.claims import design_limits as claims_limits
from asperity.paper.claims import friction_law as claims_appendix
from asperity.paper.claims import passivity_condition as claims_passivity
from asperity.paper.formula_checks import FormulaRow
from asperity.paper.probes import closest_point_derivatives, find_closest_point, generic_probes

BOUND = CATALOGUE["eq-31"]["arguments"]


def replace_everywhere(monkeypatch: pytest.MonkeyPatch, name: str, replacement: object) -> None:
    """Replace a name in every module of the paper's claims."""
    for module, content in sys.modules.items():
        if module.startswith("asperity.paper.") and hasattr(content, name):
            monkeypatch.setattr(content, name, replacement)


# A relative change of 1e-6 of a law's formula is detected.
_FACTOR = 1.0 + 1e-6
_SCALED_LAWS = replace_name(
    "definitions of laws times 1 + 1e-6",
    "symbolic_force",
    lambda original: lambda law: _FACTOR * original(law),
    asperity.paper.reference,
)


@pytest.mark.parametrize(
    "name",
    [
        "eq-6",
        "eq-7",
        "eq-8",
        "eq-11",
        "eq-14",
        "eq-15",
        "eq-17",
        "eq-18",
        "eq-19",
        "eq-20",
        "eq-21",
        "eq-22",
        "eq-28",
        "eq-38",
        "eq-39",
        "eq-44",
        "table-1-A",
        "table-1-BG",
        "table-1-F",
    ],
)
def test_scaled_law_changes_the_verdict(name: str) -> None:
    assert get_claim(name).run().verdict in {"holds", "holds with correction"}
    with _SCALED_LAWS.apply():
        assert get_claim(name).run().verdict == "does not hold"


@pytest.mark.parametrize("name", ["eq-12", "sentence-IV.A-energy", "eq-27"])
def test_scaled_work_changes_the_verdict(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def scaled_work(*arguments: Any) -> float:
        return _FACTOR * loop_work(*arguments)

    replace_everywhere(monkeypatch, "loop_work", scaled_work)
    assert get_claim(name).run().verdict == "does not hold"


@pytest.mark.parametrize(
    ("name", "factor"),
    [
        ("sentence-V.A-qA", 1.02),
        ("eq-21", 1.001),
        ("sentence-VI-increase", 0.99),
        ("sentence-V.B-margin", -1.0),
        ("limit-5", 0.9),
    ],
)
def test_scaled_number_changes_the_verdict(
    name: str, factor: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    def scaled_number(surface: Any) -> Any:
        bound = characteristic_number(surface)
        scale = factor
        if factor < 0.0:  # increase the numbers of section V.B
            scale = 10.0 if surface.texture.period > 1.5e-3 else 1.0
        return replace(bound, lower=scale * bound.lower, upper=scale * bound.upper)

    replace_everywhere(monkeypatch, "characteristic_number", scaled_number)
    assert get_claim(name).run().verdict == "does not hold"


def test_corrected_limits_hold_as_printed(monkeypatch: pytest.MonkeyPatch) -> None:
    for number in (4, 5):
        monkeypatch.setitem(
            claims_limits.PRINTED_LIMITS, number, claims_limits.CORRECTED_LIMITS[number]
        )
    for name in ("limit-4", "limit-5"):
        assert get_claim(name).run().verdict == "holds"


def test_formulas_with_swapped_correction_change_their_verdict() -> None:
    """A row holds with its correction printed, and fails with the printed formula as correction."""
    rows = [claim.compute.__self__ for claim in CLAIMS.values() if _is_row(claim)]
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
        (1, lambda v: (v["alpha"] * v["v"] / v["l"], 1.0)),  # different dimension
        (1, lambda v: (0.5 * v["alpha"] * v["v"] * v["T"] / v["l"], 1.0)),  # different factor
        (2, lambda v: (v["l"], v["beta"] * v["delta"])),  # reversed
        (6, lambda v: (v["v"] * v["l"], v["resonance"])),
    ],
)
def test_wrong_limit_does_not_hold(
    number: int, sides: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(claims_limits.PRINTED_LIMITS, number, sides)
    assert get_claim(f"limit-{number}").run().verdict == "does not hold"


def test_different_third_limit_has_contradicting_cases(monkeypatch: pytest.MonkeyPatch) -> None:
    inequality = lambda v: (v["alpha"] * (v["delta"] + v["v"] * v["T"]) / v["l"], 1.0)  # noqa: E731 - one line
    monkeypatch.setitem(claims_limits.PRINTED_LIMITS, 3, inequality)
    assert "in 0 of 4000" not in get_claim("limit-3").run().evidence.summary


def test_fast_loop_does_not_contradict_the_corollary(monkeypatch: pytest.MonkeyPatch) -> None:
    """At 1 m/s damping absorbs the gain: the counterexample requires slow motion."""
    monkeypatch.setattr(claims_passivity, "_SLOW_SPEED", 1.0)
    assert get_claim("eq-1").run().verdict == "holds"
    assert get_claim("eq-2").run().verdict == "holds"


def test_random_motions_on_c_gain_energy_below_the_limit() -> None:
    """The limits are sharp: 1/4 of (1) without delay, 3/4 with a delay of one sample."""
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


def test_corrected_appendix_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    original = claims_appendix.expand_bound
    monkeypatch.setattr(
        claims_appendix, "expand_bound", lambda r, _formula: original(r, BOUND["corrected"])
    )
    assert get_claim("eq-31").run().verdict == "holds"


def test_corrected_expansion_is_the_matrix_norm() -> None:
    """The norm is computed independently from its characteristic polynomial."""
    for case in [PAPER_CASE, *random_friction_cases(5, 99)]:
        a, b = case.sticking_entries()
        t = 1.0 + a * a + b * b
        eigenvalue = np.roots([1.0, -t, a * a]).real.max()
        corrected = claims_appendix.expand_bound(case, BOUND["corrected"])
        assert corrected**2 == pytest.approx(eigenvalue)
        assert matrix_norm(a, b) ** 2 == pytest.approx(eigenvalue)
        printed = claims_appendix.expand_bound(case, BOUND["printed"])
        assert printed**2 != pytest.approx(eigenvalue)


def test_number_of_friction_modulation_by_brute_force() -> None:
    """The maximum of the matrix norm over x, d and both phases."""
    rng, case, best = np.random.default_rng(1), PAPER_CASE, 0.0
    wave = 2.0 * np.pi / case.period
    for x, fraction in zip(
        rng.uniform(0.0, case.period, 20_000), rng.uniform(-1, 1, 20_000), strict=True
    ):
        h, slope = case.amplitude * np.sin(wave * x), case.amplitude * wave * np.cos(wave * x)
        for rate, d in ((1.0, fraction), (0.0, np.sign(fraction))):
            a = case.friction * case.depth * ((1 - h) * rate / case.deflection - slope * d)
            best = max(best, matrix_norm(a, case.friction * (1 - h) * d))
    assert best <= case.max_norm_ratio() * (1.0 + 1e-9)
    assert best == pytest.approx(case.max_norm_ratio(), rel=0.01)


def test_generic_probes_are_generic() -> None:
    """No slope, curvature or depth is small, so that an error in any of them is visible."""
    for law in "ABCDEFG":
        for probe in generic_probes(law):
            assert abs(probe.slope) > 1e-2
            assert abs(probe.second_derivative) > 10.0
            assert probe.force()[1] > 0.0
            assert find_law(law).letter == probe.surface.law.letter


def test_exact_closest_points_are_the_nearest() -> None:
    for probe in generic_probes("D", 6):
        closest = [float(value) for value in find_closest_point(probe.surface, probe.x, probe.z)]
        nearest = probe.surface.texture.nearest([[probe.x, 0.0, probe.z]])[0]
        assert closest == pytest.approx([nearest[0], nearest[2]], rel=1e-9)
        profile = probe.profile()
        for offset in np.linspace(-1e-3, 1e-3, 101):
            distance = np.hypot(
                probe.x - closest[0] - offset, probe.z - float(profile(closest[0] + offset, 0))
            )
            assert distance >= probe.distance * (1.0 - 1e-12)


def test_closest_point_derivatives_agree_with_differences() -> None:
    for result in closest_point_derivatives(3):
        probe, step = result.probe, 1e-8
        for name, shift in (("x", (step, 0.0)), ("z", (0.0, step))):
            ahead = find_closest_point(probe.surface, probe.x + shift[0], probe.z + shift[1])
            behind = find_closest_point(probe.surface, probe.x - shift[0], probe.z - shift[1])
            rates = [float(a - b) / (2.0 * step) for a, b in zip(ahead, behind, strict=True)]
            assert rates == pytest.approx(result.derivatives[:, "xz".index(name)], rel=1e-4)
