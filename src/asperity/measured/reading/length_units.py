"""The names of length units that a user or a file may give."""

from __future__ import annotations

from asperity.errors import ParameterError

METRES = {
    "m": 1.0,
    "meter": 1.0,
    "metre": 1.0,
    "cm": 1e-2,
    "mm": 1e-3,
    "millimeter": 1e-3,
    "millimetre": 1e-3,
    "um": 1e-6,
    "µm": 1e-6,  # U+00B5, the micro sign
    "μm": 1e-6,  # U+03BC, the Greek letter
    "micron": 1e-6,
    "micrometer": 1e-6,
    "micrometre": 1e-6,
    "nm": 1e-9,
    "nanometer": 1e-9,
    "nanometre": 1e-9,
    "angstrom": 1e-10,
    "ångström": 1e-10,
    "å": 1e-10,
    "pm": 1e-12,
}
_ONLY_NAMED = {"Å": 1e-10, "in": 0.0254, "inch": 0.0254, "km": 1e3, "dm": 0.1}


def metres_of(unit: str) -> float:
    """Return the length of a unit [m].

    Args:
        unit: its symbol or English name, such as "mm".

    Raises:
        ParameterError: not a unit of length that is known here.

    Example:
        >>> metres_of("um")
        1e-06
    """
    name = unit.strip() if isinstance(unit, str) else ""
    plural = name[:-1] if len(name) > 3 and name.endswith("s") else name
    for key in (name, plural):
        if key in METRES or key in _ONLY_NAMED:
            return METRES.get(key) or _ONLY_NAMED[key]
    raise ParameterError("unit", "must be a unit of length: m, cm, mm, um, nm, angstrom, in", unit)
