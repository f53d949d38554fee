"""A device as data: every number with its unit, its source, and whether it was verified."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from asperity.errors import ParameterError, nearest_names
from asperity.units import quantity

# What a device file may say, and in which unit asperity keeps it.
FIELDS: dict[str, str] = {
    "max_force": "N",
    "continuous_force": "N",
    "max_stiffness": "N/m",
    "position_resolution": "m",
    "force_resolution": "N",
    "update_rate": "Hz",
    "bandwidth": "Hz",
    "damping": "N*s/m",
    "joint_damping": "N*m*s",
    "friction": "N",
    "apparent_mass": "kg",
}


@dataclass(frozen=True)
class Datum:
    """One number of a device.

    Attributes:
        value: in SI units.
        unit: the SI unit.
        source: where the number was read.
        verified: whether it was read in a source that others can read.
    """

    value: float
    unit: str
    source: str
    verified: bool


@dataclass(frozen=True)
class Device:
    """A force-feedback device.

    Attributes:
        id: short name, as on the command line.
        name: full name.
        data: what is known, by field; see ``FIELDS``.

    Example:
        >>> device = load_device("omega.3")
        >>> device.value("max_stiffness"), device.data["update_rate"].verified
        (5000.0, False)
    """

    id: str
    name: str
    data: Mapping[str, Datum]

    def value(self, field: str) -> float | None:
        """Return a number in SI units, or ``None`` if it is not known."""
        return self.data[field].value if field in self.data else None

    @property
    def max_stiffness(self) -> float:
        """K₀ [N/m]: the stiffest smooth wall that the device renders.

        Raises:
            ParameterError: if it is not known.
        """
        value = self.value("max_stiffness")
        if value is None:
            raise ParameterError("device", f"{self.id} needs max_stiffness to compare laws [N/m]")
        return value

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "id": self.id,
            "name": self.name,
            "data": {
                field: {
                    "value": datum.value,
                    "unit": datum.unit,
                    "source": datum.source,
                    "verified": datum.verified,
                }
                for field, datum in self.data.items()
            },
        }


def device_names() -> list[str]:
    """Return the ids of the catalogue."""
    return sorted(_catalogue())


def _catalogue() -> dict[str, str]:
    """Return the text of every catalogue entry by id."""
    folder = resources.files("asperity.devices") / "catalogue"
    texts = [item.read_text("utf-8") for item in folder.iterdir() if item.name.endswith(".toml")]
    return {str(tomllib.loads(text)["id"]): text for text in texts}


def load_device(device: str | os.PathLike[str] | Device) -> Device:
    """Return a device of the catalogue by its id, or one from a TOML file.

    A file gives ``id``, ``name`` and any of the fields of the catalogue, each as a quantity
    ("12 N"), or as a table with ``value``, ``unit``, ``source`` and ``verified``.

    Raises:
        ParameterError: for an id that is unknown, or a file with unknown or wrong fields.

    Example:
        >>> load_device("Touch").name
        '3D Systems Touch'
    """
    if isinstance(device, Device):
        return device
    text = os.fspath(device)
    catalogue = _catalogue()
    for known, content in catalogue.items():
        if known.lower() == text.lower():
            return parse_device(tomllib.loads(content), known)
    if text.lower().endswith(".toml"):
        return _load_file(Path(text))
    hint = nearest_names(text, catalogue)
    raise ParameterError("device", f"is unknown: {text!r}; {hint}, or a TOML file")


def _load_file(path: Path) -> Device:
    try:
        content = tomllib.loads(path.read_text("utf-8"))
    except OSError as error:
        reason = error.strerror or str(error)
        raise ParameterError("device", f"file {path} cannot be read: {reason}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ParameterError("device", f"file {path} is not valid TOML: {error}") from None
    return parse_device(content, path.stem)


def parse_device(content: Mapping[str, Any], default_id: str) -> Device:
    """Return a device from the content of a file; see :func:`load_device`.

    Raises:
        ParameterError: for unknown or wrong fields.
    """
    unknown = [key for key in content if key not in FIELDS and key not in {"id", "name"}]
    if unknown:
        hint = nearest_names(unknown[0], [*FIELDS, "id", "name"])
        raise ParameterError("device", f"has an unknown field {unknown[0]!r}; {hint}")
    identity = str(content.get("id", default_id))
    data = {key: _datum(key, value) for key, value in content.items() if key in FIELDS}
    return Device(identity, str(content.get("name", identity)), data)


def _datum(field: str, given: Any) -> Datum:
    unit = FIELDS[field]
    table = given if isinstance(given, dict) else {"value": given}
    known = {"value", "unit", "source", "verified"}
    unknown = [key for key in table if key not in known]
    if unknown or "value" not in table:
        problem = f"unknown key {unknown[0]!r}" if unknown else "no value"
        raise ParameterError(f"device.{field}", f"has {problem}; known: {', '.join(sorted(known))}")
    given_unit = table.get("unit", unit)
    text = table["value"] if given_unit == unit else f"{table['value']} {given_unit}"
    value = quantity(f"device.{field}", text, unit)
    if value <= 0.0:
        raise ParameterError(f"device.{field}", f"must be positive [{unit}]", table["value"])
    verified = table.get("verified", False)
    if not isinstance(verified, bool):
        raise ParameterError(f"device.{field}", "verified must be true or false", verified)
    return Datum(value, unit, str(table.get("source", "given by the user")), verified)
