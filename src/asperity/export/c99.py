"""C99: one header that holds everything, or a library of header, source and CMake file.

Maps that are small stand in the header as data, larger ones in a source beside it.
"""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources

from asperity.errors import ParameterError
from asperity.export.expressions import real_literal
from asperity.export.functions import Functions, surface_functions
from asperity.export.order import Order
from asperity.export.program import block_comment

FARTHEST = 1000.0
"""Positions farther from the origin along an axis get no force [m]: cells could not be counted."""
IN_HEADER = 256 * 2**10
"""Bytes of data above which they stand in a source beside the header."""


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

    def public(self, link: str) -> str:
        """Return the definitions of the public functions."""
        words = self.words | {"link": link}
        energy = filled(template("energy.c"), words) if self.functions.energy else ""
        return filled(template("public.c"), words) + energy

    def inner(self) -> str:
        """Return records and functions."""
        return "\n".join([*self.records, self.functions.code])


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
    content = "\n".join([*arrays, parts.inner(), parts.public("")])
    # The same for every name.
    content = re.sub(rf"\b({order.name}|{order.name.upper()})_", "_", content)
    parts.words["content"] = hashlib.sha256(content.encode()).hexdigest()
    if order.shared:
        return _library(parts, stem)
    return _header(parts, stem, apart=size > IN_HEADER)


def _words(order: Order, functions: Functions, stem: str) -> dict[str, str]:
    surface, single = order.surface, order.single
    q = repr(order.q_upper) if math.isfinite(order.q_upper) else "HUGE_VAL"
    return {
        "name": order.name,
        "NAME": order.name.upper(),
        "stem": stem,
        "real": "float" if single else "double",
        "abs": "fabsf" if single else "fabs",
        "far": real_literal(FARTHEST, single),
        "held": functions.held,
        "held_type": functions.held_type,
        "energy": functions.energy,
        "stiffness": repr(surface.stiffness),
        "max_depth": repr(surface.max_depth),
        "q_upper": q,
        "note": block_comment(order.note),
    }


def _header(parts: Parts, stem: str, *, apart: bool) -> dict[str, str]:
    """Return a header that holds everything, its arrays apart if they are large."""
    words = dict(parts.words)
    storage = "static " if not apart else ""
    data = [f"{storage}{array}" for array in parts.arrays]
    if apart:
        declared = "".join(f"extern {head};\n" for head in parts.heads)
        source = f"{words['note']}#include <stdint.h>\n\n{declared}\n" + "\n".join(data)
        data = [filled(template("extern.h"), words | {"declared": declared})]
    inside = ["\n".join(data), parts.inner(), parts.public("static inline")]
    words["inside"] = "\n".join(inside)
    files = {f"{stem}.h": filled(template("header.h"), words)}
    return files | ({f"{stem}_data.c": source} if apart else {})


def _library(parts: Parts, stem: str) -> dict[str, str]:
    """Return header, source and CMake file of a library."""
    words = dict(parts.words)
    words["inside"] = "\n".join(
        [*[f"static {array}" for array in parts.arrays], parts.inner(), parts.public(_api(words))]
    )
    words["declared"] = filled(template("energy_declared.h"), words) if words["energy"] else ""
    return {
        f"{stem}.h": filled(template("library.h"), words),
        f"{stem}.c": filled(template("library.c"), words),
        "CMakeLists.txt": filled(template("CMakeLists.txt"), words),
    }


def _api(words: Mapping[str, str]) -> str:
    return f"{words['NAME']}_API"


def _too_large(
    order: Order, functions: Functions, places: Sequence[str], size: int
) -> ParameterError:
    """Return the error of a program that would be too large; it says what resolution fits."""
    store = functions.store
    shape = store.values[max(places, key=store.size)].shape
    heights = max((store.values[p].shape for p in places), key=lambda s: math.prod(s[:2]))
    flat = len(heights) > 1 and min(heights) > 4
    share = order.largest / size
    fits = [int(n * (math.sqrt(share) if flat else share)) for n in (heights if flat else shape)]
    points = " x ".join(str(max(n, 1)) for n in fits[: 2 if flat else 1])
    words = f"must be at least {size} bytes, the data of this surface; at most {points} points fit"
    return ParameterError("largest", f"{words}: crop it, or prepare it with fewer", order.largest)
