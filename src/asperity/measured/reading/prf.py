"""Read PRF profiles of stylus instruments: text with unit, resolution and spacing in its header.

Records end with a line ``EOR``. The first one has the axes, ``CZ M 3 MM 1e-9 L`` for three heights
in steps of 1e-9 mm; the second one ``SPACING CX 5e-4``, in the unit of the axis; the third one a
whole number for each height.

Reference:
    The format of the softgauges of the National Physical Laboratory, which Mahr and others write.
"""

from __future__ import annotations

import re

import numpy as np

from asperity.core.errors import SurfaceFileError
from asperity.measured.lengths import unit_to_metres
from asperity.measured.reader import RawSurface, ReadingOptions, SurfaceFile
from asperity.measured.reading.isolation import reject_on_error

_SIGNATURE = re.compile(rb"\d+ +\d+\s*\n[^\n]* PRF\s*\n")
_RECORD_END = re.compile(r"^EOR\s*$", re.MULTILINE)
_AXIS = re.compile(r"^(CX|CZ)\s+\S+\s+(\S+)\s+(\S+)\s+(\S+)", re.MULTILINE)
_SPACING = re.compile(r"^SPACING\s+CX\s+(\S+)", re.MULTILINE)


def is_prf(file: SurfaceFile) -> bool:
    """Whether a file starts as a PRF profile."""
    return _SIGNATURE.match(file.head) is not None


def read_prf(file: SurfaceFile, _options: ReadingOptions) -> RawSurface:
    """Read a PRF profile.

    Raises:
        SurfaceFileError: the file is damaged, or cut.
    """
    records = _RECORD_END.split(file.content.decode("latin-1"))
    axes = {name: values for name, *values in _AXIS.findall(records[0])}
    spacing = _SPACING.search("".join(records[1:2]))
    if len(records) < 4 or axes.keys() != {"CX", "CZ"} or spacing is None:
        raise SurfaceFileError("damaged or truncated PRF profile (an axis, SPACING or EOR lacks)")
    with reject_on_error("damaged PRF profile"):
        count, unit, resolution = axes["CZ"]
        heights = np.array(records[2].split(), dtype=np.float64)
        heights *= float(resolution) * unit_to_metres(unit.lower())
        pitch = float(spacing[1]) * unit_to_metres(axes["CX"][1].lower())
        expected = int(float(count))
    if len(heights) != expected:
        raise SurfaceFileError(f"truncated PRF profile ({len(heights)} of {expected} heights)")
    if not 0.0 < pitch < np.inf:
        raise SurfaceFileError(f"damaged PRF profile (its points are {pitch:g} m apart)")
    return RawSurface(heights, (pitch,), file.name, ())
