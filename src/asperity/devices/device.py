"""Devices as data: every number with its unit, its source and whether it was verified."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Literal

from asperity.core.arguments import read_arguments
from asperity.core.display import Displayable
from asperity.core.errors import ParameterError
from asperity.core.files import OMITTED, Serializable
from asperity.core.units import format_quantity

FIELD_TABLE = read_arguments(Path(__file__).with_name("device_fields.toml"))
"""The numbers of a device by name: description, SI unit, bounds."""

FIELD_UNITS = {name: field.unit or "1" for name, field in FIELD_TABLE.items()}
"""SI unit of each field; "1" for a plain number."""

USER_SOURCE = "given by the user"
"""Source of a number that a user gives without one."""

TEXT_FIELDS = ("id", "name", "axes", "driver", "notes")
"""Fields of a device file that are text."""


Origin = Literal["measured", "simulated", "read"]


@dataclass(frozen=True)
class Datum(Serializable):
    """One number of a device.

    Attributes:
        value: value in SI units.
        unit: the SI unit; "1" for a plain number.
        source: source of the number.
        verified: whether the source is accessible, or the number follows from accessible ones.
        also: values of the same number in other sources or for other conditions.
        origin: ``"measured"`` on such a device, according to the source; ``"simulated"``, found
            on a simulated one; ``"read"``, a constant in a driver or a line of a data sheet.
    """

    value: float
    unit: str
    source: str
    verified: bool
    also: tuple[Datum, ...] = ()
    origin: Origin = field(default="read", metadata=OMITTED)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units; ``verified`` is the origin of a number that is not read."""
        data = super().to_dict()
        if self.verified and self.origin != "read":
            data["verified"] = self.origin
        return data

    @property
    def is_trusted(self) -> bool:
        """Whether conclusions may rest on it: it was verified, or the user gave it."""
        return self.verified or self.source == USER_SOURCE

    @property
    def text(self) -> str:
        """The value as text with an SI prefix.

        Example:
            >>> Datum(0.005, "N*m*s", "", True).text, Datum(0.045, "kg", "", True).text
            ('5 mN·m·s', '45 g')
        """
        if self.unit == "1":
            return f"{self.value:.10g}"
        if self.unit == "kg" and self.value < 1.0:
            return format_quantity(1e3 * self.value, "g")
        return format_quantity(self.value, self.unit).replace("*", "·")

    @property
    def pedigree(self) -> str:
        """Origin of the number, or ``"not verified"``."""
        return self.origin if self.verified else "not verified"


Axis = Literal["x", "y", "z"]
Positions = Literal["exact", "stepped"]


ASSUMED_WALL_RATE = 1000.0
"""Update rate of a wall test [Hz] where neither the test nor its device states one."""

WALL_KEYS = (
    "directions",
    "cycled",
    "update_rate",
    "rate_source",
    "delay_samples",
    "positions",
    "lightest",
)
"""Keys of a wall test besides those of any number."""


@dataclass(frozen=True)
class WallTest(Datum):
    """A test of smooth walls of increasing stiffness on a device.

    It is the entry ``max_stiffness`` of a device: its value is K₀, the greatest stiffness without a
    limit cycle. Details missing in the source stay empty.

    Attributes:
        directions: axes of the device along which the wall was pushed; empty if unknown.
        cycled: the least stiffness with a limit cycle [N/m].
        update_rate: f₀, update rate of the test [Hz]; if unknown the device's own, or 1 kHz.
        positions: whether positions were ``"exact"``, or ``"stepped"`` by an encoder.
        lightest: damping in the lightest direction relative to that along ``directions`` [1], at
            most 1, known from geometry or other tests.
        rate_source: source of ``update_rate`` where it is not that of the stiffness.
        delay_samples: d₀, delay of the test [samples]; 0 if unknown.
    """

    directions: tuple[Axis, ...] = ()
    cycled: float | None = None
    update_rate: float | None = None
    positions: Positions | None = None
    lightest: float | None = None
    rate_source: str = ""
    delay_samples: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units, with the known details of the test."""
        data = super().to_dict().items()
        return {name: value for name, value in data if value or name not in WALL_KEYS}


@dataclass(frozen=True)
class Device(Serializable, Displayable):
    """A force-feedback device.

    Attributes:
        id: short name, as on the command line.
        name: full name.
        data: the known numbers by field; see ``asperity.devices.FIELD_TABLE``.
        axes: directions of its own x, y and z; empty if unknown.
        driver: driver for ``--driver real``, such as ``haply``; empty if none is known.
        notes: further remarks, in sentences.

    Example:
        >>> from asperity.devices import load_device
        >>> device = load_device("omega.3")
        >>> device.value("max_stiffness"), device.data["update_rate"].verified
        (5000.0, False)
        >>> [(other.text, other.verified) for other in device.data["max_stiffness"].also]
        [('14500 N/m', False)]
    """

    id: str
    name: str
    data: Mapping[str, Datum]
    axes: str = ""
    notes: tuple[str, ...] = ()
    driver: str = ""

    def __repr__(self) -> str:
        return f"<Device {self.id}, {self.name}: {len(self.data)} numbers>"

    def value(self, field: str) -> float | None:
        """Return a number in SI units, ``None`` if it is unknown."""
        return self.data[field].value if field in self.data else None

    @property
    def workspace_size(self) -> float:
        """Greatest known width of the workspace [m]; infinite if it is unknown."""
        sides = [self.value("workspace_diameter"), self.value("workspace_length")]
        widths = [2.0 * (self.value("workspace_radius") or 0.0), *filter(None, sides)]
        return max(widths) or math.inf

    @property
    def wall_test(self) -> WallTest | None:
        """The wall test of K₀; ``None`` if K₀ is unknown."""
        datum = self.data.get("max_stiffness")
        if datum is None or isinstance(datum, WallTest):
            return datum
        return WallTest(**{field.name: getattr(datum, field.name) for field in fields(Datum)})

    @property
    def max_stiffness(self) -> float:
        """K₀ [N/m]: the stiffest smooth wall without a limit cycle on the device.

        Raises:
            ParameterError: it is unknown.
        """
        value = self.value("max_stiffness")
        if value is None:
            raise ParameterError("device", f"{self.id} needs max_stiffness to compare laws [N/m]")
        return value
