"""What a PNG says of lengths: the size of a pixel (sCAL) and the height of a value (pCAL)."""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping

from asperity.errors import ParameterError
from asperity.measured.length_words import lengths_text
from asperity.measured.reading.length_units import metres_of
from asperity.measured.reading.tiff_scale import Scale

_METRE, _STRAIGHT = 1, 0


def png_scale(chunks: Mapping[bytes, bytes], depth: int) -> Scale:
    r"""Return the lengths that the chunks of a PNG name; what is no length is not taken.

    Args:
        chunks: content of the chunks by their kind.
        depth: bits of a value.

    Reference:
        Extensions to the PNG 1.2 specification, 1.2.0: sCAL, pCAL.

    Example:
        >>> found = png_scale({b"sCAL": b"\x011e-5\x002e-5"}, 16)
        >>> found.pitch
        (1e-05, 2e-05)
    """
    pitch = _pitch(chunks.get(b"sCAL", b""))
    unit, factor, offset = _heights(chunks.get(b"pCAL", b""), 2**depth - 1)
    notes = []
    if pitch is not None:
        notes.append(f"pixel size {lengths_text(pitch)} from the chunk sCAL")
    if unit is not None:
        notes.append("heights calibrated as the chunk pCAL says")
    return Scale(pitch, unit, factor, offset, tuple(notes))


def _pitch(data: bytes) -> tuple[float, float] | None:
    if data[:1] != bytes([_METRE]):
        return None
    sides = [_number(text) for text in data[1:].split(b"\0")]
    if len(sides) != 2 or not all(side > 0.0 for side in sides):
        return None
    return sides[0], sides[1]


def _heights(data: bytes, most: int) -> tuple[float | None, float, float]:
    """Return metres per unit (None for no length), factor and offset of stored values."""
    none = None, 1.0, 0.0
    _name, _zero, rest = data.partition(b"\0")
    if len(rest) < 10:
        return none
    first, last, kind, count = struct.unpack_from(">iiBB", rest)
    unit, *texts = rest[10:].split(b"\0")
    numbers = [_number(text) for text in texts]
    if kind != _STRAIGHT or count != 2 or len(numbers) != 2 or first == last:
        return none
    start, span = numbers
    if not (math.isfinite(start) and math.isfinite(span) and span != 0.0):
        return none
    try:
        metres = metres_of(unit.decode("latin-1"))
    except ParameterError:
        return none
    return metres, span / most, start + span * first / (last - first)


def _number(text: bytes) -> float:
    """Return a number as text; NaN for what is none."""
    try:
        value = float(text.decode("ascii"))
    except ValueError:
        return math.nan
    return value if math.isfinite(value) else math.nan
