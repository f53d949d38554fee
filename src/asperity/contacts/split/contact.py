"""The split contact: the mean z̄ of a god-object that has split into several surface points."""

from __future__ import annotations

from types import ModuleType
from typing import Any

from asperity.contacts.contact import ContactDerivatives, ExactHeight, HeightField
from asperity.contacts.nearest.contact import Nearest


class Split(Nearest):
    """The vector to the mean is all that a law gets; its derivative comes with it.

    Down to the fraction c/(1 + c) of the way to the medial axis the mean is the nearest point, so
    what holds for a foot holds there (MATH section 6, item 3).
    """

    name = "split"
    cost = 1000.0
    looks = 1800.0
    gap_is_force = True
    single_valued = True
    given_by_depth = False
    parameters = ("continuity",)

    def kernels(self) -> tuple[ModuleType, ...]:
        """The general solver; a texture kind may offer ``split_contact`` and the like itself."""
        from asperity.contacts.split import again, answers, conditions, solver

        return again, answers, solver, conditions, *super().kernels()

    def exact_point(
        self, texture: HeightField, h: ExactHeight, p: list[Any]
    ) -> tuple[Any, ...] | None:
        """None: its definition is a supremum over space; the theorems on it are tested instead."""
        return None

    def again_code(self, wanted: frozenset[str]) -> list[str]:
        """The vector to the mean, from the atoms of the last tick on."""
        return ["tx, ty, tz = split_again(x, y, z, continuity, memory, texture)"]

    def sample_code(self, wanted: frozenset[str]) -> list[str]:
        """The vector to the mean, with its derivative where that is wanted."""
        if "energy_tk" in wanted:
            return ["energy_tk, _count, _gap = split_energy(x, y, z, continuity, texture)"]
        if "mxx" in wanted:
            derivative = "tx, ty, tz, mxx, mxy, mxz, myy, myz, mzz"
            return [f"{derivative} = split_derivative(x, y, z, continuity, texture)"]
        return ["tx, ty, tz = split_contact(x, y, z, continuity, texture)"]

    def derivatives(self) -> ContactDerivatives:
        """Nothing by depth or point: see :meth:`jacobian_part`."""
        import sympy as sp

        return ContactDerivatives(sp.zeros(1, 3), sp.zeros(2, 3))

    def formula_symbols(self) -> tuple[Any, ...]:
        """The components of the vector from the probe to the mean."""
        from asperity.contacts.symbols import TOWARD

        return tuple(TOWARD)

    def potential(self, force: Any) -> Any:
        """Return k U of a force that is k times the vector to the mean."""
        import sympy as sp

        from asperity.contacts.symbols import TOWARD, TOWARD_ENERGY

        k = force[0].coeff(TOWARD[0])
        spring = k != 0 and not k.free_symbols & set(TOWARD)
        return k * TOWARD_ENERGY if spring and force == k * sp.Matrix(TOWARD) else None

    def toward(self) -> Any:
        """z̄ - p [m]."""
        import sympy as sp

        from asperity.contacts.symbols import TOWARD

        return sp.Matrix(TOWARD)

    def jacobian_part(self, force: Any) -> Any:
        """∂f/∂(z̄ - p) ∂(z̄ - p)/∂p."""
        from asperity.contacts.symbols import TOWARD, TOWARD_DERIVATIVE

        return force.jacobian(list(TOWARD)) * TOWARD_DERIVATIVE


SPLIT = Split()
