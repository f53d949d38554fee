"""The paper's claims in words."""

from __future__ import annotations

from collections.abc import Sequence

from asperity.paper import VERDICTS, Result
from asperity.paper.claim import Number


def counts_text(results: Sequence[Result]) -> str:
    """Return how many claims got each verdict, "55 hold, ..."."""
    counts = {verdict: sum(r.verdict == verdict for r in results) for verdict in VERDICTS}
    words = ("hold", "hold with a correction", "do not hold", "are undecided")
    parts = [f"{count} {word}" for count, word in zip(counts.values(), words, strict=True)]
    return f"Of {len(results)} claims {', '.join(parts)}."


def evidence_text(value: Number) -> str:
    """Return a number of the evidence as text."""
    if isinstance(value, list):
        return ", ".join(f"{item:.10g}" for item in value)
    return value if isinstance(value, str) else f"{value:.10g}"
