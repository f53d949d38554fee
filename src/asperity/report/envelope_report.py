"""Report of the sinusoids that devices render, and its files."""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path

from asperity.analysis.limits.perceptibility_sentences import speed_text
from asperity.core.errors import ParameterError
from asperity.core.files import write_bytes
from asperity.core.units import format_quantity
from asperity.envelopes.envelope import LISTED, DeviceEnvelope, Envelope
from asperity.envelopes.wave_borders import WaveBorders
from asperity.report import page
from asperity.report.page import SCREEN, Cell, Media, Picture, Row, Section, Table, TableLayout
from asperity.report.sentences.number_text import NOT_AVAILABLE
from asperity.report.sentences.texts import figure_text, glossary

_ALL = SCREEN | Media.HEADING
SUFFIXES = (".csv", *page.FIGURE_SUFFIXES)
"""Suffixes of the files to which an envelope is written."""


def envelope_page(result: Envelope) -> page.Page:
    """Return the report: answer, diagram, ranges by law, points and assumptions."""
    names = ", ".join(one.device.name for one in result.devices)
    stiffness = format_quantity(result.conditions.min_stiffness, "N/m")
    speed = speed_text(result.conditions.speed)
    title, caption, alt = figure_text(
        "envelope.regions", stiffness=stiffness, speed=speed, count=len(result.devices)
    )
    figure = Picture(page.plot_later(result), alt)
    tables = [Section(one.device.name, [_ranges_table(one)], media=_ALL) for one in result.devices]
    return page.Page(
        title=f"Sinusoids rendered by {names}",
        answer=" ".join(map(_answer, result.devices)),
        facts=[("Devices", names), ("Least stiffness", stiffness), ("Scanning speed", speed)],
        sections=[
            Section(title, [figure], caption, media=Media.HTML | Media.NOTEBOOK),
            *tables,
            *([_points_section(result)] if result.surfaces else ()),
            *page.user_sections(Envelope, result),
            *page.assumption_sections(result.assumptions),
            Section("How to read it", [page.DefinitionList(glossary("envelope"))]),
        ],
        footer=f"{page.PAPER_CITATION}, section II.B. {page.NO_PERCEPTUAL_TEST}",
    )


def _answer(one: DeviceEnvelope) -> str:
    law = one.widest
    largest = max(one.laws, key=lambda other: other.decades)
    if not law.decades:
        return f"{one.device.name} renders no sinusoid with these laws."
    lengths = [border.wavelength for border in law.borders if border.decades]
    span = " to ".join(format_quantity(lengths[i], "m") for i in (0, -1))
    text = f"{one.device.name} renders most with law {law.letter}, wavelengths from {span}"
    if largest is law:
        return f"{text}{'' if law.conservative else '; it feels alive'}."
    return f"{text}; law {largest.letter} renders more, but feels alive."


def _ranges_table(one: DeviceEnvelope) -> Table:
    """Return the area and the rendered amplitudes at some wavelengths, a row per law."""
    shown = [i for i, border in enumerate(one.laws[0].borders) if border.wavelength in LISTED]
    shown = shown or list(range(0, len(one.laws[0].borders), 1 + len(one.laws[0].borders) // 6))
    lengths = [format_quantity(one.laws[0].borders[i].wavelength, "m") for i in shown]
    rows = []
    for law in one.laws:
        curl = "no" if law.conservative else "yes"
        ranges = [_range_text(law.borders[i]) for i in shown]
        cells: page.Cells = [Cell(law.letter, "l"), f"{law.decades:.2f}", curl, *ranges]
        rows.append(Row(cells, kind="best" if law is one.widest else "", law=law.letter))
    layout = TableLayout(drop_order=[0, 1, *range(3, 3 + len(shown)), 2], gap=2)
    return Table(("law", "area", "curl", *lengths), rows, range(3, 3 + len(shown)), layout)


def _range_text(border: WaveBorders) -> str:
    """Return the rendered amplitudes at a wavelength for reading."""
    if math.isnan(border.felt_from):
        return NOT_AVAILABLE
    low = format_quantity(border.felt_from, "m", digits=2)
    if math.isinf(border.felt_up_to):
        return f"from {low}"
    return f"{low} – {format_quantity(border.felt_up_to, 'm', digits=2)}"


def _points_section(result: Envelope) -> Section:
    """Return the greatest waves of the surfaces, and the laws that render each."""
    headings = ("surface", "wavelength", "amplitude", *[one.device.id for one in result.devices])
    rows = []
    for surface in result.surfaces:
        for index, wave in enumerate(surface.waves):
            sizes = [format_quantity(x, "m") for x in (wave.wavelength, wave.amplitude)]
            laws = [letters[index] or "none" for letters in surface.rendered_by]
            rows.append(Row([surface.name, *sizes, *laws]))
    title = "Waves of the surfaces, and the laws that render each alone"
    return Section(title, [Table(headings, rows, (1, 2))], media=_ALL)


def write_envelope(result: Envelope, path: str) -> None:
    """Write the borders as CSV, or the diagram, by the suffix of the path.

    Raises:
        ParameterError: for another suffix, or a file that cannot be written.
    """
    suffix = check_suffix(path)
    if suffix in page.FIGURE_SUFFIXES:
        content = page.figure_bytes(result, suffix)
    else:
        text = io.StringIO()
        rows = result.table_rows()
        writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
        content = text.getvalue().encode()
    write_bytes("output", path, content)


def check_suffix(path: str) -> str:
    """Return the suffix of a path, checked."""
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise ParameterError("output", f"must end in {', '.join(SUFFIXES)}", path)
    return suffix
