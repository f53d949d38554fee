"""From a device to the file of it, which is read as the same device."""

from __future__ import annotations

import json
from typing import Any

from asperity.devices.device import Datum, Device, WallTest


def device_text(device: Device) -> str:
    """Return a device file (TOML): every number with its unit, its source, and what it rests on.

    Example:
        >>> from asperity.devices.reading import load_device
        >>> print(device_text(load_device("2diy")).splitlines()[0])
        id = "2diy"
    """
    lines = [_line("id", device.id), _line("name", device.name)]
    lines += [_line("driver", device.driver)] if device.driver else []
    lines += [_line("axes", device.axes)] if device.axes else []
    lines += [_line("notes", list(device.notes))] if device.notes else []
    for field, datum in device.data.items():
        lines += ["", f"[{field}]", *_datum_lines(datum)]
        for other in datum.also:
            lines += ["", f"[[{field}.also]]", *_datum_lines(other)]
    return "\n".join(lines) + "\n"


def _datum_lines(datum: Datum) -> list[str]:
    measured = "measured" if datum.pedigree == "measured" else datum.verified
    said: dict[str, Any] = {
        "value": datum.value, "unit": datum.unit, "source": datum.source, "verified": measured
    }  # fmt: skip
    if isinstance(datum, WallTest):
        said |= {"directions": list(datum.directions), "positions": datum.positions,
                 "lightest": datum.lightest}  # fmt: skip
        for key, unit in (("cycled", "N/m"), ("update_rate", "Hz")):
            value = getattr(datum, key)
            said[key] = None if value is None else f"{value!r} {unit}"
    return [_line(key, value) for key, value in said.items() if value is not None and value != []]


def _line(key: str, value: Any) -> str:
    # What JSON writes of texts, numbers, booleans and lists of texts, TOML reads.
    return f"{key} = {json.dumps(value, ensure_ascii=False)}"
