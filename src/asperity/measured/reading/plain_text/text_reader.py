"""Read matrices, profiles and lists of points from text, with or without a header."""

from __future__ import annotations

import codecs
import math
from collections.abc import Sequence
from dataclasses import replace
from decimal import Decimal, InvalidOperation

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.measured.reading import resampling
from asperity.measured.reading.plain_text import text_header
from asperity.measured.reading.plain_text.text_table import TextTable, find_table
from asperity.measured.reading.reader import (
    RawSurface,
    ReadingOptions,
    SurfaceFile,
    check_point_count,
    mask_missing,
)

_MIN_POINTS = 4
_MAX_HEADER_LINE = 1000
_MAX_LENGTH = 10.0  # [m]; a longer measurement has probably another unit


def read_text(file: SurfaceFile, options: ReadingOptions) -> RawSurface:
    """Read a matrix, a profile (position, height), a list of x, y, z, or a column of heights.

    Cells are separated by tabs, semicolons, commas or white space. Empty cells and "nan"
    are missing points. A decimal comma is accepted unless commas separate the cells. Two
    columns are a profile if the first increases (or decreases) throughout; three are points
    of a regular grid, in any order, unless the header is that of a map.

    Returns:
        Heights [m]; the pitch [m] of a profile or of points, else None.

    Raises:
        SurfaceFileError: no table of numbers, or one that cannot be read without guessing.
        ParameterError: a unit is given for a file that names its own, or must be given.
    """
    table = find_table(_decode(file.content))
    _check_table(table)
    table, found = text_header.drop_auxiliary_columns(table)
    header = text_header.parse_map_header(table.header)
    if text_header.parse_map_header(table.comments).describes_map:
        raise SurfaceFileError("several maps in one file: save each in a file of its own")
    rows, columns = table.values.shape
    if columns == 2 and not header.describes_map and _is_monotonic(table):
        raw = _read_profile(table, file.name, options)
    elif columns == 3 and rows > 3 and not header.describes_map:
        raw = _read_points(table, header, file.name, options)
    elif options.resample is not None:
        raise ParameterError("resample", f"must not be given: {file.name} is no list of points")
    else:
        raw = _read_matrix(table, header, file.name, options)
    return replace(raw, notes=(*found, *raw.notes))


def _decode(content: bytes) -> str:
    """Decode UTF-8 or UTF-16 with a byte order mark, else UTF-8, else Latin-1."""
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return content.decode("utf-16", errors="replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")


def _check_table(table: TextTable) -> None:
    rows, columns = table.values.shape
    check_point_count(columns, rows)
    if table.values.size < _MIN_POINTS or (columns <= 2 and rows < _MIN_POINTS):
        size = f"{rows} rows of {columns} numbers"
        raise SurfaceFileError(f"{size}; at least {_MIN_POINTS} points are expected")
    infinite = np.argwhere(np.isinf(table.values))
    if len(infinite):
        line = table.line_numbers[int(infinite[0][0])]
        raise SurfaceFileError(f"line {line} has an infinite number")


def _is_monotonic(table: TextTable) -> bool:
    """Whether two columns are a profile rather than a matrix; a damaged profile is refused."""
    positions = table.values[:, 0]
    steps = np.diff(positions)
    rising = float(np.median(steps[~np.isnan(steps)])) if (~np.isnan(steps)).any() else 0.0
    wrong = np.flatnonzero(~(steps * np.sign(rising) > 0))
    if len(wrong) == 0:
        return True
    if len(wrong) > len(steps) // 10 and not np.isnan(positions).any():
        return False
    raise SurfaceFileError(
        f"line {table.line_numbers[int(wrong[0]) + 1]}: the positions in the first of two columns"
        " must increase throughout"
    )


def _read_profile(table: TextTable, name: str, options: ReadingOptions) -> RawSurface:
    units, notes = _resolve_units(table, _column_units(table, options), name, options)
    unit_x, unit_z = units or (1.0, 1.0)
    positions, heights = table.values[:, 0], table.values[:, 1] * unit_z
    resolution, lines = _printed_resolution(table, 0), table.line_numbers
    if positions[0] > positions[-1]:
        positions, heights = positions[::-1], heights[::-1]
        resolution, lines = resolution[::-1], lines[::-1]
        notes = (*notes, "positions decrease: the profile is reversed")
    result = resampling.measure_spacing(positions, resolution)
    pitch = result.step * unit_x
    _check_length(pitch * (len(heights) - 1), has_units=units is not None)
    if options.resample is not None:
        heights, note = resampling.resample_profile(positions * unit_x, heights, options.resample)
        notes, pitch = (*notes, note), options.resample
    elif not result.is_uniform:
        raise SurfaceFileError(
            f"sampling is not uniform: line {lines[result.index]} is"
            f" {result.deviation * unit_x:.3g} m from a grid of {pitch:.3g} m;"
            f" {resampling.resampling_hint(pitch)}"
        )
    heights = np.ascontiguousarray(heights)
    return RawSurface(heights, (pitch,), name, notes, has_units=units is not None)


def _check_length(length: float, *, has_units: bool) -> None:
    if not has_units and length > _MAX_LENGTH:
        raise SurfaceFileError(
            f"positions span {length:.4g} and look not to be in metres; name the units in the"
            " column header, such as 'x [um], z [nm]', or give unit='mm'"
        )


def _read_points(
    table: TextTable, header: text_header.MapHeader, name: str, options: ReadingOptions
) -> RawSurface:
    """Return the map, or the profile along one axis, of a list of points."""
    if header.lateral_unit is None or header.unit is None:
        own = _column_units(table, options)
    else:
        own = header.lateral_unit, header.lateral_unit, header.unit
    units, notes = _resolve_units(table, own, name, options)
    if np.isnan(table.values[:, :2]).any():
        raise SurfaceFileError(f"a position is missing; {_EXPECTED_LAYOUT}")
    scale = np.array(units or (1.0, 1.0, 1.0))
    points, has_units = table.values * scale, units is not None
    _check_length(float(np.ptp(points[:, :2], axis=0).max()), has_units=has_units)
    if options.resample is not None:
        heights, note = resampling.resample_points(points, options.resample)
        pitch = (options.resample, options.resample)
        return RawSurface(heights, pitch, name, (*notes, note), has_units=has_units)
    try:
        resolution = _printed_resolution(table, 0), _printed_resolution(table, 1)
        heights, steps = points_to_grid(table.values, resolution)
    except _NoGridError as error:
        suited = resampling.suggest_pitch(points[:, :2])
        hint = f"{error}; {_EXPECTED_LAYOUT}"
        if suited is not None:
            hint += f"; {resampling.resampling_hint(suited)}, one grid point for each of theirs"
        raise SurfaceFileError(hint) from None
    pitch = (steps[0] * float(scale[0]), steps[1] * float(scale[1]))
    raw = RawSurface(heights * scale[2], pitch, name, notes, has_units=has_units)
    if 1 not in heights.shape:
        return raw
    axis = 0 if heights.shape[0] == 1 else 1
    return replace(raw, heights=raw.heights.ravel(), pitch=(pitch[axis],))


def _read_matrix(
    table: TextTable, header: text_header.MapHeader, name: str, options: ReadingOptions
) -> RawSurface:
    _reject_numbering(table.values)
    # NaN is no code: it equals nothing.
    code = math.nan if header.missing_code is None else header.missing_code
    values, marked = mask_missing(table.values, code)
    own = [] if header.unit is None else [header.unit]
    if not own and not text_header.is_lateral_entry(_last_header_line(table)):
        own = sorted(set(_named_units(table, options)))
    if len(own) > 1:
        line = " ".join(_last_header_line(table).split())
        raise SurfaceFileError(f"the header {line[:60]!r} names several units")
    units, notes = _resolve_units(table, own, name, options)
    heights = np.ascontiguousarray(values * (units or (1.0,))[0])
    pitch: tuple[float, ...] | None = header.find_pitch(*values.shape)
    if heights.shape[1] == 1:
        heights, pitch = heights[:, 0], None if pitch is None else pitch[1:]
    notes = (*header.notes, *marked, *notes)
    return RawSurface(heights, pitch, name, notes, has_units=units is not None)


def _header_cells(table: TextTable) -> list[str]:
    """Return the cells of the last header line; one if it is not split as the numbers are."""
    line = _last_header_line(table)
    cells, words = table.dialect.cells(line), line.split()
    if len(cells) == 1 and len(words) == table.values.shape[1]:
        return words
    return cells if table.dialect.separator or len(cells) == table.values.shape[1] else [line]


def _resolve_units(
    table: TextTable, own: Sequence[float], name: str, options: ReadingOptions
) -> tuple[tuple[float, ...] | None, tuple[str, ...]]:
    """Return the units of the columns [m], None if unknown, and the notes on reading."""
    unit, assumed = options.resolve_unit(name, own[0] if own else None)
    notes = list(assumed)
    if table.n_footer_lines:
        notes.append(f"{table.n_footer_lines} lines of text after the numbers ignored")
    if table.dialect.decimal == ",":
        notes.append("a comma is read as the decimal sign")
    if own or unit is None:
        return tuple(own) or None, tuple(notes)
    return (unit,) * table.values.shape[1], tuple(notes)


def _named_units(table: TextTable, options: ReadingOptions) -> list[float]:
    """Return the units [m] that the last header line names; ask for one that is not clear."""
    found = text_header.find_units(_header_cells(table))
    if not found and options.unit is None:
        text_header.require_unit(_last_header_line(table))
    return found


def _column_units(table: TextTable, options: ReadingOptions) -> Sequence[float]:
    """Return the units of the columns [m] in the last header line, none if it names none."""
    found, count = _named_units(table, options), table.values.shape[1]
    if count == 3 and len(found) == 1:
        return found * 3
    if len(found) not in (0, count):
        line, columns = _last_header_line(table), f"all {count} columns or of none"
        raise SurfaceFileError(f"the header {line[:60]!r} must name the unit of {columns}")
    return found


class _NoGridError(SurfaceFileError):
    """Points that are on no regular grid, but may be interpolated."""


def _reject_numbering(values: FloatArray) -> None:
    """Refuse numbers of rows and columns around the heights, as written by data-frame programs."""
    rows, columns = values.shape
    if rows < 3 or columns < 3 or not np.isnan(values[0, 0]):
        return
    down, across = values[1:, 0], values[0, 1:]
    for first in (0, 1):
        if np.array_equal(down, np.arange(first, first + rows - 1)) and np.array_equal(
            across, np.arange(first, first + columns - 1)
        ):
            raise SurfaceFileError("the first row and column number the others; remove them")


def _last_header_line(table: TextTable) -> str:
    """Return the last header line that is not empty."""
    line = next((line for line in reversed(table.header) if line.strip(" \t,;")), "")
    return line if len(line) <= _MAX_HEADER_LINE else ""


def _printed_resolution(table: TextTable, column: int) -> FloatArray:
    """Return the value of the last printed digit of each number in a column.

    Fixed notation prints a constant number of decimals, "%g" a constant number of digits without
    trailing zeros; the coarser of both bounds the rounding in either case.
    """
    cells = [_cell_text(table, text, column) for text in table.row_texts]
    decimals = {len(cell.partition(".")[2]) for cell in cells}
    if len(decimals) == 1 and not any("e" in cell.lower() for cell in cells):
        return np.full(len(cells), 10.0 ** -min(decimals.pop(), 300))
    parts = [_to_decimal(cell).as_tuple() for cell in cells]
    exponents = np.array([int(part.exponent) for part in parts], dtype=np.float64)
    digits = np.array([len(part.digits) for part in parts], dtype=np.float64)
    last = np.maximum(exponents.min(), exponents + digits - digits.max())
    return np.asarray(10.0 ** np.clip(last, -300, 300))


def _to_decimal(text: str) -> Decimal:
    try:
        return Decimal(text)
    except InvalidOperation:  # an exponent beyond the range of Decimal: zero as a float
        return Decimal(0)


def _cell_text(table: TextTable, text: str, column: int) -> str:
    if table.dialect.decimal == ",":
        text = text.replace(",", ".")
    return table.dialect.cells(text)[column]


_MAX_SPARSITY = 4  # grid points for each point of the list, beyond which there is no grid
_EXPECTED_LAYOUT = (
    "three columns: a list of x, y, z points must lie on a regular grid, in any order; a matrix of"
    " heights or two columns (position, height) are read, too"
)


def points_to_grid(
    points: FloatArray, resolution: tuple[FloatArray, FloatArray]
) -> tuple[FloatArray, tuple[float, float]]:
    """Return a list of points as a grid.

    Args:
        points: x, y, z, shape (n, 3).
        resolution: value of the last printed digit of each x and each y, shape (n,).

    Returns:
        Heights, shape (ny, nx), NaN for points not in the list; the pitch (p_x, p_y), in the
        unit of the positions, 0 along an axis with one point.

    Raises:
        SurfaceFileError: the points are on no regular grid, or two have the same position.

    Example:
        >>> points = np.array([[0, 0, 1.0], [0, 2, 3.0], [1, 0, 2.0], [1, 2, 4.0]])
        >>> points_to_grid(points, (np.ones(4), np.ones(4)))[0]
        array([[1., 2.],
               [3., 4.]])
    """
    x, column = np.unique(points[:, 0], return_inverse=True)
    y, row = np.unique(points[:, 1], return_inverse=True)
    if len(x) * len(y) > _MAX_SPARSITY * len(points):
        raise _NoGridError("the points are on no regular grid")
    if len(np.unique(row * len(x) + column)) < len(points):
        raise SurfaceFileError(f"two points have the same position; {_EXPECTED_LAYOUT}")
    heights = np.full((len(y), len(x)), np.nan)
    heights[row, column] = points[:, 2]
    return heights, (_grid_step("x", x, resolution[0]), _grid_step("y", y, resolution[1]))


def _grid_step(axis: str, positions: FloatArray, resolution: FloatArray) -> float:
    if len(positions) == 1:
        return 0.0
    result = resampling.measure_spacing(positions, float(resolution.max()))
    if not result.is_uniform:
        raise _NoGridError(
            f"the {axis} positions are not uniform: one is {result.deviation:.3g} from a grid of"
            f" {result.step:.3g}"
        )
    return result.step
