"""Headers of text files: what they say of heights, pitch, columns and missing points.

Units are read from the headings of columns, and from headers of programs that are declared in
``text_layouts.toml``. Nothing else in a header is used.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import shorten

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.errors import SurfaceFileError
from asperity.core.files import read_toml
from asperity.core.units import count_text
from asperity.measured.lengths import METRES_PER_UNIT, format_lengths
from asperity.measured.reader import mask_missing
from asperity.measured.reading.text_table import TextTable

_LAYOUTS = read_toml("layouts", Path(__file__).with_name("text_layouts.toml"))
_MAX_LINE = 1000  # a longer line is a row of data rather than a header
_MAX_NAME = 5  # words of a channel's name; more are a remark
_BRACKETED = re.compile(r"[\[(]([^\[\]()]*)[\])]")
_QUANTITY = re.compile(r"([+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?)\s*([^\s\d/]+)")
_CAMEL = re.compile(r"(?<=[^\W\d_])(?=[A-Z][a-z])")
_WORD = re.compile(r"[^\W\d_]+")
# Units of other quantities or systems; the second set are words as well, outside of brackets.
_OTHER_UNITS = {"inch", "inche", "thou", "feet", "volt", "pixel", "kå"}
_AMBIGUOUS_UNITS = {"in", "mil", "px", "mv", "ft"}


def _declared_names(entry: str) -> frozenset[str]:
    """Return the names that the layouts declare for an entry, in lower case."""
    return frozenset(name.lower() for layout in _LAYOUTS.values() for name in layout.get(entry, ()))


_ENTRIES = ("width", "height", "heights", "positions", "channel", "missing")
_ENTRY_OF = {name: entry for entry in _ENTRIES for name in _declared_names(entry)}
_ROLE_OF = {name: role for role in ("x", "y", "z", "other") for name in _declared_names(role)}


def names_other_quantity(text: str) -> bool:
    """Whether a text names another quantity than heights.

    Example:
        >>> names_other_quantity("PeakForceError"), names_other_quantity("Topography")
        (True, False)
    """
    words = _WORD.findall(_CAMEL.sub(" ", text).lower())
    return "other" in [_ROLE_OF.get(word) for word in words]


def find_single_unit(name: str) -> float | None:
    """Return the unit of length [m] that the heading of a column states, None if none.

    It stands in brackets ("z [nm]"), after a slash ("z/nm"), or is the last word ("Lateral um").

    Raises:
        SurfaceFileError: there are several units, or one that is no length known here.

    Example:
        >>> find_single_unit("Lateral um"), find_single_unit("z (-> nm)"), find_single_unit("z")
        (1e-06, 1e-09, None)
    """
    names = [inside.strip(" ->") for inside in _BRACKETED.findall(name)]
    units = {parse_unit(unit, is_bracketed=True) for unit in names} - {None}
    short = [unit for unit in names if 0 < len(unit) <= 3]
    if short and not units:  # "[V]" and the like
        raise _unknown_unit_error(short[0])
    if not names:
        last = re.split(r"[\s/]+", name.rstrip(" .:\r"))[-1]
        units = {parse_unit(last, is_bracketed=False)}
    if len(units) > 1:
        raise SurfaceFileError(f"the header {shorten(name, 60)!r} names several units")
    if not units:
        return None
    return units.pop()


def parse_unit(name: str, *, is_bracketed: bool) -> float | None:
    """Return the length of a unit [m]; None for any other word, without brackets for "A" too.

    Raises:
        SurfaceFileError: the unit is of another quantity or system.
    """
    key = name.lower()
    if len(key) > 3:
        key = key.removesuffix("s")
    if is_bracketed and name == "A":
        return 1e-10
    # Symbols keep their case: "Mm" and "NM" are other units or none.
    if key in METRES_PER_UNIT and (len(name) > 2 or name.lower() == name or name == "Å"):
        return METRES_PER_UNIT[key]
    if key in _OTHER_UNITS or (is_bracketed and key in _AMBIGUOUS_UNITS):
        raise _unknown_unit_error(name)
    return None


def _unknown_unit_error(name: str) -> SurfaceFileError:
    wanted = "m, mm, µm (um, micron), nm or [A] (angstrom) is expected"
    return SurfaceFileError(f"the header names the unit {shorten(name, 60)!r}; {wanted}")


@dataclass(frozen=True)
class MapHeader:
    """The entries of a header that describe the heights; None for each that it lacks.

    Attributes:
        unit: metres per height.
        lateral_unit: metres per position in a list of points.
        pitch: distance of the points along x and y [m].
        missing_code: number that marks a missing point; NaN if all are heights.
        notes: the entries applied, one sentence each.
    """

    unit: float | None
    lateral_unit: float | None
    pitch: tuple[float, float] | None
    missing_code: float | None
    notes: tuple[str, ...]


def parse_map_header(lines: Sequence[str], shape: tuple[int, ...] = (1, 1)) -> MapHeader:
    """Return what a header says in entries that a layout declares.

    Args:
        lines: its lines, without comment signs.
        shape: number of rows and columns of the numbers.

    Raises:
        SurfaceFileError: the values are no heights, or their unit is no length.

    Example:
        >>> header = parse_map_header(["Width: 8 um", "Height: 4 um", "Value units: nm"], (2, 4))
        >>> header.unit, header.pitch
        (1e-09, (2e-06, 2e-06))
    """
    values = _parse_entries(lines)
    notes = []
    unit = _find_unit(values.get("heights"))
    if unit is not None:
        notes.append(f"heights in units of {unit:g} m: header {values['heights']!r}")
    width = _parse_length(values.get("width", ""))
    height = _parse_length(values.get("height", ""))
    pitch = None
    if width and height:
        pitch = (width / shape[1], height / shape[0])
        notes.append(f"pitch {format_lengths(pitch)} from the header")
    lateral = _find_unit(values.get("positions"))
    missing = _parse_code(values.get("missing", ""))
    return MapHeader(unit, lateral, pitch, missing, tuple(notes))


def _parse_entries(lines: Sequence[str]) -> dict[str, str]:
    """Return the values of the declared entries, by entry."""
    values = {}
    for line in lines:
        if len(line) > _MAX_LINE:
            continue
        sign = min([sign for sign in ":=" if sign in line], key=line.index, default=" ")
        name, _, value = line.strip(' "\t,;').partition(sign)
        entry = _ENTRY_OF.get(name.strip().lower())
        if entry is not None:
            values[entry] = value.strip()
        is_name = entry == "channel" or (sign == " " and not re.search(r"[\d,;\t]", line))
        if is_name and len(line.split()) <= _MAX_NAME and names_other_quantity(line):
            fault = "names another quantity, which is no height; export the heights"
            raise SurfaceFileError(f"the header {shorten(line, 60)!r} {fault}")
    return values


def _find_unit(name: str | None) -> float | None:
    """Return the unit of an entry [m]; None without the entry."""
    if name is None:
        return None
    unit = parse_unit(name, is_bracketed=True)
    if unit is None:
        raise _unknown_unit_error(name)
    return unit


def _parse_length(text: str) -> float | None:
    match = _QUANTITY.fullmatch(text)
    if match is None:
        return None
    unit = parse_unit(match.group(2), is_bracketed=True)
    return None if unit is None else unit * float(match.group(1).replace(",", "."))


def _parse_code(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


# --- headings of columns --------------------------------------------------------------------------


def find_headings(table: TextTable) -> list[str]:
    """Return the headings of the columns, or the one of a matrix; none if there are none.

    They are the last line of the header; the last two if names and units stand on lines of their
    own.

    Raises:
        SurfaceFileError: the names contradict a profile, or a list of points.
    """
    lines = [line for line in table.header if line.strip(" \t,;") and len(line) <= _MAX_LINE]
    if not lines or re.search(r"(^|[\s,;])[+-]?\d|[=:]", _BRACKETED.sub("", lines[-1])):
        return []  # entries, and numbers with their units
    headings = _split_headings(lines[-1], table)
    if len(lines) > 1 and headings and not any(_BRACKETED.sub("", cell) for cell in headings):
        names = _split_headings(lines[-2], table)
        headings = [f"{name} {unit}" for name, unit in zip(names, headings, strict=False)]
    if len(headings) > 1:
        _check_roles(headings)
        return headings
    heading = lines[-1].strip(" \t,;")
    return [] if _find_role(heading) != "z" else [heading]


def _split_headings(line: str, table: TextTable) -> list[str]:
    """Return a cell for each column; none if the line does not split into as many."""
    columns = table.values.shape[1]
    splits = [
        table.dialect.cells(line),
        re.split(r"\s*[,;\t]\s*", line.strip(" \t,;\r")),
        re.findall(r"[^\s\[\]()]+\s*[\[(][^\[\]()]*[\])]", line),
        re.findall(r"[^\s\[\]()]+(?:\s*[\[(][^\[\]()]*[\])])?", line),
    ]
    for cells in splits:
        if len(cells) >= columns and not any(cells[columns:]):  # separators at the end of the line
            return [cell.strip("\"' ") for cell in cells[:columns]]
    return []


def _find_role(heading: str) -> str:
    """Return what a column holds: x, y, z, other, or "" if the heading does not say it."""
    if names_other_quantity(heading):
        return "other"
    for word in _WORD.findall(heading.lower())[:1]:
        return _ROLE_OF.get(word, "")
    return ""


def _check_roles(headings: Sequence[str]) -> None:
    """Refuse columns that are not x and z, or x, y and z, in this order."""
    roles = [_find_role(heading) for heading in headings]
    accepted: list[tuple[str, ...]] = []
    if len(roles) == 2:
        accepted = [("x", "y"), ("y", "z")]  # the axes of a picture may be named x and y
    elif len(roles) == 3:
        accepted = [("x",), ("y",), ("z",)]
    is_ordered = all(
        not role or role in names for role, names in zip(roles, accepted, strict=False)
    )
    if not is_ordered or (len(roles) > 3 and {"x", "y"} & set(roles)):
        names = ", ".join(map(repr, headings))[:120]
        fault = "are not x and z, or x, y and z: leave out the others, and name them so"
        raise SurfaceFileError(f"the columns {names} {fault}")


_MIN_POSITIONS = 5  # of a lone row or column in equal steps that is taken for positions


def reject_positions(table: TextTable) -> None:
    """Refuse a matrix with positions, or numbers of rows and columns, around its heights.

    Raises:
        SurfaceFileError: the first row or column rises or falls in equal steps, unlike the rest.
    """
    values = table.values
    if min(values.shape) < 3:
        return
    across = _is_axis(values[:, 1:])
    down = _is_axis(values[1:].T)
    rows, columns = np.array(values.shape) > _MIN_POSITIONS
    if (across and (down or columns)) or (down and rows):
        fault = "the first row or column looks like positions or numbers of the others"
        raise SurfaceFileError(
            f"{fault}: remove it, and give their distance as {{pitch}}", pitch=None
        )


def _is_axis(values: FloatArray) -> bool:
    """Whether the first row rises or falls in equal steps, and most others do not."""
    steps = np.diff(values, axis=1)
    sizes = np.abs(steps.mean(axis=1))
    is_even = (np.ptp(steps, axis=1) <= 0.1 * sizes) & (sizes > 0.0)
    return bool(steps.shape[1] >= 2 and is_even[0] and 2 * is_even[1:].sum() < len(is_even) - 1)


# --- codes of missing points ---------------------------------------------------------------------

_HUGE_CODES = (1.70141e38, -1.70141e38, 3.402823e38, -3.402823e38, 1e38, -1e38, 1e30, -1e30)
_CODES = (-9999.0, -99999.0, -32768.0, -2147483648.0, *_HUGE_CODES)
_RARE_CODES = (-999.0, 9999.0, 99999.0, 999999.0, -999999.0, 32767.0, 65535.0, 2147483647.0)
_ROUNDING = 1e-5  # codes of many digits are written with few


def mask_codes(values: FloatArray, declared: float | None) -> tuple[FloatArray, tuple[str, ...]]:
    """Return heights with NaN for each missing point, and the notes.

    Args:
        values: the numbers of the file.
        declared: number that the header declares to mark missing points; NaN if none does.

    Raises:
        SurfaceFileError: a number may be a height or a code.

    Example:
        >>> mask_codes(np.array([1.0, 2.5, -32768.0]), None)[0]
        array([1. , 2.5, nan])
    """
    if declared is not None:
        return mask_missing(values, declared)
    notes: tuple[str, ...] = ()
    for code in (*_CODES, *_RARE_CODES):
        is_code = np.isclose(values, code, rtol=_ROUNDING, atol=0.0)
        rest = values[~is_code & ~np.isnan(values)]
        if not is_code.any() or not rest.size:
            continue
        what = f"{count_text(int(is_code.sum()), 'point')} of {code:g}, which"
        if max(rest.min() - code, code - rest.max()) > np.ptp(rest):
            values = np.where(is_code, np.nan, values)
            notes += (f"{what} marks a missing point",)
        elif code in _CODES:
            remedy = f"declare it in the header ('nodata: {code:g}', or 'nodata: nan' for none)"
            raise SurfaceFileError(f"{what} may be a height or mark a missing point: {remedy}")
    return values, notes
