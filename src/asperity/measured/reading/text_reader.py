"""Read matrices, profiles and lists of points from text, with or without a header."""

from __future__ import annotations

import codecs
from dataclasses import replace
from decimal import Decimal, InvalidOperation

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.measured import reader
from asperity.measured.lengths import format_length
from asperity.measured.reading import text_header
from asperity.measured.reading.text_table import TextTable, find_table

_MIN_POINTS = 4


def read_text(file: reader.SurfaceFile, options: reader.ReadingOptions) -> reader.RawSurface:
    """Read a matrix, a profile (position, height), a list of x, y, z, or a column of heights.

    Cells are separated by tabs, semicolons, commas or white space. Empty cells and "nan"
    are missing points. A decimal comma is accepted unless commas separate the cells. Two
    columns are a profile if the first increases (or decreases) throughout; three are points
    of a regular grid, in any order, unless the header is that of a map. Units and sizes are those
    of column headings and of the headers in ``text_layouts.toml``.

    Returns:
        Heights [m]; the pitch [m] of a profile or of points, else None.

    Raises:
        SurfaceFileError: no table of numbers, or one that cannot be read without guessing.
        ParameterError: a unit is given for a file that names its own, or must be given.
    """
    table = find_table(_decode(file.content))
    _check_table(table)
    header = text_header.parse_map_header(table.header, table.values.shape)
    if text_header.parse_map_header(table.comments).pitch is not None:
        raise SurfaceFileError("several maps in one file: save each in a file of its own")
    headings = text_header.find_headings(table)
    is_list = header.pitch is None and _is_list(table, len(headings) == 2)
    heights = table.values
    if is_list:
        heights = heights[:, -1:]
    heights[:], notes = text_header.mask_codes(heights, header.missing_code)
    if is_list:
        raw = _read_list(table, headings, header, file.name, options)
    else:
        raw = _read_matrix(table, headings, header, file.name, options)
    notes = (*header.notes, *notes, *raw.notes)
    if table.dialect.decimal == ",":
        notes += ("a comma is read as the decimal sign",)
    if table.n_footer_lines:
        notes += (f"{table.n_footer_lines} lines of text after the numbers ignored",)
    return replace(raw, notes=notes)


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
    reader.check_point_count(columns, rows)
    if table.values.size < _MIN_POINTS or (columns <= 2 and rows < _MIN_POINTS):
        size = f"{rows} rows of {columns} numbers"
        raise SurfaceFileError(f"{size}; at least {_MIN_POINTS} points are expected")
    infinite = np.argwhere(np.isinf(table.values))
    if len(infinite):
        line = table.line_numbers[int(infinite[0][0])]
        raise SurfaceFileError(f"line {line} has an infinite number")


def _is_list(table: TextTable, has_two_headings: bool) -> bool:
    """Whether rows are points of a profile or of a map rather than rows of a matrix."""
    rows, columns = table.values.shape
    if columns == 2:
        return _is_monotonic(table, has_two_headings)
    return bool(columns == 3 and rows > 3)


def _is_monotonic(table: TextTable, has_two_headings: bool) -> bool:
    """Whether two columns are a profile rather than a matrix; a damaged profile is refused."""
    positions = table.values[:, 0]
    steps = np.diff(positions)
    known = steps[~np.isnan(steps)]
    rising = float(np.median(known)) if known.size else 0.0
    wrong = np.flatnonzero(~(steps * np.sign(rising) > 0))
    if len(wrong) == 0:
        return True
    is_damaged = has_two_headings or len(wrong) <= len(steps) // 10
    if not is_damaged and not np.isnan(positions).any():
        return False
    fault = "the positions in the first of two columns must increase throughout"
    raise SurfaceFileError(f"line {table.line_numbers[int(wrong[0]) + 1]}: {fault}")


def _read_list(
    table: TextTable,
    headings: list[str],
    header: text_header.MapHeader,
    name: str,
    options: reader.ReadingOptions,
) -> reader.RawSurface:
    """Read a profile, or the points of a map, with the given unit for each column without.

    Raises:
        ParameterError: a unit is missing, or given although the file names all.
    """
    units = [text_header.find_single_unit(heading) for heading in headings]
    if not units:
        units = [header.lateral_unit] * (table.values.shape[1] - 1) + [header.unit]
    stated = None if None in units else units[0]
    assumed, notes = options.resolve_unit(name, stated)
    if assumed is None:
        what = "positions and heights"
        if units[-1] is not None:
            what = "positions"
        elif any(units):
            what = "heights"
        raise ParameterError(
            "unit",
            f"is required: {name} does not state the unit of its {what}; give it, such as {{unit}},"
            " or name it for each column, such as 'x [um], z [nm]'",
            unit="um",
        )
    known = [unit or assumed for unit in units]
    raw = _read_profile(table, known, name) if len(known) == 2 else _read_points(table, known, name)
    return replace(raw, notes=(*raw.notes, *notes))


def _read_profile(table: TextTable, units: list[float], name: str) -> reader.RawSurface:
    positions = table.values[:, 0]
    heights = table.values[:, 1] * units[-1]
    resolution = _printed_resolution(table, 0)
    lines = table.line_numbers
    notes: tuple[str, ...] = ()
    if positions[0] > positions[-1]:
        positions = positions[::-1]
        heights = heights[::-1]
        resolution = resolution[::-1]
        lines = lines[::-1]
        notes = ("positions decrease: the profile is reversed",)
    result = reader.measure_spacing(positions, resolution)
    if not result.is_uniform:
        line = max(lines[result.index], lines[result.index + 1])
        deviation = format_length(result.deviation * units[0])
        median = format_length(result.median * units[0])
        raise SurfaceFileError(
            f"sampling is not uniform: the step to line {line} differs by {deviation} from the"
            f" median of {median}; {reader.INTERPOLATE}"
        )
    pitch = result.step * units[0]
    return reader.RawSurface(np.ascontiguousarray(heights), (pitch,), name, notes)


def _read_points(table: TextTable, units: list[float], name: str) -> reader.RawSurface:
    """Return the map, or the profile along one axis, of a list of points."""
    if np.isnan(table.values[:, :2]).any():
        raise SurfaceFileError(f"a position is missing; {_EXPECTED_LAYOUT}")
    resolution = _printed_resolution(table, 0), _printed_resolution(table, 1)
    heights, steps = points_to_grid(table.values, resolution)
    heights = heights * units[2]
    pitch = (steps[0] * units[0], steps[1] * units[1])
    if 1 not in heights.shape:
        return reader.RawSurface(heights, pitch, name, ())
    return reader.RawSurface(heights.ravel(), (pitch[0 if heights.shape[0] == 1 else 1],), name, ())


def _read_matrix(
    table: TextTable,
    headings: list[str],
    header: text_header.MapHeader,
    name: str,
    options: reader.ReadingOptions,
) -> reader.RawSurface:
    """Return the map, or the profile of one column; heights without a unit are relative."""
    text_header.reject_positions(table)
    stated = header.unit
    heading_note: tuple[str, ...] = ()
    if stated is None and len(headings) == 1:
        stated = text_header.find_single_unit(headings[0])
        if stated is not None:
            heading_note = (f"heights in units of {stated:g} m: header {headings[0]!r}",)
    unit, notes = options.resolve_unit(name, stated)
    heights = np.ascontiguousarray(table.values * (unit or 1.0))
    pitch: tuple[float, ...] | None = header.pitch
    if heights.shape[1] == 1:
        heights = heights[:, 0]
        if pitch is not None:
            pitch = pitch[1:]
    return reader.RawSurface(
        heights,
        pitch,
        name,
        (*heading_note, *notes),
        has_units=bool(unit),
        relative=not unit,
        lacks_unit=not unit,
    )


def _printed_resolution(table: TextTable, column: int) -> FloatArray:
    """Return the value of the last printed digit of each number in a column.

    Fixed notation prints a constant number of decimals, "%g" a constant number of digits without
    trailing zeros; the coarser of both bounds the rounding in either case.
    """
    sign = table.dialect.decimal
    cells = [table.dialect.cells(text)[column].replace(sign, ".") for text in table.row_texts]
    decimals = {len(cell.partition(".")[2]) for cell in cells}
    if len(decimals) == 1 and "e" not in "".join(cells).lower():
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


_MAX_SPARSITY = 4  # grid points for each point of the list, beyond which there is no grid
_EXPECTED_LAYOUT = "three columns are x, y, z of points on a regular grid, in any order"
_NO_GRID = f"{_EXPECTED_LAYOUT}; {reader.INTERPOLATE}"


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
        raise SurfaceFileError(f"the points are on no regular grid; {_NO_GRID}")
    if len(np.unique(row * len(x) + column)) < len(points):
        raise SurfaceFileError(f"two points have the same position; {_EXPECTED_LAYOUT}")
    heights = np.full((len(y), len(x)), np.nan)
    heights[row, column] = points[:, 2]
    return heights, (_grid_step("x", x, resolution[0]), _grid_step("y", y, resolution[1]))


def _grid_step(axis: str, positions: FloatArray, resolution: FloatArray) -> float:
    if len(positions) == 1:
        return 0.0
    result = reader.measure_spacing(positions, float(resolution.max()))
    if not result.is_uniform:
        fault = f"a step differs by {result.deviation:.3g} from the median of {result.median:.3g}"
        raise SurfaceFileError(f"the {axis} positions are not uniform: {fault}; {_NO_GRID}")
    return result.step
