"""A device as data: every number with its unit, its source, and whether it was verified.

What can be said of a device: its fields, their units, and which values they may have.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Literal

from asperity.display import Displayed
from asperity.errors import ParameterError
from asperity.files import Record, record
from asperity.units import engineering

Range = Literal["positive", "not negative", "any"]


@dataclass(frozen=True)
class Field:
    """A number that a device may have.

    Attributes:
        unit: the SI unit in which asperity keeps it; "1" for a plain number.
        words: what it is.
        allowed: which values it may have; all are finite.
        whole: whether it is a whole number.
    """

    unit: str
    words: str
    allowed: Range = "positive"
    whole: bool = False


FIELD_TABLE: dict[str, Field] = {
    "max_force": Field("N", "greatest force, for a moment"),
    "continuous_force": Field("N", "greatest force that it holds without end"),
    "max_stiffness": Field("N/m", "K₀, the stiffest smooth wall that held without a cycle"),
    "position_resolution": Field("m", "smallest step of the measured position"),
    "force_resolution": Field("N", "smallest step of the force"),
    "update_rate": Field("Hz", "updates of the force per second, 1/T"),
    "velocity_rate": Field("Hz", "updates of the measured velocity per second"),
    "bandwidth": Field("Hz", "frequency up to which it transmits force, F₀"),
    "damping": Field("N*s/m", "physical damping, σ₀(B): the least over the directions"),
    "joint_damping": Field("N*m*s", "physical damping in each joint"),
    "virtual_damping": Field("N*s/m", "damping that the controller adds, or takes away", "any"),
    "controller_damping": Field("N*s/m", "greatest damping gain of the controller; not physical"),
    "delay_samples": Field(
        "1", "whole samples between measurement and force", "not negative", True
    ),
    "friction": Field("N", "dry friction, felt when moving it", "not negative"),
    "least_friction": Field("N", "dry friction that it has at least, everywhere", "not negative"),
    "apparent_mass": Field("kg", "mass felt when moving it"),
    "workspace_radius": Field("m", "radius of the ball that it reaches"),
    "workspace_diameter": Field("m", "diameter of the cylinder that it reaches"),
    "workspace_length": Field("m", "length of the cylinder that it reaches"),
    "proximal_link": Field("m", "length of each link at a motor"),
    "distal_link": Field("m", "length of each link at the handle"),
    "base_distance": Field("m", "distance of the motors' axes", "not negative"),
    "encoder_counts": Field("1", "steps of an encoder per turn of its joint", whole=True),
}

FIELDS: dict[str, str] = {name: field.unit for name, field in FIELD_TABLE.items()}
"""The unit in which asperity keeps each field."""

WORDS = ("id", "name", "axes", "driver", "notes")
"""What a device file may say besides its numbers."""


@dataclass(frozen=True)
class Datum(Record):
    """One number of a device.

    Attributes:
        value: in SI units.
        unit: the SI unit; "1" for a plain number.
        source: where the number was read.
        verified: whether it was read in a source that others can read, or follows from such.
        also: what else is said of the same number, by other sources or for other conditions.
        measured: whether the source says that it was measured on such a device; a constant in a
            driver or a line of a data sheet is read, not measured.
    """

    value: float
    unit: str
    source: str
    verified: bool
    also: tuple[Datum, ...] = ()
    measured: bool = False

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units; ``verified`` is "measured" where the number is."""
        said = record(self, "value", "unit", "source", "verified", "also")
        return said | ({"verified": "measured"} if self.pedigree == "measured" else {})

    @property
    def text(self) -> str:
        """The value for reading, with an SI prefix.

        Example:
            >>> Datum(0.005, "N*m*s", "", True).text, Datum(0.045, "kg", "", True).text
            ('5 mN·m·s', '45 g')
        """
        if self.unit == "1":
            return f"{self.value:.10g}"
        if self.unit == "kg" and self.value < 1.0:
            return engineering(1e3 * self.value, "g")
        return engineering(self.value, self.unit).replace("*", "·")

    @property
    def pedigree(self) -> Pedigree:
        """What the number rests on: ``"measured"``, ``"read"`` or ``"not verified"``."""
        if not self.verified:
            return "not verified"
        return "measured" if self.measured else "read"


Pedigree = Literal["measured", "read", "not verified"]
Axis = Literal["x", "y", "z"]
Positions = Literal["exact", "stepped"]


@dataclass(frozen=True)
class WallTest(Datum):
    """A smooth wall that somebody raised on a device: what held, and what did not.

    It is the entry ``max_stiffness`` of a device: its value is K₀, the stiffness that held without
    a cycle. What a source does not say stays empty.

    Attributes:
        directions: axes of the device along which the wall was pushed; empty if not said.
        cycled: the least stiffness at which it began to cycle [N/m].
        update_rate: of the test [Hz]; the device's own if not said.
        positions: whether positions were read ``"exact"``, or ``"stepped"`` by an encoder.
        lightest: damping in the lightest direction as a share of that along ``directions`` [1],
            at most 1, as far as geometry or other tests tell.
    """

    directions: tuple[Axis, ...] = ()
    cycled: float | None = None
    update_rate: float | None = None
    positions: Positions | None = None
    lightest: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units, with what is known of the test and no more."""
        test = record(self, "directions", "cycled", "update_rate", "positions", "lightest")
        return super().to_dict() | {name: value for name, value in test.items() if value}


@dataclass(frozen=True)
class Device(Record, Displayed):
    """A force-feedback device.

    Attributes:
        id: short name, as on the command line.
        name: full name.
        data: what is known, by field; see ``asperity.devices.FIELDS``.
        axes: where its own x, y and z point; empty if not known.
        driver: what ``--driver real`` is on it, such as ``haply``; empty if none is known.
        notes: what else one must know, in sentences.

    Example:
        >>> from asperity.devices import load_device
        >>> device = load_device("omega.3")
        >>> device.value("max_stiffness"), device.data["update_rate"].verified
        (5000.0, False)
        >>> [(other.text, other.verified) for other in device.data["max_stiffness"].also]
        [('14500 N/m', False)]
    """

    written = "id name axes driver notes data"

    id: str
    name: str
    data: Mapping[str, Datum]
    axes: str = ""
    notes: tuple[str, ...] = ()
    driver: str = ""

    def __repr__(self) -> str:
        return f"<Device {self.id}, {self.name}: {len(self.data)} numbers>"

    def value(self, field: str) -> float | None:
        """Return a number in SI units, or ``None`` if it is not known."""
        return self.data[field].value if field in self.data else None

    @property
    def wall_test(self) -> WallTest | None:
        """What is known of the smooth wall K₀; ``None`` if nothing is."""
        datum = self.data.get("max_stiffness")
        if datum is None or isinstance(datum, WallTest):
            return datum
        return WallTest(**{field.name: getattr(datum, field.name) for field in fields(Datum)})

    @property
    def max_stiffness(self) -> float:
        """K₀ [N/m]: the stiffest smooth wall that held on the device.

        Raises:
            ParameterError: if it is not known.
        """
        value = self.value("max_stiffness")
        if value is None:
            raise ParameterError("device", f"{self.id} needs max_stiffness to compare laws [N/m]")
        return value
