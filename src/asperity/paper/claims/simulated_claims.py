"""Claims of section V judged by simulated experiments."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from asperity.paper import claim
from asperity.paper.cases import PAPER_LAWS
from asperity.paper.cycle_experiments import ALL_LAWS, STARTS, count_cycles, passivity_onsets
from asperity.paper.experiments import BumpRun, bump_experiment, scanning_experiment
from asperity.simulation.scan import Stroke

TRIED_DELAYS = (0, 4, 5, 6, 7)
"""Loop delays [samples]; the paper states none."""
MARGINAL_SHARE = 0.05
"""An energy is marginal below this share of the largest one of the stroke."""
CLEAR_ENERGY = 0.01
"""[mJ]"""


def _simulated_strokes(law: str) -> tuple[Stroke, ...]:
    return scanning_experiment(law).strokes_of(law)


def _simulated_bumps(law: str) -> tuple[BumpRun, ...]:
    return tuple([run for run in bump_experiment(law).bumps if run.law == law])


def check_over_assumptions(
    summary: str,
    by_paper_measure: Sequence[bool],
    by_exact_measure: Sequence[bool],
    numbers: Mapping[str, claim.Number],
) -> claim.Check:
    """Judge an experiment for all guesses of what the paper leaves open.

    The claim holds if every guess confirms it by the paper's measure and by the exact one, and does
    not hold if no guess confirms it by either. Otherwise it is undecided.

    Args:
        summary: result with numbers.
        by_paper_measure: for each guess, whether the paper's measure confirms the claim.
        by_exact_measure: the same for the exact measure.
        numbers: computed values by name.
    """
    outcomes = {*by_paper_measure, *by_exact_measure}
    agreed = None if len(outcomes) > 1 else all(outcomes)
    tally = (
        f"as printed in {sum(by_paper_measure)} of {len(by_paper_measure)} guesses by the paper's "
        f"measure, {sum(by_exact_measure)} by ours"
    )
    return claim.check_statement(f"{tally}: {summary}", printed=agreed, numbers=numbers)


def textured_walls_cycle() -> claim.Check:
    """At 2000 N/m W settles; textured with A or F it enters a limit cycle (Fig. 5).

    W must settle from every start. A and F must end in a limit cycle: by the paper's measure from
    count start, as in its figure, by ours from at least a quarter of them.
    """
    counts = {(law, d): count_cycles(law, 1.0, d) for law in "WAF" for d in TRIED_DELAYS}

    def is_confirmed(delay: int, least: float) -> bool:
        textured = min(counts["A", delay].cycles, counts["F", delay].cycles)
        return counts["W", delay].cycles == 0 and textured >= least

    starts = counts["W", 0].starts
    summary = "; ".join(
        [
            f"lag {d}: {', '.join([f'{law} {counts[law, d].cycles}' for law in 'WAF'])}"
            for d in TRIED_DELAYS
        ]
    )
    numbers: dict[str, claim.Number] = {}
    for (law, d), count in counts.items():
        numbers[f"{law}, lag {d}: cycles"] = float(count.cycles)
        numbers[f"{law}, lag {d}: calms down slowly"] = float(count.slow)
    return check_over_assumptions(
        f"of {starts} starts cycle for good at {summary}",
        [is_confirmed(d, 1.0) for d in TRIED_DELAYS],
        [is_confirmed(d, 0.25 * starts) for d in TRIED_DELAYS],
        numbers,
    )


def divided_walls_settle() -> claim.Check:
    """Divided by 5.1 and 8.3 the stiffness of A and F lets them settle (Fig. 5).

    Judged where they cycle undivided; at other lags the division cures nothing.
    """
    counts = [
        count_cycles(law, by, d)
        for law, by in (("A", 5.1), ("F", 8.3))
        for d in TRIED_DELAYS
        if count_cycles(law, 1.0, d).cycles
    ]
    cycling = sum([count.cycles for count in counts])
    starts = sum([count.starts for count in counts])
    lags = ", ".join([f"{count.wall} at {count.delay}" for count in counts])
    summary = f"where the undivided cycle (lags: {lags}), {cycling} of {starts} starts cycle"
    numbers = {f"{count.wall}, lag {count.delay}": float(count.cycles) for count in counts}
    settles = [count.cycles == 0 for count in counts]
    return check_over_assumptions(summary, settles, settles, numbers)


def _stroke_numbers(strokes: tuple[Stroke, ...]) -> dict[str, float]:
    numbers = {}
    for number, stroke in enumerate(strokes, start=1):
        where = f"{stroke.law} {number}, {stroke.speed:g} m/s"
        numbers[f"{where}: x [J]"] = stroke.energy[0]
        numbers[f"{where}: z [J]"] = stroke.energy[2]
        numbers[f"{where}: field [J]"] = stroke.field
        numbers[f"{where}: the paper's sum along x [J]"] = stroke.same_sample[0]
        numbers[f"{where}: the paper's sum along z [J]"] = stroke.same_sample[2]
    return numbers


def _format_ranges(energies: list[tuple[float, float]]) -> str:
    return ", ".join(
        [
            f"{min(along):+.3g} to {max(along):+.3g} mJ along {axis}"
            for axis, along in zip("xz", zip(*energies, strict=True), strict=True)
        ]
    )


def _check_strokes(
    law: str,
    predicate: Callable[[float, float], bool],
    format_field: Callable[[Sequence[Stroke]], str] = lambda _strokes: "",
) -> claim.Check:
    """Check the energies along x and z of all hands and speeds by both measures."""
    strokes = _simulated_strokes(law)
    paper = [
        (1e3 * stroke.same_sample[0], 1e3 * stroke.same_sample[2]) for stroke in strokes
    ]  # [mJ]
    exact = [(1e3 * stroke.energy[0], 1e3 * stroke.energy[2]) for stroke in strokes]
    return check_over_assumptions(
        f"the paper's sum {_format_ranges(paper)}; exact ledger {_format_ranges(exact)}"
        f"{format_field(strokes)}",
        [predicate(*energies) for energies in paper],
        [predicate(*energies) for energies in exact],
        _stroke_numbers(strokes),
    )


def _format_gain_count(strokes: Sequence[Stroke]) -> str:
    count = sum([stroke.gains_energy for stroke in strokes])
    return f"; its field supplies energy in {count} of {len(strokes)}"


def _format_greatest_supply(strokes: Sequence[Stroke]) -> str:
    field = max([abs(1e3 * stroke.field) for stroke in strokes])
    return f"; its field supplies at most {field:.2g} mJ, the rest is sampling"


def decrease_indicates_supply() -> claim.Check:
    """A decreasing energy indicates that energy is supplied by the virtual environment.

    Checked with strokes in which the balance of the whole loop shows a supply.
    """
    strokes = [stroke for law in "AE" for stroke in _simulated_strokes(law) if stroke.total > 0.0]
    rising = sum([sum(stroke.same_sample) > 0.0 for stroke in strokes])
    closure = max([stroke.closure for stroke in strokes])
    return claim.check_statement(
        f"of {len(strokes)} strokes in which A and E supply energy to the hand, by a balance of "
        f"all energies that closes within {closure:.0e}",
        printed=rising == 0,
        corrected=rising == len(strokes),
        rising=float(rising),
    )


def law_a_gains() -> claim.Check:
    """On a stroke A gains energy along z, none along x (Fig. 6)."""
    return _check_strokes("A", lambda x, z: z > 0.0 and x == 0.0, _format_gain_count)


def law_g_is_passive() -> claim.Check:
    """On a stroke G is marginally passive along x and z (Fig. 6).

    Marginally: the energy supplied along one axis is at most a small share of the largest one.
    """

    def is_marginal(x: float, z: float) -> bool:
        return max(x, z) <= MARGINAL_SHARE * max(abs(x), abs(z))

    return _check_strokes("G", is_marginal, _format_gain_count)


def law_d_is_passive() -> claim.Check:
    """On a stroke D is marginally passive along z, clearly along x (Fig. 6)."""

    def is_passive(x: float, z: float) -> bool:
        return abs(z) <= MARGINAL_SHARE and x < -CLEAR_ENERGY

    return _check_strokes("D", is_passive, _format_greatest_supply)


def law_f_is_passive() -> claim.Check:
    """On a stroke F is marginally passive along z, passive along x (Fig. 6)."""
    return _check_strokes("F", lambda x, z: x < 0.0 and abs(z) <= MARGINAL_SHARE * abs(x))


def law_a_loses_contact() -> claim.Check:
    """On a 20 mm bump A gains in jumps and loses contact (Fig. 7)."""
    bumps = _simulated_bumps("A")
    summary = "; ".join(
        [
            f"{run.entry}: {1e3 * run.total:+.3g} mJ, up to {1e3 * run.jump:.3g} mJ in 20 ms, "
            f"contact lost {run.lost} times"
            for run in bumps
        ]
    )
    # The energy of a jump must not be taken back, as it is by a field with a potential.
    confirmed = [0.25 * run.total < run.jump < run.total and run.lost > 1 for run in bumps]
    return check_over_assumptions(summary, confirmed, confirmed, _bump_numbers(bumps))


def law_d_is_balanced() -> claim.Check:
    """On a 20 mm bump D keeps its energy in balance (Fig. 7)."""
    bumps = _simulated_bumps("D")
    gains = [run.total for run in _simulated_bumps("A")]
    summary = "; ".join(
        [
            f"{run.entry}: {1e3 * run.total:+.3g} mJ against {1e3 * gain:+.3g} of A, up to "
            f"{1e3 * run.top:.0f} mm high"
            for run, gain in zip(bumps, gains, strict=True)
        ]
    )
    balanced = [
        abs(run.total) <= MARGINAL_SHARE * gain for run, gain in zip(bumps, gains, strict=True)
    ]
    return check_over_assumptions(f"{summary} of 20", balanced, balanced, _bump_numbers(bumps))


def _bump_numbers(bumps: tuple[BumpRun, ...]) -> dict[str, float]:
    numbers = {}
    for run in bumps:
        numbers[f"{run.entry}: energy [J]"] = run.total
        numbers[f"{run.entry}: in 20 ms [J]"] = run.jump
        numbers[f"{run.entry}: contact lost"] = float(run.lost)
        numbers[f"{run.entry}: highest [m]"] = run.top
        numbers[f"{run.entry}: ledger does not close by"] = run.closure
    return numbers


def divided_walls_are_passive() -> claim.Check:
    """κ₁ = κ₀/q preserves passivity, for any algorithm.

    κ₀ is the smooth wall's own onset of limit cycles in V.A's loop, q that of the depth reached.
    """
    onsets = {
        onset.onset.law: onset
        for onset in passivity_onsets(ALL_LAWS, (0,), STARTS)
        if onset.wall_rule
    }
    wall = onsets["W"].onset.quiet
    textured = {law: onset for law, onset in onsets.items() if law in PAPER_LAWS}
    violating = {law: onset for law, onset in textured.items() if onset.violates_wall_rule}
    summary = ", ".join(
        [
            f"{law} from {onset.onset.cycling:.0f} N/m on, where κ₀/q is {onset.wall_rule:.0f}"
            for law, onset in violating.items()
        ]
    )
    numbers: dict[str, claim.Number] = {"W: quiet to [N/m]": wall}
    for law, onset in textured.items():
        numbers[f"{law}: cycles at [N/m]"] = onset.onset.cycling
        numbers[f"{law}: κ₀/q [N/m]"] = onset.wall_rule or 0.0
    return claim.check_statement(
        f"without lag W is quiet to {wall:.0f} N/m; of {', '.join(textured)} cycle below κ₀/q: "
        f"{summary or 'none'}; D has no finite q there",
        printed=not violating,
        numbers=numbers,
    )


SIMULATED_CLAIM_IDS = tuple(
    name for name, row in claim.CATALOGUE.items() if "simulated_claims" in row.get("function", "")
)
"""Ids of the claims that are judged in this module."""
