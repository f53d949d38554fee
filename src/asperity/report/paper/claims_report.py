"""Report of the paper's claims and their verdicts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby

from asperity.paper import VERDICTS, Result, Verdict
from asperity.paper.claim import Number
from asperity.paper.experiments import Experiments
from asperity.report.page import (
    HEADED,
    Block,
    Cell,
    Cells,
    Media,
    Page,
    Paragraph,
    Row,
    Section,
    Table,
    TableLayout,
    assumption_sections,
    user_sections,
)

_VERDICT_KINDS: dict[Verdict, str] = {
    "holds": "good",
    "holds with correction": "part",
    "does not hold": "no",
    "undecided": "open",
}
_VERDICT_FACTS = (
    ("As printed", "holds"),
    ("With a small correction", "holds with correction"),
    ("Contradicted by the numbers", "does not hold"),
    ("Needs perception, or unstated values", "undecided"),
)
_MORE_NOTE = "The evidence of one claim: asperity reproduce --claim ID"
_FOOTER = (
    "on Campion and Hayward, “On the Synthesis of Haptic Textures”. Every verdict follows from "
    "numbers computed for this page."
)


def verdict_counts_text(results: Sequence[Result]) -> str:
    """Return the number of claims by verdict: "Of 60 claims 55 hold, ..."."""
    counts = {verdict: sum(r.verdict == verdict for r in results) for verdict in VERDICTS}
    words = ("hold", "hold with a correction", "do not hold", "are undecided")
    parts = [f"{count} {word}" for count, word in zip(counts.values(), words, strict=True)]
    return f"Of {len(results)} claims {', '.join(parts)}."


def evidence_text(value: Number) -> str:
    """Return a number of the evidence as text."""
    if isinstance(value, list):
        return ", ".join(f"{item:.10g}" for item in value)
    return value if isinstance(value, str) else f"{value:.10g}"


def claims_page(results: Sequence[Result], experiments: Experiments | None) -> Page:
    """Return the report: counts, claims by section with their evidence, figures, experiments."""
    from asperity.report.paper.experiment_report import experiment_sections, paper_sections

    sections = _terminal_sections(results, experiments)
    sections += [_claims_section(name, members) for name, members in _group_by_section(results)]
    sections += paper_sections()
    guesses: list[str] = []
    if experiments is not None:
        sections += experiment_sections(experiments)
        guesses += [*experiments.passivity.fitted, *experiments.scanning.guessed]
        guesses += [*experiments.bump.guessed, *experiments.devices.guessed]
    sections += user_sections(Result, results, experiments)
    sections += [one for one in assumption_sections(guesses) if Media.HTML in one.media]
    title = "“On the Synthesis of Haptic Textures”, claim by claim"
    return Page(title, verdict_counts_text(results), _VERDICT_FACTS, sections, _FOOTER)


def _terminal_sections(results: Sequence[Result], experiments: Experiments | None) -> list[Section]:
    """Return one row per claim and one line per experiment, for a terminal."""
    rows = []
    for section, members in _group_by_section(results):
        rows.append(Row([f"§ {section}", "", ""], style="bold"))
        for result in members:
            numbers = ", ".join(result.equations)
            statement = f"{numbers}: {result.statement}" if numbers else result.statement
            if result.evidence.fitted:
                statement += f" ({result.evidence.fitted})"
            verdict = Cell(result.verdict, _VERDICT_KINDS[result.verdict])
            rows.append(Row([result.id, verdict, statement]))
    layout = TableLayout(wrap=(2,), gap=2, has_rule=False)
    table = Table(("claim", "verdict", "states"), rows, layout=layout)
    lines = experiments.summary_lines if experiments is not None else ()
    summary = [Paragraph(f"{name}: {text}") for name, text in lines]
    return [
        Section("", [table], media=Media.TERMINAL),
        *([Section("", summary, media=Media.TERMINAL)] if summary else ()),
        Section("", (), notes=[_MORE_NOTE], media=Media.TERMINAL),
    ]


def evidence_page(results: Sequence[Result]) -> Page:
    """Return the report of chosen claims; a terminal shows everything that a verdict rests on."""
    page, evidence = claims_page(results, None), map(_evidence_section, results)
    sections = [section for section in page.sections if Media.HTML in section.media]
    return replace(page, answer="", sections=[*evidence, *sections])


def _evidence_section(result: Result) -> Section:
    places = ", ".join((*result.equations, f"section {result.section}"))
    verdict = Row([Cell(result.verdict, _VERDICT_KINDS[result.verdict])])
    details = _evidence_details(result)[1:]
    blocks: list[Block] = [
        Paragraph(result.statement),
        Table((), [verdict]),
        Paragraph(result.evidence.summary),
        *[Paragraph(f"{name[0].upper()}{name[1:]}: {text}") for name, text in details],
    ]
    numbers = result.evidence.numbers.items()
    notes = [f"  {name}: {evidence_text(value)}" for name, value in numbers]
    return Section(f"{result.id} ({places})", blocks, notes=notes, media=HEADED)


def _group_by_section(results: Sequence[Result]) -> list[tuple[str, list[Result]]]:
    grouped = groupby(results, key=lambda result: result.section)
    return [(section, [*members]) for section, members in grouped]


def _claims_section(section: str, members: Sequence[Result]) -> Section:
    headings = ("claim", "equations", "states", "verdict")
    table = Table(headings, [_claim_row(result) for result in members])
    return Section(section if section == "Abstract" else f"Section {section}", [table])


def _evidence_details(result: Result) -> list[tuple[str, str]]:
    """Return names and texts of the evidence of a claim."""
    evidence = result.evidence
    details = [
        ("found", evidence.summary),
        ("not stated by the paper", evidence.fitted),
        ("correction", evidence.correction),
        ("another verdict with", result.flips_under),
    ]
    return [(name, text) for name, text in details if text]


def _claim_row(result: Result) -> Row:
    evidence = result.evidence
    details = _evidence_details(result)
    details += [(name, evidence_text(value)) for name, value in evidence.numbers.items()]
    details.append(("reproduce", f"asperity reproduce --claim {result.id}"))
    cells: Cells = [
        Cell(result.id, "l"),
        ", ".join(result.equations),
        Cell(result.statement, subtext=evidence.fitted, details=details),
        Cell(result.verdict, _VERDICT_KINDS[result.verdict]),
    ]
    return Row(cells, id=result.id)
