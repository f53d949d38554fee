"""The paper's claims and their verdicts: in a terminal, and as a page."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from rich.console import Console

from asperity.paper import VERDICTS, Result, Verdict
from asperity.paper.claim import Number
from asperity.paper.experiments import Experiments
from asperity.report import page, terminal
from asperity.report.page import Cell, Cells, Page, Row, Section, added_sections, assumed
from asperity.report.terminal import say

# Kind of cell on a page, and the colours of kinds in a terminal.
_KINDS: dict[Verdict, str] = {
    "holds": "good",
    "holds with correction": "part",
    "does not hold": "no",
    "undecided": "open",
}
_COLOURS = {"good": "green", "part": "yellow", "no": "red", "open": "dim"}
_FACTS = (
    ("As printed", "holds"),
    ("A small change makes it right", "holds with correction"),
    ("True is something else", "does not hold"),
    ("Perception, or left to guesses", "undecided"),
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


def print_results(
    results: Sequence[Result], experiments: Experiments | None, console: Console
) -> None:
    """Print one row per claim, the counts, and one line per experiment."""
    rows = []
    for section, members in _by_section(results):
        rows.append(Row([f"§ {section}", "", ""], style="bold"))
        for result in members:
            numbers = ", ".join(result.equations)
            statement = f"{numbers}: {result.statement}" if numbers else result.statement
            if result.evidence.fitted:
                statement += f" ({result.evidence.fitted})"
            verdict = Cell(result.verdict, _KINDS[result.verdict])
            rows.append(Row([result.id, verdict, statement]))
    table = page.Table(("claim", "verdict", "states"), rows)
    console.print(terminal.table(table, wraps=(2,), styles=_COLOURS, gap=2, ruled=False))
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
    say(console, result.verdict, _COLOURS[_KINDS[result.verdict]])
    say(console, result.evidence.summary)
    for name, words in _said(result)[1:]:
        say(console, f"{name[0].upper()}{name[1:]}: {words}")
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


def _said(result: Result) -> list[tuple[str, str]]:
    """Return what is said of a claim's evidence, by what it is."""
    evidence = result.evidence
    said = [
        ("found", evidence.summary),
        ("not stated by the paper", evidence.fitted),
        ("correction", evidence.correction),
        ("another verdict with", result.flips_under),
    ]
    return [(name, words) for name, words in said if words]


def _row(result: Result) -> Row:
    evidence = result.evidence
    details = _said(result)
    details += [(name, evidence_text(value)) for name, value in evidence.numbers.items()]
    details.append(("run it again", f"asperity reproduce --claim {result.id}"))
    cells: Cells = [
        Cell(result.id, "l"),
        ", ".join(result.equations),
        Cell(result.statement, below=evidence.fitted, details=details),
        Cell(result.verdict, _KINDS[result.verdict]),
    ]
    return Row(cells, id=result.id)
