"""From text to a device: the catalogue, and files of users."""

from __future__ import annotations

import math
import os
import re
import tomllib
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Any

from asperity.devices.device import FIELD_TABLE, WORDS, Datum, Device, WallTest
from asperity.errors import ParameterError, nearest_names
from asperity.files import read_toml
from asperity.units import quantity

_KEYS = ("value", "unit", "source", "verified", "also")
_WALL_KEYS = ("directions", "cycled", "update_rate", "positions", "lightest")
_WALL_UNITS = {"cycled": "N/m", "update_rate": "Hz", "lightest": "1"}
_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029]")
_NUMBER = re.compile(r"\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\s*")


def device_names() -> list[str]:
    """Return the ids of the catalogue."""
    return sorted(_catalogue())


@lru_cache(maxsize=1)
def _catalogue() -> dict[str, dict[str, Any]]:
    """Return the content of every catalogue entry by id."""
    folder = resources.files("asperity.devices") / "catalogue"
    texts = [item.read_text("utf-8") for item in folder.iterdir() if item.name.endswith(".toml")]
    contents = [tomllib.loads(text) for text in texts]
    return {str(content["id"]): content for content in contents}


def load_device(device: str | os.PathLike[str] | Device) -> Device:
    """Return a device of the catalogue by its id, or one from a TOML file.

    A file gives ``id``, ``name`` and any of the fields of the catalogue, each with its unit
    ("12 N"), or as a table with ``value``, ``unit``, ``source``, ``verified`` (``true``,
    ``"read"``, ``"measured"`` or ``false``) and ``also``. ``max_stiffness`` is a wall test and may
    say ``directions``, ``cycled``, ``update_rate``, ``positions`` and ``lightest``; see
    :class:`~asperity.devices.device.WallTest`.

    Raises:
        ParameterError: for an id that is unknown, or a file with unknown or wrong fields.

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
    hint = nearest_names(text, _catalogue())
    raise ParameterError("device", f"is unknown: {text!r}; {hint}, or a TOML file")


def parse_device(content: Mapping[str, Any], default_id: str, *, from_file: bool = False) -> Device:
    """Return a device from its fields; see :func:`load_device`.

    Args:
        content: fields by name: text with a unit, or a number in SI units.
        default_id: of a device that says none.
        from_file: whether people wrote it in a file, where numbers need their units.

    Raises:
        ParameterError: for unknown or wrong fields.

    Example:
        >>> mine = parse_device({"max_stiffness": "1.2 N/mm", "delay_samples": 1}, "mine")
        >>> mine.max_stiffness, mine.data["max_stiffness"].source
        (1200.0, 'given by the user')
    """
    unknown = [key for key in content if key not in FIELD_TABLE and key not in WORDS]
    if unknown:
        hint = nearest_names(unknown[0], [*FIELD_TABLE, *WORDS])
        raise ParameterError("device", f"has an unknown field {unknown[0]!r}; {hint}")
    if from_file:
        _refuse_bare(content)
    identity = _text("device.id", content.get("id", default_id))
    name = _text("device.name", content.get("name", identity))
    axes, driver = (
        _text(f"device.{word}", content[word]) if word in content else ""
        for word in ("axes", "driver")
    )
    notes = content.get("notes", [])
    if not isinstance(notes, (list, tuple)):
        raise ParameterError("device.notes", "must be a list of sentences", notes)
    sentences = tuple(_text("device.notes", note) for note in notes)
    data = {field: _datum(field, given) for field, given in content.items() if field in FIELD_TABLE}
    _check_forces(data)
    return Device(identity, name, data, axes, sentences, driver)


def changed_device(device: Device, content: Mapping[str, Any]) -> Device:
    """Return a device of which a scene or a command line says something else.

    Args:
        device: what is known.
        content: fields by name, with their units.

    Raises:
        ParameterError: for unknown or wrong fields, or ones that the others contradict.

    Example:
        >>> stiff = changed_device(load_device("touch"), {"max_stiffness": "1.5 N/mm"})
        >>> stiff.id, stiff.max_stiffness, stiff.data["max_stiffness"].source
        ('touch', 1500.0, 'given by the user')
    """
    changed = parse_device(content, device.id, from_file=True)
    words = {
        name: getattr(changed, name)
        for name in ("name", "axes", "driver", "notes")
        if name in content
    }
    data = {**device.data, **changed.data}
    _check_forces(data)
    return replace(device, data=data, **words)


def _refuse_bare(content: Mapping[str, Any]) -> None:
    """Refuse numbers without their unit."""
    for field, given in content.items():
        if field not in FIELD_TABLE:
            continue
        name, table = f"device.{field}", given if isinstance(given, dict) else {"value": given}
        others = table.get("also", [])
        for said in (table, *(others if isinstance(others, list) else ())):
            if isinstance(said, dict) and "unit" not in said:
                _refuse_number(name, said.get("value"), FIELD_TABLE[field].unit)
        for key, unit in _WALL_UNITS.items():
            _refuse_number(f"{name}.{key}", table.get(key), unit)


def _refuse_number(name: str, given: Any, unit: str) -> None:
    if _is_number(given) and unit != "1":
        quantity(name, given, unit)


def _is_number(given: Any) -> bool:
    return isinstance(given, (int, float)) and not isinstance(given, bool)


def _text(name: str, given: Any) -> str:
    if not isinstance(given, str) or not given.strip() or _CONTROL.search(given):
        raise ParameterError(name, "must be text on one line", given)
    return given.strip()


def _check_forces(data: Mapping[str, Datum]) -> None:
    most, lasting = data.get("max_force"), data.get("continuous_force")
    if most is not None and lasting is not None and lasting.value > most.value:
        limit = f"must not be greater than max_force, {most.text}"
        raise ParameterError("device.continuous_force", limit, lasting.text)


def _datum(field: str, given: Any, nested: bool = False) -> Datum:
    """Return a number of a device from what a file says of it, with all that is said besides."""
    name = f"device.{field}.also" if nested else f"device.{field}"
    table = given if isinstance(given, dict) else {"value": given}
    walls = field == "max_stiffness" and not nested
    keys = (*(_KEYS[:-1] if nested else _KEYS), *(_WALL_KEYS if walls else ()))
    unknown = [key for key in table if key not in keys]
    if unknown or "value" not in table:
        problem = f"unknown key {unknown[0]!r}" if unknown else "no value"
        raise ParameterError(name, f"has {problem}; known: {', '.join(keys)}")
    value = _value(name, field, table)
    verified, measured = _verified(name, table.get("verified", False))
    source = _text(f"{name}.source", table.get("source", "given by the user"))
    others = table.get("also", [])
    if not isinstance(others, list) or not all(isinstance(other, dict) for other in others):
        raise ParameterError(f"{name}.also", "must be a list of tables with value and unit", others)
    also = tuple(_datum(field, other, nested=True) for other in others)
    known = (value, FIELD_TABLE[field].unit, source, verified, also, measured)
    return WallTest(*known, **_wall_test(name, value, table)) if walls else Datum(*known)


def _verified(name: str, given: Any) -> tuple[bool, bool]:
    """Return whether a number was read in a source, and whether it was measured."""
    if given in ("read", "measured"):
        return True, given == "measured"
    if not isinstance(given, bool):
        words = "verified must be true or false, 'read' or 'measured'"
        raise ParameterError(name, words, given)
    return given, False


def _wall_test(name: str, held: float, table: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a file says of the wall's test besides the stiffness that held [SI]."""
    said: dict[str, Any] = {}
    for key, unit in _WALL_UNITS.items():
        if key in table:
            said[key] = _quantity(f"{name}.{key}", table[key], unit)
            if said[key] <= 0.0:
                raise ParameterError(f"{name}.{key}", f"must be positive [{unit}]", table[key])
    if said.get("cycled", math.inf) <= held:
        limit = f"must be above the stiffness that held, {held:g} N/m"
        raise ParameterError(f"{name}.cycled", limit, table["cycled"])
    if said.get("lightest", 1.0) > 1.0:
        limit = "must be at most 1: the lightest direction is damped least"
        raise ParameterError(f"{name}.lightest", limit, table["lightest"])
    if "positions" in table:
        said["positions"] = table["positions"]
        if said["positions"] not in ("exact", "stepped"):
            raise ParameterError(
                f"{name}.positions", "must be 'exact' or 'stepped'", said["positions"]
            )
    axes = table.get("directions", [])
    if not isinstance(axes, list) or not all(axis in ("x", "y", "z") for axis in axes):
        raise ParameterError(f"{name}.directions", "must be a list of 'x', 'y' and 'z'", axes)
    return {**said, "directions": tuple(dict.fromkeys(axes))}


def _value(name: str, field: str, table: Mapping[str, Any]) -> float:
    """Return the value [SI] of a table with a value and perhaps a unit."""
    kind = FIELD_TABLE[field]
    given, named = table["value"], table.get("unit")
    if named is None:
        value = _quantity(name, given, kind.unit)
    else:
        value = _with_named_unit(name, given, named, kind.unit)
    shown = f" [{kind.unit}]"
    if kind.allowed == "positive" and value <= 0.0:
        raise ParameterError(name, f"must be positive{shown}", given)
    if kind.allowed == "not negative" and value < 0.0:
        raise ParameterError(name, f"must not be negative{shown}", given)
    if kind.whole and value != round(value):
        raise ParameterError(name, "must be a whole number", given)
    return value


def _quantity(name: str, given: Any, unit: str) -> float:
    """Return a finite quantity [SI]; a number is in SI units, and "1" has none."""
    if isinstance(given, int) and not isinstance(given, bool) and abs(given) > 10**300:
        raise ParameterError(name, f"must be finite [{unit}]", "a number of more than 300 digits")
    return quantity(name, given, "" if unit == "1" or _is_number(given) else unit)


def _with_named_unit(name: str, given: Any, named: Any, unit: str) -> float:
    """Return a value whose unit is named beside it; a unit of its own must be the same."""
    if unit == "1":
        if named != "1":
            raise ParameterError(f"{name}.unit", "must be '1': it is a plain number", named)
        return _quantity(name, given, unit)
    if not isinstance(named, str) or not named.strip() or _NUMBER.fullmatch(named):
        raise ParameterError(f"{name}.unit", f"must be text such as '{unit}'", named)
    if isinstance(given, str):
        number = _NUMBER.match(given)
        own = given[number.end() :].strip() if number else ""
        if own and not _same_unit(own, named):
            words = f"has the value {given!r} and the unit {named!r}, which contradict each other"
            raise ParameterError(name, words)
        if own:
            return _quantity(name, given, unit)
    quantity(f"{name}.unit", f"1 {named}", unit)  # a wrong unit is told apart from a wrong value
    plain = _quantity(name, given, "1")
    return plain if named.strip() == unit else quantity(name, f"{given} {named}", unit)


def _same_unit(one: str, other: str) -> bool:
    try:
        return abs(quantity("unit", f"1 {one}", other) - 1.0) < 1e-12
    except ParameterError:
        return False
