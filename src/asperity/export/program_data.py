"""Records and arrays of texture and law as constants of a C program."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.contacts.contact import parameter_name
from asperity.core.errors import ParameterError
from asperity.export import c_language as c
from asperity.export.c_language import ValueType
from asperity.export.expressions import real_literal
from asperity.kernels.law_codegen import SHARED_PARAMETERS
from asperity.surface import Surface

_SCALAR_TYPES = {
    "float64": c.FLOAT,
    "float32": c.SINGLE,
    "int64": c.INT,
    "int32": c.INT,
    "bool": c.BOOL,
}
_WIDTH = 100


@dataclass(frozen=True)
class ProgramData:
    """Data of a program.

    Attributes:
        prefix: prefix of all names.
        single: whether real numbers are of single precision.
        texture: type of the record of the texture.
        law: type of the record of the law.
        values: numbers by ``record.field``, and arrays by name.
    """

    prefix: str
    single: bool
    texture: c.ConstantRecord
    law: c.ConstantRecord
    values: dict[str, Any]

    def used_by(self, code: str) -> tuple[list[str], list[str]]:
        """Return the arrays and the definitions of the records that C code uses."""
        words = set(re.findall(r"\w+(?:\.\w+)?", code))
        used = [place for place in self.values if place in words]
        definitions = [self._record_definition(record, used) for record in (self.texture, self.law)]
        return [place for place in used if "." not in place], list(filter(None, definitions))

    def _record_definition(self, record: c.ConstantRecord, places: Sequence[str]) -> str:
        """Return the definition of a record with the used fields; empty if there are none."""
        fields, values = "", []
        for name, kind in zip(record.names, record.items, strict=True):
            place = f"{record.c_name}.{name}"
            if place in places and isinstance(kind, c.ScalarType):
                fields += f"    {self._c_type(kind)} {name};\n"
                values.append(self._literal(self.values[place], kind))
        initializer = f"{record.c_name} = {{{', '.join(values)}}};\n"
        return f"static const struct {{\n{fields}}} {initializer}" if values else ""

    def declaration(self, name: str) -> str:
        """Return the declaration of an array, without storage class and semicolon."""
        values = self.values[name]
        kind = _element_type(values)
        whole = "int32_t" if _fits_32_bits(values) else "int64_t"
        c_type = whole if kind == c.INT else self._c_type(kind)
        return f"const {c_type} {name}" + "".join(f"[{max(n, 1)}]" for n in values.shape)

    def definition(self, name: str) -> str:
        """Return the definition of an array, without storage class."""
        return f"{self.declaration(name)} = {self._initializer(self.values[name])};\n"

    def size_in_bytes(self, name: str) -> int:
        """Return the size of an array in the program [bytes]."""
        values = self.values[name]
        wide = {
            c.FLOAT: 4 if self.single else 8,
            c.SINGLE: 4,
            c.INT: 4 if _fits_32_bits(values) else 8,
        }
        return int(values.size) * wide.get(_element_type(values), 4)

    def _initializer(self, values: NDArray[Any]) -> str:
        if values.size == 0:
            return "{" * values.ndim + "0" + "}" * values.ndim
        if values.ndim > 1:
            return "{\n" + ",\n".join(self._initializer(row) for row in values) + "\n}"
        kind = _element_type(values)
        texts = [self._literal(value, kind) for value in values.tolist()]
        return "{" + _wrap_lines(texts) + "}"

    def _c_type(self, value_type: ValueType) -> str:
        return c.c_scalar_type(value_type, "float" if self.single else "double")

    def _literal(self, value: Any, value_type: c.ScalarType) -> str:
        if value_type in {c.BOOL, c.INT}:
            return str(int(value))
        return real_literal(float(value), self.single or value_type == c.SINGLE)


def make_program_data(surface: Surface, prefix: str, *, single: bool) -> ProgramData:
    """Return the data of a surface.

    Raises:
        ParameterError: for a texture whose record holds values other than numbers and arrays.
    """
    arguments: Any = surface.texture.arguments
    values: dict[str, Any] = {}
    texture = _constant_record(f"{prefix}_surface", arguments._fields, arguments, prefix, values)
    names = (*SHARED_PARAMETERS, *map(parameter_name, surface.law.parameters))
    numbers = [float(value) for value in surface.law_arguments]
    law = _constant_record(f"{prefix}_law", names, numbers, prefix, values)
    law = replace(law, read_macro=f"{prefix.upper()}_READ")
    return ProgramData(prefix, single, texture, law, values)


def _constant_record(
    c_name: str, names: Sequence[str], items: Sequence[Any], prefix: str, values: dict[str, Any]
) -> c.ConstantRecord:
    kinds: list[ValueType] = []
    for name, item in zip(names, items, strict=True):
        kind = _SCALAR_TYPES.get(np.asarray(item).dtype.name)
        if kind is None:
            words = f"cannot be exported: its record holds {name!r}, a {type(item).__name__}"
            raise ParameterError("texture", words)
        if isinstance(item, np.ndarray):
            array = f"{prefix}_data_{name}"
            values[array] = item
            kinds.append(c.ArrayType(item.shape, kind, array))
        else:
            values[f"{c_name}.{name}"] = item
            kinds.append(kind)
    return c.ConstantRecord(tuple(kinds), tuple(names), c_name)


def _element_type(values: NDArray[Any]) -> c.ScalarType:
    return _SCALAR_TYPES[values.dtype.name]


def _fits_32_bits(values: NDArray[Any]) -> bool:
    """Return whether integers fit into 32 bits."""
    return values.size == 0 or bool(np.abs(values).max() < 2**31)


def _wrap_lines(texts: Sequence[str]) -> str:
    """Return numbers separated by commas, in lines of limited length."""
    lines, line = [], ""
    for text in texts:
        if line and len(line) + len(text) > _WIDTH:
            lines.append(line)
            line = ""
        line += f"{text}, "
    return "\n".join([*lines, line]).rstrip(", ")
