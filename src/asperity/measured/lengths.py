"""Format lengths for messages; parse units of length and numbers in files."""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Sequence

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError, SurfaceFileError

Pitch = tuple[float, ...]
"""Distance of neighbouring points, (px, py) or (px,) for a profile [m]."""
Shape = tuple[int, ...]
"""Shape of heights, (ny, nx) or (n,) for a profile."""


def format_length(value: float) -> str:
    """Return a length as text, with a readable unit.

    Example:
        >>> format_length(1.03e-5), format_length(-2e-9)
        ('10.3 µm', '-2 nm')
    """
    for unit, factor in (("m", 1.0), ("mm", 1e-3), ("µm", 1e-6)):
        if abs(value) >= factor:
            return f"{value / factor:.4g} {unit}"
    return f"{value / 1e-9:.4g} nm"


def format_lengths(values: Sequence[float]) -> str:
    """Return lengths along x and y as text, once if they are equal.

    Example:
        >>> format_lengths((1e-6, 1e-6)), format_lengths((1e-6, 2e-6))
        ('1 µm', '1 µm x 2 µm')
    """
    texts = [format_length(value) for value in values]
    return texts[0] if len(set(texts)) == 1 else " x ".join(texts)


def format_counts(values: Sequence[int]) -> str:
    """Return counts along the axes as text: "30 x 40"."""
    return " x ".join(map(str, values))


def side_lengths(shape: Shape, pitch: Pitch) -> tuple[float, ...]:
    """Return the lengths of a grid along x and y, or of a profile [m].

    Example:
        >>> side_lengths((3, 5), (1e-3, 2e-3))
        (0.004, 0.004)
    """
    return tuple((n - 1) * p for n, p in zip(shape[::-1], pitch, strict=True))


def is_pitch(pitch: Pitch) -> bool:
    """Whether all distances are positive and finite."""
    return all(math.isfinite(p) and p > 0.0 for p in pitch)


METRES_PER_UNIT = {
    "m": 1.0,
    "meter": 1.0,
    "metre": 1.0,
    "cm": 1e-2,
    "mm": 1e-3,
    "millimeter": 1e-3,
    "millimetre": 1e-3,
    "um": 1e-6,
    "µm": 1e-6,  # U+00B5
    "μm": 1e-6,  # U+03BC
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
"""Lengths of the units [m] by name in lower case."""
_EXPLICIT_UNITS = {"Å": 1e-10, "in": 0.0254, "inch": 0.0254, "km": 1e3, "dm": 0.1}
_MULTIPLE = re.compile(r"((?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(\D+)")


def unit_to_metres(unit: str) -> float:
    """Return the length of a unit [m].

    Args:
        unit: its symbol or English name, such as "mm", or a multiple, such as "0.5 nm".

    Raises:
        ParameterError: not a known unit of length.

    Example:
        >>> unit_to_metres("um")
        1e-06
    """
    name = str(unit).strip()
    factor = 1.0
    multiple = _MULTIPLE.fullmatch(name)
    if multiple:
        factor = float(multiple.group(1))
        name = multiple.group(2)
    singular = name.removesuffix("s") if len(name) > 3 else name
    for key in (name, singular):
        if key in METRES_PER_UNIT or key in _EXPLICIT_UNITS:
            return factor * (METRES_PER_UNIT.get(key) or _EXPLICIT_UNITS[key])
    raise ParameterError("unit", "must be a unit of length: m, cm, mm, um, nm, angstrom, in", unit)


_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


def parse_number(text: str, what: str) -> float:
    """Return a finite number in plain notation (``float`` also accepts 1_000 and nan).

    Args:
        text: the number.
        what: name of the number, for the message.

    Raises:
        SurfaceFileError: not a finite number.

    Example:
        >>> parse_number("-2.5e-3", "offset")
        -0.0025
    """
    if not _NUMBER.fullmatch(text) or not math.isfinite(float(text)):
        raise SurfaceFileError(f"{what} is {text[:40]!r}; a finite number is expected")
    return float(text)


def parse_heights(text: str) -> FloatArray:
    """Return the numbers of a text, apart by white space; "nan" is a missing one.

    NumPy's parser needs little memory.

    Raises:
        SurfaceFileError: a word is not a number.
    """
    if not text.strip():  # which NumPy reads as a number
        return np.empty(0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return np.fromstring(text, dtype=np.float64, sep=" ")
        except (DeprecationWarning, ValueError):
            for index, match in enumerate(re.finditer(r"\S+", text), 1):
                if match.group().lower() not in ("nan", "-nan"):
                    parse_number(match.group(), f"height {index}")
            raise SurfaceFileError("the heights are not numbers") from None
