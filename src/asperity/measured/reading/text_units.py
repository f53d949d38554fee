"""Length units in the header of a text file."""

from __future__ import annotations

import re

from asperity.errors import SurfaceFileError
from asperity.measured.reading.length_units import METRES

# Units of other things or of other systems: never to be mistaken for metres.
_REFUSED = {"in", "inch", "inche", "mil", "thou", "ft", "feet", "volt", "px", "pixel", "mv", "kå"}
_WORD = re.compile(r"[^\W\d_]+")
_BRACKET = re.compile(r"[\[(]([^\[\]()]*)[\])]")


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
    for bracket in _BRACKET.findall(text):
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
