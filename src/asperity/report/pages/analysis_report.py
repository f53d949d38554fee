"""Report of the analysis of one law."""

from __future__ import annotations

import math
from dataclasses import replace

from asperity.analysis.passivity.verdict import Passivity
from asperity.analysis.results.analyze import PASSIVITY_FIELDS, Analysis
from asperity.core.units import format_quantity
from asperity.report.document.page import (
    HEADED,
    NO_PERCEPTUAL_TEST,
    PAPER_CITATION,
    Block,
    Cell,
    Cells,
    DefinitionList,
    Media,
    Page,
    Paragraph,
    Row,
    Section,
    Table,
    TableLayout,
    assumption_sections,
    figure_section,
    holds_cell,
    pairs_table,
    plot_later,
)
from asperity.report.pages.catalogue_report import device_numbers_table
from asperity.report.sentences.analysis_text import (
    bound_notes,
    computed_bounds,
    critical_speed_text,
    thrust_text,
)
from asperity.report.sentences.passivity_sentences import (
    absorbing_friction_text,
    stability_limit_text,
)
from asperity.report.sentences.surface_text import texture_name
from asperity.report.sentences.texts import (
    NOT_AVAILABLE,
    format_in_one_unit,
    friction_force_text,
    glossary,
    interval_text,
    limit_text,
    lower_bound_text,
    margin_text,
    merit_text,
    position_text,
    range_text,
    readable_name,
    sentence,
    upper_bound_text,
    witness_text,
)

_BOUND_HEADINGS = ("number", "lower", "upper", "method", "attained at")
_CRITERIA_HEADINGS = ("criterion", "condition", "holds", "limit", "margin", "conclusion, premises")
_JUMP_HEADINGS = ("at depth", "jumps by", "near (both witnesses are in the JSON)")
_MEDIA = HEADED | Media.HTML


def undecided_criteria(analysis: Analysis) -> list[tuple[str, str]]:
    """Return the criteria that decide nothing, grouped by reason: names and reason."""
    names: dict[str, list[str]] = {}
    for criterion in analysis.passivity.criteria:
        if criterion.holds is None:
            names.setdefault(criterion.conclusion, []).append(criterion.name)
    return [("; ".join(group), reason) for reason, group in names.items()]


def leak_facts(analysis: Analysis) -> list[tuple[str, str]]:
    """Return names and values of the worst loop."""
    leak = analysis.leak
    density = analysis.curl_density
    line = analysis.leak.line
    direction = ", ".join([f"{float(part) + 0.0:.6g}" for part in line.direction])
    start = ", ".join([f"{1e3 * float(part) + 0.0:.6g}" for part in line.start])
    plane = f"vertical, along ({direction}) through ({start}) mm"
    energy = NOT_AVAILABLE
    if not math.isnan(leak.energy):
        energy = range_text(leak.energy, leak.upper_per_period, "J")
        energy += f" per traversal ({leak.method})"
    facts = [
        ("energy", energy),
        ("description", leak.description),
        ("plane", f"{plane}, {format_quantity(line.length, 'm')} of it"),
    ]
    if len(leak.vertices):
        path = f"{len(leak.vertices)} vertices, {format_quantity(leak.length, 'm')} long"
        mean = format_quantity(leak.per_length, "N")
        facts.append(("polygon", path))
        facts.append(("per length", f"{mean}: energy over the length of the line"))
    if leak.steady is not None:
        steady = format_quantity(leak.steady, "J")
        facts.append(("steady", f"{steady} a turn, once turns are alike, on the worst path found"))
    friction = leak.absorbing
    if not analysis.conservative:
        facts.append(("f_c*", f"{absorbing_friction_text(friction)} at every speed"))
    if friction.planes and not analysis.conservative:
        loop = f"{format_quantity(friction.energy, 'J')} on {format_quantity(friction.length, 'm')}"
        facts.append(("greatest W/length", loop))
    facts += [("v*", critical_speed_text(analysis)), ("thrust", thrust_text(analysis))]
    if density is not None and density.upper > 0.0:
        area = range_text(density.lower, density.upper, "J/m²")
        facts.append(("small loops", f"gain at most {area}: the greatest |curl f|"))
    return facts


def merit_facts(analysis: Analysis) -> list[tuple[str, str]]:
    """Return strength, support and force on the scan that compares laws."""
    scan = analysis.merit
    surface = analysis.surface
    strength = merit_text(scan.strength)
    if not surface.texture.scan_line().periodic:
        strength += " m"
    facts = [
        ("strength T", strength),
        ("support S", merit_text(scan.support)),
        ("RMS force", f"{format_quantity(scan.ripple * surface.stiffness, 'N')} RMS at this k"),
        ("height", f"z = {format_quantity(scan.height, 'm')}"),
    ]
    if analysis.friction_force is not None:
        facts.append(("friction", friction_force_text(analysis.friction_force)))
    if scan.contact_lost > 0.0:
        facts.append(("no contact", f"on {100.0 * scan.contact_lost:.0f} % of the scan"))
    return facts


# --- tables ---------------------------------------------------------------------------------------


def bounds_table(analysis: Analysis) -> Table:
    """Return one row per number: lower, upper, method and the point that attains lower."""
    bounds = computed_bounds(analysis)
    density = analysis.curl_density
    if density is not None and density.upper > 0.0:
        bounds.append(("|curl f| [N/m]", density))
    rows = []
    for name, bound in bounds:
        ends = [lower_bound_text(bound.lower), upper_bound_text(bound.upper)]
        rows.append(Row([Cell(name, "l"), *ends, bound.method, witness_text(bound)]))
    return Table(_BOUND_HEADINGS, rows, (1, 2), TableLayout(wrap=(4,)))


def criteria_table(passivity: Passivity) -> Table:
    """Return one row per criterion of passivity; the decisive one is marked."""
    rows = []
    for criterion in passivity.criteria:
        decides = criterion.name == passivity.decided_by
        cells: Cells = [
            Cell(criterion.name, "l"),
            Cell(criterion.formula, "line"),
            holds_cell(criterion.holds),
            limit_text(criterion.limit),
            margin_text(criterion.margin),
            Cell(criterion.conclusion, subtext=criterion.assumptions),
        ]
        style = "dim" if criterion.holds is None else ""
        rows.append(Row(cells, decides, style=style))
    return Table(_CRITERIA_HEADINGS, rows, (3, 4))


def _jumps_table(analysis: Analysis) -> Table:
    """Return one row per depth at which a jump was located."""
    jumps = analysis.continuity.jumps
    depths = format_in_one_unit([jump.depth for jump in jumps], "m")
    sizes = format_in_one_unit([jump.size for jump in jumps], "N")
    places = [position_text(jump.before) for jump in jumps]
    rows = [Row(cells) for cells in zip(depths, sizes, places, strict=True)]
    return Table(_JUMP_HEADINGS, rows, (0, 1), TableLayout(wrap=(2,)))


# --- the page -------------------------------------------------------------------------------------


def analysis_page(analysis: Analysis) -> Page:
    """Return the report: verdict, numbers, criteria, figures and assumptions."""
    surface = analysis.surface
    name = analysis.device.name
    # The map of a profile shows no more than its section.
    gain_figures = ("gain", "depth") if surface.texture.is_profile else ("gain", "top", "depth")
    return Page(
        title=f"{texture_name(surface.texture)}, law {surface.law.letter}, on the {name}",
        answer=analysis.answer,
        facts=_facts(analysis),
        sections=[
            _bounds_section(analysis),
            *_figure_sections(analysis, *gain_figures),
            *_criteria_sections(analysis),
            Section("Worst loop", [pairs_table(leak_facts(analysis))], media=_MEDIA),
            *_figure_sections(analysis, "field"),
            _continuity_section(analysis),
            Section("On a straight scan", [pairs_table(merit_facts(analysis))], media=_MEDIA),
            *assumption_sections(
                analysis.assumptions, device_numbers_table(analysis.device, PASSIVITY_FIELDS)
            ),
            Section("How to read it", [DefinitionList(glossary("analysis"))]),
        ],
        footer=f"{PAPER_CITATION}. {NO_PERCEPTUAL_TEST}",
    )


def _facts(analysis: Analysis) -> list[tuple[str, str]]:
    surface = analysis.surface
    decisive = analysis.passivity.criterion(analysis.passivity.decided_by)
    return [
        ("Surface", str(surface.texture.describe()["kind"])),
        ("Peak to valley", format_quantity(surface.texture.peak_to_valley, "m")),
        ("Law", f"{surface.law.letter}, {readable_name(surface.law.name)}"),
        ("Device", analysis.device.name),
        ("Stiffness", f"{surface.stiffness:g} N/m"),
        ("Pressed to", format_quantity(surface.max_depth, "m")),
        ("Characteristic number q", interval_text(analysis.q)),
        (f"Greatest stiffness by {decisive.name}", limit_text(decisive.limit)),
    ]


def _bounds_section(analysis: Analysis) -> Section:
    law = analysis.surface.law
    return Section(
        f"Law {law.letter}, {readable_name(law.name)}: suprema over the working region",
        [bounds_table(analysis)],
        notes=bound_notes(analysis),
        media=_MEDIA | Media.NOTEBOOK,
    )


def _criteria_sections(analysis: Analysis) -> list[Section]:
    """Return the criteria for a page, and in short for a terminal."""
    passivity = analysis.passivity
    table = criteria_table(analysis.passivity)
    title = f"Passive on the {analysis.device.name}?"
    marked = [replace(row, cells=["→" * row.is_best, *row.cells]) for row in table.rows]
    layout = TableLayout(wrap=(1,), max_widths={1: 18}, omit=(6,))
    short = Table(("", *table.headings), marked, (4, 5), layout)
    limit = stability_limit_text(passivity.stability_limit, passivity.loop)
    stiffness = f"Stiffness: {limit}"
    verdict = f"{passivity.verdict}. It rests on: {passivity.decided_by}"
    caption = sentence("criteria", verdict=verdict, stiffness=stiffness)
    undecided = DefinitionList(undecided_criteria(analysis))
    blocks: list[Block] = [short, undecided, Paragraph(stiffness)]
    return [
        Section(title, [table], caption, media=Media.HTML | Media.NOTEBOOK),
        Section(f"{title} {passivity.verdict}", blocks, media=HEADED),
    ]


def _continuity_section(analysis: Analysis) -> Section:
    blocks: list[Block] = [Paragraph(analysis.continuity.reason)]
    if analysis.continuity.jumps:
        blocks.append(_jumps_table(analysis))
    return Section("Continuity", blocks, media=_MEDIA)


def _figure_sections(analysis: Analysis, *names: str) -> list[Section]:
    """Return the figures of these names."""
    sections = []
    leak = analysis.leak
    gained = range_text(leak.energy, leak.upper_per_period, "J")
    values: dict[str, object] = {
        "letter": analysis.surface.law.letter,
        "q": interval_text(analysis.q),
        "loop": "",
    }
    if len(leak.vertices):
        values["loop"] = f"; the worst loop gains {gained}"
    for name in names:
        figure = plot_later(analysis, name)
        media = Media.HTML | Media.NOTEBOOK if name == "gain" else Media.HTML
        text = f"analysis.{name}"
        sections.append(figure_section(text, figure, (), 3, media, **values))
    return sections
