"""Headers of text files: what they say of columns, heights, pitch and missing points.

Only entries whose words are known to be of the heights state their unit: a header names many other
lengths. An entry that may be a factor of the heights, or contradicts another, leaves the unit open.
The names of columns say which are positions, heights, validity or numbers of rows.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from textwrap import shorten

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.core.errors import SurfaceFileError
from asperity.measured.lengths import METRES_PER_UNIT, format_lengths
from asperity.measured.reader import mask_missing
from asperity.measured.reading.text_table import TextTable

_MAX_LINE = 1000  # a longer line is a row of data rather than a header
BRACKETED = re.compile(r"[\[(]([^\[\]()]*)[\])]")
_QUANTITY = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([^\s\d/]*)")
_CAMEL = re.compile(r"(?<=[^\W\d_])(?=[A-Z][a-z])")
_WORD = re.compile(r"[^\W\d_]+")
# Units of other quantities or systems; the second set are words as well, outside of brackets.
_OTHER_UNITS = {"inch", "inche", "thou", "feet", "volt", "pixel", "kå"}
_AMBIGUOUS_UNITS = {"in", "mil", "px", "mv", "ft"}


def split_words(text: str) -> frozenset[str]:
    """Return the words of a text in lower case and singular, without what is in brackets.

    Example:
        >>> sorted(split_words("XYPixelSize [um]")), sorted(split_words("NODATA_values"))
        (['pixel', 'size', 'xy'], ['nodata', 'value'])
    """
    words = _WORD.findall(_CAMEL.sub(" ", BRACKETED.sub(" ", text)).lower())
    return frozenset(word.removesuffix("s") if len(word) > 3 else word for word in words)


_TABLE = tomllib.loads(Path(__file__).with_name("text_words.toml").read_text("utf-8"))
ROLES = {role: split_words(words) for role, words in _TABLE.pop("columns").items()}
"""Words that name a column, by its role."""
WORDS = {name: split_words(words) for name, words in _TABLE.items()}
"""Words in headers, by what they are of."""


def parse_quantity(text: str) -> tuple[float, float | None] | None:
    """Return a number and the length of its unit [m] (None without a unit); None for other text.

    Example:
        >>> parse_quantity("0.5 um"), parse_quantity("3"), parse_quantity("2 nm/V")
        ((0.5, 1e-06), (3.0, None), None)
    """
    match = _QUANTITY.fullmatch(text.strip().replace(",", "."))
    if match is None or not match.group(2):
        return None if match is None else (float(match.group(1)), None)
    unit = parse_unit(match.group(2), is_bracketed=False)
    return None if unit is None else (float(match.group(1)), unit)


def find_single_unit(name: str) -> float | None:
    """Return the unit of length [m] that the name of a column or an entry states, None if none.

    It stands in brackets ("z [nm]"), after a slash ("z/nm"), or is the last word ("Lateral um").

    Raises:
        SurfaceFileError: there are several units, or one that is no length known here.

    Example:
        >>> find_single_unit("Lateral um"), find_single_unit("z (-> nm)"), find_single_unit("z")
        (1e-06, 1e-09, None)
    """
    names = [inside.strip(" ->") for inside in BRACKETED.findall(name)]
    units = {parse_unit(unit, is_bracketed=True) for unit in names} - {None}
    short = [unit for unit in names if 0 < len(unit) <= 3]
    if short and not units:  # "[V]" and the like
        raise _unknown_unit_error(short[0])
    if not names:
        last = re.split(r"[\s/]+", name.rstrip(" .:\r"))[-1]
        units = {parse_unit(last, is_bracketed=False)}
    if len(units) > 1:
        raise SurfaceFileError(f"the header {shorten(name, 60)!r} names several units")
    return units.pop() if units else None


def parse_unit(name: str, *, is_bracketed: bool) -> float | None:
    """Return the length of a unit [m]; None for any other word, without brackets for "A" too.

    Raises:
        SurfaceFileError: the unit is of another quantity or system.
    """
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
    wanted = "m, mm, µm (um, micron), nm or [A] (angstrom) is expected"
    return SurfaceFileError(f"the header names the unit {shorten(name, 60)!r}; {wanted}")


@dataclass(frozen=True)
class MapHeader:
    """The entries of a header that describe the heights; None for each that it lacks.

    Attributes:
        unit: metres per height.
        question: why the unit is open although the header says something of it; else empty.
        pitch: distance of the points along x and y [m]; None along an axis not named.
        lateral_unit: metres per position in a list of points.
        missing_code: number that marks a missing point; NaN if all are heights.
        describes_map: whether the header is that of a map, even of two or three columns.
        notes: the entries applied, one sentence each.
    """

    unit: float | None
    question: str
    pitch: tuple[float | None, float | None]
    lateral_unit: float | None
    missing_code: float | None
    describes_map: bool
    notes: tuple[str, ...]


def parse_map_header(lines: Sequence[str], shape: tuple[int, ...] = (1, 1)) -> MapHeader:
    """Return what a header says.

    Args:
        lines: its lines, without comment signs.
        shape: number of rows and columns of the numbers.

    Raises:
        SurfaceFileError: the values are no heights, or their unit is no length.

    Example:
        >>> header = parse_map_header(["pixel size=3.7e-007 m", "z factor (-> m)=6e-8"])
        >>> header.unit, header.pitch
        (6e-08, (3.7e-07, 3.7e-07))
    """
    entries = [HeaderEntry.parse(line) for line in lines if len(line) <= _MAX_LINE]
    _reject_other_quantities(entries)
    unit, sources = _find_height_unit(entries)
    width, height = (
        _single({e.length() for e in entries if e.words and e.words <= WORDS[side]})
        for side in ("width", "height")
    )
    pitch = _find_pitch(entries)
    if width and height:
        pitch = (None, None) if any(pitch) else (width / shape[1], height / shape[0])
    notes = [] if unit is None else [f"heights in units of {unit:g} m: header {sources[0]!r}"]
    if any(pitch):
        notes.append(f"pitch {format_lengths([p for p in pitch if p])} from the header")
    lateral = _single({e.unit() for e in entries if e.states_unit(WORDS["positions"])})
    is_map = bool(width and height) and any(e.words & WORDS["channels"] for e in entries)
    texts = " and ".join(map(repr, sources[:3])) if unit is None else ""
    question = f": the header says {texts}" if texts else ""
    missing = _find_missing_code(entries)
    return MapHeader(unit, question, pitch, lateral, missing, is_map, tuple(notes))


def _single(values: set[float | None]) -> float | None:
    """Return the only value; None if there is none, or several."""
    found = values - {None}
    return found.pop() if len(found) == 1 else None


@dataclass(frozen=True)
class HeaderEntry:
    """A line of a header: its key, the words of the key, the value, and the whole line."""

    key: str
    words: frozenset[str]
    value: str
    line: str

    @classmethod
    def parse(cls, line: str) -> HeaderEntry:
        """Split "key=value", "key: value", "key,value,unit", "key 1 nm" or a line without value."""
        line = " ".join(line.replace('"', " ").strip(" \t,;").split(" "))
        sign = min((s for s in "=:" if s in line), key=line.index, default=None)
        sign = sign or next((s for s in "\t;," if s in line), None)
        key, _, value = line.partition(sign) if sign else (line, "", "")
        found = None if sign else re.search(r"(?<=[^\d\s])\s(?=[+-]?[0-9])", line)
        if found:
            key = line[: found.start()]
            value = line[found.end() :]
        value = re.sub(r"[\s;,](?=\S*$)" if sign in ("\t", ";", ",") else r"\s+", " ", value)
        return cls(key, split_words(key), value.strip(), shorten(line, 60))

    def length(self) -> float | None:
        """Return the value [m] with its unit, which may stand beside the key in brackets."""
        beside = find_single_unit(self.key) if BRACKETED.search(self.key) else None
        number, unit = parse_quantity(self.value) or (0.0, None)
        unit = beside if unit is None else unit
        return number * unit if unit and number > 0.0 and beside in (None, unit) else None

    def unit(self) -> float | None:
        """Return the unit [m] that is the whole value, or stands in a line without a value."""
        if not self.value:
            return None if re.search(r"\d", self.key) else find_single_unit(self.key)
        return parse_unit(self.value.strip("[]()' "), is_bracketed=True)

    def states_unit(self, owners: frozenset[str]) -> bool:
        """Whether this is "Z unit: nm", "z [nm]" or "heights in um" for one of the owners."""
        words = self.words - WORDS["fillers"]
        if not self.value:  # a sentence, whose unit is among its words
            words = frozenset(w for w in words if parse_unit(w, is_bracketed=False) is None)
        has_key = bool("unit" in self.words and self.value)
        return bool(words) and words <= owners and (has_key or self.unit() is not None)

    def may_scale_heights(self) -> bool:
        """Whether the numbers may have to be multiplied by the value."""
        words = self.words | split_words(self.value)
        is_lateral = self.words & WORDS["positions"] and not self.words & WORDS["heights"]
        is_step = words & WORDS["steps"] and words & (WORDS["heights"] | {"vertical", "lsb"})
        return bool((words & WORDS["factors"] and not is_lateral) or is_step)


def _reject_other_quantities(entries: Sequence[HeaderEntry]) -> None:
    """Refuse a channel whose name is that of another quantity."""
    for entry in entries:
        is_alone = not entry.value and len(entry.words) <= 3
        text = entry.value if entry.words & WORDS["channels"] else entry.key * is_alone
        found = split_words(re.sub(r"[\[\]()]", " ", text)) & WORDS["quantities"]
        if found:
            what = f"{min(found)!r}, which is no height; export the heights"
            raise SurfaceFileError(f"the header {entry.line!r} names {what}")


def _find_height_unit(entries: Sequence[HeaderEntry]) -> tuple[float | None, list[str]]:
    """Return the unit of the heights [m], None if open, and the lines that say something of it."""
    stated = {e.line: e.unit() for e in entries if e.states_unit(WORDS["heights"])}
    scaling = [e for e in entries if e.may_scale_heights()]
    factors = {e.line: e.length() for e in scaling if "factor" in e.words and e.length()}
    doubts = [e.line for e in scaling if e.line not in factors]
    units = {**factors, **stated}
    unit = _single(set(units.values()))
    if unit is not None and not doubts:
        return unit, [line for line, value in units.items() if value]
    if stated and not doubts and not any(units.values()):
        fault = "is no unit of length, and there is no conversion factor"
        raise SurfaceFileError(f"the header {min(stated)!r} {fault}")
    return None, [*doubts, *units]


def _find_pitch(entries: Sequence[HeaderEntry]) -> tuple[float | None, float | None]:
    """Return the pitch along x and y [m]; none if another entry may name a different one."""
    found: dict[str, set[float | None]] = {"x": set(), "y": set()}
    for entry in entries:
        words = entry.words
        is_lateral = words & WORDS["spacing"] and not words & WORDS["vertical"]
        length = entry.length() if is_lateral else None
        if length is None:
            continue
        axes = [axis for axis in found if words & WORDS[axis]]
        is_known = words <= WORDS["pitch"] and len(axes) <= 1 and (axes or len(words) > 1)
        if not is_known:  # perhaps the camera's, or a period of the sample
            return None, None
        for axis in axes or found:
            found[axis].add(length)
    return _single(found["x"]), _single(found["y"])


def _find_missing_code(entries: Sequence[HeaderEntry]) -> float | None:
    """Return the only number that the header declares to mark missing points."""
    fillers = WORDS["missing_fillers"]
    known = WORDS["missing"]
    texts = {e.value for e in entries if e.words - fillers and e.words - fillers <= known}
    with suppress(ValueError):
        return _single({float(text) for text in texts})
    return None


_MAX_HEADER_LINE = 1000


def select_columns(table: TextTable) -> tuple[TextTable, list[str], list[str]]:
    """Return a table with the columns x, z or x, y, z only, if the header names columns.

    Heights whose validity is 0 become missing, and a first column that numbers the rows is left
    out.

    Returns:
        The table, the names of its columns (none if the header does not name them), and notes.

    Raises:
        SurfaceFileError: the names contradict a profile or a list of points.
    """
    names = _find_names(table)
    notes = list[str]()
    invalid = np.zeros(len(table.values), bool)
    roles = [_find_role(name) for name in names]
    rest = list(range(len(names)))
    if "valid" in roles and len(rest) > 2:
        rest.remove(roles.index("valid"))
        invalid = _find_invalid(table, roles.index("valid"))
        notes.append(f"{invalid.sum()} of {len(invalid)} points are marked as not valid: missing")
    first = table.values[:, 0]
    if roles[:1] == ["index"] and first[0] in (0.0, 1.0) and np.all(np.diff(first) == 1.0):
        rest.remove(0)
        notes.append("the first column numbers the points: left out")
    order = [rest[k] for k in _find_order([names[k] for k in rest], [roles[k] for k in rest])]
    if order != rest:
        notes.append(f"columns taken: {', '.join(repr(names[k]) for k in order)}")
    table = _take_columns(table, order) if names else table
    table.values[invalid, -1] = np.nan
    return table, [names[k] for k in order] if len(order) <= 3 else [], notes


def _find_names(table: TextTable) -> list[str]:
    """Return the columns that the last header lines name; names and units may be on two lines."""
    lines = [line for line in table.header if line.strip(" \t,;") and len(line) <= _MAX_HEADER_LINE]
    cells = _split_names(lines[-1], table) if lines else []
    if cells and len(lines) > 1 and not any(split_words(cell) for cell in cells):
        above = _split_names(lines[-2], table)
        cells = [f"{name} {unit}" for name, unit in zip(above, cells, strict=False)] or cells
    is_numbers = any(re.search(r"(^|\s)[+-]?\d|[=:]", BRACKETED.sub("", cell)) for cell in cells)
    return [] if is_numbers else cells  # entries and numbers with their units


def _split_names(line: str, table: TextTable) -> list[str]:
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


def _find_role(name: str) -> str:
    if re.search(r"[01]/[01]", name):
        return "valid"
    words = split_words(name)
    if words & WORDS["quantities"]:
        return "other"
    return next((role for role, known in ROLES.items() if words & known), "")


def _find_invalid(table: TextTable, column: int) -> NDArray[np.bool_]:
    valid: FloatArray = table.values[:, column]
    wrong = ~np.isin(valid, (0.0, 1.0))
    if wrong.any():
        line = table.line_numbers[int(np.argmax(wrong))]
        raise SurfaceFileError(f"line {line}: validity must be 0 or 1")
    return np.asarray(valid == 0.0)


def _find_order(names: list[str], roles: list[str]) -> list[int]:
    """Return the columns x, z or x, y, z; all as they are if their names say nothing of that."""
    count = len(roles)
    if count == 2 and "y" in roles:  # the axis of heights in a picture, or the one of positions
        roles = [role.replace("y", "x" if "z" in roles else "z") for role in roles]
    says_nothing = not any(roles) or (count == 2 and roles in (["x", ""], ["", "z"]))
    if count < 2 or says_nothing or (count > 3 and not {"x", "y"} & set(roles)):
        return list(range(count))
    wanted = ["x", "z"] if count == 2 else ["x", "y", "z"]
    if any(roles.count(role) != 1 for role in wanted):
        fault = "are not x and z, or x, y and z: name them so, each once"
        raise SurfaceFileError(f"the columns {', '.join(map(repr, names))[:120]} {fault}")
    return [roles.index(role) for role in wanted]


def _take_columns(table: TextTable, order: Sequence[int]) -> TextTable:
    """Return a table with some of the columns, in this order."""
    rows = [table.dialect.cells(line) for line in table.row_texts]
    texts = [(table.dialect.separator or " ").join(row[k] for k in order) for row in rows]
    return replace(table, values=table.values[:, list(order)], row_texts=texts)


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
        text = f"{fault}: remove it, and give their distance as {{pitch}}"
        raise SurfaceFileError(text, pitch=None)


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
        found = np.isclose(values, code, rtol=_ROUNDING, atol=0.0)
        rest = values[~found & ~np.isnan(values)]
        if not found.any() or not rest.size:
            continue
        what = f"{int(found.sum())} points hold {code:g}, which"
        if max(rest.min() - code, code - rest.max()) > np.ptp(rest):
            values = np.where(found, np.nan, values)
            notes += (f"{what} marks a missing point",)
        elif code in _CODES:
            remedy = f"declare it in the header ('nodata: {code:g}', or 'nodata: nan' for none)"
            raise SurfaceFileError(f"{what} may be a height or mark a missing point: {remedy}")
    return values, notes
