"""Export target C99: a header, or a library of header, source and CMake file, and their output.

The data of large maps are written to a source file beside the header.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from asperity.contacts.warm_start import BUDGET, ERROR_BOUND, UNLIMITED, WARM_START_SIZE
from asperity.core.errors import ParameterError, escape_unprintable, find_named
from asperity.core.files import check_not_existing, open_atomic
from asperity.export.c_language import fill_template, load_template
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
    if request.as_library or size <= MAX_HEADER_DATA:
        data = "\n".join([f"static {array}" for array in arrays])
        return _program_files(request, functions, values, "\n".join([data, *records]))
    declared = "".join([f"extern {store.declaration(place)};\n" for place in places])
    data = _render("extern.h", values | {"declared": declared})
    files = _program_files(request, functions, values, "\n".join([data, *records]))
    head = f"{values['note']}#include <stdint.h>\n\n{declared}\n"
    return {**files, f"{stem}_data.c": head + "\n".join(arrays)}


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
    contract = _render("contract.h", values)
    public = _render("public.c", values)
    if request.loads_field:
        contract += _render("field.h", values)
        public += _render("field.c", values)
    if functions.energy_name:
        contract += _render("energy.h", values)
        public += _render("energy.c", values)
    values |= {"contract": contract, "inside": "\n".join([data, functions.code, public])}
    values["guards"] = _render("guards.h", values)
    files = {"@stem@.h": "header.h"}
    if request.as_library:
        files = {
            "@stem@.h": "library.h",
            "@stem@.c": "library.c",
            "CMakeLists.txt": "CMakeLists.txt",
        }
    return {fill_template(file, values): _render(name, values) for file, name in files.items()}


def _substitutions(
    request: ExportRequest, functions: SurfaceFunctions, stem: str
) -> dict[str, str]:
    surface = request.surface
    single = request.is_single_precision
    q_upper = _bound_literal(request.q_upper)
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
        "max_evaluations": _bound_literal(request.evaluation_budget),
        "content": surface.digest,
        "note": block_comment(request.comment),
    }


def _bound_literal(value: float) -> str:
    """Return a number as a C constant."""
    return repr(value) if math.isfinite(value) else "HUGE_VAL"


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


@dataclass(frozen=True)
class ExportTarget:
    """A format to export to.

    Attributes:
        name: name of the target, such as ``c99``.
        description: short description.
        suffix: suffix of the main file, such as ``.h``.
        files: function of an export request and the stem of the file names that returns the texts
            of the files by name, the main file first.
    """

    name: str
    description: str
    suffix: str
    files: Callable[[ExportRequest, str], dict[str, str]]


TARGETS = {"c99": ExportTarget("c99", "a C header, or a C library", ".h", c99_files)}
"""Export targets by name."""


def find_target(name: str) -> ExportTarget:
    """Return an export target by its name.

    Raises:
        ParameterError: for an unknown name.
    """
    return find_named("lang", name.lower(), TARGETS)


def check_name(path: Path, target: ExportTarget) -> None:
    """Check that the file name has the suffix of the target.

    Raises:
        ParameterError: for another suffix, or a name that is not printable.
    """
    if path.suffix != target.suffix or not path.stem.isprintable() or '"' in path.stem:
        requirement = f"must be a file that ends in {target.suffix}"
        raise ParameterError("output", requirement, escape_unprintable(path.name))


def write_files(
    path: str | os.PathLike[str], target: ExportTarget, request: ExportRequest, *, force: bool
) -> list[Path]:
    """Write all files of an exported program, or none, and return their paths.

    Args:
        path: the main file; further files are written to the same folder.
        target: the export target.
        request: the export request.
        force: whether to replace existing files.

    Raises:
        ParameterError: for a file that exists, or cannot be written.
    """
    place = Path(path)
    check_name(place, target)
    files = target.files(request, place.stem)
    for name in files:
        check_not_existing("output", place.parent / name, force=force)
    try:
        with ExitStack() as written:
            for name, text in files.items():
                stream = written.enter_context(open_atomic(place.parent / name))
                stream.write(text.encode())
                stream.flush()
    except OSError as error:
        raise ParameterError("output", f"cannot be written: {error.strerror}", str(path)) from None
    return [place.parent / name for name in files]
