"""A grip: the mechanical impedance of the hand at the tool, and the motions that it notices."""

from __future__ import annotations

import math
import os
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError, suggest_names
from asperity.core.files import Serializable, read_toml
from asperity.core.units import parse_quantity

DEFAULT_GRIP = "pen-grip"
_FOLDER = Path(__file__).parent / "grips"
_UNITS = {"stiffness": "N/m", "damping": "N*s/m", "mass": "kg"}
_POINT_UNITS = {"frequency": "Hz", "unnoticed": "m", "felt": "m"}


@dataclass(frozen=True)
class Grip(Serializable):
    """The hand that holds the tool.

    Its impedance is Z(ω) = jωm + b + K/(jω), the same in all directions. Without a stiffness a slow
    force would move the hand without end.

    Attributes:
        name: name for reading.
        stiffness: K [N/m].
        damping: b [N·s/m].
        mass: m [kg], moved with the tool.
        frequency: frequencies of the thresholds [Hz], ascending.
        unnoticed: amplitude of a sinusoidal motion of the tool that nobody notices below [m].
        felt: amplitude that is felt [m]; in between it depends on the person.
        sources: source of each number by name.

    Raises:
        ParameterError: for a stiffness that is not positive, negative damping or mass, or
            thresholds without two ascending frequencies and 0 < unnoticed <= felt.
    """

    name: str
    stiffness: float
    damping: float
    mass: float
    frequency: tuple[float, ...]
    unnoticed: tuple[float, ...]
    felt: tuple[float, ...]
    sources: Mapping[str, str]

    def __post_init__(self) -> None:
        for name, unit in _UNITS.items():
            number = getattr(self, name)
            above = name == "stiffness"
            if not 0.0 <= number < math.inf or (above and number == 0.0):
                least = "positive" if above else "at least 0"
                raise ParameterError(
                    "grip", f"{self.name}: {name} must be {least} [{unit}]", number
                )
        rises = (a < b for a, b in pairwise((0.0, *self.frequency)))
        if len(self.frequency) < 2 or not all(rises):
            needs = "thresholds need two or more ascending frequencies"
            raise ParameterError("grip", f"{self.name}: {needs}")
        sizes = {len(self.frequency), len(self.unnoticed), len(self.felt)}
        levels = zip(self.unnoticed, self.felt, strict=False)
        if len(sizes) > 1 or any(not 0.0 < low <= high for low, high in levels):
            raise ParameterError("grip", f"{self.name}: thresholds need 0 < unnoticed <= felt")

    def threshold(self, frequency: FloatArray | float) -> tuple[FloatArray, FloatArray]:
        """Return the thresholds at frequencies [Hz]: amplitudes unnoticed and felt [m].

        Interpolated linearly in the logarithms of both; constant beyond the frequencies of the
        data, see :meth:`is_known`. Thresholds against frequency are U-shaped, so what is unnoticed
        there is unnoticed; what is felt there is not known.
        """
        f = np.log(np.asarray(frequency, dtype=float))
        known = np.log(self.frequency)
        lower, upper = (
            np.exp(np.interp(f, known, np.log(level))) for level in (self.unnoticed, self.felt)
        )
        return lower, upper

    def is_known(self, frequency: FloatArray) -> NDArray[np.bool_]:
        """Return at which frequencies [Hz], shape (n,), the data have thresholds, shape (n,)."""
        return (frequency >= self.frequency[0]) & (frequency <= self.frequency[-1])

    def compliance(
        self,
        frequency: FloatArray,
        device_mass: float = 0.0,
        device_damping: float = 0.0,
        contact_stiffness: float = 0.0,
    ) -> FloatArray:
        """Return the amplitude of motion of the held tool per amplitude of force [m/N].

        X/F = 1/|K + k - (M + m) ω² + jω (B + b)|, for a force at the motors on the apparent mass M
        and damping B of the device, held by this grip, and pressed on a wall of stiffness k.
        Without them it is 1/(ω|Z|), motion per force on the hand itself.

        Args:
            frequency: shape (n,) [Hz].
            device_mass: M [kg].
            device_damping: B [N·s/m].
            contact_stiffness: k [N/m]; 0 for a force along the wall.
        """
        omega = 2.0 * np.pi * frequency
        spring = self.stiffness + contact_stiffness - (device_mass + self.mass) * omega**2
        return np.asarray(1.0 / np.abs(spring + 1j * omega * (device_damping + self.damping)))


def load_grip(grip: str | os.PathLike[str] | Grip = DEFAULT_GRIP) -> Grip:
    """Return a grip by its id, or one from a TOML file.

    A file has ``stiffness``, ``damping`` and ``mass``, each a quantity ("200 N/m") or a table with
    ``value`` and ``source``, and ``thresholds`` with ``points``: ``frequency``, ``unnoticed`` and
    ``felt``, and their ``source``.

    Raises:
        ParameterError: the id is unknown, or the file has wrong or missing numbers.

    Example:
        >>> pen = load_grip("pen-grip")
        >>> pen.stiffness, [f"{float(level):.2g}" for level in pen.threshold(100.0)]
        (200.0, ['4e-08', '4e-07'])
    """
    if isinstance(grip, Grip):
        return grip
    name = os.fspath(grip)
    shipped = _shipped_grips()
    if name in shipped:
        return parse_grip(shipped[name], name)
    if not os.path.exists(name):
        hint = suggest_names(name, shipped)
        raise ParameterError("grip", f"must be a TOML file or a known grip; {hint}", name)
    return parse_grip(read_toml("grip", name), name)


def _shipped_grips() -> dict[str, dict[str, Any]]:
    """Return the content of the files that come with the package, by id."""
    contents = [tomllib.loads(file.read_text("utf-8")) for file in _FOLDER.glob("*.toml")]
    return {str(content["id"]): content for content in contents}


def parse_grip(table: Mapping[str, Any], source: str) -> Grip:
    """Return a grip from the content of a file.

    Args:
        table: the content, see :func:`load_grip`.
        source: the file, for messages.

    Raises:
        ParameterError: for wrong or missing numbers; it names them.
    """
    if unknown := set(table) - {*_UNITS, "thresholds", "id", "name"}:
        names = ", ".join(sorted(unknown))
        raise ParameterError("grip", f"{source} has unknown keys: {names}")
    numbers: dict[str, Any] = {}
    sources = {}
    for name, unit in _UNITS.items():
        entry = table.get(name)
        entry = entry if isinstance(entry, Mapping) else {"value": entry}
        if entry.get("value") is None:
            raise ParameterError("grip", f"{source} needs {name} [{unit}]")
        numbers[name] = parse_quantity(f"{name} of the grip", entry["value"], unit)
        sources[name] = str(entry.get("source", source))
    thresholds = table.get("thresholds", {})
    sources["thresholds"] = str(thresholds.get("source", source))
    points = _parse_points(thresholds.get("points", ()), source)
    return Grip(name=str(table.get("name", source)), sources=sources, **numbers, **points)


def _parse_points(points: Sequence[Mapping[str, Any]], source: str) -> dict[str, Any]:
    """Return frequencies, unnoticed and felt amplitudes by name."""
    try:
        return {
            name: tuple(parse_quantity(name, point[name], unit) for point in points)
            for name, unit in _POINT_UNITS.items()
        }
    except (KeyError, TypeError):
        needs = ", ".join(_POINT_UNITS)
        raise ParameterError("grip", f"{source}: each threshold needs {needs}") from None
