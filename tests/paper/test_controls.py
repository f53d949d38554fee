"""Negative controls: with something else computed, or printed, the verdicts change."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import asperity.definition
from asperity.analysis.energy.loops import loop_work
from asperity.analysis.gain.characteristic import characteristic_number
from asperity.laws import find_law
from asperity.paper import (
    claim,
    claims_appendix,
    claims_god_object,
    claims_limits,
    claims_passivity,
)
from asperity.paper.changes import other
from asperity.paper.claims_friction import PAPER, norm_of, random_rubs, stick_entries
from asperity.paper.plane import foot_of, foot_rates, spots


def changed_everywhere(monkeypatch: pytest.MonkeyPatch, name: str, changed: object) -> None:
    """Let every module of the paper's claims have something else under a name."""
    for module, content in sys.modules.items():
        if module.startswith("asperity.paper.") and hasattr(content, name):
            monkeypatch.setattr(content, name, changed)


# A part in a million of the law's formula is seen.
_CHANGED = 1.0 + 1e-6
_ANOTHER = other(
    "definitions of laws times 1 + 1e-6", "symbolic_force",
    lambda was: lambda law: _CHANGED * was(law), asperity.definition,
)  # fmt: skip


@pytest.mark.parametrize(
    "name",
    ["eq-6", "eq-7", "eq-8", "eq-11", "eq-14", "eq-15", "eq-17", "eq-18", "eq-19", "eq-20", "eq-21",
     "eq-22", "eq-28", "eq-38", "eq-39", "eq-44", "table-1-A", "table-1-BG", "table-1-F"],
)  # fmt: skip
def test_another_law_flips_the_verdict(name: str) -> None:
    assert claim(name).run().verdict in {"holds", "holds with correction"}
    with _ANOTHER.made():
        assert claim(name).run().verdict == "does not hold"


@pytest.mark.parametrize("name", ["eq-12", "sentence-IV.A-energy", "eq-27"])
def test_another_work_flips_the_verdict(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def changed(*arguments: Any) -> float:
        return _CHANGED * loop_work(*arguments)

    changed_everywhere(monkeypatch, "loop_work", changed)
    assert claim(name).run().verdict == "does not hold"


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
    assert claim(name).run().verdict == "does not hold"


def test_what_is_printed_right_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    for number in (4, 5):
        monkeypatch.setitem(claims_limits.PRINTED, number, claims_limits.CORRECTED[number])
    monkeypatch.setattr(claims_appendix, "flat_jacobian", claims_god_object.bent_jacobian)
    for name in ("limit-4", "limit-5", "eq-44"):
        assert claim(name).run().verdict == "holds"


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
    monkeypatch.setitem(claims_limits.PRINTED, number, sides)
    assert claim(f"limit-{number}").run().verdict == "does not hold"


def test_a_third_limit_that_differed_would_count(monkeypatch: pytest.MonkeyPatch) -> None:
    other = lambda v: (v["alpha"] * (v["delta"] + v["v"] * v["T"]) / v["l"], 1.0)  # noqa: E731 - one
    monkeypatch.setitem(claims_limits.PRINTED, 3, other)
    assert "in 0 of 4000" not in claim("limit-3").run().evidence.summary


def test_a_fast_loop_would_not_contradict_the_corollary(monkeypatch: pytest.MonkeyPatch) -> None:
    """At 1 m/s damping absorbs the loop: the counter-example is one of slow motion."""
    monkeypatch.setattr(claims_passivity, "_SLOW", 1.0)
    assert claim("eq-1").run().verdict == "holds"
    assert claim("eq-2").run().verdict == "holds"


def test_motions_on_c_gain_where_damping_is_too_small() -> None:
    """Sharp: a quarter of (1) without delay, three quarters with one sample of it."""
    assert claims_passivity._quiet(0, 31, 0.26) < 0.0 < claims_passivity._quiet(0, 31, 0.24)
    assert claims_passivity._quiet(1, 32, 0.78) < 0.0 < claims_passivity._quiet(1, 32, 0.72)


def test_an_appendix_with_all_terms_right_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    original = claims_appendix.expansion
    monkeypatch.setattr(
        claims_appendix, "expansion", lambda r, **_asked: original(r, as_printed=False)
    )
    assert claim("eq-31").run().verdict == "holds"


def test_the_expansion_needs_each_of_its_corrections() -> None:
    """The corrected expression is the norm by its characteristic polynomial."""
    for r in [PAPER, *random_rubs(5, 99)]:
        a, b = stick_entries(r)
        t = 1.0 + a * a + b * b
        eigenvalue = np.roots([1.0, -t, a * a]).real.max()
        assert claims_appendix.expansion(r, as_printed=False) ** 2 == pytest.approx(eigenvalue)
        assert norm_of(a, b) ** 2 == pytest.approx(eigenvalue)
        assert claims_appendix.expansion(r, as_printed=True) ** 2 != pytest.approx(eigenvalue)


def test_number_of_the_papers_friction_by_brute_force() -> None:
    """Over x, d and both phases, from the matrix itself."""
    draw, r, best = np.random.default_rng(1), PAPER, 0.0
    wave = 2.0 * np.pi / r.period
    for x, share in zip(
        draw.uniform(0.0, r.period, 20_000), draw.uniform(-1, 1, 20_000), strict=True
    ):
        h, slope = r.amplitude * np.sin(wave * x), r.amplitude * wave * np.cos(wave * x)
        for rate, d in ((1.0, share), (0.0, np.sign(share))):
            a = r.friction * r.depth * ((1 - h) * rate / r.deflection - slope * d)
            best = max(best, norm_of(a, r.friction * (1 - h) * d))
    assert best <= claims_appendix.true_number(r) * (1.0 + 1e-9)
    assert best == pytest.approx(claims_appendix.true_number(r), rel=0.01)


def test_generic_probes_are_generic() -> None:
    """No slope, curvature or depth is small: an error in any of them shows."""
    for law in "ABCDEFG":
        for spot in spots(law):
            assert abs(spot.slope) > 1e-2
            assert abs(spot.bend) > 10.0
            assert spot.force()[1] > 0.0
            assert find_law(law).letter == spot.surface.law.letter


def test_feet_are_the_nearest_points() -> None:
    for spot in spots("D", 6):
        foot = [float(value) for value in foot_of(spot.surface, spot.x, spot.z)]
        known = spot.surface.texture.nearest([[spot.x, 0.0, spot.z]])[0]
        assert foot == pytest.approx([known[0], known[2]], rel=1e-9)
        profile = spot.profile()
        for near in np.linspace(-1e-3, 1e-3, 101):
            other = np.hypot(spot.x - foot[0] - near, spot.z - float(profile(foot[0] + near, 0)))
            assert other >= spot.distance * (1.0 - 1e-12)


def test_derivatives_of_feet_by_coarser_differences() -> None:
    for found in foot_rates(3):
        spot, step = found.spot, 1e-8
        for name, move in (("x", (step, 0.0)), ("z", (0.0, step))):
            ahead = foot_of(spot.surface, spot.x + move[0], spot.z + move[1])
            behind = foot_of(spot.surface, spot.x - move[0], spot.z - move[1])
            rates = [float(a - b) / (2.0 * step) for a, b in zip(ahead, behind, strict=True)]
            assert rates == pytest.approx([found.rate("x", name), found.rate("z", name)], rel=1e-4)
