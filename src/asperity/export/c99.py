"""Export target C99: a header, or a library of header, source and CMake file, and their output.

The data of large maps are written to a source file beside the header.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence

from asperity.contacts.warm_start import BUDGET, ERROR_BOUND, UNLIMITED, WARM_START_SIZE
from asperity.core.errors import ParameterError
from asperity.export.abi import ABI_VERSION, abi_values, bound_literal, linked_name
from asperity.export.c_language import REAL_FUNCTIONS, fill_template, load_template
from asperity.export.expressions import real_literal
from asperity.export.program import block_comment
from asperity.export.surface_functions import (
    ExportRequest,
    ProgramData,
    SurfaceFunctions,
    surface_functions,
)

MAX_POSITION = 1000.0
"""Limit of the coordinates [m]; the force is zero beyond, where cell indices would overflow."""
MAX_HEADER_DATA = 256 * 2**10
"""Size of the data [bytes] above which they are written to a source file."""


def c99_files(request: ExportRequest, stem: str) -> dict[str, str]:
    """Return the files of a program by name, the header first.

    Args:
        request: the export request.
        stem: stem of the file names.

    Raises:
        ParameterError: for a surface that cannot be exported, or would be too large.
    """
    functions = surface_functions(request)
    store = functions.data
    places, records = store.used_by(functions.code)
    size = sum(map(store.size_in_bytes, places))
    if size > request.max_data_size:
        raise _size_error(request, store, places, size)
    values = _substitutions(request, functions, stem)
    values["parts"] = "".join([f"{{{place}, sizeof {place}}}, " for place in places])
    if request.loads_field:
        values["parts"] = f"{{{request.name}_surface.file, {request.name}_surface.used}}, "
        records.insert(0, _render("field_data.c", values))
        return _program_files(request, functions, values, "\n".join(records))
    arrays = [store.definition(place) for place in places]
    lines = _render("lines.h", values) * any(map(store.has_lines, places))
    if request.as_library or size <= MAX_HEADER_DATA:
        data = lines + "\n".join([f"static {array}" for array in arrays])
        return _program_files(request, functions, values, "\n".join([data, *records]))
    declared = lines + "".join([f"extern {store.declaration(place)};\n" for place in places])
    data = _render("extern.h", values | {"declared": declared})
    files = _program_files(request, functions, values, "\n".join([data, *records]))
    head = f"{values['note']}#include <stdint.h>\n\n{declared}\n"
    return {**files, f"{stem}_data.c": head + "\n".join(arrays)}


def data_size(request: ExportRequest) -> int:
    """Return the size of the data of a program [bytes]."""
    functions = surface_functions(request)
    store = functions.data
    return sum(map(store.size_in_bytes, store.used_by(functions.code)[0]))


def _render(name: str, values: Mapping[str, str]) -> str:
    return fill_template(load_template(name), values)


def _program_files(
    request: ExportRequest, functions: SurfaceFunctions, values: Mapping[str, str], data: str
) -> dict[str, str]:
    """Return the header, or header, source and CMake file of a library.

    Args:
        request: the export request.
        functions: the private functions.
        values: values of the placeholders of the templates.
        data: definitions or declarations of the data.
    """
    values = {**values, "link": "static inline"}
    if request.as_library:
        values["link"] = f"{values['NAME']}_API"
    values |= {name: _render(f"{file}.h", values) for name, file in _PARTS.items()}
    contract = _render("contract.h", values)
    public = _render("public.c", values) + "\n" + _render("abi.c", values)
    if request.loads_field:
        contract += _render("field.h", values)
        public += _render("field.c", values)
    if functions.energy_name:
        contract += _render("energy.h", values)
        public += _render("energy.c", values)
    if request.as_library:
        public += f"\n{values['link']} const int {linked_name(request)} = {ABI_VERSION};\n"
    code = "\n".join([data, functions.code, public])
    values |= {"contract": contract, "inside": _with_builtins(code, values)}
    values["guards"] = _render("guards.h", values)
    files = {"@stem@.h": "header.h"}
    if request.as_library:
        files = {
            "@stem@.h": "library.h",
            "@stem@.c": "library.c",
            "CMakeLists.txt": "CMakeLists.txt",
        }
    return {fill_template(file, values): _render(name, values) for file, name in files.items()}


_PARTS = {"includes": "no_libc", "abi_header": "abi", "linked_header": "linked"}
"""Templates that stand in others, by the name of their placeholder."""
_FUNCTIONS = frozenset((*REAL_FUNCTIONS.values(), "floor", "fmod", "rint"))


def _with_builtins(code: str, values: Mapping[str, str]) -> str:
    """Return code whose mathematical functions are the compiler's own without a C library."""
    words = sorted(set(re.findall(r"\b([a-z]\w*)\(", code)))
    used = [word for word in words if word in _FUNCTIONS or word.removesuffix("f") in _FUNCTIONS]
    head = "".join([f"#define {word} __builtin_{word}\n" for word in used])
    tail = "".join([f"#undef {word}\n" for word in used])
    guard = f"#if defined({values['NAME']}_NO_LIBC)\n"
    return f"{_render('builtins.c', {**values, 'defined': head})}\n{code}{guard}{tail}#endif\n"


def _substitutions(
    request: ExportRequest, functions: SurfaceFunctions, stem: str
) -> dict[str, str]:
    surface = request.surface
    single = request.is_single_precision
    q_upper = bound_literal(request.q_upper)
    if request.loads_field:
        q_upper = f"{request.name}_q()"
    absolute = "fabs"
    if single:
        absolute = "fabsf"
    return {
        "name": request.name,
        "NAME": request.name.upper(),
        "stem": stem,
        "real": request.precision,
        "abs": absolute,
        "far": real_literal(MAX_POSITION, single),
        "tick": functions.tick_name,
        "tick_type": functions.tick_type,
        "memory": str(WARM_START_SIZE),
        "at_budget": str(BUDGET),
        "at_gap": str(ERROR_BOUND),
        "budget": real_literal(min(request.evaluation_budget, UNLIMITED), single),
        "energy": functions.energy_name,
        "stiffness": repr(surface.stiffness),
        "max_depth": repr(surface.max_depth),
        "q_upper": q_upper,
        "max_evaluations": bound_literal(request.evaluation_budget),
        "content": surface.digest,
        "note": block_comment(request.comment),
        **abi_values(request),
    }


def _size_error(
    request: ExportRequest, store: ProgramData, names: Sequence[str], size: int
) -> ParameterError:
    """Return the error of a program that would be too large, with the resolution that fits."""
    # Heights are double, in contrast to the search tree, which may be longer.
    arrays = [store.values[place] for place in names]
    doubles = [array for array in arrays if array.dtype.name == "float64"]
    shape = max(doubles or arrays, key=lambda array: array.size).shape
    share = request.max_data_size / size
    points = str(max(int(share * shape[0]), 1))
    if len(shape) > 1 and min(shape) > 4:
        side = math.sqrt(share)
        points = " x ".join([str(max(int(side * count), 1)) for count in shape[:2]])
    needed = f"must be at least {size} bytes, the data of this surface; at most {points} points fit"
    advice = "crop it, or prepare it with fewer; a field may be loaded"
    return ParameterError("max_data", f"{needed}: {advice}", request.max_data_size)
