"""Devices: the catalogue and one device in a terminal, the numbers of a device on a page."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table

from asperity.devices import FIELD_TABLE, Datum, Device, WallTest
from asperity.report import page
from asperity.report.terminal import say, table
from asperity.report.words.number_words import NONE, law_title
from asperity.units import engineering

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
        return NONE
    return datum.text if datum.verified else f"{datum.text} {UNVERIFIED}"


def verified_text(datum: Datum) -> str:
    """Return "measured", "read" in a source that others can read, or "no"."""
    return datum.pedigree if datum.verified else "no"


def wall_test_text(test: WallTest) -> str:
    """Return what is known of a wall's test besides the stiffness that held; "" for nothing.

    Example:
        >>> wall_test_text(WallTest(1e3, "N/m", "", True, cycled=2e3, directions=("x", "z")))
        'tried along x, z; cycled at 2000 N/m'
    """
    said = [
        f"tried along {', '.join(test.directions)}" if test.directions else "",
        f"cycled at {engineering(test.cycled, 'N/m')}" if test.cycled else "",
        f"at {engineering(test.update_rate, 'Hz')}" if test.update_rate else "",
        f"{test.positions} positions" if test.positions else "",
        f"lightest direction {test.lightest:g} of the one tried" if test.lightest else "",
    ]
    return "; ".join(part for part in said if part)


def devices_table(devices: Sequence[Device], width: int = 100) -> Table:
    """Return one row per device, the first column its id alone.

    Args:
        devices: what to list.
        width: of the console in characters; full names are left out on a narrow one.
    """
    rows = []
    for device in devices:
        texts = [datum_text(device.data.get(field)) for field in _COLUMNS.values()]
        rows.append(page.Row([page.Cell(device.id, "l"), device.name, *texts]))
    shown = page.Table(("id", "device", *_COLUMNS), rows, range(2, 2 + len(_COLUMNS)))
    without = () if width >= _NAMES_FROM else (1,)
    return table(shown, wraps=(1,), without=without, styles={"l": "bold"})


def device_table(device: Device) -> Table:
    """Return every number of a device with its source; other values of it in the rows below."""
    rows = []
    for field, datum in device.data.items():
        for what, one in ((law_title(field), datum), *(("  also", other) for other in datum.also)):
            style = "" if one.verified else "yellow"
            rows.append(page.Row([what, one.text, verified_text(one), one.source], style=style))
        if isinstance(datum, WallTest) and wall_test_text(datum):
            rows.append(page.Row(["  the test", "", "", wall_test_text(datum)]))
    return table(page.Table(("what", "value", "verified", "source"), rows, (1,)), wraps=(3,))


def numbers_table(device: Device, fields: Sequence[str]) -> page.Table:
    """Return the numbers of a device for a page, with what is asked for and not known.

    Args:
        device: the device.
        fields: what is asked for.
    """
    rows = []
    for field in fields:
        datum = device.data.get(field)
        if datum is None:
            unknown = page.Cell("not known", "open")
            rows.append(page.Row([law_title(field), "", unknown, FIELD_TABLE[field].words]))
        else:
            known = page.Cell(verified_text(datum), "" if datum.verified else "open")
            test = wall_test_text(datum) if isinstance(datum, WallTest) else ""
            rows.append(
                page.Row([law_title(field), datum.text, known, page.Cell(datum.source, below=test)])
            )
    return page.Table((device.name, "value", "verified", "source"), rows, numbers=(1,))


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


def print_devices(devices: Sequence[Device], console: Console, *, in_detail: bool = False) -> None:
    """Print one row per device; in detail, everything that is known of each."""
    if in_detail:
        for number, device in enumerate(devices):
            if number:
                console.print()
            _print_device(device, console)
        return
    console.print(devices_table(devices, console.width))
    console.print()
    if any(not datum.verified for device in devices for datum in device.data.values()):
        say(console, NOT_VERIFIED_NOTE, "dim")
    say(console, "Sources and other values: asperity devices NAME", "dim")


def _print_device(device: Device, console: Console) -> None:
    """Print everything that is known of a device, and what is not."""
    title = device.name if device.name == device.id else f"{device.name} ({device.id})"
    say(console, title, "bold")
    console.print()
    console.print(device_table(device))
    if device.axes:
        console.print()
        say(console, f"Axes: {device.axes}")
    if device.driver:
        say(console, f"Driver: {device.driver} (asperity run ... --driver real)")
    for note in device.notes:
        console.print()
        say(console, note)
    missing = unknown_fields(device)
    if missing:
        console.print()
        say(console, "Not known, so what needs it is not decided:")
        for words in missing:
            say(console, f"  {words}")
