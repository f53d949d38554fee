"""The records of texture and law, and their arrays, as constants of a C program."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.errors import ParameterError
from asperity.export.expressions import real_literal
from asperity.export.subset import (
    BOOL,
    FLOAT,
    INT,
    SINGLE,
    Constants,
    Data,
    Kind,
    Number,
    number_type,
)
from asperity.kernels.probe import SHARED_PARAMETERS
from asperity.surface import Surface

_ELEMENTS = {"float64": FLOAT, "float32": SINGLE, "int64": INT, "int32": INT, "bool": BOOL}
_WIDTH = 100


@dataclass(frozen=True)
class Store:
    """What a program holds as data.

    Attributes:
        prefix: of its names.
        single: whether real numbers are of single precision.
        texture: kind of the texture's record.
        law: kind of the law's record.
        values: of numbers and arrays, by ``record.field`` or by the name of the array.
    """

    prefix: str
    single: bool
    texture: Constants
    law: Constants
    values: dict[str, Any]

    def used(self, code: str) -> tuple[list[str], list[str]]:
        """Return the arrays and the definitions of records that some functions use."""
        words = set(re.findall(r"\w+(?:\.\w+)?", code))
        arrays = [place for place in self.values if "." not in place and place in words]
        return arrays, [
            self._record(record, words)
            for record in (self.texture, self.law)
            if any(f"{record.place}.{name}" in words for name, _kind in record.fields)
        ]

    def _record(self, record: Constants, words: set[str]) -> str:
        used = [
            (name, kind)
            for name, kind in record.fields
            if f"{record.place}.{name}" in words and isinstance(kind, Number)
        ]
        fields = "".join(f"    {self._type(kind)} {name};\n" for name, kind in used)
        values = (self.values[f"{record.place}.{name}"] for name, _kind in used)
        texts = [
            self._literal(value, kind) for value, (_name, kind) in zip(values, used, strict=True)
        ]
        return f"static const struct {{\n{fields}}} {record.place} = {{{', '.join(texts)}}};\n"

    def head(self, place: str) -> str:
        """Return the declaration of an array, without storage class or end."""
        values = self.values[place]
        kind = _element(values)
        whole = "int32_t" if _is_small(values) else "int64_t"
        c_type = whole if kind == INT else self._type(kind)
        return f"const {c_type} {place}" + "".join(f"[{max(n, 1)}]" for n in values.shape)

    def array(self, place: str) -> str:
        """Return the definition of an array, without storage class."""
        return f"{self.head(place)} = {self._rows(self.values[place])};\n"

    def size(self, place: str) -> int:
        """Return the bytes that an array takes in the program."""
        values = self.values[place]
        wide = {FLOAT: 4 if self.single else 8, SINGLE: 4, INT: 4 if _is_small(values) else 8}
        return int(values.size) * wide.get(_element(values), 4)

    def _rows(self, values: NDArray[Any]) -> str:
        if values.size == 0:
            return "{" * values.ndim + "0" + "}" * values.ndim
        if values.ndim > 1:
            return "{\n" + ",\n".join(self._rows(row) for row in values) + "\n}"
        kind = _element(values)
        texts = [self._literal(value, kind) for value in values.tolist()]
        return "{" + _wrapped(texts) + "}"

    def _type(self, kind: Kind) -> str:
        return number_type(kind, "float" if self.single else "double")

    def _literal(self, value: Any, kind: Number) -> str:
        if kind in {BOOL, INT}:
            return str(int(value))
        return real_literal(float(value), self.single or kind == SINGLE)


def store_of(surface: Surface, prefix: str, *, single: bool) -> Store:
    """Return what a program for a surface may hold as data.

    Raises:
        ParameterError: for a texture whose record holds what C does not know.
    """
    arguments: Any = surface.texture.arguments
    values: dict[str, Any] = {}
    texture = _constants(f"{prefix}_surface", arguments._fields, arguments, prefix, values)
    names = (*SHARED_PARAMETERS, *surface.law.parameters)
    numbers = [float(value) for value in surface.law_arguments]
    law = _constants(f"{prefix}_law", names, numbers, prefix, values)
    law = replace(law, reader=f"{prefix.upper()}_READ")
    return Store(prefix, single, texture, law, values)


def _constants(
    place: str, names: Sequence[str], items: Sequence[Any], prefix: str, values: dict[str, Any]
) -> Constants:
    fields: list[tuple[str, Kind]] = []
    for name, item in zip(names, items, strict=True):
        if isinstance(item, np.ndarray) and item.dtype.name in _ELEMENTS:
            array = f"{prefix}_data_{name}"
            values[array] = item
            fields.append((name, Data(array, item.shape, _ELEMENTS[item.dtype.name])))
        elif isinstance(item, (bool, int, float, np.bool_, np.integer, np.floating)):
            values[f"{place}.{name}"] = item
            fields.append((name, _of_scalar(item)))
        else:
            words = f"cannot be exported: its record holds {name!r}, a {type(item).__name__}"
            raise ParameterError("texture", words)
    return Constants(place, tuple(fields))


def _of_scalar(value: Any) -> Number:
    if isinstance(value, (bool, np.bool_)):
        return BOOL
    return INT if isinstance(value, (int, np.integer)) else FLOAT


def _element(values: NDArray[Any]) -> Number:
    return _ELEMENTS[values.dtype.name]


def _is_small(values: NDArray[Any]) -> bool:
    """Return whether integers fit into 32 bits."""
    return values.size == 0 or bool(np.abs(values).max() < 2**31)


def _wrapped(texts: Sequence[str]) -> str:
    """Return numbers with commas between, in lines that an editor can show."""
    lines, line = [], ""
    for text in texts:
        if line and len(line) + len(text) > _WIDTH:
            lines.append(line)
            line = ""
        line += f"{text}, "
    return "\n".join([*lines, line]).rstrip(", ")
