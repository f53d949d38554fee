"""Onsets of limit cycles in words, beside what the criteria allow."""

from __future__ import annotations

import math
from collections.abc import Sequence

from asperity.report.words.number_words import INFINITE, NONE
from asperity.scene.setup import Setup
from asperity.simulation.prediction import Prediction
from asperity.units import engineering

HEADINGS = (
    "law", "d", "quiet to", "cycles", "starts", "depth", "q", "paper (1)", "delay rule", "K₀/q",
)  # fmt: skip
NOTES = (
    "Stiffnesses in N/m, d the delay in samples. Quiet to, cycles: the bracket of the onset over "
    "all starts. Starts: how many of them end in a limit cycle where it begins. Depth: how deep "
    "the handle got there; q is that of this depth.",
    "Paper (1): σ₀/(2Tq). Delay rule: σ₀/(T(q⁺/2 + dq)), a proof for conservative laws and exact "
    "positions; in brackets for the other laws, where it proves nothing. K₀/q: the wall's own "
    "onset at that delay, over q; the paper's rule of thumb, not a proof.",
)


def cells(found: Prediction) -> list[str]:
    """Return the texts of a row."""
    onset = found.onset
    rule = newton(found.delay_rule)
    return [
        onset.law,
        str(onset.delay),
        newton(onset.quiet),
        "none" if math.isinf(onset.cycling) else newton(onset.cycling),
        f"{onset.cycles}/{onset.starts}",
        engineering(found.depth, "m", digits=2),
        INFINITE if math.isinf(found.q) else newton(found.q),
        newton(found.paper),
        rule if found.conservative else f"({rule})",
        NONE if found.wall_rule is None else newton(found.wall_rule),
    ]


def newton(value: float) -> str:
    """Return a stiffness without its unit, three digits [N/m]."""
    if math.isinf(value):
        return INFINITE
    return f"{value:.3g}" if value < 1000.0 else f"{float(f'{value:.3g}'):,.0f}".replace(",", " ")


def answer(setup: Setup, found: Sequence[Prediction]) -> str:
    """Return what was found in two sentences."""
    missed = [one for one in found if one.missed]
    walls = [one for one in found if one.wall_rule_missed]
    proved = sum(one.conservative for one in found)
    step = setup.servo.position_resolution
    if missed:
        names = ", ".join(
            f"{one.onset.law} at d = {one.onset.delay} ({one.onset.cycling / one.delay_rule:.0%})"
            for one in missed
        )
        said = f"Limit cycles below the delay rule, at so much of it: {names}."
        if step:
            said += f" It is proved for exact positions, not for steps of {engineering(step, 'm')}."
    else:
        cases = "case" if proved == 1 else "cases"
        said = f"No limit cycle below the delay rule, in {proved} {cases} of conservative laws."
    if any(one.wall_rule is not None and not one.onset.wall for one in found):
        names = ", ".join(f"{one.onset.law} at d = {one.onset.delay}" for one in walls)
        said += f" K₀/q was too much for: {names}." if walls else " K₀/q was safe in all of them."
    return said
