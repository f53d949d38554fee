"""Export target C99: a header, or a library of header, source and CMake file.

The data of large maps are written to a source file beside the header.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources

from asperity.contacts.contact import Contact
from asperity.contacts.warm_start import BUDGET, ERROR_BOUND, UNLIMITED, WARM_START_SIZE
from asperity.core.errors import ParameterError
from asperity.export.export_request import ExportRequest
from asperity.export.expressions import real_literal
from asperity.export.program import block_comment
from asperity.export.surface_functions import SurfaceFunctions, surface_functions

MAX_POSITION = 1000.0
"""Limit of the coordinates [m]; the force is zero beyond, where cell indices would overflow."""
MAX_HEADER_DATA = 256 * 2**10
"""Size of the data [bytes] above which they are written to a source file."""
_UNLIMITED_COMMENT = "\n * The search has no limit of evaluations: not for a real-time loop."


@lru_cache(maxsize=16)
def load_template(name: str) -> str:
    """Return a file of the folder ``templates``."""
    return resources.files("asperity.export").joinpath("templates", name).read_text("utf-8")


def fill_template(text: str, values: Mapping[str, str]) -> str:
    """Return a template with its placeholders, such as ``@name@``, replaced.

    Example:
        >>> fill_template("void @name@_reset(void);", {"name": "texture"})
        'void texture_reset(void);'
    """
    return re.sub(r"@(\w+)@", lambda found: values[found[1]], text)


@dataclass(frozen=True)
class ProgramParts:
    """Parts of a program.

    Attributes:
        substitutions: values of the placeholders of the templates.
        array_definitions: definitions of the arrays, without storage class.
        array_declarations: declarations of the arrays, without storage class.
        record_definitions: definitions of the constant records.
        functions: the private functions.
    """

    substitutions: dict[str, str]
    array_definitions: tuple[str, ...]
    array_declarations: tuple[str, ...]
    record_definitions: tuple[str, ...]
    functions: SurfaceFunctions

    def render(self, name: str, linkage: str, data: str) -> str:
        """Return a template filled with the parts.

        Args:
            name: name of the template.
            linkage: storage class of the public functions.
            data: definitions or declarations of the arrays.
        """
        energy = bool(self.functions.energy_name)
        contract, public = ["contract.h", "energy.h"], ["public.c", "energy.c"]
        words = self.substitutions | {"link": linkage}
        words["guards"] = fill_template(load_template("guards.h"), words)
        words["contract"] = _fill_templates(contract[: 1 + energy], words)
        public_code = _fill_templates(public[: 1 + energy], words)
        words["inside"] = "\n".join(
            [data, *self.record_definitions, self.functions.code, public_code]
        )
        return fill_template(load_template(name), words)


def _fill_templates(names: Sequence[str], values: Mapping[str, str]) -> str:
    return "".join(fill_template(load_template(name), values) for name in names)


def c99_files(request: ExportRequest, stem: str) -> dict[str, str]:
    """Return the files of a program by name, the header first.

    Args:
        request: the export request.
        stem: stem of the file names.

    Raises:
        ParameterError: for a surface that cannot be exported, or would be too large.
    """
    functions = surface_functions(request.surface, request.name, single=request.is_single_precision)
    store = functions.data
    places, records = store.used_by(functions.code)
    size = sum(store.size_in_bytes(place) for place in places)
    if size > request.max_data_size:
        raise _size_error(request, functions, places, size)
    arrays = tuple(store.definition(place) for place in places)
    heads = tuple(store.declaration(place) for place in places)
    parts = ProgramParts(
        _substitutions(request, functions, stem), arrays, heads, tuple(records), functions
    )
    if request.as_library:
        return _library(parts, stem)
    return _header(parts, stem, separate_data=size > MAX_HEADER_DATA)


def _substitutions(
    request: ExportRequest, functions: SurfaceFunctions, stem: str
) -> dict[str, str]:
    surface, single, law = request.surface, request.is_single_precision, request.surface.law
    return {
        "name": request.name,
        "NAME": request.name.upper(),
        "stem": stem,
        "real": "float" if single else "double",
        "abs": "fabsf" if single else "fabs",
        "far": real_literal(MAX_POSITION, single),
        "tick": functions.tick_name,
        "tick_type": functions.tick_type,
        "memory": str(WARM_START_SIZE),
        "at_budget": str(BUDGET),
        "at_gap": str(ERROR_BOUND),
        "budget": real_literal(min(request.evaluation_budget, UNLIMITED), single),
        "gap": _gap_comment(law.contact),
        "unlimited": _UNLIMITED_COMMENT if law.contact.has_warm_start else "",
        "energy": functions.energy_name,
        "stiffness": repr(surface.stiffness),
        "max_depth": repr(surface.max_depth),
        "q_upper": _bound_literal(request.q_upper),
        "max_evaluations": _bound_literal(request.evaluation_budget),
        "content": surface.digest,
        "note": block_comment(request.comment),
    }


def _gap_comment(contact: Contact) -> str:
    """Return the meaning of the error bound for the comment of ``texture_gap``."""
    if not contact.has_warm_start:
        return "0, this law does not search."
    if contact.bounds_force_error:
        bound = "the exact force differs by at most k times this."
    else:
        bound = "no point of the surface is closer by more than this."
    return f"{bound}\n * 0 if the search converged within its limit of evaluations."


def _bound_literal(value: float) -> str:
    """Return a number as a C constant."""
    return repr(value) if math.isfinite(value) else "HUGE_VAL"


def _header(parts: ProgramParts, stem: str, *, separate_data: bool) -> dict[str, str]:
    """Return a header, with a source file for large arrays."""
    if not separate_data:
        data = "\n".join(f"static {array}" for array in parts.array_definitions)
        return {f"{stem}.h": parts.render("header.h", "static inline", data)}
    declared = "".join(f"extern {head};\n" for head in parts.array_declarations)
    data = fill_template(load_template("extern.h"), parts.substitutions | {"declared": declared})
    head = f"{parts.substitutions['note']}#include <stdint.h>\n\n{declared}\n"
    return {
        f"{stem}.h": parts.render("header.h", "static inline", data),
        f"{stem}_data.c": head + "\n".join(parts.array_definitions),
    }


def _library(parts: ProgramParts, stem: str) -> dict[str, str]:
    """Return header, source and CMake file of a library."""
    data = "\n".join(f"static {array}" for array in parts.array_definitions)
    names = {f"{stem}.h": "library.h", f"{stem}.c": "library.c", "CMakeLists.txt": "CMakeLists.txt"}
    link = f"{parts.substitutions['NAME']}_API"
    return {file: parts.render(name, link, data) for file, name in names.items()}


def _size_error(
    request: ExportRequest, functions: SurfaceFunctions, names: Sequence[str], size: int
) -> ParameterError:
    """Return the error of a program that would be too large, with the resolution that fits."""
    store = functions.data
    # Heights are double, in contrast to the search tree, which may be longer.
    arrays = [store.values[place] for place in names]
    doubles = [array for array in arrays if array.dtype.name == "float64"]
    shape = max(doubles or arrays, key=lambda array: array.size).shape
    flat = len(shape) > 1 and min(shape) > 4
    share = request.max_data_size / size
    fits = [int(n * (math.sqrt(share) if flat else share)) for n in shape]
    points = " x ".join(str(max(n, 1)) for n in fits[: 2 if flat else 1])
    words = f"must be at least {size} bytes, the data of this surface; at most {points} points fit"
    return ParameterError(
        "max_data", f"{words}: crop it, or prepare it with fewer", request.max_data_size
    )
