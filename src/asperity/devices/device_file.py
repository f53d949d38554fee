"""Device files: the catalogue, files of users, a template, and writing them."""

from __future__ import annotations

import json
import math
import os
import re
import tomllib
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, get_args

from asperity.core.arguments import Argument
from asperity.core.errors import ParameterError, suggest_names
from asperity.core.files import read_toml
from asperity.core.units import parse_quantity
from asperity.devices.device import (
    ASSUMED_WALL_RATE,
    FIELD_TABLE,
    TEXT_FIELDS,
    USER_SOURCE,
    WALL_KEYS,
    Datum,
    Device,
    Origin,
    WallTest,
)

Table = Mapping[str, Any]
_FOLDER = Path(__file__).parent
_DATUM_KEYS = ("value", "unit", "source", "verified", "also")
_WALL_ARGUMENTS = (
    Argument("cycled", "", "N/m", must_be_positive=True),
    Argument("update_rate", "", "Hz", must_be_positive=True),
    Argument("delay_samples", ""),
    Argument("lightest", "", must_be_positive=True),
)
_CONTROL_CHARACTERS = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029]")
_NUMBER = re.compile(r"\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\s*")


def device_names() -> list[str]:
    """Return the ids of all devices in the catalogue."""
    return sorted(_catalogue())


@lru_cache(maxsize=1)
def _catalogue() -> dict[str, dict[str, Any]]:
    """Return the content of all catalogue files by id."""
    files = (_FOLDER / "catalogue").glob("*.toml")
    contents = [tomllib.loads(file.read_text("utf-8")) for file in files]
    return {str(content["id"]): content for content in contents}


DeviceLike = Device | str | os.PathLike[str]
"""A device, its id in the catalogue, or its TOML file."""


def load_device(device: DeviceLike) -> Device:
    """Return a device of the catalogue by its id, or one from a TOML file.

    A file has ``id``, ``name`` and any of the fields of the catalogue, each with its unit
    ("12 N"), or as a table with ``value``, ``unit``, ``source``, ``verified`` (``true``,
    ``"read"``, ``"measured"``, ``"simulated"`` or ``false``) and ``also``. ``max_stiffness`` is a
    wall test, which may have ``directions``, ``cycled``, ``update_rate``, ``rate_source``,
    ``delay_samples``, ``positions`` and ``lightest``; see
    :class:`~asperity.devices.device.WallTest`.

    Raises:
        ParameterError: the id is unknown, or the file has unknown or wrong fields.

    Example:
        >>> load_device("Touch").name
        '3D Systems Touch'
    """
    if isinstance(device, Device):
        return device
    text = os.fspath(device) if isinstance(device, os.PathLike) else device
    if not isinstance(text, str):
        raise ParameterError("device", "must be an id, a TOML file or a Device", device)
    for known, content in _catalogue().items():
        if known.lower() == text.strip().lower():
            return parse_device(content, known)
    if text.lower().endswith(".toml"):
        return parse_device(read_toml("device", Path(text)), Path(text).stem, from_file=True)
    hint = suggest_names(text, _catalogue())
    raise ParameterError("device", f"is unknown: {text!r}; {hint}, or a TOML file")


def parse_device(content: Table, default_id: str, *, from_file: bool = False) -> Device:
    """Return a device from its fields; see :func:`load_device`.

    Args:
        content: fields by name: text with a unit, or a number in SI units.
        default_id: id of a device without one.
        from_file: whether the fields are from a user's file, whose numbers need units.

    Raises:
        ParameterError: fields are unknown or wrong.

    Example:
        >>> mine = parse_device({"max_stiffness": "1.2 N/mm", "delay_samples": 1}, "mine")
        >>> mine.max_stiffness, mine.data["max_stiffness"].source
        (1200.0, 'given by the user')
    """
    unknown = [key for key in content if key not in FIELD_TABLE and key not in TEXT_FIELDS]
    if unknown:
        hint = suggest_names(unknown[0], [*FIELD_TABLE, *TEXT_FIELDS])
        raise ParameterError("device", f"has an unknown field {unknown[0]!r}; {hint}")
    device_id = _check_text("device.id", content.get("id", default_id))
    name = _check_text("device.name", content.get("name", device_id))
    texts = {
        key: _check_text(f"device.{key}", content[key])
        for key in ("axes", "driver")
        if key in content
    }
    notes = content.get("notes", [])
    if not isinstance(notes, (list, tuple)):
        raise ParameterError("device.notes", "must be a list of sentences", notes)
    sentences = tuple([_check_text("device.notes", note) for note in notes])
    data = {
        field: _parse_datum(field, value, from_file)
        for field, value in content.items()
        if field in FIELD_TABLE
    }
    _check_forces(data)
    return Device(device_id, name, data, notes=sentences, **texts)


def override_device(device: Device, content: Table) -> Device:
    """Return a device with some of its fields overridden.

    Args:
        device: the device.
        content: the overriding fields by name, with their units.

    Raises:
        ParameterError: fields are unknown, wrong, or contradict others.

    Example:
        >>> stiff = override_device(load_device("touch"), {"max_stiffness": "1.5 N/mm"})
        >>> stiff.id, stiff.max_stiffness, stiff.data["max_stiffness"].source
        ('touch', 1500.0, 'given by the user')
    """
    changed = parse_device(content, device.id, from_file=True)
    texts = {key: getattr(changed, key) for key in TEXT_FIELDS[1:] if key in content}
    data = {**device.data, **changed.data}
    test = device.wall_test
    if test is not None and test.update_rate is None and "max_stiffness" not in changed.data:
        # Another loop: the wall held in the loop of the device itself.
        rate = device.value("update_rate") or ASSUMED_WALL_RATE
        data["max_stiffness"] = replace(test, update_rate=rate)
    _check_forces(data)
    return replace(device, data=data, **texts)


def _check_text(name: str, value: Any) -> str:
    if not isinstance(value, str) or not value.strip() or _CONTROL_CHARACTERS.search(value):
        raise ParameterError(name, "must be text on one line", value)
    return value.strip()


def _check_forces(data: Mapping[str, Datum]) -> None:
    peak = data.get("max_force")
    continuous = data.get("continuous_force")
    if peak is not None and continuous is not None and continuous.value > peak.value:
        limit = f"must not be greater than max_force, {peak.text}"
        raise ParameterError("device.continuous_force", limit, continuous.text)


def _parse_datum(field: str, value: Any, from_file: bool, is_nested: bool = False) -> Datum:
    """Return a number of a device, with the values of other sources."""
    name = f"device.{field}"
    keys: tuple[str, ...] = _DATUM_KEYS
    is_wall = field == "max_stiffness" and not is_nested
    if is_nested:
        name = f"{name}.also"
        keys = _DATUM_KEYS[:-1]
    if is_wall:
        keys = (*_DATUM_KEYS, *WALL_KEYS)
    table = value if isinstance(value, dict) else {"value": value}
    unknown = [key for key in table if key not in keys]
    if unknown:
        raise ParameterError(name, f"has unknown key {unknown[0]!r}; known: {', '.join(keys)}")
    if "value" not in table:
        raise ParameterError(name, f"has no value; known: {', '.join(keys)}")
    argument = replace(FIELD_TABLE[field], name=name)
    quantity = table["value"]
    if "unit" in table:
        quantity = _append_unit(name, quantity, table["unit"], argument.unit)
    value = argument.validate(_parse_quantity(name, quantity, argument.unit, from_file))
    verified, origin = _parse_verified(name, table.get("verified", False))
    source = _check_text(f"{name}.source", table.get("source", USER_SOURCE))
    others = table.get("also", [])
    if not isinstance(others, list) or not all(isinstance(other, dict) for other in others):
        raise ParameterError(f"{name}.also", "must be a list of tables with value and unit", others)
    also = tuple([_parse_datum(field, other, from_file, is_nested=True) for other in others])
    datum = (float(value), argument.unit or "1", source, verified, also, origin)
    if is_wall:
        return WallTest(*datum, **_parse_wall_test(name, value, table, from_file))
    return Datum(*datum)


def _parse_verified(name: str, value: Any) -> tuple[bool, Origin]:
    """Return whether a number was verified, and its origin."""
    if value in get_args(Origin):
        return True, value
    if not isinstance(value, bool):
        requirement = "verified must be true or false, 'read', 'measured' or 'simulated'"
        raise ParameterError(name, requirement, value)
    return value, "read"


def _parse_wall_test(name: str, stiffness: float, table: Table, from_file: bool) -> dict[str, Any]:
    """Return the details of a wall test [SI] besides its stiffness."""
    details: dict[str, Any] = {}
    for key in _WALL_ARGUMENTS:
        if key.name in table:
            argument = replace(key, name=f"{name}.{key.name}")
            quantity = _parse_quantity(argument.name, table[key.name], key.unit, from_file)
            details[key.name] = argument.validate(quantity)
    if "rate_source" in table:
        details["rate_source"] = _check_text(f"{name}.rate_source", table["rate_source"])
    if details.get("cycled", math.inf) <= stiffness:
        limit = f"must be above the stiffness that held, {stiffness:g} N/m"
        raise ParameterError(f"{name}.cycled", limit, table["cycled"])
    if details.get("lightest", 1.0) > 1.0:
        limit = "must be at most 1: the lightest direction is damped least"
        raise ParameterError(f"{name}.lightest", limit, table["lightest"])
    details["positions"] = table.get("positions")
    if details["positions"] not in (None, "exact", "stepped"):
        requirement = "must be 'exact' or 'stepped'"
        raise ParameterError(f"{name}.positions", requirement, details["positions"])
    axes = table.get("directions", [])
    if not isinstance(axes, list) or not {"x", "y", "z"}.issuperset(map(str, axes)):
        raise ParameterError(f"{name}.directions", "must be a list of 'x', 'y' and 'z'", axes)
    return {**details, "directions": tuple(dict.fromkeys(axes))}


def _parse_quantity(name: str, value: Any, unit: str, from_file: bool) -> float:
    """Return a finite quantity [SI]; numbers are in SI units, except in a file."""
    if isinstance(value, (int, float)) and not isinstance(value, bool) and not from_file:
        unit = ""
    return parse_quantity(name, value, unit)


def _append_unit(name: str, value: Any, unit_name: Any, unit: str) -> Any:
    """Return a value as text with the unit that its table names."""
    if not unit:
        if unit_name != "1":
            raise ParameterError(f"{name}.unit", "must be '1': it is a plain number", unit_name)
        return value
    if not isinstance(unit_name, str) or not unit_name.strip() or _NUMBER.fullmatch(unit_name):
        raise ParameterError(f"{name}.unit", f"must be text such as '{unit}'", unit_name)
    parse_quantity(f"{name}.unit", f"1 {unit_name}", unit)
    if isinstance(value, str) and not _NUMBER.fullmatch(value):
        parse_quantity(name, value, unit)
        twice = f"has its unit twice, in {value!r} and in unit = {unit_name!r}: remove one"
        raise ParameterError(name, twice)
    parse_quantity(name, value, "")
    return f"{value} {unit_name}"


def to_device_toml(device: Device) -> str:
    """Return a device file (TOML): every number with its unit, its source and its origin.

    Example:
        >>> from asperity.devices.device_file import load_device
        >>> print(to_device_toml(load_device("2diy")).splitlines()[0])
        id = "2diy"
    """
    texts = {key: getattr(device, key) for key in ("id", "name", "driver", "axes", "notes")}
    lines = [_toml_line(key, text) for key, text in texts.items() if text]
    for field, datum in device.data.items():
        lines += ["", f"[{field}]", *_datum_lines(datum)]
        for other in datum.also:
            lines += ["", f"[[{field}.also]]", *_datum_lines(other)]
    return "\n".join(lines) + "\n"


def _datum_lines(datum: Datum) -> list[str]:
    entries = datum.to_dict()
    entries.pop("also", None)
    for key, unit in (("cycled", "N/m"), ("update_rate", "Hz")):
        if key in entries:
            entries[key] = f"{entries[key]!r} {unit}"
    return [_toml_line(key, value) for key, value in entries.items()]


def _toml_line(key: str, value: Any) -> str:
    # JSON of texts, numbers, booleans and lists of texts is valid TOML.
    return f"{key} = {json.dumps(value, ensure_ascii=False)}"


def device_template() -> str:
    """Return a template of a device file (TOML), valid as it is and with all lines uncommented.

    Example:
        >>> [line for line in device_template().splitlines() if "max_force" in line]
        ['# max_force = "3.3 N"  # peak force [N]']
    """
    lines = []
    for name, field in FIELD_TABLE.items():
        line = f"# {name} = {_example_value(field)}  # {field.description}"
        lines.append(f"{line} [{field.unit}]" if field.unit else line)
    template = (_FOLDER / "device_template.toml").read_text("utf-8")
    return template.replace("# {fields}", "\n".join(lines))


def _example_value(field: Argument) -> str:
    """Return the value of a device in the catalogue, or one in the right unit."""
    for device in ("touch", "pantograph", *device_names()):
        datum = load_device(device).data.get(field.name)
        if datum is not None:
            plain = datum.text.replace("·", "*").replace("µ", "u")
            return f'"{plain}"' if field.unit else plain
    return f'"0.1 {field.unit}"' if field.unit else "1"
