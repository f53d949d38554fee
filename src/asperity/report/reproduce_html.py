"""The paper, claim by claim, as one HTML file that needs no network."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from asperity.paper import Result
from asperity.paper.experiments import Experiments
from asperity.report.page import Grid, Page, Picture, Row, page_html
from asperity.report.pictures.experiment_pictures import experiment_parts
from asperity.report.pictures.paper_pictures import paper_pictures
from asperity.report.reproduce_table import counts_text, number_text

KINDS = {
    "holds": "good",
    "holds with correction": "part",
    "does not hold": "no",
    "undecided": "open",
}
HEADINGS = ("claim", "equations", "states", "verdict")
FOOTER = (
    "on Campion and Hayward, “On the Synthesis of Haptic Textures”. Every verdict follows from "
    "numbers that are computed when this page is made."
)


def reproduce_html(results: Sequence[Result], experiments: Experiments | None) -> str:
    """Return the report: counts, claims by section with their evidence, figures, experiments."""
    parts: list[Picture | Grid] = []
    for section, members in groupby(results, key=lambda result: result.section):
        rows = [_row(result) for result in members]
        parts.append(
            Grid(section if section == "Abstract" else f"Section {section}", "", HEADINGS, rows)
        )
    parts += paper_pictures()
    assumptions: tuple[str, ...] = ()
    if experiments is not None:
        parts += experiment_parts(experiments)
        assumptions = (
            *experiments.passivity.fitted, *experiments.scanning.guessed,
            *experiments.bump.guessed, *experiments.beyond.guessed,
        )  # fmt: skip
    facts = [
        ("As printed", "holds"),
        ("A small change makes it right", "holds with correction"),
        ("True is something else", "does not hold"),
        ("Perception, or not computable", "undecided"),
    ]
    title = "“On the Synthesis of Haptic Textures”, claim by claim"
    return page_html(Page(title, counts_text(results), facts, parts, assumptions, FOOTER))


def _row(result: Result) -> Row:
    evidence = result.evidence
    details = [("found", evidence.summary)]
    if evidence.correction:
        details.append(("correction", evidence.correction))
    details += [(name, number_text(value)) for name, value in evidence.numbers.items()]
    details.append(("run it again", f"asperity reproduce --claim {result.id}"))
    cells = [result.id, ", ".join(result.equations), result.statement, result.verdict]
    kinds = {0: "l", 3: KINDS.get(result.verdict, "")}
    return Row(cells, kinds, result.id, "Evidence", details, details_in=2)
