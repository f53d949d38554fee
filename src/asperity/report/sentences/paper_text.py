"""Verdicts and evidence of the claims of the paper as text."""

from __future__ import annotations

from collections.abc import Sequence

from asperity.paper import VERDICTS, Result
from asperity.paper.claim import Number
from asperity.paper.figures import LoopEnergy
from asperity.report.sentences.texts import table_data


def verdict_counts_text(results: Sequence[Result]) -> str:
    """Return the number of claims by verdict: "Of 60 claims 55 hold, ..."."""
    counts = {verdict: sum([r.verdict == verdict for r in results]) for verdict in VERDICTS}
    verdicts = table_data("verdicts")
    parts = [f"{count} {verdicts[verdict]['plural']}" for verdict, count in counts.items()]
    return f"Of {len(results)} claims {', '.join(parts)}."


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
