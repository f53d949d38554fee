"""Convert the pixels of an image to heights, with the lengths in its metadata."""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.measured.lengths import format_lengths, is_pitch, unit_to_metres
from asperity.measured.reader import RawSurface, ReadingOptions, check_point_count, states_periodic
from asperity.measured.reading.normal_map import decode_normals, normals_to_surface

_MAX_DESCRIPTION = 10**6
_OME_PIXELS = re.compile(r"<(?:\w{1,20}:)?Pixels\s([^<>]{0,5000})>")
_XML_ATTRIBUTE = re.compile(r"(\w{1,40})=[\"']([^\"'<>]{0,100})[\"']")
_UNICODE_ESCAPE = re.compile(r"\\u([0-9a-fA-F]{4})")
_IMAGEJ_LINEAR = 0  # ImageJ's calibration function y = c0 + c1 v


@dataclass(frozen=True)
class ImageScale:
    """Lengths of an image.

    Attributes:
        pitch: size of a pixel (px, py) [m]; None if unknown.
        metres_per_value: metres per value; None if unknown. A value is factor * number + offset.
        factor: see ``metres_per_value``.
        offset: see ``metres_per_value``.
        notes: the lengths found, one sentence each.
        is_periodic: whether the file states that the surface repeats.
    """

    pitch: tuple[float, float] | None = None
    metres_per_value: float | None = None
    factor: float = 1.0
    offset: float = 0.0
    notes: tuple[str, ...] = ()
    is_periodic: bool = False


def imagej_scale(metadata: Mapping[str, Any], resolution: tuple[float, float] | None) -> ImageScale:
    """Return the lengths in the metadata that ImageJ writes into a TIFF.

    The pixel size is 1/resolution of its "unit"; a linear calibration (cf=0, c0, c1) converts
    stored numbers to values, which are heights if their unit ("vunit") is a length.

    Args:
        metadata: ImageJ's keys and values.
        resolution: pixels per unit along x and y, from the resolution tags.

    Reference:
        ij.io.FileInfo and ij.measure.Calibration of ImageJ 1.x.

    Example:
        >>> found = imagej_scale({"unit": "micron", "vunit": "nm"}, (2.0, 2.0))
        >>> found.pitch, found.metres_per_value
        ((5e-07, 5e-07), 1e-09)
    """
    lateral = _find_metres_per_unit(metadata.get("unit"))
    unit = _find_metres_per_unit(metadata.get("vunit"))
    across = _find_metres_per_unit(metadata.get("yunit")) or lateral
    pitch = None
    if lateral and across and resolution is not None and all(resolution):
        pitch = _valid_pitch((lateral / resolution[0], across / resolution[1]))
    factor = _parse_float(str(metadata.get("c1")))
    offset = _parse_float(str(metadata.get("c0") or 0.0))
    is_linear = metadata.get("cf") == _IMAGEJ_LINEAR and factor != 0.0
    if not (is_linear and math.isfinite(factor) and math.isfinite(offset)):
        factor = 1.0
        offset = 0.0
    notes = []
    if pitch is not None:
        notes.append(f"pixel size {format_lengths(pitch)} from ImageJ's metadata")
    if unit is not None:
        notes.append(f"unit of heights {metadata['vunit']!s:.20} from ImageJ's metadata")
    if (factor, offset) != (1.0, 0.0):
        notes.append(f"calibrated as ImageJ's metadata says: {offset:g} + {factor:g} value")
    repeats = states_periodic(str(metadata.get("Info")))
    return ImageScale(pitch, unit, factor, offset, tuple(notes), repeats)


def ome_scale(description: str) -> ImageScale:
    """Return the pixel size in the OME-XML of a TIFF, which has no unit of heights.

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
    match = _OME_PIXELS.search(description[:_MAX_DESCRIPTION])
    if match is None:
        return ImageScale()
    attributes = dict(_XML_ATTRIBUTE.findall(match.group(1)))
    sides = []
    for axis in "XY":
        unit = _find_metres_per_unit(attributes.get(f"PhysicalSize{axis}Unit", "µm"))
        sides.append(_parse_float(attributes.get(f"PhysicalSize{axis}", "")) * (unit or math.nan))
    pitch = _valid_pitch((sides[0], sides[1]))
    if pitch is None:
        return ImageScale()
    return ImageScale(pitch, notes=(f"pixel size {format_lengths(pitch)} from the OME metadata",))


def _find_metres_per_unit(unit: Any) -> float | None:
    """Return the length of a unit [m]; None if it is no length ("pixel")."""
    if not isinstance(unit, str):
        return None
    # ImageJ escapes characters that are not ASCII, as in \\u00B5.
    text = _UNICODE_ESCAPE.sub(lambda code: chr(int(code.group(1), 16)), unit[:40])
    try:
        return unit_to_metres(text.strip().strip("\x00"))
    except ParameterError:
        return None


def _valid_pitch(pitch: tuple[float, float]) -> tuple[float, float] | None:
    return pitch if is_pitch(pitch) else None


_SCAL_METRE = 1
_PCAL_LINEAR = 0


def png_scale(chunks: Mapping[bytes, bytes], depth: int) -> ImageScale:
    r"""Return the lengths in the chunks of a PNG; units that are no length are ignored.

    Args:
        chunks: content of the chunks by kind.
        depth: bits of a value.

    Reference:
        Extensions to the PNG 1.2 specification, 1.2.0: sCAL, pCAL.

    Example:
        >>> found = png_scale({b"sCAL": b"\x011e-5\x002e-5"}, 16)
        >>> found.pitch
        (1e-05, 2e-05)
    """
    pitch = _parse_scal(chunks.get(b"sCAL", b""))
    unit, factor, offset = _parse_pcal(chunks.get(b"pCAL", b""), 2**depth - 1)
    notes = []
    if pitch is not None:
        notes.append(f"pixel size {format_lengths(pitch)} from the chunk sCAL")
    if unit is not None:
        notes.append("heights calibrated as the chunk pCAL says")
    repeats = states_periodic(chunks.get(b"tEXt", b"").decode("latin-1"))
    return ImageScale(pitch, unit, factor, offset, tuple(notes), repeats)


def _parse_scal(data: bytes) -> tuple[float, float] | None:
    if data[:1] != bytes([_SCAL_METRE]):
        return None
    sides = [_parse_float(text.decode("latin-1")) for text in data[1:].split(b"\0")]
    return None if len(sides) != 2 else _valid_pitch((sides[0], sides[1]))


def _parse_pcal(data: bytes, max_value: int) -> tuple[float | None, float, float]:
    """Return metres per unit (None if it is no length), factor and offset of stored values."""
    none = None, 1.0, 0.0
    _name, _zero, rest = data.partition(b"\0")
    if len(rest) < 10:
        return none
    first, last, kind, count = struct.unpack_from(">iiBB", rest)
    unit, *texts = rest[10:].split(b"\0")
    numbers = [_parse_float(text.decode("latin-1")) for text in texts]
    if kind != _PCAL_LINEAR or count != 2 or len(numbers) != 2 or first == last:
        return none
    start, span = numbers
    if not (math.isfinite(start) and math.isfinite(span) and span != 0.0):
        return none
    try:
        metres = unit_to_metres(unit.decode("latin-1"))
    except ParameterError:
        return none
    return metres, span / max_value, start + span * first / (last - first)


def _parse_float(text: str) -> float:
    """Return a finite number, NaN for any other text."""
    try:
        value = float(text)
    except ValueError:
        return math.nan
    return math.nan if not math.isfinite(value) else value


def check_image_size(rows: int, columns: int) -> None:
    """Refuse an image without pixels or with too many, before any memory is allocated.

    Raises:
        SurfaceFileError: the size cannot be read.
    """
    if rows < 1 or columns < 1:
        raise SurfaceFileError(f"{columns} x {rows} pixels")
    check_point_count(columns, rows)


def pixels_to_surface(
    values: NDArray[Any],
    scale: ImageScale,
    name: str,
    options: ReadingOptions,
    *,
    has_alpha: bool,
    notes: tuple[str, ...] = (),
) -> RawSurface:
    """Convert pixels to heights.

    Row i is row i of the image from the top, so that y runs down the image.

    Args:
        values: pixels, shape (rows, columns, channels), unsigned, signed or float.
        scale: lengths that the file names.
        name: name of the file.
        options: ``unit``.
        has_alpha: whether the last channel is opacity.
        notes: peculiarities of the file.

    Returns:
        Heights, without a unit unless the file or the options name one; the pitch if the file
        has one.

    Raises:
        SurfaceFileError: colours or transparency.
        ParameterError: a unit for a file that names its own.
    """
    notes = (*notes, *scale.notes)
    if has_alpha:
        _check_opaque(values[..., -1])
        values = values[..., :-1]
        notes = (*notes, "alpha channel dropped: opaque everywhere")
    normals = decode_normals(values)
    if normals is not None:
        surface = normals_to_surface(normals, name, options.green)
        notes = (*notes, *surface.notes)
        return replace(surface, pitch=scale.pitch, notes=notes, is_periodic=scale.is_periodic)
    if options.green is not None:
        raise ParameterError("green", f"must not be given: {name} is no normal map", options.green)
    grey, notes = _to_grey(values, notes)
    with np.errstate(invalid="ignore"):  # a signalling NaN is a missing point too
        heights = scale.factor * grey.astype(np.float64) + scale.offset
    unit, assumed = options.resolve_unit(name, scale.metres_per_value)
    if unit is None:
        note = "an image has no unit: heights are pixel values, y runs down the image"
        return RawSurface(
            heights, scale.pitch, name, (*notes, note), has_units=False, relative=True
        )
    notes = (*notes, *assumed, "y runs down the image")
    return RawSurface(unit * heights, scale.pitch, name, notes, is_periodic=scale.is_periodic)


def _check_opaque(alpha: NDArray[Any]) -> None:
    opaque = np.iinfo(alpha.dtype).max if alpha.dtype.kind in "iu" else 1.0
    transparent = int(np.count_nonzero(alpha != opaque))
    if transparent:
        raise SurfaceFileError(
            f"{transparent} of {alpha.size} pixels are transparent; transparency has no height:"
            " save the image without an alpha channel"
        )


def _to_grey(values: NDArray[Any], notes: tuple[str, ...]) -> tuple[NDArray[Any], tuple[str, ...]]:
    """Return the only channel, or the first of three equal ones."""
    channels = values.shape[-1]
    first = values[..., 0]
    if channels == 1:
        return first, notes
    if channels != 3:
        raise SurfaceFileError(f"has {channels} channels; one channel of heights is expected")
    is_float = first.dtype.kind == "f"
    if all(np.array_equal(first, values[..., k], equal_nan=is_float) for k in (1, 2)):
        return first, (*notes, "three equal channels: read as one grey image")
    raise SurfaceFileError(
        "is a colour image: its three channels differ, and a colour is no height;"
        " save the heights as a grey image (16 bit if possible)"
    )
