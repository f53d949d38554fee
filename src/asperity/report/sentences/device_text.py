"""Data of devices as text."""

from __future__ import annotations

from asperity.core.units import format_quantity
from asperity.devices import FIELD_TABLE, FIELD_UNITS, Datum, Device, WallTest
from asperity.report.sentences.number_text import NOT_AVAILABLE

UNVERIFIED_MARK = "?"
_USED_FIELDS = (
    "max_stiffness",
    "position_resolution",
    "force_resolution",
    "update_rate",
    "bandwidth",
    "damping",
    "friction",
)
"""The data without which some results are undecided."""


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
    parts = []
    if test.directions:
        parts.append(f"tried along {', '.join(test.directions)}")
    if test.cycled:
        parts.append(f"cycled at {format_quantity(test.cycled, 'N/m')}")
    if test.update_rate:
        parts.append(f"at {format_quantity(test.update_rate, 'Hz')}")
    if test.positions:
        parts.append(f"{test.positions} positions")
    if test.lightest:
        parts.append(f"lightest direction {test.lightest:g} of the one tried")
    return "; ".join(parts)


def missing_fields(device: Device) -> list[str]:
    """Return the data that asperity uses and that the device lacks, with units.

    Example:
        >>> from asperity.devices import load_device
        >>> missing_fields(load_device("touch"))[0]
        'force_resolution [N]: smallest step of the force'
    """
    return [
        f"{field} [{FIELD_UNITS[field]}]: {FIELD_TABLE[field].description}"
        for field in _USED_FIELDS
        if field not in device.data
    ]
