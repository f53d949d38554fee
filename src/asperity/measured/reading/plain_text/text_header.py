"""The header of a text file: units, pixel size, missing values, columns that are no lengths."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.measured.lengths import METRES_PER_UNIT, parse_number
from asperity.measured.reading.plain_text.text_table import TextTable

_MAX_LINE = 1000  # a longer line is a row of data rather than a header
_BRACKETED = re.compile(r"[\[(]([^\[\]()]*)[\])]")
_QUANTITY = re.compile(r"([+-]?[0-9.]+(?:[eE][+-]?[0-9]+)?)\s*(\S*)")
# Gwyddion writes its header in the language of its user.
_WIDTH_KEYS = ("width", "breite", "largeur", "larghezza", "ancho", "šířka", "largura")
_HEIGHT_KEYS = ("height", "höhe", "hauteur", "altezza", "alto", "výška", "altura")
_PIXEL_KEYS = ("pixel size", "pixel width", "pixel pitch", "pixel spacing", "point spacing")
_LATERAL_KEYS = ("lateral unit", "lateral units", "xy unit", "xy units")
_UNIT_KEYS = tuple(f"{of} unit{s}" for of in ("data", "value", "z", "height") for s in ("", "s"))
_NODATA_KEYS = ("nodata", "nodata_value", "nodatavalue")
# Units of other quantities or systems; the second set are words as well, outside of brackets.
_OTHER_UNITS = {"inch", "inche", "thou", "feet", "volt", "pixel", "kå"}
_AMBIGUOUS_UNITS = {"in", "mil", "px", "mv", "ft"}


@dataclass(frozen=True)
class MapHeader:
    """The entries of a header that describe the heights; None for each that it lacks.

    Attributes:
        unit: metres per height.
        pitch: distance of the points [m].
        size: (width, height) of the map [m].
        lateral_unit: metres per position in a list of points.
        missing_code: number that marks a missing point.
        notes: the entries applied, one sentence each.
    """

    unit: float | None = None
    pitch: float | None = None
    size: tuple[float, float] | None = None
    lateral_unit: float | None = None
    missing_code: float | None = None
    notes: tuple[str, ...] = ()

    @property
    def describes_map(self) -> bool:
        """Whether the header is that of a map, whatever the number of its columns."""
        return self.pitch is not None or self.size is not None

    def find_pitch(self, rows: int, columns: int) -> tuple[float, float] | None:
        """Return the pitch [m] of a matrix with these numbers of rows and columns."""
        if self.pitch is not None:
            return self.pitch, self.pitch
        if self.size is None:
            return None
        return self.size[0] / columns, self.size[1] / rows


def parse_map_header(lines: Sequence[str]) -> MapHeader:
    """Return the entries "key=value" or "key: value" of a header.

    Raises:
        SurfaceFileError: a factor or a unit of the heights cannot be applied; ignoring it would
            give wrong heights without notice.

    Example:
        >>> header = parse_map_header(["pixel size=3.7e-007 m", "z factor (-> m)=6e-8"])
        >>> header.unit, header.pitch
        (6e-08, 3.7e-07)
    """
    entries = dict(_split_entry(line) for line in lines if len(line) <= _MAX_LINE)
    factor = _find_factor(entries)
    note = f"heights multiplied by the header's factor, {factor or 0.0:g} m"
    width, height = (_find_length(entries, keys) for keys in (_WIDTH_KEYS, _HEIGHT_KEYS))
    codes = [parse_number(entries[key], key) for key in _NODATA_KEYS if key in entries]
    return MapHeader(
        unit=factor or _find_unit(entries, _UNIT_KEYS),
        pitch=_find_length(entries, _PIXEL_KEYS),
        size=None if width is None or height is None else (width, height),
        lateral_unit=_find_unit(entries, _LATERAL_KEYS),
        missing_code=codes[0] if codes else None,
        notes=(note,) if factor else (),
    )


def is_lateral_entry(line: str) -> bool:
    """Whether a header line describes lengths along the surface rather than heights.

    Example:
        >>> is_lateral_entry("Height: 4.00 µm"), is_lateral_entry("Value units: m")
        (True, False)
    """
    return _split_entry(line)[0] in (*_WIDTH_KEYS, *_HEIGHT_KEYS, *_PIXEL_KEYS, *_LATERAL_KEYS)


def _split_entry(line: str) -> tuple[str, str]:
    """Return key and value of "key=value", "key: value" or "nodata value"."""
    sign = min((s for s in "=:" if s in line), key=line.index, default="=")
    key, found, value = line.partition(sign)
    words = key.lower().split() if found else re.split(r"[,;\s]+", line.lower().strip())
    if not found and len(words) == 2 and words[0] in _NODATA_KEYS:
        return words[0], words[1]
    return " ".join(words), value.strip()


def _find_length(entries: dict[str, str], keys: Sequence[str]) -> float | None:
    """Return the positive length [m] under the first of the keys that has one."""
    for key in keys:
        match = _QUANTITY.fullmatch(entries.get(key, "").replace(",", "."))
        if match is None:
            continue
        unit, number = find_single_unit(match.group(2)), parse_number(match.group(1), key)
        if unit is not None and number > 0.0:
            return number * unit
    return None


def _find_factor(entries: dict[str, str]) -> float | None:
    """Return the metres per number of a conversion factor of the heights."""
    for key, value in entries.items():
        words = set(_BRACKETED.sub(" ", key).split())
        if "factor" not in words or not words & {"height", "z", "data", "value", "conversion"}:
            continue
        match = _QUANTITY.fullmatch(value)
        unit = find_single_unit(key) or (find_single_unit(match.group(2)) if match else None)
        if match is None or unit is None:
            raise SurfaceFileError(
                f"the header's {key!r} is {value[:40]!r}; a number and a unit of length, such as "
                "'(-> m)=6.3e-8', are expected: without them the heights are not known"
            )
        return parse_number(match.group(1), key) * unit
    return None


def _find_unit(entries: dict[str, str], keys: Sequence[str]) -> float | None:
    """Return the unit [m] under one of the keys."""
    for key in keys:
        if key not in entries:
            continue
        unit = find_single_unit(entries[key])
        if unit is None:
            raise SurfaceFileError(
                f"the header's {key!r} is {entries[key][:40]!r}, no unit of length, and there is "
                "no conversion factor: the lengths are not known"
            )
        return unit
    return None


# --- units --------------------------------------------------------------------------------------


def find_units(cells: Sequence[str]) -> list[float]:
    """Return the units of length [m] that the cells of a header line name, in order.

    A unit stands in brackets ("z [nm]"), after a slash ("z/nm"), or is the last word of a cell
    ("Lateral um").

    Raises:
        SurfaceFileError: a unit is no length known here.

    Example:
        >>> find_units(["Lateral um", "Raw Micrometer"])
        [1e-06, 1e-06]
        >>> find_units(["height"])
        []
    """
    units: list[float] = []
    for cell in cells:
        names = _BRACKETED.findall(cell)
        found = [_parse_unit(name.strip(" ->"), is_bracketed=True) for name in names]
        if not any(found):
            last = re.split(r"[\s/]+", cell.rstrip(" .:\r"))[-1:]
            found = [_parse_unit(name, is_bracketed=False) for name in last if not names]
            for name in names:  # "[V]" and the like
                if 0 < len(name.strip()) <= 3:
                    raise _unknown_unit_error(name.strip())
        units.extend(unit for unit in found if unit is not None)
    return units


def find_single_unit(*cells: str) -> float | None:
    """Return the only unit [m] that the cells of a header line name, None if they name none.

    Raises:
        SurfaceFileError: the cells name several units.
    """
    units = set(find_units(cells))
    if len(units) > 1:
        raise SurfaceFileError(f"the header {_shorten(' '.join(cells))!r} names several units")
    return units.pop() if units else None


def require_unit(line: str) -> None:
    """Ask for the unit if a header line holds the name of one in a place that is not understood.

    Raises:
        ParameterError: the line holds the name of a unit of length.
    """
    for word in re.findall(r"[^\W\d_]{2,}", line):
        if _parse_unit(word, is_bracketed=False) is not None:
            raise ParameterError(
                "unit",
                f"is required: the header {_shorten(line)!r} does not say in brackets, such as"
                " 'z [nm]', what is in which unit",
            )


def _parse_unit(name: str, *, is_bracketed: bool) -> float | None:
    """Return the length of a unit [m]; None for any other word, without brackets for "A" too."""
    key = name.lower()
    key = key[:-1] if key.endswith("s") and len(key) > 3 else key
    if is_bracketed and name == "A":
        return 1e-10
    # Symbols keep their case: "Mm" and "NM" are other units or none.
    if key in METRES_PER_UNIT and (len(name) > 2 or name.lower() == name or name == "Å"):
        return METRES_PER_UNIT[key]
    if key in _OTHER_UNITS or (is_bracketed and key in _AMBIGUOUS_UNITS):
        raise _unknown_unit_error(name)
    return None


def _unknown_unit_error(name: str) -> SurfaceFileError:
    return SurfaceFileError(
        f"the header names the unit {_shorten(name)!r};"
        " m, mm, µm (um, micron), nm or [A] (angstrom) is expected"
    )


def _shorten(text: str) -> str:
    text = " ".join(text.split())
    return text if len(text) <= 60 else text[:57] + "..."


# --- columns that are no lengths ----------------------------------------------------------------

_VALIDITY_NAMES = {"valid", "validity", "mask", "isvalid", "[1/0]", "[0/1]", "(1/0)", "(0/1)"}
_NUMBERING_NAMES = {"index", "idx", "no", "no.", "nr", "nr.", "point", "#"}
_MAX_COLUMNS = 6
_MAX_HEADER_LINES = 3  # number of lines above the numbers that may name the columns


def drop_auxiliary_columns(table: TextTable) -> tuple[TextTable, list[str]]:
    """Return a table without its column of validity and its column of row numbers.

    A validity column has a header such as "valid" or "[1/0]": where it is 0, the height (the last
    of the other columns) becomes missing. A column of row numbers is the first, with a header such
    as "index", and counts the rows.

    Returns:
        The table, and what was done, one sentence each.

    Raises:
        SurfaceFileError: the validity column has other values than 0 and 1.
    """
    notes = []
    names = _column_names(table)
    validity = next((k for k, found in enumerate(names) if found & _VALIDITY_NAMES), None)
    if validity is not None:
        valid = table.values[:, validity]
        wrong = ~np.isin(valid, (0.0, 1.0))
        if wrong.any():
            line = table.line_numbers[int(np.argmax(wrong))]
            raise SurfaceFileError(f"line {line}: validity must be 0 or 1")
        table = _drop_column(table, validity)
        table.values[valid == 0.0, -1] = np.nan
        count = int((valid == 0.0).sum())
        notes.append(f"{count} of {len(valid)} points are marked as not valid: missing")
        names = _column_names(table)
    first = table.values[:, 0]
    is_numbering = first[0] in (0.0, 1.0) and np.all(np.diff(first) == 1.0)
    if is_numbering and names[0] & _NUMBERING_NAMES:
        table = _drop_column(table, 0)
        notes.append("the first column numbers the points: left out")
    return table, notes


def _column_names(table: TextTable) -> list[set[str]]:
    """Return the lower-case names of each column of a list of points."""
    columns = table.values.shape[1]
    names: list[set[str]] = [set() for _ in range(columns)]
    lines = [line for line in table.header if line.strip(" \t,;")]
    for line in lines[-_MAX_HEADER_LINES:] if 3 <= columns <= _MAX_COLUMNS else ():
        cells = [cell.strip("\"' ").lower() for cell in table.dialect.cells(line[:_MAX_LINE])]
        if len(cells) == columns:
            for known, cell in zip(names, cells, strict=True):
                known.add(cell)
        elif table.dialect.separator is None:  # a name such as "x [um]" is two cells
            names[-1].add(cells[-1])
    return names


def _drop_column(table: TextTable, column: int) -> TextTable:
    """Return a table without a column, in its rows and its header."""
    columns = table.values.shape[1]

    def drop_cell(line: str) -> str:
        cells = table.dialect.cells(line)
        if len(cells) != columns:
            return line
        return (table.dialect.separator or " ").join(cells[:column] + cells[column + 1 :])

    return replace(
        table,
        values=np.delete(table.values, column, axis=1),
        header=[drop_cell(line) for line in table.header],
        row_texts=[drop_cell(line) for line in table.row_texts],
    )
