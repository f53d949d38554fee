"""The header of a text file: what it says of heights, pitch and missing points.

Only entries whose words are known to be of the heights state their unit: a header names many other
lengths. An entry that may be a factor of the heights, or contradicts another, leaves the unit open.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from textwrap import shorten

from asperity.core.errors import SurfaceFileError
from asperity.measured.lengths import METRES_PER_UNIT, format_lengths

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
