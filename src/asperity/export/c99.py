"""C99: one header that holds everything, or a library of header, source and CMake file.

Maps that are small stand in the header as data, larger ones in a source beside it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources

from asperity.contacts.contact import Contact
from asperity.contacts.memory import BUDGET, GAP, SIZE, UNLIMITED
from asperity.content import surface_content
from asperity.errors import ParameterError
from asperity.export.expressions import real_literal
from asperity.export.functions import Functions, surface_functions
from asperity.export.order import Order
from asperity.export.program import block_comment

FARTHEST = 1000.0
"""Positions farther from the origin along an axis get no force [m]: cells could not be counted."""
IN_HEADER = 256 * 2**10
"""Bytes of data above which they stand in a source beside the header."""
_UNLIMITED = "\n * Its search has no limit of looks: not for the loop."


@lru_cache(maxsize=16)
def template(name: str) -> str:
    """Return a text of the folder ``templates``."""
    return resources.files("asperity.export").joinpath("templates", name).read_text("utf-8")


def filled(text: str, words: Mapping[str, str]) -> str:
    """Return a template with its words, such as ``@name@``, replaced.

    Example:
        >>> filled("void @name@_reset(void);", {"name": "texture"})
        'void texture_reset(void);'
    """
    return re.sub(r"@(\w+)@", lambda found: words[found[1]], text)


@dataclass(frozen=True)
class Parts:
    """The parts of a program.

    Attributes:
        words: for templates.
        arrays: definitions of arrays, without storage class.
        heads: their declarations, without storage class.
        records: definitions of constant records.
        functions: the functions that are not public.
    """

    words: dict[str, str]
    arrays: tuple[str, ...]
    heads: tuple[str, ...]
    records: tuple[str, ...]
    functions: Functions

    def file(self, name: str, link: str, data: str) -> str:
        """Return a template with words and code.

        Args:
            name: of the template.
            link: how the public functions are declared.
            data: definitions or declarations of the arrays.
        """
        energy = bool(self.functions.energy)
        contract, public = ["contract.h", "energy.h"], ["public.c", "energy.c"]
        words = self.words | {"link": link}
        words["guards"] = filled(template("guards.h"), words)
        words["contract"] = _joined(contract[: 1 + energy], words)
        public_code = _joined(public[: 1 + energy], words)
        words["inside"] = "\n".join([data, *self.records, self.functions.code, public_code])
        return filled(template(name), words)


def _joined(names: Sequence[str], words: Mapping[str, str]) -> str:
    return "".join(filled(template(name), words) for name in names)


def c99_files(order: Order, stem: str) -> dict[str, str]:
    """Return the files of a program, by name: the header first.

    Args:
        order: what is to be exported.
        stem: of the files' names.

    Raises:
        ParameterError: for what cannot be expressed in C, or would be too large.
    """
    functions = surface_functions(order.surface, order.name, single=order.single)
    store = functions.store
    places, records = store.used(functions.code)
    size = sum(store.size(place) for place in places)
    if size > order.largest:
        raise _too_large(order, functions, places, size)
    arrays = tuple(store.array(place) for place in places)
    heads = tuple(store.head(place) for place in places)
    parts = Parts(_words(order, functions, stem), arrays, heads, tuple(records), functions)
    if order.shared:
        return _library(parts, stem)
    return _header(parts, stem, apart=size > IN_HEADER)


def _words(order: Order, functions: Functions, stem: str) -> dict[str, str]:
    surface, single, law = order.surface, order.single, order.surface.law
    return {
        "name": order.name,
        "NAME": order.name.upper(),
        "stem": stem,
        "real": "float" if single else "double",
        "abs": "fabsf" if single else "fabs",
        "far": real_literal(FARTHEST, single),
        "tick": functions.tick,
        "tick_type": functions.tick_type,
        "memory": str(SIZE),
        "at_budget": str(BUDGET),
        "at_gap": str(GAP),
        "budget": real_literal(min(order.budget, UNLIMITED), single),
        "gap": _gap_words(law.contact),
        "unlimited": _UNLIMITED if law.contact.remembers else "",
        "energy": functions.energy,
        "stiffness": repr(surface.stiffness),
        "max_depth": repr(surface.max_depth),
        "q_upper": _bound(order.q_upper),
        "looks": _bound(order.budget),
        "content": surface_content(surface),
        "note": block_comment(order.note),
    }


def _gap_words(contact: Contact) -> str:
    """Return what the gap of a search says, for the comment of ``texture_gap``."""
    if not contact.remembers:
        return "0, this law does not search."
    if contact.gap_is_force:
        said = "the exact one differs by at most k times this."
    else:
        said = "no point of the surface is nearer by more."
    return f"{said}\n * 0 where the search came to its end within its looks."


def _bound(value: float) -> str:
    """Return a number as a constant of the contract."""
    return repr(value) if math.isfinite(value) else "HUGE_VAL"


def _header(parts: Parts, stem: str, *, apart: bool) -> dict[str, str]:
    """Return a header that holds everything, its arrays apart if they are large."""
    if not apart:
        data = "\n".join(f"static {array}" for array in parts.arrays)
        return {f"{stem}.h": parts.file("header.h", "static inline", data)}
    declared = "".join(f"extern {head};\n" for head in parts.heads)
    data = filled(template("extern.h"), parts.words | {"declared": declared})
    head = f"{parts.words['note']}#include <stdint.h>\n\n{declared}\n"
    return {
        f"{stem}.h": parts.file("header.h", "static inline", data),
        f"{stem}_data.c": head + "\n".join(parts.arrays),
    }


def _library(parts: Parts, stem: str) -> dict[str, str]:
    """Return header, source and CMake file of a library."""
    data = "\n".join(f"static {array}" for array in parts.arrays)
    names = {f"{stem}.h": "library.h", f"{stem}.c": "library.c", "CMakeLists.txt": "CMakeLists.txt"}
    link = f"{parts.words['NAME']}_API"
    return {file: parts.file(name, link, data) for file, name in names.items()}


def _too_large(
    order: Order, functions: Functions, places: Sequence[str], size: int
) -> ParameterError:
    """Return the error of a program that would be too large; it says what resolution fits."""
    store = functions.store
    # The heights are double; the tree that a search descends is not, and may be longer.
    arrays = [store.values[place] for place in places]
    doubles = [array for array in arrays if array.dtype.name == "float64"]
    shape = max(doubles or arrays, key=lambda array: array.size).shape
    flat = len(shape) > 1 and min(shape) > 4
    share = order.largest / size
    fits = [int(n * (math.sqrt(share) if flat else share)) for n in shape]
    points = " x ".join(str(max(n, 1)) for n in fits[: 2 if flat else 1])
    words = f"must be at least {size} bytes, the data of this surface; at most {points} points fit"
    return ParameterError("largest", f"{words}: crop it, or prepare it with fewer", order.largest)
