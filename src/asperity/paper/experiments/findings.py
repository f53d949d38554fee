"""What the simulated experiments say of the paper's sentences: verdicts from numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from asperity.paper.changes import Change, other
from asperity.paper.claim import DECLARED, Check, Number, Verdict, decide, judges
from asperity.paper.experiments.bump import Bump, bump_experiment
from asperity.paper.experiments.passivity import STARTS, Count, count_cycles, passivity_onsets
from asperity.paper.experiments.scanning import scanning_experiment
from asperity.paper.experiments.settings import (
    BAND,
    BAND_WITHOUT_LAG,
    LETTERS,
    THREE_HANDS,
    TWO_WAYS,
)
from asperity.paper.plane import LAWS
from asperity.simulation.scan import Stroke

# Lags that are tried: the paper states none.
LAGS = (0, 4, 5, 6, 7)
# An energy is marginal below this part of the largest one of the stroke.
MARGINAL = 0.05
CLEAR = 0.01


def _strokes(law: str) -> tuple[Stroke, ...]:
    return scanning_experiment(law).of(law)


def _bumps(law: str) -> tuple[Bump, ...]:
    return bump_experiment(law).of(law)


def over_guesses(
    says: str, paper: Sequence[bool], ours: Sequence[bool], fitted: str,
    numbers: Mapping[str, Number],
) -> Check:  # fmt: skip
    """Judge an experiment of which the paper leaves something open by all guesses together.

    It holds where every guess shows it by the paper's own measure and by ours, and does not where
    none does by either. Else the guesses decide, or the measure: no verdict on the paper.

    Args:
        says: what was found, with numbers.
        paper: for each guess, whether the paper's measure shows what the paper says.
        ours: the same for ours.
        fitted: what was fitted or guessed.
        numbers: the evidence.
    """
    shown = {*paper, *ours}
    verdict: Verdict = "undecided"
    if len(shown) == 1:
        verdict = "holds" if True in shown else "does not hold"
    tally = f"as printed in {sum(paper)} of {len(paper)} guesses by the paper's measure"
    return Check(verdict, f"{tally}, {sum(ours)} by ours: {says}", numbers, fitted=fitted)


def _as_printed(original: Callable[..., Count]) -> Callable[..., Count]:
    """Return what counts no cycle of W, and one from every start of the others."""

    def count(law: str, divisor: float, delay: int) -> Count:
        found = original(law, divisor, 0)
        return replace(found, delay=delay, cycles=0 if law == "W" else found.starts)

    return count


AS_PRINTED = other("A and F cycling from every start, W from none", "count_cycles", _as_printed)


@judges("sentence-V.A-cycles", "V.A", flipped_by=AS_PRINTED)
def textured_walls_cycle() -> Check:
    """At 2000 N/m W settles; textured with A or F it enters a limit cycle (Fig. 5).

    W must settle from every start; A and F must cycle for good, as the paper's figure shows it from
    one start, by ours from at least a quarter.
    """
    counts = {(law, d): count_cycles(law, 1.0, d) for law in "WAF" for d in LAGS}

    def shown(delay: int, least: float) -> bool:
        wall, a, f = (counts[law, delay] for law in "WAF")
        return wall.cycles == 0 and min(a.cycles, f.cycles) >= least

    starts = counts["W", 0].starts
    says = "; ".join(
        f"lag {d}: {', '.join(f'{law} {counts[law, d].cycles}' for law in 'WAF')}" for d in LAGS
    )
    numbers = {f"{law}, lag {d}: cycles": float(one.cycles) for (law, d), one in counts.items()}
    slow = {f"{law}, lag {d}: calms down slowly": float(one.slow)
            for (law, d), one in counts.items()}  # fmt: skip
    return over_guesses(
        f"of {starts} starts cycle for good at {says}",
        [shown(d, 1.0) for d in LAGS],
        [shown(d, 0.25 * starts) for d in LAGS],
        BAND,
        numbers | slow,
    )


@judges("sentence-V.A-settles", "V.A", flipped_by=AS_PRINTED)
def divided_walls_settle() -> Check:
    """Divided by 5.1 and 8.3 the stiffness of A and F lets them settle (Fig. 5)."""
    counts = [count_cycles(law, by, d) for law, by in (("A", 5.1), ("F", 8.3)) for d in LAGS]
    cycling = sum(one.cycles for one in counts)
    starts = sum(one.starts for one in counts)
    lags = ", ".join(str(lag) for lag in LAGS)
    numbers = {f"{one.law}/{one.divisor:g}, lag {one.delay}": float(one.cycles) for one in counts}
    quiet = [one.cycles == 0 for one in counts]
    return over_guesses(
        f"A/5.1 and F/8.3 at lags of {lags} samples: {cycling} of {starts} starts cycle",
        quiet, quiet, BAND, numbers,
    )  # fmt: skip


def _numbers(strokes: tuple[Stroke, ...]) -> dict[str, float]:
    numbers = {}
    for i, one in enumerate(strokes):
        where = f"{one.law} {i + 1}, {one.speed:g} m/s"
        numbers[f"{where}: x [J]"] = one.energy[0]
        numbers[f"{where}: z [J]"] = one.energy[2]
        numbers[f"{where}: field [J]"] = one.field
        numbers[f"{where}: the paper's sum along x [J]"] = one.same_sample[0]
        numbers[f"{where}: the paper's sum along z [J]"] = one.same_sample[2]
    return numbers


Axes = tuple[float, float]


def _both(strokes: tuple[Stroke, ...]) -> tuple[list[Axes], list[Axes]]:
    """Return the energies along x and z by the paper's sum, and by the exact ledger [mJ]."""
    paper = [(1e3 * one.same_sample[0], 1e3 * one.same_sample[2]) for one in strokes]
    return paper, [(1e3 * one.energy[0], 1e3 * one.energy[2]) for one in strokes]


def _ranges(energies: list[Axes]) -> str:
    return ", ".join(
        f"{min(along):+.3g} to {max(along):+.3g} mJ along {axis}"
        for axis, along in zip("xz", zip(*energies, strict=True), strict=True)
    )


def _stroke_check(
    strokes: tuple[Stroke, ...], as_said: Callable[[float, float], bool], more: str = ""
) -> Check:
    """Judge the energies of all hands and speeds along x and z by both measures."""
    paper, ours = _both(strokes)
    return over_guesses(
        f"the paper's sum {_ranges(paper)}; exact ledger {_ranges(ours)}{more}",
        [as_said(*one) for one in paper],
        [as_said(*one) for one in ours],
        THREE_HANDS,
        _numbers(strokes),
    )


def _stroke_of(law: str) -> Change:
    return other(f"strokes of law {law}", "_strokes", lambda was: lambda _law: was(law))


def _feeding(strokes: tuple[Stroke, ...]) -> str:
    return f"; its field feeds {sum(one.feeds for one in strokes)} of {len(strokes)}"


TURNED = other(
    "the paper's sum with its sign turned", "_strokes",
    lambda was: lambda law: tuple(
        replace(one, same_sample=tuple(-part for part in one.same_sample)) for one in was(law)
    ),
)  # fmt: skip


@judges("sentence-V.B-decrease", "V.B", flipped_by=TURNED)
def decreasing_energy() -> Check:
    """A decreasing energy indicates that energy is supplied by the virtual environment.

    Of strokes in which it is supplied for certain: the energies of the whole loop add up.
    """
    strokes = [one for law in "AE" for one in _strokes(law) if one.total > 0.0]
    rising = sum(sum(one.same_sample) > 0.0 for one in strokes)
    open_by = max(one.closure for one in strokes)
    return decide(
        f"of {len(strokes)} strokes in which A and E feed the hand, by a balance of all energies "
        f"that closes within {open_by:.0e}, the paper's sum of f Δp rises in {rising}",
        printed=rising == 0,
        corrected=rising == len(strokes),
        correction="an increasing one, as f is the force sent to the device; it decreases if f is "
        "the hand's force on the environment",
        rising=float(rising),
    )


@judges("sentence-V.B-A", "V.B", flipped_by=_stroke_of("H"))
def law_a_gains() -> Check:
    """On a stroke A gains energy along z, none along x (Fig. 6)."""
    strokes = _strokes("A")
    return _stroke_check(strokes, lambda x, z: z > 0.0 and x == 0.0, _feeding(strokes))


@judges("sentence-V.B-G", "V.B", flipped_by=_stroke_of("A"))
def law_g_is_passive() -> Check:
    """On a stroke G is marginally passive along x and z (Fig. 6).

    Marginally: along each axis what it gives is small against what it takes, or less.
    """
    strokes = _strokes("G")
    return _stroke_check(
        strokes, lambda x, z: max(x, z) <= MARGINAL * max(abs(x), abs(z)), _feeding(strokes)
    )


@judges("sentence-V.B-D", "V.B", flipped_by=_stroke_of("A"))
def law_d_is_passive() -> Check:
    """On a stroke D is marginally passive along z, clearly along x (Fig. 6)."""
    strokes = _strokes("D")
    field = max(abs(1e3 * one.field) for one in strokes)
    return _stroke_check(
        strokes, lambda x, z: abs(z) <= MARGINAL and x < -CLEAR,
        f"; its field gives at most {field:.2g} mJ, what is left is sampling",
    )  # fmt: skip


@judges("sentence-V.B-F", "V.B", flipped_by=_stroke_of("A"))
def law_f_is_passive() -> Check:
    """On a stroke F is marginally passive along z, passive along x (Fig. 6)."""
    return _stroke_check(_strokes("F"), lambda x, z: x < 0.0 and abs(z) <= MARGINAL * abs(x))


def _bumps_of(law: str, by: str) -> Change:
    return other(
        f"bumps of law {by} for {law}", "_bumps",
        lambda was: lambda asked: was(by if asked == law else asked),
    )  # fmt: skip


@judges("sentence-V.C-A", "V.C", flipped_by=_bumps_of("A", "D"))
def law_a_throws_off() -> Check:
    """On a 20 mm bump A gains in jumps and loses contact (Fig. 7)."""
    bumps = _bumps("A")
    says = "; ".join(
        f"{one.entry}: {1e3 * one.total:+.3g} mJ, up to {1e3 * one.jump:.3g} mJ in 20 ms, contact "
        f"lost {one.lost} times" for one in bumps
    )  # fmt: skip
    # What a jump gives must stay given: a field with an energy takes it back.
    shown = [0.25 * one.total < one.jump < one.total and one.lost > 1 for one in bumps]
    return over_guesses(says, shown, shown, TWO_WAYS, _of_bumps(bumps))


@judges("sentence-V.C-D", "V.C", flipped_by=_bumps_of("D", "A"))
def law_d_is_balanced() -> Check:
    """On a 20 mm bump D keeps its energy in balance (Fig. 7)."""
    bumps, lively = _bumps("D"), _bumps("A")
    says = "; ".join(
        f"{one.entry}: {1e3 * one.total:+.3g} mJ against {1e3 * most.total:+.3g} of A, up to "
        f"{1e3 * one.top:.0f} mm high" for one, most in zip(bumps, lively, strict=True)
    )  # fmt: skip
    balanced = [
        abs(one.total) <= MARGINAL * most.total for one, most in zip(bumps, lively, strict=True)
    ]
    return over_guesses(f"{says} of 20", balanced, balanced, TWO_WAYS, _of_bumps(bumps))


def _of_bumps(bumps: tuple[Bump, ...]) -> dict[str, float]:
    numbers = {}
    for one in bumps:
        numbers[f"{one.entry}: energy [J]"] = one.total
        numbers[f"{one.entry}: in 20 ms [J]"] = one.jump
        numbers[f"{one.entry}: contact lost"] = float(one.lost)
        numbers[f"{one.entry}: highest [m]"] = one.top
        numbers[f"{one.entry}: ledger does not close by"] = one.closure
    return numbers


# --- III.B: what the onsets say -------------------------------------------------------------------

SOFT = other(
    "every textured wall cycling at ten times the stiffness", "passivity_onsets",
    lambda was: lambda laws, delay, _starts: tuple(
        one if one.onset.wall else
        replace(one, onset=replace(one.onset, cycling=10.0 * one.onset.cycling))
        for one in was(laws, delay, 1)
    ),
)  # fmt: skip


@judges("sentence-III.B-reduced", "III.B", flipped_by=SOFT)
def divided_walls_are_passive() -> Check:
    """κ₁ = κ₀/q preserves passivity, for any algorithm.

    κ₀ is the smooth wall's own onset of limit cycles in V.A's loop, q that of the depth reached.
    """
    found = {one.onset.law: one for one in passivity_onsets(LETTERS, 0, STARTS) if one.wall_rule}
    wall = found["W"].onset.quiet
    textured = {law: one for law, one in found.items() if law in LAWS}
    missed = [law for law, one in textured.items() if one.wall_rule_missed]
    said = ", ".join(f"{law} from {textured[law].onset.cycling:.0f} N/m on, where κ₀/q is "
                     f"{textured[law].wall_rule:.0f}" for law in missed)  # fmt: skip
    numbers: dict[str, Number] = {"W: quiet to [N/m]": wall}
    for law, one in textured.items():
        numbers |= {f"{law}: cycles at [N/m]": one.onset.cycling,
                    f"{law}: κ₀/q [N/m]": one.wall_rule or 0.0}  # fmt: skip
    check = decide(
        f"without lag W is quiet to {wall:.0f} N/m; of {', '.join(textured)} cycle below κ₀/q: "
        f"{said or 'none'}; D has no finite q there",
        printed=not missed,
        correction="a wall that stays quiet proves no damping: κ₀ q⁺ <= 2σ₀/T does, where the "
        "field is conservative and nothing is late",
        numbers=numbers,
    )
    return replace(check, fitted=BAND_WITHOUT_LAG)


FINDINGS = tuple(claim.id for claim in DECLARED if claim.compute.__module__ == __name__)
"""Ids of the sentences that are judged here."""
