"""What the header of a text matrix says of its heights: unit, factor, size of a pixel.

Length units in the header of a text file.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from asperity.errors import SurfaceFileError
from asperity.measured.reading.length_units import METRES
from asperity.measured.reading.numbers import parse_number

# A longer line is no header but data that went astray.
_LONGEST_LINE = 1000
_BRACKETED = re.compile(r"[\[(]([^\[\]()]*)[\])]")
_QUANTITY = re.compile(r"([+-]?[0-9.]+(?:[eE][+-]?[0-9]+)?)\s*(\S*)")
_COUNTS = re.compile(r"\b([hw])=([0-9]+)\b")
# Gwyddion writes its header in the language of its user.
_WIDTH = ("width", "breite", "largeur", "larghezza", "ancho", "šířka", "largura")
_HEIGHT = ("height", "höhe", "hauteur", "altezza", "alto", "výška", "altura")
_PIXEL = ("pixel size", "pixel width", "pixel pitch", "pixel spacing", "point spacing")
_LATERAL = ("lateral unit", "lateral units", "xy unit", "xy units")
_UNIT = ("data unit", "data units", "value unit", "value units", "z unit", "z units", "height unit")


@dataclass(frozen=True)
class MapHeader:
    """What the header of a matrix says.

    Attributes:
        unit: metres per number, None where the header does not say.
        pitch: distance of the points [m], None where it does not say.
        size: (width, height) [m], None where it does not say.
        shape: rows and columns, None where it does not say.
        lateral: metres per number of positions in a list of points, None where it does not say.
        notes: what was applied, one sentence each.
    """

    unit: float | None = None
    pitch: float | None = None
    size: tuple[float, float] | None = None
    shape: tuple[int, int] | None = None
    lateral: float | None = None
    notes: tuple[str, ...] = ()

    @property
    def describes_map(self) -> bool:
        """Whether the header is that of a map, whatever the number of its columns."""
        return not (self.pitch is None and self.size is None and self.shape is None)

    @property
    def units_of_points(self) -> tuple[float, float, float] | None:
        """Metres per number of x, y and z, None where the header does not say all."""
        if self.lateral is None or self.unit is None:
            return None
        return self.lateral, self.lateral, self.unit

    def pitch_of(self, rows: int, columns: int) -> tuple[float, float] | None:
        """Return the pitch of a matrix of so many rows and columns [m]."""
        if self.pitch is not None:
            return self.pitch, self.pitch
        if self.size is None:
            return None
        return self.size[0] / columns, self.size[1] / rows


def map_header(lines: Sequence[str]) -> MapHeader:
    """Return what a header says of the heights below it.

    Raises:
        SurfaceFileError: for a factor or a unit of the heights that cannot be applied: heights
            that are wrong by it would pass unnoticed.

    Example:
        >>> header = map_header(["pixel size=3.7e-007 m", "height conversion factor (-> m)=6e-8"])
        >>> header.unit, header.pitch
        (6e-08, 3.7e-07)
    """
    entries = dict(_entry(line) for line in lines if len(line) <= _LONGEST_LINE)
    factor = _factor(entries)
    unit = factor if factor is not None else _unit(entries, _UNIT)
    notes = () if factor is None else (f"heights multiplied by the header's factor, {factor:g} m",)
    sides = [_length(entries, names) for names in (_WIDTH, _HEIGHT)]
    size = None if sides[0] is None or sides[1] is None else (sides[0], sides[1])
    lateral = _unit(entries, _LATERAL)
    return MapHeader(unit, _length(entries, _PIXEL), size, _shape(lines), lateral, notes)


def is_lateral(line: str) -> bool:
    """Whether a header line is about lengths along the surface, so that its unit is not of heights.

    Example:
        >>> is_lateral("Height: 4.00 µm"), is_lateral("Value units: m")
        (True, False)
    """
    return _entry(line)[0] in (*_WIDTH, *_HEIGHT, *_PIXEL, *_LATERAL)


def _entry(line: str) -> tuple[str, str]:
    """Return key and value of "key=value" or "key: value"."""
    sign = min((s for s in "=:" if s in line), key=line.index, default="=")
    key, _, value = line.partition(sign)
    return " ".join(key.lower().split()), value.strip()


def _length(entries: dict[str, str], names: Sequence[str]) -> float | None:
    """Return the positive length [m] that one of the keys names."""
    for name in names:
        match = _QUANTITY.fullmatch(entries.get(name, "").replace(",", "."))
        if match is None:
            continue
        metres = one_unit(match.group(2)) if match.group(2) else None
        number = parse_number(match.group(1), name)
        if metres is not None and number > 0.0:
            return number * metres
    return None


def _factor(entries: dict[str, str]) -> float | None:
    """Return the metres per number that a conversion factor of the heights says."""
    for key, value in entries.items():
        words = set(_BRACKETED.sub(" ", key).split())
        if "factor" not in words or not words & {"height", "z", "data", "value", "conversion"}:
            continue
        match = _QUANTITY.fullmatch(value)
        target = units_of(f"{' '.join(_BRACKETED.findall(key))} {match.group(2) if match else ''}")
        if match is None or len(set(target)) != 1:
            raise SurfaceFileError(
                f"the header's {key!r} is {value[:40]!r}; a number and a unit of length, such as "
                "'(-> m)=6.3e-8', are expected: without them the heights are not known"
            )
        return parse_number(match.group(1), key) * target[0]
    return None


def _unit(entries: dict[str, str], names: Sequence[str]) -> float | None:
    """Return the metres per number that the unit under one of the keys says."""
    for name in names:
        if name not in entries:
            continue
        metres = one_unit(entries[name])
        if metres is None:
            raise SurfaceFileError(
                f"the header's {name!r} is {entries[name][:40]!r}, no unit of length, and there is "
                "no conversion factor: the lengths are not known"
            )
        return metres
    return None


def _shape(lines: Sequence[str]) -> tuple[int, int] | None:
    """Return rows and columns from "h=650 w=650"."""
    for line in lines:
        found = dict(_COUNTS.findall(line[:_LONGEST_LINE]))
        if len(found) == 2:
            return int(found["h"][:12]), int(found["w"][:12])
    return None


# Units of other things or of other systems: never to be mistaken for metres.
_REFUSED = {"in", "inch", "inche", "mil", "thou", "ft", "feet", "volt", "px", "pixel", "mv", "kå"}
_WORD = re.compile(r"[^\W\d_]+")


def units_of(text: str) -> list[float]:
    """Return the units that a piece of header names, in order, in metres.

    Words count anywhere ("Lateral um"), "A" only in brackets ("z [A]").

    Args:
        text: a column header, or a whole header line.

    Returns:
        Metres per unit, one for each unit named.

    Raises:
        SurfaceFileError: a unit that is no length known here.

    Example:
        >>> units_of("Lateral um,Raw Micrometer")
        [1e-06, 1e-06]
        >>> units_of("height")
        []
    """
    found = []
    for match in _WORD.finditer(text):
        word = match.group()
        bracketed = _in_brackets(text, match)
        key = _key(word)
        if bracketed and word == "A":
            found.append(1e-10)
        elif key in METRES and _case_fits(word):
            found.append(METRES[key])
        elif key in _REFUSED and (bracketed or key not in ("in", "mil", "px", "mv", "ft")):
            raise _unknown(word)
    if not found:
        _refuse_brackets(text)
    return found


def one_unit(text: str) -> float | None:
    """Return the single unit that a header line names, None for none.

    Raises:
        SurfaceFileError: the line names units that differ.
    """
    units = set(units_of(text))
    if len(units) > 1:
        raise SurfaceFileError(f"the header {_short(text)!r} names several units")
    return units.pop() if units else None


def two_units(cells: list[str], line: str) -> tuple[float, float] | None:
    """Return the units of positions and heights, None where the header names none.

    Args:
        cells: the column headers, split as the data are.
        line: the whole header line, for headers that do not split so.

    Raises:
        SurfaceFileError: one column has a unit and the other has none, or the like.
    """
    named = [cell for cell in cells if cell.strip()]
    if len(named) == 2:
        pair = [one_unit(cell) for cell in named]
    else:
        found: list[float | None] = list(units_of(line))
        pair = found or [None, None]
    if pair == [None, None]:
        return None
    if len(pair) != 2 or pair[0] is None or pair[1] is None:
        raise SurfaceFileError(
            f"the header {_short(line)!r} must name the unit of both columns or of none"
        )
    return pair[0], pair[1]


def _key(word: str) -> str:
    low = word.lower()
    return low[:-1] if low.endswith("s") and len(low) > 3 else low


def _case_fits(word: str) -> bool:
    """Short symbols keep their case: "Mm" and "NM" are other units or no unit at all."""
    return len(word) > 2 or word.lower() == word or word == "Å"


def _in_brackets(text: str, match: re.Match[str]) -> bool:
    before, after = text[: match.start()].rstrip(), text[match.end() :].lstrip()
    return before.endswith(("[", "(")) and after.startswith(("]", ")"))


def _refuse_brackets(text: str) -> None:
    """Refuse "[V]" and the like: a bracket that stands where a unit stands."""
    for bracket in _BRACKETED.findall(text):
        content = bracket.strip()
        if content and (len(content) <= 3 or _key(content) in _REFUSED):
            raise _unknown(content)


def _unknown(word: str) -> SurfaceFileError:
    return SurfaceFileError(
        f"the header names the unit {_short(word)!r};"
        " m, mm, µm (um, micron), nm or [A] (angstrom) is expected"
    )


def _short(text: str) -> str:
    text = " ".join(text.split())
    return text if len(text) <= 60 else text[:57] + "..."
