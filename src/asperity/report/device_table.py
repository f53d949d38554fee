"""Devices in a terminal: the catalogue, and one device with the source of every number."""

from __future__ import annotations

from collections.abc import Sequence

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from asperity.devices import FIELD_TABLE, Datum, Device

UNVERIFIED = "?"
NOT_VERIFIED_NOTE = (
    f"{UNVERIFIED} not verified: remembered, or derived from what is; "
    "not read in a source that others can read."
)
_NAMES_FROM = 96
"""Console width [characters] from which the full name has a column."""

# What tells devices apart; the rest is said of one device.
_COLUMNS = {
    "max\nforce": "max_force",
    "stiffest\nwall": "max_stiffness",
    "position\nstep": "position_resolution",
    "force\nstep": "force_resolution",
    "update\nrate": "update_rate",
    "damping\nσ₀(B)": "damping",
}


def datum_text(datum: Datum | None) -> str:
    """Return a number for reading, with a ? if it is not verified; "–" for none.

    Example:
        >>> datum_text(Datum(5.5e-5, "m", "remembered", False)), datum_text(None)
        ('55 µm ?', '–')
    """
    if datum is None:
        return "–"
    return datum.text if datum.verified else f"{datum.text} {UNVERIFIED}"


def devices_table(devices: Sequence[Device], width: int = 100) -> Table:
    """Return one row per device, the first column its id alone.

    Args:
        devices: what to list.
        width: of the console in characters; full names are left out on a narrow one.
    """
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), show_edge=False, pad_edge=False)
    table.add_column("id", no_wrap=True, style="bold")
    named = width >= _NAMES_FROM
    if named:
        table.add_column("device")
    for heading in _COLUMNS:
        table.add_column(heading, justify="right", no_wrap=True)
    for device in devices:
        numbers = [datum_text(device.data.get(field)) for field in _COLUMNS.values()]
        cells = [device.id, *([device.name] if named else []), *numbers]
        table.add_row(*[Text(cell) for cell in cells])
    return table


def device_table(device: Device) -> Table:
    """Return every number of a device with its source; other values of it in the rows below."""
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), show_edge=False, pad_edge=False)
    table.add_column("what", no_wrap=True)
    table.add_column("value", justify="right", no_wrap=True)
    table.add_column("verified", no_wrap=True)
    table.add_column("source")
    for field, datum in device.data.items():
        _add(table, field.replace("_", " "), datum)
        for other in datum.also:
            _add(table, "  also", other)
    return table


def _add(table: Table, what: str, datum: Datum) -> None:
    verified = "yes" if datum.verified else "no"
    style = "" if datum.verified else "yellow"
    cells = [Text(cell) for cell in (what, datum.text, verified, datum.source)]
    table.add_row(*cells, style=style)


def unknown_fields(device: Device) -> list[str]:
    """Return what asperity asks of a device and is not known of this one, with the field's name.

    Example:
        >>> from asperity.devices import load_device
        >>> unknown_fields(load_device("touch"))[0]
        'force_resolution [N]: smallest step of the force'
    """
    asked = ("max_stiffness", "position_resolution", "force_resolution", "update_rate",
             "bandwidth", "damping", "friction")  # fmt: skip
    return [
        f"{field} [{FIELD_TABLE[field].unit}]: {FIELD_TABLE[field].words}"
        for field in asked
        if field not in device.data
    ]


def print_devices(devices: Sequence[Device], console: Console) -> None:
    """Print the catalogue."""
    console.print(devices_table(devices, console.width))
    console.print()
    if any(not datum.verified for device in devices for datum in device.data.values()):
        console.print(Text(NOT_VERIFIED_NOTE, style="dim"))
    console.print(Text("Sources and other values: asperity devices NAME", style="dim"))


def print_device(device: Device, console: Console) -> None:
    """Print everything that is known of a device, and what is not."""
    title = device.name if device.name == device.id else f"{device.name} ({device.id})"
    console.print(Text(title, style="bold"))
    console.print()
    console.print(device_table(device))
    if device.axes:
        console.print()
        console.print(Text(f"Axes: {device.axes}"))
    for note in device.notes:
        console.print()
        console.print(Text(note))
    missing = unknown_fields(device)
    if missing:
        console.print()
        console.print(Text("Not known, so what needs it is not decided:"))
        for words in missing:
            console.print(Text(f"  {words}"))
