"""The force of a surface as C functions, printed from what Numba compiles for it."""

from __future__ import annotations

from dataclasses import dataclass

from asperity.contacts.memory import SIZE
from asperity.export.data import Store, store_of
from asperity.export.energy import energy_units
from asperity.export.program import Linked, Program
from asperity.export.subset import BOOL, FLOAT, Kind, Work
from asperity.kernels.fuse import law_units, link_on_texture
from asperity.kernels.link import module_unit
from asperity.surface import Surface

# Names after the prefix that a program has besides its functions.
_PUBLIC = frozenset(("state", "reset", "force", "gap", "energy", "surface", "law"))


@dataclass(frozen=True)
class Functions:
    """The functions of a program.

    Attributes:
        code: their definitions, with the types that they use.
        tick: name of the function that returns force and anchor.
        tick_type: C type of what it returns.
        energy: name of the function that returns the energy; empty if there is none.
        store: the data.
    """

    code: str
    tick: str
    tick_type: str
    energy: str
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
    probe = next(unit for unit in law_units(law, clamp) if "probe_tick" in unit.texts)
    energy = energy_units(law, clamp)
    roots = [("probe_tick", probe), *[("probe_energy", unit) for unit in energy[:1]]]
    brought = [*map(module_unit, law.contact.kernels()), *energy]
    text = link_on_texture(law, surface.texture.sampler, clamp, roots, brought)
    program = Program(Linked(text), prefix, single=single, taken=_PUBLIC)
    store = store_of(surface, prefix, single=single)
    constants: tuple[Kind, Kind] = (store.texture, store.law)
    place = (FLOAT, FLOAT, FLOAT)
    kinds = (*place, FLOAT, FLOAT, BOOL, Work((SIZE,)), *constants)
    tick = program.function("probe_tick", kinds)
    tick_type = program.type_of(program.scope("probe_tick", kinds).result)
    stored = program.function("probe_energy", (*place, *constants)) if energy else ""
    code = "\n".join([*program.types, *program.helpers, *program.functions])
    return Functions(code, tick, tick_type, stored, store)
