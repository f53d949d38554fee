"""The split contact: the mean z̄ of a god-object that has split into several surface points."""

from __future__ import annotations

from types import ModuleType
from typing import Any

from asperity.contacts.closest.closest_contact import NearestContact
from asperity.contacts.contact import ContactDerivatives, ExactHeight, HeightField


class SplitContact(NearestContact):
    """A law receives the vector to the mean and its derivative.

    Down to the fraction c/(1 + c) of the distance to the medial axis the mean is the closest point,
    and has its properties (docs/theory/split.md).
    """

    name = "split"
    relative_cost = 1000.0
    max_evaluations = 2800.0
    bounds_force_error = True
    single_valued = True
    is_determined_by_depth = False
    has_potential_field = True
    parameters = ("continuity",)

    def kernels(self) -> tuple[ModuleType, ...]:
        """Return the general solver; a texture kind may provide ``split_contact`` etc. itself."""
        from asperity.contacts.split import optimality, solver, split_evaluation

        return split_evaluation, solver, optimality, *super().kernels()

    def exact_contact(
        self, texture: HeightField, h: ExactHeight, p: list[Any]
    ) -> tuple[Any, ...] | None:
        """Return None: the definition is a supremum over space; its theorems are tested instead."""
        return None

    def warm_start_code(self, needed: frozenset[str]) -> list[str]:
        """Return the vector to the mean, computed from the atoms of the last tick."""
        return ["tx, ty, tz = split_contact_warm(x, y, z, param_continuity, warm_start, texture)"]

    def sampling_code(self, needed: frozenset[str]) -> list[str]:
        """Return the vector to the mean, with its derivative or energy if needed."""
        if "energy_tk" in needed:
            return ["energy_tk, _count, _gap = split_energy(x, y, z, param_continuity, texture)"]
        if "mxx" in needed:
            derivative = "tx, ty, tz, mxx, mxy, mxz, myy, myz, mzz"
            return [f"{derivative} = split_derivative(x, y, z, param_continuity, texture)"]
        return ["tx, ty, tz = split_contact(x, y, z, param_continuity, texture)"]

    def derivatives(self) -> ContactDerivatives:
        """Return zeros; see :meth:`jacobian_contribution`."""
        import sympy as sp

        return ContactDerivatives(sp.zeros(1, 3), sp.zeros(2, 3))

    def formula_symbols(self) -> tuple[Any, ...]:
        """Return the components of the vector from the probe to the mean."""
        from asperity.contacts.symbols import CONTACT_VECTOR

        return tuple(CONTACT_VECTOR)

    def potential(self, force: Any) -> Any:
        """Return k U of a force that is k times the vector to the mean."""
        import sympy as sp

        from asperity.contacts.symbols import CONTACT_ENERGY, CONTACT_VECTOR

        k = force[0].coeff(CONTACT_VECTOR[0])
        spring = k != 0 and not k.free_symbols & set(CONTACT_VECTOR)
        return k * CONTACT_ENERGY if spring and force == k * sp.Matrix(CONTACT_VECTOR) else None

    def contact_vector(self) -> Any:
        """Return z̄ - p [m]."""
        import sympy as sp

        from asperity.contacts.symbols import CONTACT_VECTOR

        return sp.Matrix(CONTACT_VECTOR)

    def jacobian_contribution(self, force: Any) -> Any:
        """Return ∂f/∂(z̄ - p) ∂(z̄ - p)/∂p."""
        from asperity.contacts.symbols import CONTACT_VECTOR, CONTACT_VECTOR_DERIVATIVE

        return force.jacobian(list(CONTACT_VECTOR)) * CONTACT_VECTOR_DERIVATIVE


SPLIT = SplitContact()
