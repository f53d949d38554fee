"""Report of the device catalogue, and the data of a device in other reports."""

from __future__ import annotations

from collections.abc import Sequence

from asperity.devices import FIELD_TABLE, Device, WallTest
from asperity.report.document import page
from asperity.report.document.page import (
    HEADED,
    Cell,
    Media,
    Page,
    Row,
    Section,
    Table,
    TableLayout,
)
from asperity.report.sentences.device_text import (
    datum_text,
    missing_fields,
    verified_text,
    wall_test_text,
)
from asperity.report.sentences.number_text import readable_name
from asperity.report.sentences.texts import table_notes

_NAME_MIN_CONSOLE = 96
"""Console width [characters] from which the full name has a column."""
_COLUMNS = {
    "max\nforce": "max_force",
    "stiffest\nwall": "max_stiffness",
    "position\nstep": "position_resolution",
    "force\nstep": "force_resolution",
    "update\nrate": "update_rate",
    "damping\nσ₀(B)": "damping",
}
"""The data that distinguish devices, by heading; all data are listed for one device."""


def devices_page(devices: Sequence[Device], *, detailed: bool = False) -> Page:
    """Return one row per device for a terminal; in detail, all data of each device."""
    if detailed:
        return Page("", "", (), [part for device in devices for part in _device_sections(device)])
    notes = table_notes("devices")
    if all(datum.verified for device in devices for datum in device.data.values()):
        notes = notes[1:]  # the first explains the mark of unverified data
    last = page.terminal_section(notes=notes)
    return Page("", "", (), [page.terminal_section(_devices_table(devices)), last])


def _devices_table(devices: Sequence[Device]) -> Table:
    """Return one row per device, the first column its id alone."""
    rows = []
    for device in devices:
        texts = [datum_text(device.data.get(field)) for field in _COLUMNS.values()]
        rows.append(Row([Cell(device.id, "l"), device.name, *texts]))
    headings = ("id", "device", *_COLUMNS)
    layout = TableLayout(wrap=(1,), min_console={1: _NAME_MIN_CONSOLE})
    return Table(headings, rows, range(2, len(headings)), layout)


def _device_table(device: Device) -> Table:
    """Return all data of a device with their sources, alternative values in rows below."""
    rows = []
    for field, datum in device.data.items():
        named = [(readable_name(field), datum), *[("  also", other) for other in datum.also]]
        for name, value in named:
            style = "" if value.verified else "yellow"
            cells = [name, value.text, verified_text(value), value.source]
            rows.append(Row(cells, style=style))
        if isinstance(datum, WallTest) and wall_test_text(datum):
            rows.append(Row(["  the test", "", "", wall_test_text(datum)]))
    headings = ("datum", "value", "verified", "source")
    return Table(headings, rows, (1,), TableLayout(wrap=(3,)))


def device_page(device: Device) -> Page:
    """Return the data of a device for a notebook."""
    table = device_numbers_table(device, list(device.data))
    return Page("", device.name, (), [Section("", [table], media=Media.NOTEBOOK)])


def device_numbers_table(device: Device, fields: Sequence[str]) -> Table:
    """Return data of a device, and which of them are missing.

    Args:
        device: the device.
        fields: names of the data.
    """
    rows = []
    for field in fields:
        name = readable_name(field)
        datum = device.data.get(field)
        if datum is None:
            missing = Cell("not known", "open")
            rows.append(Row([name, "", missing, FIELD_TABLE[field].description]))
            continue
        verified = Cell(verified_text(datum), "" if datum.verified else "open")
        test = wall_test_text(datum) if isinstance(datum, WallTest) else ""
        rows.append(Row([name, datum.text, verified, Cell(datum.source, subtext=test)]))
    return Table((device.name, "value", "verified", "source"), rows, numeric_columns=(1,))


def _device_sections(device: Device) -> list[Section]:
    """Return the data of a device, and what is missing, for a terminal."""
    title = device.name
    if device.name != device.id:
        title += f" ({device.id})"
    access = []
    if device.axes:
        access.append(f"Axes: {device.axes}")
    if device.driver:
        access.append(f"Driver: {device.driver}, which 'real' names")
    missing = [f"  {field}" for field in missing_fields(device)]
    if missing:
        missing.insert(0, "Missing data, without which some results are undecided:")
    parts = [access, *[[note] for note in device.notes], missing]
    return [
        Section(title, (), media=HEADED),
        page.terminal_section(_device_table(device)),
        *[page.terminal_section(*map(page.Paragraph, lines)) for lines in parts if lines],
    ]
