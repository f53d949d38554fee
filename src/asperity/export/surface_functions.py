"""C functions of the force and the potential energy of a surface."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from asperity.clamps import Clamp
from asperity.contacts.warm_start import WARM_START_SIZE
from asperity.derive.facts import clamped_facts
from asperity.export.c_language import BOOL, FLOAT, ArrayType, ValueType
from asperity.export.program import LinkedSource, Program
from asperity.export.program_data import ProgramData, make_program_data
from asperity.kernels.fuse import law_units, link_on_texture
from asperity.kernels.law_codegen import LawCode, energy_source
from asperity.kernels.link import SourceUnit, generated_unit, unit_from_module
from asperity.laws import Law
from asperity.surface import Surface


@lru_cache(maxsize=64)
def energy_units(law: Law, clamp: Clamp) -> tuple[SourceUnit, ...]:
    """Return the energy functions of a law, ``probe_energy`` first; none without a potential.

    Args:
        law: the law.
        clamp: the depth clamp. One that holds a part of the force has no potential.

    Example:
        >>> from asperity.clamps import BACKED
        >>> from asperity.laws import find_law
        >>> [len(energy_units(find_law(letter), BACKED)) for letter in "BCDH"]
        [0, 2, 2, 2]
    """
    from asperity.contacts.symbols import DEPTH
    from asperity.derive.jacobian import derive
    from asperity.derive.python_source import function_source

    facts = clamped_facts(law, clamp)
    conservative = facts.conservative and facts.vanishes_at_contact and clamp.has_potential
    if law.stateful or not conservative:
        return ()
    derivation = derive(law)
    energy = law.contact.potential(derivation.force)
    if energy is None:
        return ()
    values = [energy, energy.diff(DEPTH)]
    source = function_source(derivation, "law_energy", values, "Energy [J], and by the depth [N].")
    plan = LawCode(law, source, clamp)
    return (
        generated_unit(f"energy of law {law} at a probe", energy_source(plan)),
        generated_unit(f"energy of law {law}", source),
    )


# Further names of a program, after the prefix.
_RESERVED_NAMES = frozenset(("state", "reset", "force", "gap", "energy", "surface", "law"))


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


def surface_functions(surface: Surface, prefix: str, *, single: bool) -> SurfaceFunctions:
    """Return the C functions of a surface.

    Args:
        surface: the surface.
        prefix: prefix of all names.
        single: whether real numbers are of single precision.

    Raises:
        ParameterError: for a law or a texture that cannot be exported.
    """
    law, clamp = surface.law, surface.effective_clamp
    probe = next(unit for unit in law_units(law, clamp) if "probe_tick" in unit.sources)
    energy = energy_units(law, clamp)
    roots = [("probe_tick", probe), *[("probe_energy", unit) for unit in energy[:1]]]
    brought = [*map(unit_from_module, law.contact.kernels()), *energy]
    text = link_on_texture(law, surface.texture.sampler, clamp, roots, brought)
    program = Program(LinkedSource(text), prefix, single=single, reserved=_RESERVED_NAMES)
    store = make_program_data(surface, prefix, single=single)
    constants: tuple[ValueType, ValueType] = (store.texture, store.law)
    place = (FLOAT, FLOAT, FLOAT)
    kinds = (*place, FLOAT, FLOAT, BOOL, ArrayType((WARM_START_SIZE,)), *constants)
    tick = program.function_name("probe_tick", kinds)
    tick_type = program.c_type(program.infer_types("probe_tick", kinds).result_type)
    stored = program.function_name("probe_energy", (*place, *constants)) if energy else ""
    code = "\n".join([*program.types, *program.helpers, *program.functions])
    return SurfaceFunctions(code, tick, tick_type, stored, store)
