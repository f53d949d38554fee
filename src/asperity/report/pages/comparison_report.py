"""Reports of comparisons: laws on one device or several, and a texture that meets a target."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import chain
from operator import attrgetter

from asperity.analysis.results.compare import Comparison
from asperity.analysis.results.device_comparisons import DeviceComparisons
from asperity.analysis.results.recommendation import LawRow
from asperity.core.errors import ArgumentWriter, write_keyword
from asperity.core.units import format_quantity, format_stiffness
from asperity.envelopes.find_design import Design
from asperity.envelopes.searches import MET
from asperity.report.document.page import (
    HEADED,
    NO_PERCEPTUAL_TEST,
    PAPER_CITATION,
    SCREEN,
    BulletList,
    Cell,
    DefinitionList,
    Media,
    Page,
    Paragraph,
    Picture,
    Row,
    Section,
    Table,
    TableLayout,
    assumption_sections,
    plot_later,
    terminal_section,
)
from asperity.report.pages.catalogue_report import device_numbers_table
from asperity.report.pages.comparison_columns import law_rows, law_sections, terminal_sections
from asperity.report.pages.measured_report import measured_sections, thin_sections
from asperity.report.sentences.analysis_text import datum_text
from asperity.report.sentences.answer_sentences import (
    methods_text,
    recommendation_reasons,
    recommendation_text,
)
from asperity.report.sentences.assumption_sentences import comparison_defaults
from asperity.report.sentences.comparison_sentences import (
    case_title,
    design_answer,
    field_alt_text,
    force_alt_text,
    gain_alt_text,
    hand_alt_text,
    merit_alt_text,
    recommended_stiffness_text,
    requested_stiffness_text,
    risk_alt_text,
    spectrum_alt_text,
    surface_alt_text,
)
from asperity.report.sentences.limit_sentences import (
    force_magnitude_text,
    percent,
    speed_text,
    tier_text,
)
from asperity.report.sentences.surface_text import describe_texture, texture_name
from asperity.report.sentences.texts import (
    NOT_AVAILABLE,
    bound_text,
    column_meanings,
    figure_text,
    glossary,
    position_text,
)

_FOOTER = f"{PAPER_CITATION}. {NO_PERCEPTUAL_TEST}"


def comparison_page(
    comparison: Comparison,
    full: bool = False,
    why: bool = False,
    write_argument: ArgumentWriter = write_keyword,
) -> Page:
    """Return the report: answer, tables, figures, assumptions and provenance.

    Args:
        comparison: the result.
        full: whether a terminal shows every number instead of the summary.
        why: whether a terminal shows the reasons of the answer and all assumptions.
        write_argument: writes an argument that changes the answer, as in Python or as an option.
    """
    reasons = [BulletList(recommendation_reasons(comparison, write_argument))]
    assumed = assumption_sections(
        comparison.assumptions,
        device_numbers_table(comparison.device, list(comparison.device.data)),
        brief=None if why else comparison_defaults(comparison),
    )
    return Page(
        title=f"{texture_name(comparison.texture)} on the {comparison.device.name}",
        answer=recommendation_text(comparison, write_argument),
        facts=_facts(comparison),
        sections=[
            *([Section("Why:", reasons, media=HEADED)] if why else []),
            *terminal_sections(comparison, full),
            Section("Why", reasons),
            *law_sections(comparison),
            *_figure_sections(comparison),
            *thin_sections(comparison.texture),
            *measured_sections(comparison.texture),
            *assumed,
            _provenance_section(comparison),
            Section("How to read it", [DefinitionList(glossary("comparison"))]),
        ],
        footer=_FOOTER,
        methods=methods_text(comparison),
    )


def _facts(comparison: Comparison) -> list[tuple[str, str]]:
    texture = comparison.texture
    device = comparison.device
    return [
        ("Surface", describe_texture(texture.describe())),
        ("Peak to valley", format_quantity(texture.peak_to_valley, "m")),
        ("Device", device.name),
        ("K₀, stiffest smooth wall", datum_text(device.wall_test)),
        ("Stiffness", requested_stiffness_text(comparison)),
        ("Pressed to", _pressed_text(comparison)),
        ("Scanned at", speed_text(comparison.speed)),
    ]


def _pressed_text(comparison: Comparison) -> str:
    if comparison.press is not None:
        return format_quantity(comparison.press, "N")
    return format_quantity(comparison.max_depth, "m")


def _figure_sections(comparison: Comparison) -> list[Section]:
    depth = format_quantity(comparison.max_depth, "m")
    stiffness = requested_stiffness_text(comparison)
    find_digest = partial(attrgetter("content_digest"), comparison)  # slow, for a page alone
    sections = []
    for name, describe in _FIGURE_DESCRIPTIONS.items():
        text = partial(describe, comparison)
        picture = Picture(plot_later(comparison, name), text, name, find_digest)
        media = Media.HTML | Media.NOTEBOOK if name == "merit" else Media.HTML
        title, caption, _ = figure_text(f"comparison.{name}", depth=depth, stiffness=stiffness)
        sections.append(Section(title, [picture], caption, media=media))
    return sections


def _describe_surface(comparison: Comparison) -> str:
    return surface_alt_text(comparison.texture)


def _describe_spectrum(comparison: Comparison) -> str:
    from asperity.report.pictures.device_pictures import device_wavelength_limits, line_spectrum

    lengths, amplitudes = line_spectrum(comparison.texture)
    strongest = amplitudes.argmax()
    limits = [text for _length, text in device_wavelength_limits(comparison.device)]
    return spectrum_alt_text(float(lengths[strongest]), float(amplitudes[strongest]), limits)


def _describe_force(comparison: Comparison) -> str:
    from asperity.report.pictures.law_pictures import force_segment

    return force_alt_text(comparison, force_segment(comparison.texture).length)


# Functions that describe the figures of a comparison, in the order of its page.
_FIGURE_DESCRIPTIONS: dict[str, Callable[[Comparison], str]] = {
    "surface": _describe_surface,
    "spectrum": _describe_spectrum,
    "hand": hand_alt_text,
    "force": _describe_force,
    "field": field_alt_text,
    "gain": gain_alt_text,
    "merit": merit_alt_text,
    "risk": risk_alt_text,
}


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
    start = recommended_stiffness_text(best)
    if comparison.stiffness is not None:
        start = format_stiffness(comparison.stiffness)
    text = best.law.letter if comparison.recommended else f"({best.law.letter})"
    return Row(
        [
            comparison.device.name,
            depth,
            Cell(text, "l", note=comparison.recommendation),
            start,
            force_magnitude_text(best.resolved_force),
            tier_text(best.perceptibility),
        ]
    )


def cases_table(comparisons: DeviceComparisons) -> Table:
    """Return a row for each device and depth."""
    rows = list(map(_case_row, comparisons.comparisons))
    for missing in comparisons.missing_data:
        rows.append(Row([missing.device, NOT_AVAILABLE, "K₀ missing", *[NOT_AVAILABLE] * 3]))
    legend = dict(enumerate(column_meanings("cases"), start=1))
    layout = TableLayout(wrap=(0,), drop_order=(3, 4), legend=legend)
    return Table(_CASE_HEADINGS, rows, (1, 3, 4), layout)


def comparisons_page(comparisons: DeviceComparisons, why: bool = False) -> Page:
    """Return the report: the table, then each device and depth with its laws and assumptions."""
    texture = comparisons.texture
    missing = [device.sentence for device in comparisons.missing_data]
    cases = comparisons.comparisons
    table = cases_table(comparisons)
    answers = [f"{case_title(case)}: {case.recommendation}" for case in cases]
    common = _common_assumptions(cases)
    defaults = set(chain.from_iterable(map(comparison_defaults, cases)))
    brief = None if why else [text for text in common if text in defaults]
    assumed = assumption_sections(common, brief=brief)
    return Page(
        title=f"{texture_name(texture)} on several devices",
        answer=comparisons.recommendation,
        facts=[
            ("Surface", describe_texture(texture.describe())),
            ("Peak to valley", format_quantity(texture.peak_to_valley, "m")),
        ],
        sections=[
            terminal_section(table),
            *[terminal_section(Paragraph(text)) for text in (*answers, *missing)],
            *[section for section in assumed if Media.TERMINAL in section.media],
            Section("", [table, *map(Paragraph, missing)], media=Media.NOTEBOOK),
            Section("Summary", [table, DefinitionList(column_meanings("cases"))]),
            *map(_case_section, cases),
            *_missing_sections(missing),
            *measured_sections(texture),
        ],
        footer=_FOOTER,
    )


def _common_assumptions(cases: Sequence[Comparison]) -> list[str]:
    """Return the assumptions that all comparisons share."""
    return [
        assumption
        for comparison in cases[:1]
        for assumption in comparison.assumptions
        if all(assumption in other.assumptions for other in cases)
    ]


def _missing_sections(sentences: Sequence[str]) -> list[Section]:
    if not sentences:
        return []
    return [Section("Missing", [BulletList(sentences)])]


def _case_section(comparison: Comparison) -> Section:
    """Return answer, laws and assumptions of one device and depth."""

    def cells(row: LawRow) -> list[str | Cell]:
        felt = tier_text(row.perceptibility)
        return [Cell(row.law.letter, "l"), recommended_stiffness_text(row), felt, row.verdict]

    rows = law_rows(comparison, cells)
    table = Table(("law", "start at", "felt?", "verdict"), rows, (1,))
    answer = comparison.recommendation
    assumptions = comparison.assumptions
    return Section(case_title(comparison), [Paragraph(answer), table, BulletList(assumptions)])


def design_page(result: Design, why: bool = False) -> Page:
    """Return the report: answer, margins, what is lost, and the comparison of the answer."""
    compared = comparison_page(result.comparison, why=why)
    rows = []
    for name, ratio in result.margins.items():
        remark = Cell("")
        if ratio < MET:
            remark = Cell("not met", "no")
        elif name in result.binding:
            remark = Cell("limits the answer")
        rows.append(Row([name, f"{ratio:.3g}", remark]))
    media = SCREEN | Media.HEADING
    title = "Margins: by which factor each requirement is exceeded"
    sections = [Section(title, [Table(("requirement", "margin", ""), rows, (1,))], media=media)]
    if result.lost:
        sections.append(Section("What the device takes away", [_lost_table(result)], media=media))
    return Page(
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
        quantity, _, unit = name.rstrip("]").partition(" [")
        text = format_quantity(value, unit) if unit else percent(value)
        rows.append(Row([quantity, text]))
    return Table(("of the texture", "not rendered"), rows, (1,))
