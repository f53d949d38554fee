"""What a TIFF says of lengths: the size of a pixel and the unit of its values (ImageJ, OME)."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from asperity.errors import ParameterError
from asperity.measured.length_words import lengths_text
from asperity.measured.reading.length_units import metres_of

_MOST_TEXT = 10**6
_PIXELS = re.compile(r"<(?:\w{1,20}:)?Pixels\s([^<>]{0,5000})>")
_ATTRIBUTE = re.compile(r"(\w{1,40})=[\"']([^\"'<>]{0,100})[\"']")
_ESCAPED = re.compile(r"\\u([0-9a-fA-F]{4})")
_STRAIGHT = 0  # ImageJ's calibration function y = c0 + c1 v


@dataclass(frozen=True)
class Scale:
    """Lengths of an image.

    Attributes:
        pitch: size of a pixel (px, py) [m]; None where the file does not say.
        unit: metres per value; None where it does not say.
        factor: what a stored number is multiplied by to give a value.
        offset: what is added then.
        notes: what was found, one sentence each.
    """

    pitch: tuple[float, float] | None = None
    unit: float | None = None
    factor: float = 1.0
    offset: float = 0.0
    notes: tuple[str, ...] = ()


NO_SCALE = Scale()
"""Of an image that says nothing of lengths."""


def imagej_scale(metadata: Mapping[str, Any], resolution: tuple[float, float] | None) -> Scale:
    """Return what ImageJ has written into a TIFF.

    The pixel's size is 1/resolution of its "unit"; a straight calibration (cf=0, c0, c1) makes
    values of the stored numbers, which are heights if their unit ("vunit") is a length.

    Args:
        metadata: ImageJ's keys and values.
        resolution: pixels per unit along x and y, from the resolution tags.

    Reference:
        ij.io.FileInfo and ij.measure.Calibration of ImageJ 1.x.

    Example:
        >>> found = imagej_scale({"unit": "micron", "vunit": "nm"}, (2.0, 2.0))
        >>> found.pitch, found.unit
        ((5e-07, 5e-07), 1e-09)
    """
    lateral, unit = _metres(metadata.get("unit")), _metres(metadata.get("vunit"))
    pitch = None
    if lateral is not None and resolution is not None and all(_usable(r) for r in resolution):
        across = _metres(metadata.get("yunit")) or lateral
        pitch = _checked((lateral / resolution[0], across / resolution[1]))
    factor, offset = 1.0, 0.0
    if metadata.get("cf") == _STRAIGHT and _usable(metadata.get("c1")):
        factor, offset = float(metadata["c1"]), float(metadata.get("c0") or 0.0)
        if not math.isfinite(offset):
            factor, offset = 1.0, 0.0
    notes = []
    if pitch is not None:
        notes.append(f"pixel size {lengths_text(pitch)} from ImageJ's metadata")
    if unit is not None:
        notes.append(f"unit of heights {metadata['vunit']!s:.20} from ImageJ's metadata")
    if (factor, offset) != (1.0, 0.0):
        notes.append(f"calibrated as ImageJ's metadata says: {offset:g} + {factor:g} value")
    return Scale(pitch, unit, factor, offset, tuple(notes))


def ome_scale(description: str) -> Scale:
    """Return the size of a pixel in the OME-XML of a TIFF; it says nothing of heights.

    Args:
        description: the text of the image description.

    Reference:
        OME model 2016-06, Pixels: PhysicalSizeX and PhysicalSizeXUnit, micrometres by default.

    Example:
        >>> pitch = ome_scale('<OME><Pixels PhysicalSizeX="0.5" PhysicalSizeY="250"'
        ...                   ' PhysicalSizeYUnit="nm">').pitch
        >>> [f"{step:g} m" for step in pitch]
        ['5e-07 m', '2.5e-07 m']
    """
    found = _PIXELS.search(description[:_MOST_TEXT])
    if found is None:
        return Scale()
    said = dict(_ATTRIBUTE.findall(found.group(1)))
    sides = []
    for axis in "XY":
        unit = _metres(said.get(f"PhysicalSize{axis}Unit", "µm"))
        size = _number(said.get(f"PhysicalSize{axis}"))
        if unit is None or size is None:
            return Scale()
        sides.append(size * unit)
    pitch = _checked((sides[0], sides[1]))
    if pitch is None:
        return Scale()
    return Scale(pitch, notes=(f"pixel size {lengths_text(pitch)} from the OME metadata",))


def _metres(unit: Any) -> float | None:
    """Return the length of a unit [m]; None for what is none ("pixel")."""
    if not isinstance(unit, str):
        return None
    # ImageJ writes what is not ASCII as \\u00B5.
    text = _ESCAPED.sub(lambda code: chr(int(code.group(1), 16)), unit[:40])
    try:
        return metres_of(text.strip().strip("\x00"))
    except ParameterError:
        return None


def _number(text: str | None) -> float | None:
    try:
        value = float(text or "")
    except ValueError:
        return None
    return value if _usable(value) else None


def _usable(value: Any) -> bool:
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return number and math.isfinite(value) and value != 0


def _checked(pitch: tuple[float, float]) -> tuple[float, float] | None:
    return pitch if all(math.isfinite(p) and p > 0.0 for p in pitch) else None
