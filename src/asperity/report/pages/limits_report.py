"""Reports of what devices render: the six limits of one, and sinusoids on several, with files."""

from __future__ import annotations

from dataclasses import replace

from asperity.analysis.limits.limit_rules import LIMIT_RULES, Limit
from asperity.analysis.results import check_limits
from asperity.core.files import write_bytes
from asperity.core.units import format_quantity
from asperity.envelopes.envelope import LISTED, DeviceEnvelope, Envelope
from asperity.report.document.page import (
    NO_PERCEPTUAL_TEST,
    PAPER_CITATION,
    SCREEN,
    Cell,
    Cells,
    DefinitionList,
    Media,
    Page,
    Picture,
    Row,
    Section,
    Table,
    TableLayout,
    assumption_sections,
    check_suffix,
    figure_bytes,
    figure_section,
    holds_cell,
    plot_later,
)
from asperity.report.pages.catalogue_report import device_numbers_table
from asperity.report.sentences.analysis_text import (
    amplitude_range_text,
    envelope_answer,
    symbol_lines,
)
from asperity.report.sentences.limit_sentences import (
    percent,
    speed_text,
    speeds_text,
    stiffness_text,
    texture_amount_text,
)
from asperity.report.sentences.surface_text import texture_name
from asperity.report.sentences.texts import (
    column_meanings,
    figure_text,
    glossary,
    readable_name,
    side_text,
    table_notes,
    yes_no_text,
)

_LIMIT_HEADINGS = ("", "limit", "condition", "left", "right", "holds", "for", "at speeds")
_NAME_COLUMN = 1
_SHARE_COLUMN = 6
_SPEEDS_COLUMN = 7
# Console width [characters] from which names have one line and shares are shown.
_WIDE_CONSOLE = 96
_LIMITS_LAYOUT = TableLayout(
    wrap=(_NAME_COLUMN, _SPEEDS_COLUMN),
    max_widths={_NAME_COLUMN: len("reconstruction")},
    max_widths_below=_WIDE_CONSOLE,
    min_console={_SHARE_COLUMN: _WIDE_CONSOLE},
)
_STYLES = {True: "", False: "bold red", None: "dim"}
_WAVE_HEADINGS = ("wavelength", "amplitude", "share", "frequency", "force")
MAX_WAVES = 16
"""Number of waves listed: those with the greatest share of the height variance."""
WAVE_LIMITS = tuple(rule.number for rule in LIMIT_RULES if rule.number != 5)


def six_limits_table(result: check_limits.Limits) -> Table:
    """Return one row per limit: number, name, condition, both sides, result, share and speeds."""
    rows = []
    for limit in result.limits:
        cells: Cells = [
            Cell(str(limit.number), "l"),
            limit.name,
            limit.inequality,
            side_text(limit.left, limit.unit),
            side_text(limit.right, limit.unit),
            holds_cell(limit.holds),
            "" if limit.share is None else percent(limit.share),
            _speeds_cell(limit),
        ]
        rows.append(Row(cells, style=_STYLES[limit.holds]))
    layout = replace(_LIMITS_LAYOUT, legend={_SHARE_COLUMN: column_meanings("limits")[0]})
    return Table(_LIMIT_HEADINGS, rows, (3, 4, _SHARE_COLUMN), layout)


def _speeds_cell(limit: Limit) -> str:
    if limit.missing_data:
        return f"needs {', '.join(limit.missing_data)}"
    return speeds_text(limit.speeds)


def listed_waves(result: check_limits.Limits) -> list[check_limits.RenderedWave]:
    """Return the waves of the table, the longest first."""
    largest = sorted(result.waves, key=lambda wave: -wave.share)[:MAX_WAVES]
    return sorted(largest, key=lambda wave: -wave.wavelength)


def _waves_table(result: check_limits.Limits, *, short: bool) -> Table:
    """Return wave, force and the limits met, a row per wave; ``short`` abbreviates the limits."""

    def cell(holds: bool | None) -> str | Cell:
        return yes_no_text(holds)[0] if short else holds_cell(holds)

    rows = [
        Row(
            [
                format_quantity(wave.wavelength, "m"),
                format_quantity(wave.amplitude, "m"),
                percent(wave.share),
                format_quantity(wave.frequency, "Hz"),
                format_quantity(wave.force, "N", digits=2),
                *[cell(wave.holds.get(number)) for number in WAVE_LIMITS],
                speeds_text((0.0, wave.top_speed)),
            ]
        )
        for wave in listed_waves(result)
    ]
    limits = [f"{number}" if short else f"limit {number}" for number in WAVE_LIMITS]
    headings = (*_WAVE_HEADINGS, *limits, "at speeds")
    return Table(headings, rows, range(len(_WAVE_HEADINGS)))


def limits_page(result: check_limits.Limits) -> Page:
    """Return the report: answer, limits, figure, waves and assumptions."""
    fields = [*dict.fromkeys([limit.device_field for limit in result.limits]), "friction"]
    notes = [*symbol_lines(result), *table_notes("limits")]
    limits = [six_limits_table(result)]
    terms = [*column_meanings("limits"), *glossary("limits")]
    surface = result.surface
    name = result.device.name
    return Page(
        title=f"Limits of {texture_name(surface.texture)}, law {surface.law.letter}, on the {name}",
        answer=result.answer,
        facts=_facts(result),
        sections=[
            Section("The six limits", limits, notes=notes, media=SCREEN | Media.NOTEBOOK),
            _figure_section(result),
            *_waves_sections(result),
            *assumption_sections(result.assumptions, device_numbers_table(result.device, fields)),
            Section("How to read it", [DefinitionList(terms)]),
        ],
        footer=f"{PAPER_CITATION}, section II.B. {NO_PERCEPTUAL_TEST}",
    )


def _facts(result: check_limits.Limits) -> list[tuple[str, str]]:
    texture = result.texture
    law = result.surface.law
    perceptibility = result.perceptibility
    return [
        ("Surface", str(texture.describe()["kind"])),
        ("Peak to valley", format_quantity(texture.peak_to_valley, "m")),
        ("Law", f"{law.letter}, {readable_name(law.name)}"),
        ("Device", result.device.name),
        ("Scanning speed", speed_text(result.speed)),
        ("Stiffness", stiffness_text(result)),
        ("Speeds at which all decided limits hold", speeds_text(result.speeds)),
        ("Texture force", f"{texture_amount_text(perceptibility)}: {perceptibility.tier}"),
    ]


def _figure_section(result: check_limits.Limits) -> Section:
    met = sum([all(wave.holds.values()) for wave in result.waves])
    figure = plot_later(result)
    media = Media.HTML | Media.NOTEBOOK
    count = len(result.waves)
    return figure_section("limits.waves", figure, media=media, count=count, met=met)


def _waves_sections(result: check_limits.Limits) -> list[Section]:
    """Return the waves in numbers, for a page and for a terminal."""
    if not result.waves:
        return []
    notes = []
    more = len(result.waves) - MAX_WAVES
    if more > 0:
        notes.append(f"And {more} more with less of the height variance.")
    return [
        Section("Wave by wave", [_waves_table(result, short=False)], notes=notes),
        Section("", [_waves_table(result, short=True)], notes=notes, media=Media.TERMINAL),
    ]


_ALL = SCREEN | Media.HEADING
TABLE_SUFFIX = ".csv"
"""Suffix of the file to which the borders of an envelope are written."""


def envelope_page(result: Envelope) -> Page:
    """Return the report: answer, diagram, ranges by law, points and assumptions."""
    names = ", ".join([envelope.device.name for envelope in result.devices])
    stiffness = format_quantity(result.conditions.min_stiffness, "N/m")
    speed = speed_text(result.conditions.speed)
    title, caption, alt = figure_text(
        "envelope.regions", stiffness=stiffness, speed=speed, count=len(result.devices)
    )
    figure = Picture(plot_later(result), alt)
    tables = [
        Section(envelope.device.name, [_ranges_table(envelope)], media=_ALL)
        for envelope in result.devices
    ]
    return Page(
        title=f"Sinusoids rendered by {names}",
        answer=" ".join(map(envelope_answer, result.devices)),
        facts=[("Devices", names), ("Least stiffness", stiffness), ("Scanning speed", speed)],
        sections=[
            Section(title, [figure], caption, media=Media.HTML | Media.NOTEBOOK),
            *tables,
            *_points_sections(result),
            *assumption_sections(result.assumptions),
            Section("How to read it", [DefinitionList(glossary("envelope"))]),
        ],
        footer=f"{PAPER_CITATION}, section II.B. {NO_PERCEPTUAL_TEST}",
    )


def _ranges_table(envelope: DeviceEnvelope) -> Table:
    """Return the area and the rendered amplitudes at some wavelengths, a row per law."""
    borders = envelope.laws[0].borders
    shown = [i for i, border in enumerate(borders) if border.wavelength in LISTED]
    if not shown:
        shown = list(range(0, len(borders), 1 + len(borders) // 6))
    lengths = [format_quantity(borders[i].wavelength, "m") for i in shown]
    rows = []
    for law in envelope.laws:
        curl = yes_no_text(not law.conservative)
        ranges = [amplitude_range_text(law.borders[i]) for i in shown]
        cells: Cells = [Cell(law.letter, "l"), f"{law.decades:.2f}", curl, *ranges]
        rows.append(Row(cells, law is envelope.widest, law=law.letter))
    layout = TableLayout(drop_order=[0, 1, *range(3, 3 + len(shown)), 2], gap=2)
    return Table(("law", "decades²", "curl", *lengths), rows, range(3, 3 + len(shown)), layout)


def _points_sections(result: Envelope) -> list[Section]:
    """Return the greatest waves of the surfaces, if any, and the laws that render each."""
    if not result.surfaces:
        return []
    headings = (
        "surface",
        "wavelength",
        "amplitude",
        *[envelope.device.id for envelope in result.devices],
    )
    rows = []
    for surface in result.surfaces:
        for index, wave in enumerate(surface.waves):
            sizes = [format_quantity(x, "m") for x in (wave.wavelength, wave.amplitude)]
            laws = [letters[index] or "none" for letters in surface.rendered_by]
            rows.append(Row([surface.name, *sizes, *laws]))
    title = "Waves of the surfaces, and the laws that render each alone"
    return [Section(title, [Table(headings, rows, (1, 2))], media=_ALL)]


def write_envelope(result: Envelope, path: str) -> None:
    """Write the borders as CSV, or the diagram, by the suffix of the path.

    Raises:
        ParameterError: for another suffix, or a file that cannot be written.
    """
    suffix = check_suffix(path, TABLE_SUFFIX)
    if suffix == TABLE_SUFFIX:
        result.to_csv(path)
    else:
        write_bytes("output", path, figure_bytes(result, suffix))
