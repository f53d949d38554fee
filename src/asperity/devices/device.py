"""A device as data: every number with its unit, its source, and whether it was verified."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from asperity.errors import ParameterError
from asperity.files import Record
from asperity.units import engineering


@dataclass(frozen=True)
class Datum(Record):
    """One number of a device.

    Attributes:
        value: in SI units.
        unit: the SI unit; "1" for a plain number.
        source: where the number was read.
        verified: whether it was read in a source that others can read, or follows from such.
        also: what else is said of the same number, by other sources or for other conditions.
    """

    value: float
    unit: str
    source: str
    verified: bool
    also: tuple[Datum, ...] = ()

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


@dataclass(frozen=True)
class Device(Record):
    """A force-feedback device.

    Attributes:
        id: short name, as on the command line.
        name: full name.
        data: what is known, by field; see ``asperity.devices.FIELDS``.
        axes: where its own x, y and z point; empty if not known.
        notes: what else one must know, in sentences.

    Example:
        >>> from asperity.devices import load_device
        >>> device = load_device("omega.3")
        >>> device.value("max_stiffness"), device.data["update_rate"].verified
        (5000.0, False)
        >>> [(other.text, other.verified) for other in device.data["max_stiffness"].also]
        [('14500 N/m', False)]
    """

    written = "id name axes notes data"

    id: str
    name: str
    data: Mapping[str, Datum]
    axes: str = ""
    notes: tuple[str, ...] = ()

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
