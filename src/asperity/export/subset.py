"""The kinds of value in compiled functions, and the error for what cannot be expressed in C.

Compiled functions (:mod:`asperity.compiled`) know numbers, tuples and records of them, arrays of
numbers of a constant shape, and constants: the records of texture and law with their arrays, which
an exported program holds as data.
"""

from __future__ import annotations

from dataclasses import dataclass

from asperity.errors import ParameterError


class NotExportableError(ParameterError):
    """A function that cannot be expressed in C; it says which construct, where, and why."""

    def __init__(self, function: str, construct: str) -> None:
        super().__init__("law", f"cannot be exported: the function {function!r} {construct}")


@dataclass(frozen=True)
class Number:
    """A scalar.

    Attributes:
        name: in Numba's words: ``float64``, ``float32``, ``int64`` or ``bool``.
        rank: of two that meet in an expression the one of the higher rank is their common kind.
    """

    name: str
    rank: int


BOOL, INT, SINGLE, FLOAT = (
    Number(name, rank) for rank, name in enumerate(("bool", "int64", "float32", "float64"))
)


@dataclass(frozen=True)
class Group:
    """A tuple, or a record: a tuple whose items have names.

    Attributes:
        items: kinds of its items.
        names: their names; none for a plain tuple.
    """

    items: tuple[Kind, ...]
    names: tuple[str, ...] = ()

    @property
    def alike(self) -> bool:
        """Whether all items are of one kind, so that an index may be computed."""
        return len(set(self.items)) == 1


@dataclass(frozen=True)
class Work:
    """A work array of float64 on the stack.

    Attributes:
        shape: its lengths.
    """

    shape: tuple[int, ...]


@dataclass(frozen=True)
class Data:
    """A constant array, which the program holds as data.

    Attributes:
        place: its name in the program.
        shape: its lengths.
        element: kind of its numbers.
    """

    place: str
    shape: tuple[int, ...]
    element: Number


@dataclass(frozen=True)
class Constants:
    """A constant record: numbers and arrays by name, which the program holds as data.

    Attributes:
        place: its name in the program.
        fields: its items by name.
        reader: macro that reads a real number without the compiler knowing it; empty for none.
    """

    place: str
    fields: tuple[tuple[str, Kind], ...]
    reader: str = ""

    def read(self, name: str) -> str:
        """Return the expression of a number."""
        place = f"{self.place}.{name}"
        return f"{self.reader}({place})" if self.reader else place


@dataclass(frozen=True)
class Nothing:
    """What a function without a result returns."""


NOTHING = Nothing()

Kind = Number | Group | Work | Data | Constants | Nothing


def is_constant(kind: Kind) -> bool:
    """Return whether a value is known from its kind: then it is no argument of a C function."""
    return isinstance(kind, (Data, Constants))


def common(first: Kind, second: Kind) -> Kind | None:
    """Return the kind of a variable that holds both, ``None`` if there is none.

    Example:
        >>> common(INT, FLOAT).name, common(INT, Work((3,)))
        ('float64', None)
    """
    if first == second:
        return first
    if isinstance(first, Number) and isinstance(second, Number):
        return max(first, second, key=lambda number: number.rank)
    if isinstance(first, Group) and isinstance(second, Group):
        items = [common(a, b) for a, b in zip(first.items, second.items, strict=False)]
        if len(first.items) == len(second.items) and first.names == second.names:
            known = tuple(item for item in items if item is not None)
            return Group(known, first.names) if len(known) == len(items) else None
    return None


def number_type(kind: Kind, real: str) -> str:
    """Return the C type of a number.

    Example:
        >>> number_type(INT, "double"), number_type(FLOAT, "double")
        ('int64_t', 'double')
    """
    known: dict[Kind, str] = {BOOL: "int", INT: "int64_t", SINGLE: "float"}
    return known.get(kind, real)
