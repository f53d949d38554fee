"""The force of a surface as C functions, printed from what Numba compiles for it."""

from __future__ import annotations

from dataclasses import dataclass

from asperity.export.data import Store, store_of
from asperity.export.program import Linked, Program
from asperity.export.subset import BOOL, FLOAT, Kind
from asperity.kernels.fuse import law_units, link_on_texture
from asperity.kernels.link import Unit, module_unit
from asperity.surface import Surface

# Names after the prefix that the program has besides its functions.
_PUBLIC = frozenset(("state", "reset", "force", "energy", "surface", "law"))
_PROBE = (FLOAT, FLOAT, FLOAT)


@dataclass(frozen=True)
class Functions:
    """The functions of a program.

    Attributes:
        code: their definitions, with the types that they use.
        held: name of the function that returns force and anchor.
        held_type: C type of what it returns.
        store: the data.
    """

    code: str
    held: str
    held_type: str
    store: Store


def surface_functions(surface: Surface, prefix: str, *, single: bool) -> Functions:
    """Return the functions of a surface's force.

    Args:
        surface: the surface.
        prefix: of all names.
        single: whether real numbers are of single precision.

    Raises:
        ParameterError: for a law or a texture that cannot be expressed in C.
    """
    law, clamp = surface.law, surface.acting_clamp
    probe = next(unit for unit in law_units(law, clamp) if "probe_held" in unit.texts)
    roots: list[tuple[str, Unit]] = [("probe_held", probe)]
    brought = [module_unit(module) for module in law.contact.kernels()]
    text = link_on_texture(law, surface.texture.sampler, clamp, roots, brought)
    program = Program(Linked(text), prefix, single=single, taken=_PUBLIC)
    store = store_of(surface, prefix, single=single)
    constants: tuple[Kind, Kind] = (store.texture, store.law)
    kinds = (*_PROBE, FLOAT, FLOAT, BOOL, *constants)
    held = program.function("probe_held", kinds)
    held_type = program.type_of(program.scope("probe_held", kinds).result)
    code = "\n".join([*program.types, *program.helpers, *program.functions])
    return Functions(code, held, held_type, store)
