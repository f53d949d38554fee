"""Reports of comparisons: laws on one device or several, and a texture that meets a target."""

from __future__ import annotations

from functools import partial
from operator import attrgetter

from asperity.analysis.limits import perceptibility_sentences
from asperity.analysis.limits.perceptibility_sentences import force_magnitude_text
from asperity.analysis.results.check_limits import percent
from asperity.analysis.results.compare import Comparison
from asperity.analysis.results.device_comparisons import DeviceComparisons
from asperity.analysis.results.recommendation import LawRow
from asperity.core.units import format_quantity
from asperity.envelopes.find_design import Design
from asperity.envelopes.searches import FORCE, MET
from asperity.report.document import page
from asperity.report.document.page import Cell, Media, Page, Row, Section, Table, TableLayout
from asperity.report.pages.comparison_columns import (
    describe_texture,
    law_rows,
    law_sections,
    recommended_stiffness_text,
    terminal_sections,
    texture_name,
)
from asperity.report.pages.device_report import datum_text, device_numbers_table
from asperity.report.pages.measured_report import measured_sections, thin_sections
from asperity.report.sentences.alt_text import COMPARISON_FIGURES, comparison_alt_text
from asperity.report.sentences.number_text import (
    NOT_AVAILABLE,
    bound_text,
    limit_text,
    position_text,
)
from asperity.report.sentences.texts import column_meanings, figure_text, glossary

_FOOTER = f"{page.PAPER_CITATION}. {page.NO_PERCEPTUAL_TEST}"


def comparison_page(comparison: Comparison, full: bool = False) -> Page:
    """Return the report: answer, tables, figures, assumptions and provenance.

    Args:
        comparison: the result.
        full: whether a terminal shows every number instead of the summary.
    """
    return Page(
        title=f"{texture_name(comparison.texture)} on the {comparison.device.name}",
        answer=comparison.recommendation,
        facts=_facts(comparison),
        sections=[
            *terminal_sections(comparison, full),
            *law_sections(comparison),
            *_figure_sections(comparison),
            *thin_sections(comparison.texture),
            *measured_sections(comparison.texture),
            *page.assumption_sections(
                comparison.assumptions,
                device_numbers_table(comparison.device, list(comparison.device.data)),
            ),
            _provenance_section(comparison),
            Section("How to read it", [page.DefinitionList(glossary("comparison"))]),
        ],
        footer=_FOOTER,
    )


def _facts(comparison: Comparison) -> list[tuple[str, str]]:
    texture = comparison.texture
    device = comparison.device
    return [
        ("Surface", describe_texture(texture.describe())),
        ("Peak to valley", format_quantity(texture.peak_to_valley, "m")),
        ("Device", device.name),
        ("K₀, stiffest smooth wall", datum_text(device.wall_test)),
        ("Stiffness", _requested_stiffness_text(comparison)),
        ("Pressed to", format_quantity(comparison.max_depth, "m")),
        ("Scanned at", perceptibility_sentences.speed_text(comparison.speed)),
    ]


def _requested_stiffness_text(comparison: Comparison) -> str:
    stiffness = comparison.stiffness
    recommended = "the recommended one of each law"
    return recommended if stiffness is None else format_quantity(stiffness, "N/m", 4)


def _figure_sections(comparison: Comparison) -> list[Section]:
    depth = format_quantity(comparison.max_depth, "m")
    stiffness = _requested_stiffness_text(comparison)
    find_digest = partial(attrgetter("content_digest"), comparison)  # slow, for a page alone
    sections = []
    for name in COMPARISON_FIGURES:
        text = partial(comparison_alt_text, comparison, name)
        picture = page.Picture(page.plot_later(comparison, name), text, name, find_digest)
        media = Media.HTML | Media.NOTEBOOK if name == "merit" else Media.HTML
        title, caption, _ = figure_text(f"comparison.{name}", depth=depth, stiffness=stiffness)
        sections.append(Section(title, [picture], caption, media=media))
    return sections


def _provenance_section(comparison: Comparison) -> Section:
    """Return how each number was obtained."""
    headings = ("law", "q", "attained at", "q⁺", "conservative", "leak", "continuous")
    rows = [
        Row(
            [
                Cell(row.law.letter, "l"),
                f"{bound_text(row.q)} ({row.q.method}: {row.q.note})",
                position_text(row.q.at),
                f"{bound_text(row.one_sided)} ({row.one_sided.method}: {row.one_sided.note})",
                row.conservative_reason,
                f"{row.leak.method}: {row.leak.description}",
                row.continuous_reason,
            ],
            law=row.law.letter,
        )
        for row in comparison.rows
    ]
    return Section("Provenance of the numbers", [Table(headings, rows)])


# --- several devices and depths -------------------------------------------------------------------

_CASE_HEADINGS = ("device", "depth", "law", "start at", "texture", "felt?")


def _case_row(comparison: Comparison) -> Row:
    depth = format_quantity(comparison.max_depth, "m")
    best = comparison.recommended_row or comparison.nearest_row
    if best is None:
        return Row([comparison.device.name, depth, "none", *[NOT_AVAILABLE] * 3])
    text = best.law.letter if comparison.recommended else f"({best.law.letter})"
    return Row(
        [
            comparison.device.name,
            depth,
            Cell(text, "l", note=comparison.recommendation),
            limit_text(comparison.stiffness or best.recommended_stiffness),
            perceptibility_sentences.force_magnitude_text(best.resolved_force),
            perceptibility_sentences.tier_text(best.perceptibility),
        ]
    )


def cases_table(comparisons: DeviceComparisons) -> Table:
    """Return a row for each device and depth."""
    rows = [_case_row(one) for one in comparisons.comparisons]
    for missing in comparisons.missing_data:
        rows.append(Row([missing.device, NOT_AVAILABLE, "K₀ missing", *[NOT_AVAILABLE] * 3]))
    legend = dict(enumerate(column_meanings("cases"), start=1))
    layout = TableLayout(wrap=(0,), drop_order=(3, 4), legend=legend)
    return Table(_CASE_HEADINGS, rows, (1, 3, 4), layout)


def comparisons_page(comparisons: DeviceComparisons) -> Page:
    """Return the report: the table, then each device and depth with its laws and assumptions."""
    texture = comparisons.texture
    missing = [one.sentence for one in comparisons.missing_data]
    cases = comparisons.comparisons
    table = cases_table(comparisons)
    answers = [f"{_case_title(one)}: {one.recommendation}" for one in cases]
    common = [
        sentence
        for sentence in (cases[0].assumptions if cases else ())
        if all(sentence in one.assumptions for one in cases)
    ]
    assumed = [one for one in page.assumption_sections(common) if Media.TERMINAL in one.media]
    return Page(
        title=f"{texture_name(texture)} on several devices",
        answer=comparisons.recommendation,
        facts=[
            ("Surface", describe_texture(texture.describe())),
            ("Peak to valley", format_quantity(texture.peak_to_valley, "m")),
        ],
        sections=[
            page.terminal_section(table),
            *[page.terminal_section(page.Paragraph(text)) for text in (*answers, *missing)],
            *assumed,
            Section("", [table, *map(page.Paragraph, missing)], media=Media.NOTEBOOK),
            Section("Summary", [table, page.DefinitionList(column_meanings("cases"))]),
            *[_case_section(one) for one in cases],
            *([Section("Missing", [page.BulletList(missing)])] if missing else ()),
            *measured_sections(texture),
        ],
        footer=_FOOTER,
    )


def _case_title(comparison: Comparison) -> str:
    return f"{comparison.device.name}, {format_quantity(comparison.max_depth, 'm')} deep"


def _case_section(comparison: Comparison) -> Section:
    """Return answer, laws and assumptions of one device and depth."""

    def cells(row: LawRow) -> list[str | Cell]:
        felt = perceptibility_sentences.tier_text(row.perceptibility)
        return [Cell(row.law.letter, "l"), recommended_stiffness_text(row), felt, row.verdict]

    rows = law_rows(comparison, cells)
    table = Table(("law", "start at", "felt?", "verdict"), rows, (1,))
    answer = comparison.recommendation
    assumptions = comparison.assumptions
    return Section(
        _case_title(comparison), [page.Paragraph(answer), table, page.BulletList(assumptions)]
    )


def design_page(result: Design) -> page.Page:
    """Return the report: answer, margins, what is lost, and the comparison of the answer."""
    compared = comparison_page(result.comparison)
    rows = []
    for name, ratio in result.margins.items():
        note = "limits the answer" if name in result.binding else ""
        cell = Cell("not met", "no") if ratio < MET else note
        rows.append(Row([name, f"{ratio:.3g}", cell]))
    media = page.SCREEN | Media.HEADING
    title = "Margins: by which factor each requirement is exceeded"
    sections = [Section(title, [Table(("requirement", "margin", ""), rows, (1,))], media=media)]
    if result.lost:
        sections.append(Section("What the device takes away", [_lost_table(result)], media=media))
    return page.Page(
        title=f"Design for {result.comparison.device.name}",
        answer=design_answer(result),
        facts=compared.facts,
        sections=[*sections, *compared.sections],
        footer=compared.footer,
    )


def _lost_table(result: Design) -> Table:
    """Return what the device takes away from the texture."""
    rows = []
    for name, value in result.lost.items():
        words, _, unit = name.rstrip("]").partition(" [")
        rows.append(Row([words, format_quantity(value, unit) if unit else percent(value)]))
    return Table(("of the texture", "not rendered"), rows, (1,))


def design_answer(result: Design) -> str:
    """Return the design, and whether it meets the target, in a few sentences."""
    row = result.row
    texture = result.comparison.texture
    target = result.target
    k = format_quantity(row.surface.stiffness, "N/m", 4)
    felt = row.perceptibility
    height = format_quantity(texture.peak_to_valley, "m")
    way = "as high" if texture.single_wave is not None else "as large"
    unit = f"{target.measure} at the {target.at}"
    text = f"law {row.law.letter} at {k}, {result.factor:.4g} times {way}: {height} peak to valley"
    if felt is not None:
        text += f"; {force_magnitude_text(felt.texture_rms)} RMS of texture, "
        if target.texture_force and unit != "RMS at the motor":
            text += f"{force_magnitude_text(result.margins[FORCE] * target.texture_force)} {unit}, "
        text += (f"support {row.support:.2g}, " if target.min_support else "") + felt.tier
    verb = "limits" if len(result.binding) == 1 else "limit"
    limits = f"{' and '.join(result.binding)} {verb} it"
    if not result.is_feasible:
        force = f"{force_magnitude_text(result.reachable)} {unit}"
        most = force if result.reachable else "Nothing"
        return f"Not met. {most} can be reached; {limits}. Nearest: {text}."
    if target.texture_force is None:
        return f"The largest is l{text[1:]}. {limits[0].upper()}{limits[1:]}."
    least = min(result.margins.values())
    return f"L{text[1:]}. Least margin {least:.3g}; {limits}."
