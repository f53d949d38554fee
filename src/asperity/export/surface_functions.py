"""C functions of the force and the potential energy of a surface, and their data.

An :class:`ExportRequest` says of which surface, and in which form.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.contacts.contact import Contact
from asperity.contacts.warm_start import WARM_START_SIZE
from asperity.core.checks import check_positive
from asperity.core.errors import ParameterError
from asperity.derive.facts import clamped_facts
from asperity.export import c_language as c
from asperity.export.c_language import ValueType
from asperity.export.expressions import real_literal, real_literals
from asperity.export.program import LinkedSource, Program
from asperity.export.statements import RESERVED_WORDS
from asperity.kernels.fuse import energy_kernel_source, law_units, link_on_texture
from asperity.kernels.link import SourceUnit, generated_unit, unit_from_module
from asperity.kernels.probe_functions import LawCode, energy_source, parameter_names
from asperity.laws import Law
from asperity.laws.clamps import Clamp
from asperity.rendering import is_searched
from asperity.surface import Surface
from asperity.textures.fields.field_record import BRICK_ENTRIES

PRECISIONS = ("double", "float")
MAX_DATA_SIZE = 64 * 2**20
"""Default limit of the data of a program [bytes]."""


def is_searching(contact: Contact) -> bool:
    """Return whether exported laws on a contact search: not where a field or a formula is used."""
    return contact.has_warm_start and not contact.has_potential_field


@dataclass(frozen=True)
class ExportRequest:
    """A surface to export, and the options of the program.

    Attributes:
        surface: the surface with its law.
        name: prefix of all names.
        precision: precision of real numbers, ``double`` or ``float``.
        as_library: whether to write a library.
        comment: comment at the top of the file, plain text.
        q_upper: upper bound of the characteristic number.
        one_sided_upper: upper bound of the one-sided number.
        max_force: greatest force on a straight scan at ``max_depth`` [N]; infinite if unknown.
        max_press: mean normal force on that scan [N]; infinite if unknown.
        holds_deeper: whether both numbers hold at any depth.
        max_data_size: limit of the data of the program [bytes].
        max_bytes: size of the data [bytes] to which a map or field was coarsened.
        loads_field: whether the program loads the baked field from its file; else the source holds
            all data.
        max_evaluations: limit of evaluations of the surface per tick; infinite for an exact search;
            default: that of the contact of the law.

    Raises:
        ParameterError: for a name that is not a C identifier, an unknown precision, a number of
            evaluations that is not positive, a surface with law H that is neither baked nor has a
            closed form, or ``loads_field`` without a baked field.
    """

    surface: Surface
    name: str = "texture"
    precision: str = "double"
    as_library: bool = False
    comment: str = ""
    q_upper: float = math.inf
    one_sided_upper: float = math.inf
    max_force: float = math.inf
    max_press: float = math.inf
    holds_deeper: bool = False
    max_data_size: int = MAX_DATA_SIZE
    max_bytes: int | None = None
    loads_field: bool = False
    max_evaluations: float | None = None

    def __post_init__(self) -> None:
        self.validate(**vars(self))
        if is_searched(self.surface):
            text = "must be baked to export law H; without a period, bake a part of it"
            raise ParameterError("surface", text)
        if self.loads_field and not self.surface.texture.baked_numbers:
            raise ParameterError("load", "needs a baked field: law H without a closed form")

    @staticmethod
    def validate(
        name: str = "texture",
        precision: str = "double",
        max_evaluations: float | None = None,
        **_others: object,
    ) -> None:
        """Check the options without a surface; others are ignored.

        Raises:
            ParameterError: see the class.
        """
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) or "__" in name:
            requirement = "must be a C identifier: letters, digits and single _, a letter first"
            raise ParameterError("name", requirement, name)
        if name in RESERVED_WORDS:
            raise ParameterError("name", "must not be a reserved word of C or C++", name)
        if precision not in PRECISIONS:
            requirement = f"must be one of {', '.join(PRECISIONS)}"
            raise ParameterError("precision", requirement, precision)
        if max_evaluations is not None and max_evaluations != math.inf:
            check_positive("max_evaluations", max_evaluations)

    @property
    def evaluation_budget(self) -> float:
        """Limit of evaluations of the surface per tick; 1 for a law without a search."""
        contact = self.surface.law.contact
        if not is_searching(contact):
            return 1.0
        return self.max_evaluations or contact.max_evaluations

    @property
    def is_single_precision(self) -> bool:
        """Whether real numbers are of single precision."""
        return self.precision == "float"


# Further names of a program, after the prefix.
_RESERVED_NAMES = frozenset(
    (
        *("state", "reset", "force", "gap", "energy", "surface", "law", "prepare"),
        *("abi_version", "state_size", "facts", "info"),
    )
)


@dataclass(frozen=True)
class SurfaceFunctions:
    """C functions of a surface.

    Attributes:
        code: definitions of the functions and their types.
        tick_name: name of the function of force and anchor.
        tick_type: C type of its result.
        energy_name: name of the function of the energy; empty if there is none.
        data: data of the program.
    """

    code: str
    tick_name: str
    tick_type: str
    energy_name: str
    data: ProgramData


def surface_functions(request: ExportRequest) -> SurfaceFunctions:
    """Return the C functions of a surface.

    Raises:
        ParameterError: for a law or a texture that cannot be exported.
    """
    surface = request.surface
    prefix = request.name
    single = request.is_single_precision
    law = surface.law
    clamp = surface.effective_clamp
    has_friction = surface.contact_friction is not None
    (probe,) = [
        unit for unit in law_units(law, clamp, has_friction) if "probe_tick" in unit.sources
    ]
    energy = energy_units(law, clamp, has_friction)
    roots = [("probe_tick", probe), *[("probe_energy", unit) for unit in energy[:1]]]
    units = [*map(unit_from_module, law.contact.kernels()), *energy]
    text = link_on_texture(law, surface.texture.sampler, clamp, roots, units, has_friction)
    program = Program(LinkedSource(text), prefix, single=single, reserved=_RESERVED_NAMES)
    store = make_program_data(surface, prefix, single=single, loads_field=request.loads_field)
    constants: tuple[ValueType, ValueType] = (store.texture, store.law)
    place = (c.FLOAT, c.FLOAT, c.FLOAT)
    kinds = (*place, c.FLOAT, c.FLOAT, c.FLOAT, c.BOOL, c.ArrayType((WARM_START_SIZE,)), *constants)
    tick = program.function_name("probe_tick", kinds)
    tick_type = program.c_type(program.infer_types("probe_tick", kinds).result_type)
    energy_name = ""
    if energy:
        energy_name = program.function_name("probe_energy", (*place, *constants))
    code = "\n".join([*program.types, *program.helpers, *program.functions])
    return SurfaceFunctions(code, tick, tick_type, energy_name, store)


@lru_cache(maxsize=64)
def energy_units(law: Law, clamp: Clamp, has_friction: bool = False) -> tuple[SourceUnit, ...]:
    """Return the energy functions of a law, ``probe_energy`` first; none without a potential.

    Args:
        law: the law.
        clamp: the depth clamp. One that holds a part of the force has no potential.
        has_friction: whether the record of the law also holds parameters of friction.

    Example:
        >>> from asperity.laws.clamps import BACKED
        >>> from asperity.laws import find_law
        >>> [len(energy_units(find_law(letter), BACKED)) for letter in "BCDH"]
        [0, 2, 2, 2]
    """
    source = energy_kernel_source(law)
    if not (source and clamp.has_potential and clamped_facts(law, clamp).conservative):
        return ()
    plan = LawCode(law, source, clamp, has_friction)
    return (
        generated_unit(f"energy of law {law} at a probe", energy_source(plan)),
        generated_unit(f"energy of law {law}", source),
    )


_SCALAR_TYPES = {
    "float64": c.FLOAT,
    "float32": c.SINGLE,
    "int64": c.INT,
    "int32": c.INT,
    "int16": c.INT,
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
        names = set(re.findall(r"\w+(?:\.\w+)?", code))
        used = [place for place in self.values if place in names]
        definitions = [self._record_definition(record, used) for record in (self.texture, self.law)]
        return [place for place in used if "." not in place], list(filter(None, definitions))

    def _record_definition(self, record: c.ConstantRecord, places: Sequence[str]) -> str:
        """Return the definition of a record with the used fields; empty if there are none."""
        fields = ""
        values = []
        for name, kind in zip(record.names, record.items, strict=True):
            place = f"{record.c_name}.{name}"
            if place in places and isinstance(kind, c.ScalarType):
                fields += f"    {self._c_type(kind)} {name};\n"
                values.append(self._literal(self.values[place], kind))
        if not values:
            return ""
        initializer = f"{record.c_name} = {{{', '.join(values)}}};\n"
        return f"static const struct {{\n{fields}}} {initializer}"

    def declaration(self, name: str) -> str:
        """Return the declaration of an array, without storage class and semicolon."""
        values = self.values[name]
        c_type = self._c_type(_element_type(values))
        if c_type == "int64_t" and _fits_32_bits(values):
            c_type = "int32_t"
        if self.has_lines(name):
            c_type = f"int16_t {self.prefix.upper()}_LINES"
        lengths = "".join([f"[{max(length, 1)}]" for length in values.shape])
        return f"const {c_type} {name}{lengths}"

    def has_lines(self, name: str) -> bool:
        """Return whether the rows of an array are aligned lines of the cache: bricks."""
        return bool(self.values[name].dtype == np.int16)

    def definition(self, name: str) -> str:
        """Return the definition of an array, without storage class."""
        return f"{self.declaration(name)} = {self._initializer(self.values[name])};\n"

    def size_in_bytes(self, name: str) -> int:
        """Return the size of an array in the program [bytes]."""
        values = self.values[name]
        if self.has_lines(name):
            return int(values.nbytes)
        narrow = {c.FLOAT: self.single, c.INT: _fits_32_bits(values)}
        item_size = 4 if narrow.get(_element_type(values), True) else 8
        return int(values.size) * item_size

    def _initializer(self, values: NDArray[Any]) -> str:
        if values.size == 0:
            return "{" * values.ndim + "0" + "}" * values.ndim
        if values.ndim > 1:
            return "{\n" + ",\n".join(map(self._initializer, values)) + "\n}"
        kind = _element_type(values)
        if kind in {c.BOOL, c.INT}:
            texts = list(map(str, values.astype(int).tolist()))
        else:
            texts = real_literals(values, self.single or kind == c.SINGLE)
        return "{" + _wrap_lines(texts) + "}"

    def _c_type(self, value_type: ValueType) -> str:
        return c.c_scalar_type(value_type, "float" if self.single else "double")

    def _literal(self, value: Any, value_type: c.ScalarType) -> str:
        if value_type in {c.BOOL, c.INT}:
            return str(int(value))
        return real_literal(float(value), self.single or value_type == c.SINGLE)


# Lengths of the arrays of a field that a program loads, in its record: template field_data.c.
_LOADED_LENGTHS = {
    "c": ("{0}.count",),
    "columns": ("{0}.rows", "{0}.width", "4"),
    "bricks": ("{0}.brick_count", str(BRICK_ENTRIES)),
    "stretched_cells": ("{0}.stretched", "7"),
}


def make_program_data(
    surface: Surface, prefix: str, *, single: bool, loads_field: bool = False
) -> ProgramData:
    """Return the data of a surface.

    Raises:
        ParameterError: for a texture whose record holds values other than numbers and arrays.
    """
    arguments: Any = surface.texture.arguments
    values: dict[str, Any] = {}
    record_name = f"{prefix}_surface"
    if loads_field:
        texture = _constant_record(
            record_name, arguments._fields, arguments, prefix, {}, _LOADED_LENGTHS
        )
    else:
        texture = _constant_record(record_name, arguments._fields, arguments, prefix, values)
    names = parameter_names(surface.law, surface.contact_friction is not None)
    numbers = [float(value) for value in surface.loop_arguments]
    law = _constant_record(f"{prefix}_law", names, numbers, prefix, values)
    law = replace(law, read_macro=f"{prefix.upper()}_READ")
    return ProgramData(prefix, single, texture, law, values)


def _constant_record(
    c_name: str,
    names: Sequence[str],
    items: Sequence[Any],
    prefix: str,
    values: dict[str, Any],
    lengths: Mapping[str, tuple[str, ...]] = {},
) -> c.ConstantRecord:
    kinds: list[ValueType] = []
    for name, item in zip(names, items, strict=True):
        kind = _SCALAR_TYPES.get(np.asarray(item).dtype.name)
        if kind is None:
            reason = f"its record holds {name!r}, a {type(item).__name__}"
            raise ParameterError("texture", f"cannot be exported: {reason}")
        if isinstance(item, np.ndarray):
            array = f"{prefix}_data_{name}"
            if lengths:
                array = f"{c_name}.{name}"
            values[array] = item
            expressions = [text.format(c_name) for text in lengths.get(name, ())]
            kinds.append(c.ArrayType(item.shape, kind, array, tuple(expressions)))
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
    """Return numbers separated by commas, as many in each line as fit for the longest."""
    count = max(_WIDTH // (max(map(len, texts)) + 2), 1)
    lines = [", ".join(texts[first : first + count]) for first in range(0, len(texts), count)]
    return ",\n".join(lines)
