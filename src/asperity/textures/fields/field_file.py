"""Files of baked fields: little-endian, versioned, checked, and read into memory.

A file is a header of 256 bytes (:data:`HEADER`), the table of columns, the coefficients, one by
one or in bricks, the heights of a texture that is a spline, and a description as JSON. A C program
needs the header, the columns and the coefficients; the description holds the certified numbers and
the source.
"""

from __future__ import annotations

import json
import math
import os
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.core.cache import get_or_compute
from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.core.files import content_digest, json_text, open_input, open_output
from asperity.core.memory import free_memory
from asperity.textures.fields.field_bricks import align_bricks
from asperity.textures.fields.field_certificate import certify_gain
from asperity.textures.fields.field_grid import FieldGrid
from asperity.textures.fields.field_record import (
    BRICK_ENTRIES,
    MIRRORED,
    PERIODIC,
    ZERO,
    FieldArguments,
    field_rows,
    field_width,
)
from asperity.textures.fields.potential_field import FieldAccuracy, PotentialField, ThinRegion
from asperity.textures.spline.spline_texture import fit_spline
from asperity.textures.texture import CertifiedNumber, Texture

MAGIC = b"ASPFIELD"
VERSION = 4
_WITHOUT_BRICKS = 3  # the version of fields that have none
_UNSTRETCHED = 2  # the version before, whose cells are equally high
_BYTE_ORDER = 0x01020304
_ALIGNMENT = 4096
_SCALE_TOLERANCE = 1e-9
# Relative difference of bounds that a search finds in another order.
_CLAIM_TOLERANCE = 1e-6
_COUNTS = ("levels", "below", "border")
_TUPLES = {"at", "depths", "shares", "presses"}
"""Tuples of numbers in the description; all others are single numbers."""
_SCALARS = ("x0", "y0", "z0", "m00", "m01", "m10", "m11", "iz", "margin", "lift")
_NUMBERS = (*_SCALARS, "floor", "fade")
_BRICK_NUMBERS = ("unit", "excess_rows", "excess_columns")
_SECTIONS = ("columns", "stretched", "values", "bricks", "heights", "json")

HEADER = np.dtype(
    [
        ("magic", "S8"),
        ("version", "<u4"),
        ("byte_order", "<u4"),  # 0x01020304
        ("file_bytes", "<u8"),
        ("rows", "<u4"),
        ("columns", "<u4"),
        ("columns_offset", "<u8"),  # int32 (rows, columns, 4)
        ("count", "<u8"),
        ("values_offset", "<u8"),  # float32 (count,)
        ("heights_offset", "<u8"),  # float64, to the description
        ("json_offset", "<u8"),  # UTF-8, to the end of the file
        *((name, "<f8") for name in _SCALARS),
        ("levels", "<i4"),
        ("border", "<i4"),
        ("q", "<f8"),  # certified characteristic number
        ("floor", "<f8"),  # z down to which it is that of the spline [m]
        ("below", "<i4"),
        ("stretched", "<u4"),
        ("stretched_offset", "<u8"),  # float64 (stretched, 7)
        ("fade", "<f8"),  # twice the height of the cells below the floor [m]
        ("bricks_offset", "<u8"),  # int16 (brick_count, 32)
        ("unit", "<f8"),  # least step of the coefficients of bricks [m]
        ("brick_count", "<u4"),
        ("excess_rows", "<u4"),
        ("excess_columns", "<u4"),
        ("reserved", "V20"),
        ("checksum", "<u4"),  # CRC-32 of all that follows the header
        ("header_checksum", "<u4"),  # CRC-32 of the header before this entry
    ]
)

# Builds the texture of a description; see :meth:`Texture.describe`.
BuildTexture = Callable[[Mapping[str, Any]], Texture]


def save_field(path: str | os.PathLike[str], field: Texture) -> PotentialField:
    """Save a baked field; the file is written atomically.

    Args:
        path: the file to write; an existing one is replaced.
        field: the texture of a baked surface.

    Returns:
        The field.

    Raises:
        ParameterError: if it is no baked field, or cannot be written.
    """
    if not isinstance(field, PotentialField):
        raise ParameterError("field", "must be the texture of a baked surface", field)
    header, sections = _encode(field)
    with open_output("output", path, durable=True) as stream:
        stream.write(header.tobytes())
        for offset, section in sections:
            stream.seek(offset)
            stream.write(section)
    return field


def _encode(field: PotentialField) -> tuple[NDArray[Any], list[tuple[int, bytes]]]:
    record = field.arguments
    heights = field.stored_heights()
    stored = {"filled": _mask_changes(field.filled_mask), "thin_map": field.thin_map}
    description = json_text(field.describe() | stored).encode()
    parts = [
        np.ascontiguousarray(record.columns, "<i4").tobytes(),
        np.ascontiguousarray(record.stretched_cells, "<f8").tobytes(),
        np.ascontiguousarray(record.c, "<f4").tobytes(),
        np.ascontiguousarray(record.bricks, "<i2").tobytes(),
        np.ascontiguousarray(heights, "<f8").tobytes(),
        description,
    ]
    offsets = []
    end = HEADER.itemsize
    for part in parts:
        offsets.append(-(-end // _ALIGNMENT) * _ALIGNMENT)
        end = offsets[-1] + len(part)
    header = np.zeros((), HEADER)
    header["magic"] = MAGIC
    header["version"] = VERSION if len(record.bricks) else _WITHOUT_BRICKS
    header["byte_order"] = _BYTE_ORDER
    header["file_bytes"] = end
    header["count"] = record.c.size
    header["rows"], header["columns"] = record.columns.shape[:2]
    header["brick_count"] = len(record.bricks)
    header["stretched"] = len(record.stretched_cells)
    for name, offset in zip(_SECTIONS, offsets, strict=True):
        header[f"{name}_offset"] = offset
    for name in (*_NUMBERS, *_COUNTS, *_BRICK_NUMBERS):
        header[name] = getattr(record, name)
    header["q"] = field.gain.upper
    sections = list(zip(offsets, parts, strict=True))
    header["checksum"] = _checksum(sections, HEADER.itemsize)
    header["header_checksum"] = zlib.crc32(header.tobytes()[:-4])
    return header, sections


def _checksum(sections: list[tuple[int, bytes]], start: int) -> int:
    """Return the CRC-32 of the file after its header; between sections it is zero."""
    value = 0
    for offset, section in sections:
        value = zlib.crc32(section, zlib.crc32(bytes(offset - start), value))
        start = offset + len(section)
    return value


def is_field(path: str | os.PathLike[str]) -> bool:
    """Return whether a file is a baked field, by its content."""
    try:
        with open_input(path, 2**40) as stream:
            return stream.read(len(MAGIC)) == MAGIC
    except (OSError, ValueError):  # which the reader of surfaces reports
        return False


def load_field(path: str | os.PathLike[str], build_texture: BuildTexture) -> PotentialField:
    """Load a baked field into memory, where no change of the file reaches it.

    Its gain is computed from its coefficients, once for each content; what the file states is a
    claim: :attr:`PotentialField.claimed_gain`. So is its difference from exact law H.

    Args:
        path: the file.
        build_texture: builds the texture that was baked, unless it is a spline.

    Raises:
        SurfaceFileError: the file is damaged, cut, of another version, or larger than the memory.
    """
    name = Path(path).name
    try:
        with open_input(path, 2**40) as stream:
            size = os.fstat(stream.fileno()).st_size
            free = free_memory()
            if free is not None and size > free:
                raise SurfaceFileError(f"its {size:,} bytes exceed the free memory, {free:,} bytes")
            data = np.fromfile(stream, np.uint8)
        return _certify(_decode(data, build_texture))
    except SurfaceFileError as error:
        raise SurfaceFileError(f"{name}: {error}") from None
    except (OSError, MemoryError) as error:
        raise SurfaceFileError(f"{name}: cannot be read ({error})") from None
    except RecursionError:
        raise SurfaceFileError(f"{name}: damaged field (its description is nested)") from None
    except (LookupError, TypeError, ValueError, ArithmeticError) as error:
        raise SurfaceFileError(f"{name}: damaged field ({error})") from None


def _decode(data: NDArray[np.uint8], build_texture: BuildTexture) -> PotentialField:
    header = _read_header(data)
    shape = (int(header["rows"]), int(header["columns"]), 4)
    columns = _section(data, header["columns_offset"], math.prod(shape), "<i4")
    values = _section(data, header["values_offset"], int(header["count"]), "<f4")
    described = json.loads(bytes(data[int(header["json_offset"]) :]))
    numbers: dict[str, Any] = {name: header[name].item() for name in (*_NUMBERS, *_COUNTS)}
    if header["version"] == _UNSTRETCHED:
        numbers["fade"] = 2.0 * numbers["below"] / numbers["iz"]
    cells = _section(data, header["stretched_offset"], 7 * int(header["stretched"]), "<f8")
    record = FieldArguments(values, columns.reshape(shape), cells.reshape(-1, 7), **numbers)
    if header["brick_count"]:
        size = int(header["brick_count"]) * BRICK_ENTRIES
        bricks = _section(data, header["bricks_offset"], size, "<i2")
        parts = {name: header[name].item() for name in _BRICK_NUMBERS}
        record = record._replace(bricks=bricks.reshape(-1, BRICK_ENTRIES), **parts)
    count = math.prod(described["shape"]) * bool(described["shape"])
    heights = _section(data, header["heights_offset"], count, "<f8")
    field = assemble_field(align_bricks(record), described, heights, build_texture)
    _check_scales(header, field)
    return field


def _certify(field: PotentialField) -> PotentialField:
    """Replace the numbers that a file claims by those of its coefficients, up to rounding."""
    grid = field.grid
    content = content_digest(*field.arguments, *grid.cells, grid.level_spacing)
    gain, one_sided = get_or_compute(
        "field gain", content, lambda: certify_gain(grid, field.arguments)
    )
    field.claimed_gain = field.gain.upper
    if not _agree(field.gain, gain) or not _agree(field.one_sided, one_sided):
        field.gain = gain
        field.one_sided = one_sided
    return field


def _agree(claim: CertifiedNumber, computed: CertifiedNumber) -> bool:
    """Return whether two numbers are the same but for the order of a search."""
    pairs = [(claim.lower, computed.lower), (claim.upper, computed.upper)]
    return all(math.isclose(*pair, rel_tol=_CLAIM_TOLERANCE) for pair in pairs)


def assemble_field(
    record: FieldArguments,
    described: Mapping[str, Any],
    heights: FloatArray,
    build_texture: BuildTexture,
) -> PotentialField:
    """Return a field from its record, its description and the heights of a spline.

    Args:
        record: coefficients and columns.
        described: see :meth:`PotentialField.describe`.
        heights: see :meth:`PotentialField.stored_heights`.
        build_texture: builds the texture that was baked, unless it is a spline.

    Raises:
        SurfaceFileError: the table of columns is damaged.
        KeyError, TypeError, ValueError: the description is damaged.
    """
    numbers = described["grid"]
    grid = FieldGrid(
        steps=np.array(numbers["steps"], float),
        cells=tuple(map(int, numbers["cells"])),
        start=np.array(numbers["start"], float),
        levels=record.levels,
        level_spacing=_number(numbers["level_spacing"]),
        floor=_number(numbers["floor"]),
        below=record.below,
        border=record.border,
        knots=np.array(numbers.get("knots", ()), float),
    )
    sizes = [grid.level_spacing, grid.floor, *grid.steps.ravel(), *grid.knots.ravel()]
    if grid.steps.shape != (len(grid.cells), 2) or not np.isfinite(sizes).all():
        raise ValueError("its grid has no steps")
    if not (grid.level_spacing > 0.0 and (np.diff(grid.knots.ravel()) > 0.0).all()):
        raise ValueError("the levels of its grid do not rise")
    _check_record(record, grid)
    thin_map = described.get("thin_map")
    return PotentialField(
        _source(described, heights, build_texture),
        grid,
        record,
        max_depth=_number(described["max_depth"]),
        continuity=_number(described["continuity"]),
        passes=int(described["passes"]),
        gain=CertifiedNumber(**_numbers(described["gain"])),
        one_sided=CertifiedNumber(**_numbers(described["one_sided"])),
        accuracy=FieldAccuracy(**_numbers(described["accuracy"])),
        thin_regions=tuple(
            [ThinRegion(**_numbers(region)) for region in described.get("thin_regions", ())]
        ),
        thin_map=None if thin_map is None else np.array(thin_map, float),
    )


def _numbers(entries: Mapping[str, Any]) -> dict[str, Any]:
    """Return numbers by name, and tuples of them, which JSON knows as lists.

    Raises:
        TypeError, ValueError: for anything else.
    """
    values: dict[str, Any] = {}
    for name in entries:
        value = entries[name]
        if name in _TUPLES:
            values[name] = tuple(map(_number, value))
        else:
            values[name] = _number(value)
    return values


def _number(value: Any) -> float:
    number = float(value)  # also of the text "inf"
    if math.isnan(number):
        raise ValueError(f"{value!r} is not a number")
    return value if isinstance(value, int) else number


def _read_header(data: NDArray[np.uint8]) -> Any:
    """Return the header.

    Raises:
        SurfaceFileError: the file is damaged, cut, or of another version.
    """
    if len(data) < HEADER.itemsize:
        raise SurfaceFileError("is cut: it has no whole header")
    header = data[: HEADER.itemsize].view(HEADER)[0]
    if header["byte_order"] != _BYTE_ORDER:
        raise SurfaceFileError("has another byte order, or is damaged")
    if header["version"] not in range(_UNSTRETCHED, VERSION + 1):
        known = f"{_UNSTRETCHED} to {VERSION} are read"
        fault = f"is a .field file of version {header['version']}, of which {known}"
        raise SurfaceFileError(f"{fault}; bake it again")
    if header["header_checksum"] != zlib.crc32(data[: HEADER.itemsize - 4].data):
        raise SurfaceFileError("has a damaged header")
    if header["file_bytes"] != len(data):
        raise SurfaceFileError(f"is cut: {len(data)} of {header['file_bytes']} bytes")
    if header["checksum"] != zlib.crc32(data[HEADER.itemsize :].data):
        raise SurfaceFileError("is damaged: its checksum is wrong")
    return header


def _check_record(record: FieldArguments, grid: FieldGrid) -> None:
    """Refuse a table that points outside of the coefficients: the force kernels do not check.

    Raises:
        SurfaceFileError: the table is damaged.
    """
    offset, first, end, reach = np.moveaxis(record.columns.astype(np.int64), -1, 0)
    rows = 1 if len(grid.cells) == 1 else grid.cells[1] + 3
    shape = field_rows(record), field_width(record)
    fits = shape == (rows, grid.cells[0] + 3) and record.levels >= 3
    fits = fits and record.border in (PERIODIC, MIRRORED, ZERO)
    fits = fits and 1 <= record.below <= record.levels - 2
    fits = fits and record.stretched_cells.shape == grid.stretched_table().shape
    fits = fits and len(record.stretched_cells) < record.levels
    fits = fits and 0 <= max(record.excess_rows, record.excess_columns) <= len(record.bricks)
    count = len(record.bricks) or record.c.size
    ordered = (first >= 0) & (first <= end) & (reach >= 0) & (reach <= record.levels)
    stored = (first == end) | ((offset + first >= 0) & (offset + end <= count))
    numbers = np.array([getattr(record, name) for name in (*_NUMBERS, "unit")])
    if not (fits and ordered.all() and stored.all()):
        raise SurfaceFileError("has a damaged table of columns")
    finite = [np.isfinite(part).all() for part in (numbers, record.c, record.stretched_cells)]
    if not (all(finite) and min(record.iz, record.fade, record.unit) > 0.0):
        raise SurfaceFileError("has numbers that are not finite")


def _check_scales(header: Any, field: PotentialField) -> None:
    """Refuse a header whose numbers are not those of the description.

    Raises:
        ValueError: it states both numbers.
    """
    grid = field.grid
    scales = grid.scales() | {"q": field.gain.upper}
    if not np.allclose(grid.stretched_table(), field.arguments.stretched_cells, _SCALE_TOLERANCE):
        raise ValueError("its stretched cells are not those of its description")
    for name in scales:
        number = getattr(field.arguments, name, header["q"].item())
        if not math.isclose(number, scales[name], rel_tol=_SCALE_TOLERANCE, abs_tol=1e-12):
            expected = f"of its description {scales[name]:.9g}"
            raise ValueError(f"{name} of its header is {number:.9g}, {expected}")


def _section(data: NDArray[np.uint8], offset: Any, count: int, dtype: str) -> NDArray[Any]:
    """Return an array of a file; writing to it would change a copy only.

    Raises:
        SurfaceFileError: the file ends before it.
    """
    values = data[int(offset) : int(offset) + count * np.dtype(dtype).itemsize]
    if len(values) < count * np.dtype(dtype).itemsize:
        raise SurfaceFileError("has sections beyond its end")
    return values.view(np.ndarray).view(dtype)


def _source(described: Mapping[str, Any], heights: FloatArray, build: BuildTexture) -> Texture:
    source = described["source"]
    if not isinstance(source, Mapping):
        raise TypeError("its source is not described")
    if not described["shape"]:
        return build(source)
    origin = described["origin"] if len(described["shape"]) == 2 else described["origin"][0]
    return fit_spline(
        heights.reshape(described["shape"]),
        described["pitch"],
        periodic=described["periodic"],
        origin=origin,
        preparation=described["preparation"],
        filled_mask=_mask_from_changes(described.get("filled"), described["shape"]),
    )


def _mask_changes(mask: NDArray[np.bool_] | None) -> list[int] | None:
    """Return the indices at which a mask changes, row by row; the first is where it is true."""
    if mask is None:
        return None
    return np.flatnonzero(np.diff(mask.ravel(), prepend=False)).tolist()


def _mask_from_changes(changes: list[int] | None, shape: list[int]) -> NDArray[np.bool_] | None:
    if changes is None:
        return None
    flips = np.zeros(math.prod(shape), dtype=bool)
    flips[changes] = True
    return np.logical_xor.accumulate(flips).reshape(shape)
