"""The paper's claims and their verdicts: in a terminal, and as a page."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from rich.console import Console
from rich.text import Text

from asperity.paper import VERDICTS, Result, Verdict
from asperity.paper.claim import Number
from asperity.paper.experiments import Experiments
from asperity.report import page, terminal
from asperity.report.page import Cell, Cells, Page, Row, Section, added_sections, assumed
from asperity.report.terminal import Column, say

# Colour in a terminal, and kind of cell on a page.
_LOOKS: dict[Verdict, tuple[str, str]] = {
    "holds": ("green", "good"),
    "holds with correction": ("yellow", "part"),
    "does not hold": ("red", "no"),
    "undecided": ("dim", "open"),
}
_FACTS = (
    ("As printed", "holds"),
    ("A small change makes it right", "holds with correction"),
    ("True is something else", "does not hold"),
    ("Perception, or not computable", "undecided"),
)
_FOOTER = (
    "on Campion and Hayward, “On the Synthesis of Haptic Textures”. Every verdict follows from "
    "numbers that are computed when this page is made."
)


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


def _verdict(result: Result) -> Text:
    return Text(result.verdict, style=_LOOKS[result.verdict][0])


def print_results(
    results: Sequence[Result], experiments: Experiments | None, console: Console
) -> None:
    """Print one row per claim, the counts, and one line per experiment."""
    rows: list[tuple[list[str | Text], str]] = []
    for section, members in _by_section(results):
        rows.append(([Text(f"§ {section}", style="bold"), "", ""], ""))
        for result in members:
            numbers = ", ".join(result.equations)
            statement = f"{numbers}: {result.statement}" if numbers else result.statement
            rows.append(([result.id, _verdict(result), statement], ""))
    columns = (Column("claim"), Column("verdict"), Column("states", wraps=True))
    console.print(terminal.table(columns, rows, gap=2, ruled=False))
    console.print()
    say(console, counts_text(results), "bold")
    if experiments is not None:
        console.print()
        for name, words in experiments.lines:
            say(console, f"{name}: {words}")
    console.print()
    say(console, "The evidence of one: asperity reproduce --claim ID", "dim")


def print_evidence(result: Result, console: Console) -> None:
    """Print a claim with everything that its verdict rests on."""
    places = ", ".join((*result.equations, f"section {result.section}"))
    say(console, f"{result.id} ({places})", "bold")
    say(console, result.statement)
    console.print(_verdict(result))
    say(console, result.evidence.summary)
    if result.evidence.correction:
        say(console, f"Correction: {result.evidence.correction}")
    for name, value in result.evidence.numbers.items():
        say(console, f"  {name}: {evidence_text(value)}", "dim")
    console.print()


def reproduce_page(results: Sequence[Result], experiments: Experiments | None) -> Page:
    """Return the report: counts, claims by section with their evidence, figures, experiments."""
    from asperity.report.experiments import experiment_sections, paper_sections

    sections = [_claims(name, members) for name, members in _by_section(results)]
    sections += paper_sections()
    guesses: list[str] = []
    if experiments is not None:
        sections += experiment_sections(experiments)
        guesses += [*experiments.passivity.fitted, *experiments.scanning.guessed]
        guesses += [*experiments.bump.guessed, *experiments.beyond.guessed]
    sections += [*added_sections(Result, results, experiments), *assumed(guesses)]
    title = "“On the Synthesis of Haptic Textures”, claim by claim"
    return Page(title, counts_text(results), _FACTS, sections, _FOOTER)


def _by_section(results: Sequence[Result]) -> list[tuple[str, list[Result]]]:
    grouped = groupby(results, key=lambda result: result.section)
    return [(section, [*members]) for section, members in grouped]


def _claims(section: str, members: Sequence[Result]) -> Section:
    headings = ("claim", "equations", "states", "verdict")
    table = page.Table(headings, [_row(result) for result in members])
    return Section(section if section == "Abstract" else f"Section {section}", [table])


def _row(result: Result) -> Row:
    evidence = result.evidence
    details = [("found", evidence.summary)]
    if evidence.correction:
        details.append(("correction", evidence.correction))
    details += [(name, evidence_text(value)) for name, value in evidence.numbers.items()]
    details.append(("run it again", f"asperity reproduce --claim {result.id}"))
    cells: Cells = [
        Cell(result.id, "l"),
        ", ".join(result.equations),
        Cell(result.statement, details=details),
        Cell(result.verdict, _LOOKS[result.verdict][1]),
    ]
    return Row(cells, id=result.id)
