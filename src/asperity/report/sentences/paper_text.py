"""Claims of the paper and its simulated experiments as text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from asperity.core.units import count_text, format_quantity
from asperity.paper import VERDICTS, Result, Verdict
from asperity.paper.claim import Number
from asperity.paper.cycle_experiments import RESOLUTION, DeviceExperiment
from asperity.paper.experiments import Experiments
from asperity.paper.figures import LoopEnergy


class VerdictText(NamedTuple):
    """How a verdict is shown: its meaning, what that many claims do, and the kind of its cell."""

    meaning: str
    plural: str
    cell_kind: str


VERDICT_TEXTS: dict[Verdict, VerdictText] = {
    "holds": VerdictText("As printed", "hold", "good"),
    "holds with correction": VerdictText(
        "With a small correction", "hold with a correction", "part"
    ),
    "does not hold": VerdictText("Contradicted by the numbers", "do not hold", "no"),
    "undecided": VerdictText("Needs perception, or unstated values", "are undecided", "open"),
}


def verdict_counts_text(results: Sequence[Result]) -> str:
    """Return the number of claims by verdict: "Of 60 claims 55 hold, ..."."""
    counts = {verdict: sum([r.verdict == verdict for r in results]) for verdict in VERDICTS}
    parts = [f"{count} {VERDICT_TEXTS[verdict].plural}" for verdict, count in counts.items()]
    return f"Of {count_text(len(results), 'claim')} {', '.join(parts)}."


def evidence_text(value: Number) -> str:
    """Return a number of the evidence as text."""
    if isinstance(value, list):
        return ", ".join([f"{item:.10g}" for item in value])
    if isinstance(value, str):
        return value
    return f"{value:.10g}"


def loop_energy_text(panel: LoopEnergy) -> str:
    """Return the energy of the loop as text."""
    gain = round(1e6 * panel.energy, 1)
    energy = f"gains {gain:.1f} µJ" if gain > 0.0 else "returns all"
    return f"{energy}, as {panel.equation}" if panel.equation else energy


# --- simulated experiments -----------------------------------------------------------------------


def experiment_summaries(experiments: Experiments) -> tuple[tuple[str, str], ...]:
    """Return name and result of each experiment."""
    return (
        ("V.A", _summarize_cycles(experiments)),
        (
            "V.A onsets",
            f"{_summarize_delay_rule(experiments)}; {_summarize_wall_rule(experiments)}",
        ),
        ("V.B", _summarize_strokes(experiments)),
        ("V.C", _summarize_bumps(experiments)),
        ("devices", _summarize_devices(experiments)),
    )


def _summarize_cycles(experiments: Experiments) -> str:
    parts = [f"{count.wall} {count.cycles}" for count in experiments.passivity.counts]
    first = experiments.passivity.counts[0]
    return (
        f"of {first.starts} starts cycle at 2000 N/m and a lag of {first.delay} samples: "
        f"{', '.join(parts)}"
    )


def _summarize_wall_rule(experiments: Experiments) -> str:
    """Count the textures that cycle below the wall's own onset over q."""
    textured = [
        prediction
        for prediction in experiments.passivity.onsets
        if prediction.wall_rule and not prediction.onset.is_smooth_wall
    ]
    safe = [prediction for prediction in textured if not prediction.violates_wall_rule]
    missed = len(textured) - len(safe)
    text = f"below K0/q of the wall's own onset in {missed} of {len(textured)} cases"
    # A wall that cycles at the least stiffness tried may also cycle below it.
    unknown = sum([prediction.onset.quiet == 0.0 for prediction in safe])
    return f"{text}, unknown in {unknown}" if unknown else text


def _summarize_delay_rule(experiments: Experiments) -> str:
    predictions = experiments.passivity.onsets
    missed = [
        f"{prediction.onset.law} at d = {prediction.onset.delay}"
        for prediction in predictions
        if prediction.violates_delay_rule
    ]
    cases = sum([prediction.conservative for prediction in predictions])
    if not missed:
        return f"no limit cycle below the delay rule in {cases} cases of conservative laws"
    return (
        f"limit cycles below the delay rule in {len(missed)} of {cases} cases of conservative "
        f"laws, with steps of the encoder of {format_quantity(RESOLUTION, 'm')}; it is proved "
        f"for exact positions: {', '.join(missed)}"
    )


def _summarize_strokes(experiments: Experiments) -> str:
    counts: dict[str, list[bool]] = {}
    for done in experiments.scanning.strokes:
        counts.setdefault(done.stroke.law, []).append(done.stroke.gains_energy)
    parts = [f"{law} {sum(gains)}" for law, gains in counts.items()]
    total = max(map(len, counts.values()))
    return f"of {total} hands and speeds the field supplies energy: {', '.join(parts)}"


def _summarize_bumps(experiments: Experiments) -> str:
    bumps = experiments.bump.bumps
    return ", ".join([f"{run.law} {1e3 * run.total:+.3g} mJ ({run.entry})" for run in bumps])


def _summarize_devices(experiments: Experiments) -> str:
    onsets = experiments.devices.onsets
    missed = sum([onset.catalogue_rule_missed for onset in onsets])
    rules = sum([onset.prediction.violates_delay_rule for onset in onsets])
    text = (
        f"{missed} of {len(onsets)} cases cycle at a stiffness that the catalogue's K0/q "
        f"allows, {rules} below the delay rule"
    )
    summary = wall_summary_text(experiments.devices)
    return f"{text}; {summary}" if summary else text


def wall_summary_text(experiment: DeviceExperiment) -> str:
    """Return how the simulated walls compare with the catalogue; empty if none was simulated.

    It qualifies the number of cases that cycle below the catalogue's K₀/q.
    """
    ratios = experiment.wall_ratios
    if not ratios:
        return ""
    span = f"{min(ratios):.0f} to {max(ratios):.0f}"
    return f"the simulated wall itself cycles only at {span} times the catalogue's K0"


def fitted_notes(sentences: Sequence[str]) -> list[str]:
    """Return a note with the assumptions of an experiment."""
    return [f"Not stated by the paper: {'; '.join(sentences)}."]
