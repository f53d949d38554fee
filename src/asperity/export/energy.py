"""The potential energy of a conservative law, derived from its symbols like its Jacobian."""

from __future__ import annotations

from functools import lru_cache

from asperity.derive.facts import clamped_facts
from asperity.kernels.link import Unit, written_unit
from asperity.kernels.probe import ClampName, ProbePlan, energy_source
from asperity.laws import Law


@lru_cache(maxsize=64)
def energy_units(law: Law, clamp: ClampName) -> tuple[Unit, ...]:
    """Return the functions of a law's energy, ``probe_energy`` first; none if it has no potential.

    Args:
        law: the law.
        clamp: the depth clamp. Under ``lateral`` no energy is given: it acts on a part of a force.

    Example:
        >>> from asperity.laws import find_law
        >>> [len(energy_units(find_law(letter), "backed")) for letter in "BCDH"]
        [0, 2, 2, 2]
    """
    from asperity.contacts.symbols import DEPTH
    from asperity.derive.jacobian import derive
    from asperity.derive.python_source import function_source

    facts = clamped_facts(law, clamp)
    if law.stateful or not (facts.conservative and facts.begins_at_zero) or clamp == "lateral":
        return ()
    derivation = derive(law)
    energy = law.contact.potential(derivation.force)
    if energy is None:
        return ()
    values = [energy, energy.diff(DEPTH)]
    source = function_source(derivation, "law_energy", values, "Energy [J], and by the depth [N].")
    plan = ProbePlan(law, source, clamp)
    return (
        written_unit(f"energy of law {law} at a probe", energy_source(plan)),
        written_unit(f"energy of law {law}", source),
    )
