"""Report of the device catalogue, and the data of a device in other reports."""

from __future__ import annotations

from collections.abc import Sequence

from asperity.core.units import format_quantity
from asperity.devices import FIELD_TABLE, FIELD_UNITS, Datum, Device, WallTest
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
from asperity.report.sentences.number_text import NOT_AVAILABLE, readable_name
from asperity.report.sentences.texts import table_data, table_notes

UNVERIFIED_MARK = "?"
_NAME_MIN_CONSOLE = 96
"""Console width [characters] from which the full name has a column."""


def datum_text(datum: Datum | None) -> str:
    """Return a datum as text, with a ? if it is not verified; "–" for none.

    Example:
        >>> datum_text(Datum(5.5e-5, "m", "remembered", False)), datum_text(None)
        ('55 µm ?', '–')
    """
    if datum is None:
        return NOT_AVAILABLE
    return datum.text if datum.verified else f"{datum.text} {UNVERIFIED_MARK}"


def verified_text(datum: Datum) -> str:
    """Return the pedigree of a verified datum, "measured" or "read" in a public source, or "no"."""
    return datum.pedigree if datum.verified else "no"


def wall_test_text(test: WallTest) -> str:
    """Return the conditions of a wall test as text; "" without any.

    Example:
        >>> wall_test_text(WallTest(1e3, "N/m", "", True, cycled=2e3, directions=("x", "z")))
        'tried along x, z; cycled at 2000 N/m'
    """
    parts = [
        f"tried along {', '.join(test.directions)}" if test.directions else "",
        f"cycled at {format_quantity(test.cycled, 'N/m')}" if test.cycled else "",
        f"at {format_quantity(test.update_rate, 'Hz')}" if test.update_rate else "",
        f"{test.positions} positions" if test.positions else "",
        f"lightest direction {test.lightest:g} of the one tried" if test.lightest else "",
    ]
    return "; ".join(part for part in parts if part)


def devices_page(devices: Sequence[Device], *, detailed: bool = False) -> Page:
    """Return one row per device for a terminal; in detail, all data of each device."""
    if detailed:
        return Page("", "", (), [part for device in devices for part in _device_sections(device)])
    has_unverified = any(not datum.verified for device in devices for datum in device.data.values())
    unverified, more = table_notes("devices")
    last = page.terminal_section(notes=[unverified, more] if has_unverified else [more])
    return Page("", "", (), [page.terminal_section(_devices_table(devices)), last])


def _devices_table(devices: Sequence[Device]) -> Table:
    """Return one row per device, the first column its id alone."""
    rows = []
    columns = table_data("devices")
    for device in devices:
        texts = [datum_text(device.data.get(field)) for field in columns.values()]
        rows.append(Row([Cell(device.id, "l"), device.name, *texts]))
    headings = ("id", "device", *columns)
    layout = TableLayout(wrap=(1,), min_console={1: _NAME_MIN_CONSOLE})
    return Table(headings, rows, range(2, len(headings)), layout)


def _device_table(device: Device) -> Table:
    """Return all data of a device with their sources, alternative values in rows below."""
    rows = []
    for field, datum in device.data.items():
        named = [(readable_name(field), datum), *(("  also", other) for other in datum.also)]
        for name, one in named:
            style = "" if one.verified else "yellow"
            rows.append(Row([name, one.text, verified_text(one), one.source], style=style))
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


def missing_fields(device: Device) -> list[str]:
    """Return the data that asperity uses and that the device lacks, with units.

    Example:
        >>> from asperity.devices import load_device
        >>> missing_fields(load_device("touch"))[0]
        'force_resolution [N]: smallest step of the force'
    """
    return [
        f"{field} [{FIELD_UNITS[field]}]: {FIELD_TABLE[field].description}"
        for field in table_data("used_fields")
        if field not in device.data
    ]


def _device_sections(device: Device) -> list[Section]:
    """Return the data of a device, and what is missing, for a terminal."""
    title = device.name if device.name == device.id else f"{device.name} ({device.id})"
    text = [f"Axes: {device.axes}"] if device.axes else []
    if device.driver:
        text.append(f"Driver: {device.driver} (asperity run ... --driver real)")
    parts = [text] if text else []
    parts += [[note] for note in device.notes]
    if missing := missing_fields(device):
        heading = "Missing data, without which some results are undecided:"
        parts.append([heading, *(f"  {one}" for one in missing)])
    return [
        Section(title, (), media=HEADED),
        page.terminal_section(_device_table(device)),
        *[page.terminal_section(*map(page.Paragraph, lines)) for lines in parts],
    ]
