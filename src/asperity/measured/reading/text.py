"""Read text matrices and two-column profiles, with or without an instrument's header.

A list of x, y, z points on a regular grid, in any order, as the map that it is.
"""

from __future__ import annotations

import codecs
import re
from dataclasses import replace
from decimal import Decimal, InvalidOperation

import numpy as np
from numpy.typing import NDArray

from asperity.errors import ParameterError, SurfaceFileError
from asperity.measured.reading.numbers import parse_number
from asperity.measured.reading.raw import MAX_POINTS, RawSurface
from asperity.measured.reading.reader import ReadingOptions, SurfaceFile, naming
from asperity.measured.reading.scatter import (
    advice,
    fitting_pitch,
    resampled,
    resampled_line,
)
from asperity.measured.reading.spacing import spacing
from asperity.measured.reading.text_columns import lengths_alone
from asperity.measured.reading.text_header import (
    MapHeader,
    is_lateral,
    map_header,
    one_unit,
    two_units,
    units_of,
)
from asperity.measured.reading.text_table import Table, find_table
from asperity.memory import reserve

_LEAST_POINTS = 4
_LONGEST_HEADER = 1000
_LONGEST = 10.0  # [m]; a longer measurement is rather one whose unit is not the metre


@naming
def read_text(file: SurfaceFile, options: ReadingOptions) -> RawSurface:
    """Read a matrix, a profile (position, height), a list of x, y, z, or a column of heights.

    Cells are separated by tabs, semicolons, commas or white space. Empty cells and "nan"
    are missing points. A decimal comma is accepted where the separator is no comma. Two
    columns are a profile where the first increases (or decreases) throughout; three are points
    of a regular grid, in any order, unless the header is a map's.

    Returns:
        Heights [m]; the pitch [m] of a two-column profile, else None.

    Raises:
        SurfaceFileError: no table of numbers, or one that cannot be read without guessing.
        ParameterError: a unit for a file that names its own.
    """
    name, metres = file.name, options.metres
    table = find_table(_decode(file.content))
    _check_table(table)
    table, said = lengths_alone(table)
    header = map_header(table.header)
    if map_header(table.remarks).describes_map:
        raise SurfaceFileError("several maps in one file: save each in a file of its own")
    rows, columns = table.values.shape
    is_list = columns == 3 and rows > 3 and not header.describes_map
    if columns == 2 and not header.describes_map and _is_monotonic(table):
        raw = _profile(table, name, options)
    elif is_list:
        raw = _points(table, header, name, options)
    elif options.resample is not None:
        raise ParameterError("resample", f"must not be given: {name} is no list of points")
    else:
        raw = _matrix(table, header, name, metres)
    return replace(raw, notes=(*said, *raw.notes))


def _decode(content: bytes) -> str:
    """Decode UTF-8 or UTF-16 with a byte order mark, else UTF-8, else Latin-1."""
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return content.decode("utf-16", errors="replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")


def _check_table(table: Table) -> None:
    rows, columns = table.values.shape
    if rows * columns > MAX_POINTS:
        raise SurfaceFileError(f"{rows * columns} numbers; at most {MAX_POINTS} are read")
    reserve(columns, rows)
    if table.values.size < _LEAST_POINTS or (columns <= 2 and rows < _LEAST_POINTS):
        raise SurfaceFileError(
            f"{rows} rows of {columns} numbers; at least {_LEAST_POINTS} points are expected"
        )
    infinite = np.argwhere(np.isinf(table.values))
    if len(infinite):
        raise SurfaceFileError(f"line {table.lines[int(infinite[0][0])]} has an infinite number")


def _is_monotonic(table: Table) -> bool:
    """Tell a profile from a matrix of two columns; refuse a profile with a fault."""
    positions = table.values[:, 0]
    steps = np.diff(positions)
    rising = float(np.median(steps[~np.isnan(steps)])) if (~np.isnan(steps)).any() else 0.0
    wrong = np.flatnonzero(~(steps * np.sign(rising) > 0))
    if len(wrong) == 0:
        return True
    if len(wrong) > len(steps) // 10 and not np.isnan(positions).any():
        return False
    raise SurfaceFileError(
        f"line {table.lines[int(wrong[0]) + 1]}: the positions in the first of two columns"
        " must increase throughout"
    )


def _profile(table: Table, name: str, options: ReadingOptions) -> RawSurface:
    named, metres = _near_two(table), options.metres
    _refuse_second(named, name, metres)
    known = named is not None or metres is not None
    notes = _notes(table, metres)
    unit_x, unit_z = named or (metres or 1.0, metres or 1.0)
    positions, heights = table.values[:, 0], table.values[:, 1] * unit_z
    resolution = _resolution(table)
    lines = table.lines
    if positions[0] > positions[-1]:
        positions, heights = positions[::-1], heights[::-1]
        resolution, lines = resolution[::-1], lines[::-1]
        notes = (*notes, "positions decrease: the profile is reversed")
    result = spacing(positions, resolution)
    pitch = result.step * unit_x
    _refuse_long(pitch * (len(heights) - 1), known=known)
    if options.resample is not None:
        heights, said = resampled_line(positions * unit_x, heights, options.resample)
        notes, pitch = (*notes, said), options.resample
    elif not result.uniform:
        raise SurfaceFileError(
            f"sampling is not uniform: line {lines[result.index]} is"
            f" {result.deviation * unit_x:.3g} m from a grid of {pitch:.3g} m; {advice(pitch)}"
        )
    return RawSurface(np.ascontiguousarray(heights), (pitch,), name, notes, has_units=known)


def _refuse_long(length: float, *, known: bool) -> None:
    if not known and length > _LONGEST:
        raise SurfaceFileError(
            f"positions span {length:.4g} and look not to be in metres; name the units in the"
            " column header, such as 'x [um], z [nm]', or give unit='mm'"
        )


def _points(table: Table, header: MapHeader, name: str, options: ReadingOptions) -> RawSurface:
    """Return the map, or the profile along one axis, that a list of points is."""
    named, metres = header.units_of_points or _near_three(table), options.metres
    _refuse_second(named, name, metres)
    known = named is not None or metres is not None
    units = np.array(named or (metres or 1.0,) * 3)
    if np.isnan(table.values[:, :2]).any():
        raise SurfaceFileError(f"a position is missing; {_EXPECTED}")
    points = table.values * units
    _refuse_long(float(np.ptp(points[:, :2], axis=0).max()), known=known)
    notes = _notes(table, metres)
    if options.resample is not None:
        heights, said = resampled(points, options.resample)
        pitch = (options.resample, options.resample)
        return RawSurface(heights, pitch, name, (*notes, said), has_units=known)
    try:
        heights, steps = grid_of(table.values, (_resolution(table, 0), _resolution(table, 1)))
    except _NoGridError as error:
        raise SurfaceFileError(f"{error}; {_advice(points)}") from None
    pitch = (steps[0] * float(units[0]), steps[1] * float(units[1]))
    heights = np.ascontiguousarray(heights * units[2])
    if 1 in heights.shape:
        axis = 0 if heights.shape[0] == 1 else 1
        return RawSurface(heights.ravel(), (pitch[axis],), name, notes, has_units=known)
    return RawSurface(heights, pitch, name, notes, has_units=known)


class _NoGridError(SurfaceFileError):
    """Points that are on no regular grid, which interpolation may help."""


def _advice(points: NDArray[np.float64]) -> str:
    """Return how points on no grid can be read."""
    pitch = fitting_pitch(points[:, :2])
    if pitch is None:
        return _EXPECTED
    return f"{_EXPECTED}; {advice(pitch)}, one grid point for each of theirs"


def _matrix(table: Table, header: MapHeader, name: str, metres: float | None) -> RawSurface:
    values = table.values
    if header.shape is not None and header.shape != values.shape:
        said, found = (
            f"{rows} rows of {columns}" for rows, columns in (header.shape, values.shape)
        )
        raise SurfaceFileError(f"the header says {said} heights, there are {found}")
    _refuse_numbering(values)
    notes = list(header.notes)
    code = _code_of_missing(table.header)
    if code is not None:
        values = np.where(values == code, np.nan, values)
        notes.append(f"the header says that {code:g} is a missing point")
    last = _last_header(table)
    own = header.unit
    if own is None and not is_lateral(last):
        own = one_unit(last)
    _refuse_second(own, name, metres)
    unit = own if own is not None else metres
    notes.extend(_notes(table, metres))
    heights = np.ascontiguousarray(values * (1.0 if unit is None else unit))
    pitch: tuple[float, ...] | None = header.pitch_of(*values.shape)
    if heights.shape[1] == 1:
        heights, pitch = heights[:, 0], None if pitch is None else pitch[1:]
    return RawSurface(heights, pitch, name, tuple(notes), has_units=unit is not None)


def _refuse_numbering(values: NDArray[np.float64]) -> None:
    """Refuse row and column numbers around the heights, as data-frame programs write them."""
    rows, columns = values.shape
    if rows < 3 or columns < 3 or not np.isnan(values[0, 0]):
        return
    down, across = values[1:, 0], values[0, 1:]
    for first in (0, 1):
        if np.array_equal(down, np.arange(first, first + rows - 1)) and np.array_equal(
            across, np.arange(first, first + columns - 1)
        ):
            raise SurfaceFileError("the first row and column number the others; remove them")


def _code_of_missing(header: list[str]) -> float | None:
    """Return the number that stands for a missing point where the header declares one."""
    for line in header:
        words = re.split(r"[:=,;\s]+", line[:_LONGEST_HEADER].strip())
        if len(words) == 2 and words[0].lower().replace("_", "") in {"nodata", "nodatavalue"}:
            return parse_number(words[1], "the header's value for missing points")
    return None


def _refuse_second(named: object, name: str, metres: float | None) -> None:
    """Refuse a unit for a file that names its own."""
    if named is not None and metres is not None:
        raise ParameterError("unit", f"must not be given: {name} names its units")


def _last_header(table: Table) -> str:
    """Return the last header line, right before the numbers."""
    line = next((line for line in reversed(table.header) if line.strip(" \t,;")), "")
    return line if len(line) <= _LONGEST_HEADER else ""


def _near_two(table: Table) -> tuple[float, float] | None:
    line = _last_header(table)
    return two_units(table.dialect.cells(line) if table.dialect.separator else [], line)


def _near_three(table: Table) -> tuple[float, float, float] | None:
    found = units_of(_last_header(table))
    if len(found) not in {0, 1, 3}:
        raise SurfaceFileError("the header must name the unit of all three columns or of none")
    return None if not found else (found[0], found[len(found) // 2], found[-1])


def _notes(table: Table, metres: float | None) -> tuple[str, ...]:
    notes = []
    if metres is not None:
        notes.append(f"no unit in the file: {metres:g} m as given")
    if table.footer:
        notes.append(f"{table.footer} lines of text after the numbers ignored")
    if table.dialect.decimal == ",":
        notes.append("a comma is read as the decimal sign")
    return tuple(notes)


def _resolution(table: Table, column: int = 0) -> NDArray[np.float64]:
    """Return the value of the last printed digit of each number of a column.

    Fixed notation prints the same number of decimals, "%g" the same number of digits and
    drops zeros at the end; the coarser of both bounds the rounding in either case.
    """
    cells = [_cell(table, text, column) for text in table.texts]
    decimals = {len(cell.partition(".")[2]) for cell in cells}
    if len(decimals) == 1 and not any("e" in cell.lower() for cell in cells):
        return np.full(len(cells), 10.0 ** -min(decimals.pop(), 300))
    parts = [_decimal(cell).as_tuple() for cell in cells]
    exponents = np.array([int(part.exponent) for part in parts], dtype=np.float64)
    digits = np.array([len(part.digits) for part in parts], dtype=np.float64)
    last = np.maximum(exponents.min(), exponents + digits - digits.max())
    return np.asarray(10.0 ** np.clip(last, -300, 300))


def _decimal(text: str) -> Decimal:
    try:
        return Decimal(text)
    except InvalidOperation:  # an exponent beyond what Decimal holds: zero as a float
        return Decimal(0)


def _cell(table: Table, text: str, column: int) -> str:
    if table.dialect.decimal == ",":
        text = text.replace(",", ".")
    return table.dialect.cells(text)[column]


# A list that names fewer of its grid's points than one in so many is no grid.
_SPARSEST = 4
_EXPECTED = (
    "three columns: a list of x, y, z points must lie on a regular grid, in any order; a matrix of"
    " heights or two columns (position, height) are read, too"
)


def grid_of(
    points: NDArray[np.float64], resolution: tuple[NDArray[np.float64], NDArray[np.float64]]
) -> tuple[NDArray[np.float64], tuple[float, float]]:
    """Return the grid of a list of points.

    Args:
        points: x, y, z, shape (n, 3).
        resolution: value of the last printed digit of each x and each y, shape (n,).

    Returns:
        Heights, shape (ny, nx), NaN where the list names no point; the pitch (p_x, p_y), in the
        unit of the positions, 0 along an axis with one point.

    Raises:
        SurfaceFileError: for points that are on no regular grid, or named twice.

    Example:
        >>> points = np.array([[0, 0, 1.0], [0, 2, 3.0], [1, 0, 2.0], [1, 2, 4.0]])
        >>> grid_of(points, (np.ones(4), np.ones(4)))[0]
        array([[1., 2.],
               [3., 4.]])
    """
    x, column = np.unique(points[:, 0], return_inverse=True)
    y, row = np.unique(points[:, 1], return_inverse=True)
    if len(x) * len(y) > _SPARSEST * len(points):
        raise _NoGridError("the points are on no regular grid")
    if len(np.unique(row * len(x) + column)) < len(points):
        raise SurfaceFileError(f"two points have the same position; {_EXPECTED}")
    heights = np.full((len(y), len(x)), np.nan)
    heights[row, column] = points[:, 2]
    return heights, (_step("x", x, resolution[0]), _step("y", y, resolution[1]))


def _step(axis: str, positions: NDArray[np.float64], resolution: NDArray[np.float64]) -> float:
    if len(positions) == 1:
        return 0.0
    result = spacing(positions, float(resolution.max()))
    if not result.uniform:
        raise _NoGridError(
            f"the {axis} positions are not uniform: one is {result.deviation:.3g} from a grid of"
            f" {result.step:.3g}"
        )
    return result.step
