"""Results say themselves in one line at a prompt."""

from __future__ import annotations

import asperity as asp
from asperity.analysis.several import compare_several


def test_results_are_one_line_each() -> None:
    texture = asp.Sinusoid(2e-4, 2e-3)
    result = asp.compare(texture, "omega.3", "WCH")
    row = result.recommended_row
    assert row is not None
    start = f"start at {row.start:g} N/m, felt"
    assert repr(row) == f"<LawRow {row.law.letter}: {start}>"
    assert repr(result) == f"<Comparison of 3 laws on omega.3: {row!r} recommended>"
    assert repr(asp.compare(texture, "touch", "W")).endswith("none recommended>")
    surface = asp.Surface(texture, "A", 100.0)
    analysis = repr(asp.analyze(surface, "omega.3"))
    assert analysis.startswith("<Analysis of law A on omega.3: q = ")
    assert analysis.endswith("not passive>")
    limits = repr(asp.limits(texture, "omega.3", law="C"))
    assert limits == "<Limits of law C on omega.3 at 0.1 m/s: 4 of 6 hold, felt>"
    several = repr(compare_several(texture, ["omega.3", "2diy"], laws="W"))
    assert several == "<Comparisons: 1 answered, 1 lacking>"
