"""Read text matrices and two-column profiles, with or without an instrument's header."""

from __future__ import annotations

import codecs
import re
from decimal import Decimal, InvalidOperation

import numpy as np
from numpy.typing import NDArray

from asperity.errors import ParameterError, SurfaceFileError
from asperity.measured.reading.numbers import parse_number
from asperity.measured.reading.raw import MAX_POINTS, RawSurface
from asperity.measured.reading.spacing import spacing
from asperity.measured.reading.text_table import Table, find_table
from asperity.measured.reading.text_units import one_unit, two_units

_LEAST_POINTS = 4
_LONGEST = 10.0  # [m]; a longer measurement is rather one whose unit is not the metre


def read_text(content: bytes, name: str, metres: float | None = None) -> RawSurface:
    """Read a text matrix, a two-column profile (position, height) or a column of heights.

    Cells are separated by tabs, semicolons, commas or white space. Empty cells and "nan"
    are missing points. A decimal comma is accepted where the separator is no comma. Two
    columns are a profile where the first increases (or decreases) throughout.

    Args:
        content: the bytes of the file.
        name: its name, for messages.
        metres: length of the unit of all numbers [m] where the file names none.

    Returns:
        Heights [m]; the pitch [m] of a two-column profile, else None.

    Raises:
        SurfaceFileError: no table of numbers, or one that cannot be read without guessing.
        ParameterError: a unit for a file that names its own.
    """
    try:
        table = find_table(_decode(content))
        _check_table(table)
        if table.values.shape[1] == 2 and _is_monotonic(table):
            return _profile(table, name, metres)
        return _matrix(table, name, metres)
    except SurfaceFileError as error:
        raise SurfaceFileError(f"{name}: {error}") from error


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
    if table.values.size < _LEAST_POINTS or (columns <= 2 and rows < _LEAST_POINTS):
        raise SurfaceFileError(
            f"{rows} rows of {columns} numbers; at least {_LEAST_POINTS} points are expected"
        )
    if columns == 3 and rows > 3:
        raise SurfaceFileError(
            "three columns: a list of x, y, z points or of several heights has no grid;"
            " a matrix of heights or two columns (position, height) are expected"
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


def _profile(table: Table, name: str, metres: float | None) -> RawSurface:
    units = _units(table, name, metres, two_columns=True)
    notes = _notes(table, units, metres)
    unit_x, unit_z = units or (1.0, 1.0)
    positions, heights = table.values[:, 0], table.values[:, 1] * unit_z
    resolution = _resolution(table)
    lines = table.lines
    if positions[0] > positions[-1]:
        positions, heights = positions[::-1], heights[::-1]
        resolution, lines = resolution[::-1], lines[::-1]
        notes = (*notes, "positions decrease: the profile is reversed")
    result = spacing(positions, resolution)
    if not result.uniform:
        raise SurfaceFileError(
            f"sampling is not uniform: line {lines[result.index]} is"
            f" {result.deviation * unit_x:.3g} m from a grid of {result.step * unit_x:.3g} m;"
            " resample the profile"
        )
    pitch = result.step * unit_x
    if units is None and pitch * (len(heights) - 1) > _LONGEST:
        raise SurfaceFileError(
            f"positions span {pitch * (len(heights) - 1):.4g} and look not to be in metres;"
            " name the units in the column header, such as 'x [um], z [nm]', or give unit='mm'"
        )
    return RawSurface(
        np.ascontiguousarray(heights), (pitch,), name, notes, has_units=units is not None
    )


def _matrix(table: Table, name: str, metres: float | None) -> RawSurface:
    values = table.values
    _refuse_numbering(values)
    notes = []
    code = _code_of_missing(table.header)
    if code is not None:
        values = np.where(values == code, np.nan, values)
        notes.append(f"the header says that {code:g} is a missing point")
    units = _units(table, name, metres, two_columns=False)
    notes.extend(_notes(table, units, metres))
    heights = np.ascontiguousarray(values * (units[1] if units else 1.0))
    if heights.shape[1] == 1:
        heights = heights[:, 0]
    pitch = _pitch_of_size(table) if heights.ndim == 2 else None
    return RawSurface(heights, pitch, name, tuple(notes), has_units=units is not None)


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
        match = re.fullmatch(r"\s*no_?data(?:_?value)?\s*[:=,;\s]\s*(\S+)\s*", line, re.IGNORECASE)
        if match:
            return parse_number(match.group(1), "the header's value for missing points")
    return None


def _pitch_of_size(table: Table) -> tuple[float, float] | None:
    """Return the pitch from "Width: 5 µm" and "Height: 5 µm", as Gwyddion exports them."""
    sizes = {}
    for line in table.header:
        match = re.fullmatch(
            r"\s*(width|height)\s*:\s*([0-9.eE+-]+)\s*(\S+)\s*", line, re.IGNORECASE
        )
        unit = one_unit(match.group(3)) if match else None
        if match and unit is not None:
            sizes[match.group(1).lower()] = unit * parse_number(match.group(2), match.group(1))
    if sizes.keys() != {"width", "height"} or min(sizes.values()) <= 0:
        return None
    rows, columns = table.values.shape
    return sizes["width"] / columns, sizes["height"] / rows


def _units(
    table: Table, name: str, metres: float | None, *, two_columns: bool
) -> tuple[float, float] | None:
    """Return the units that the header names, else the one that was given, else None."""
    units = _near(table, two_columns=two_columns)
    if metres is None:
        return units
    if units is not None:
        raise ParameterError("unit", f"must not be given: {name} names its units")
    return metres, metres


def _near(table: Table, *, two_columns: bool) -> tuple[float, float] | None:
    """Return the units that the last header line names, right before the numbers."""
    line = next((line for line in reversed(table.header) if line.strip(" \t,;")), "")
    if two_columns:
        cells = table.dialect.cells(line) if table.dialect.separator else []
        return two_units(cells, line)
    unit = one_unit(line)
    return None if unit is None else (unit, unit)


def _notes(
    table: Table, units: tuple[float, float] | None, metres: float | None
) -> tuple[str, ...]:
    notes = []
    if units is None:
        notes.append("no unit in the file: taken as metres")
    elif metres is not None:
        notes.append(f"no unit in the file: {metres:g} m as given")
    if table.footer:
        notes.append(f"{table.footer} lines of text after the numbers ignored")
    if table.dialect.decimal == ",":
        notes.append("a comma is read as the decimal sign")
    return tuple(notes)


def _resolution(table: Table) -> NDArray[np.float64]:
    """Return the value of the last printed digit of each position.

    Fixed notation prints the same number of decimals, "%g" the same number of digits and
    drops zeros at the end; the coarser of both bounds the rounding in either case.
    """
    cells = [_first_cell(table, text) for text in table.texts]
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


def _first_cell(table: Table, text: str) -> str:
    if table.dialect.decimal == ",":
        text = text.replace(",", ".")
    cell = table.dialect.cells(text)[0]
    return re.sub(r"\s", "", cell)
