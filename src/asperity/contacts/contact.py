"""Contacts: the point at which the probe touches a surface, and everything that follows from it.

A contact has a depth and a point (X, Y, h(X, Y)) of the surface. A law is a formula in both;
whatever depends on the contact alone is a method of the contact.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

from asperity.contacts.sampler_interface import sampler_call

if TYPE_CHECKING:  # contacts are imported at start-up, NumPy only where points are evaluated
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from asperity.core.checks import FloatArray


class HeightField(Protocol):
    """The part of a texture that a contact uses: heights, their derivatives and extremes."""

    @property
    def extremes(self) -> tuple[float, float]:
        """Least and greatest height [m]."""

    def height(self, xy: FloatArray) -> FloatArray:
        """Heights [m], shape (n,), at points (n, 2) [m]."""

    def gradient(self, xy: FloatArray) -> FloatArray:
        """Slopes [1], shape (n, 2), at points (n, 2) [m]."""

    def nearest(self, points: ArrayLike) -> FloatArray:
        """Closest surface points [m], shape (n, 3), of probes (n, 3) [m]."""


def parameter_name(name: str) -> str:
    """Return the name of a law's parameter in compiled code, where no other name begins so."""
    return f"param_{name}"


# h(x, y, m, n), the derivative of the height of order (m, n), in mpmath.
ExactHeight = Callable[[Any, Any, int, int], Any]


@dataclass(frozen=True)
class ContactDerivatives:
    """Derivatives of a contact by the probe position.

    Attributes:
        depth_gradient: ∇depth, shape (1, 3).
        point_derivative: ∂(X, Y)/∂p, shape (2, 3).
        definitions: names of common subexpressions with their values, each in terms of the contact
            symbols and the names before it. They are not expanded, because expanding the
            determinant of Q cancels digits near the medial axis.
    """

    depth_gradient: Any
    point_derivative: Any
    definitions: tuple[tuple[Any, Any], ...] = ()


class Contact(ABC):
    """The point at which the probe touches a surface.

    The class variables state what a law on this contact may do and what an analysis may rely on;
    the defaults hold for every contact.

    Attributes:
        name: one word.
        single_valued: whether the contact point depends continuously on the probe.
        is_above_probe: whether the contact point is straight above or below the probe, so that the
            probe at a given point and depth lies on a vertical line.
        begins_on_texture: whether contact begins at the textured surface.
        is_determined_by_depth: whether point and depth determine the probe position; false where
            the probe is pulled to the mean of several points.
        relative_cost: time to find one contact point over the time of one height of a map.
        clampable: whether a law on this contact may have its depth clamped.
        supports_state: whether a law on this contact may have state: an anchor that is held during
            contact.
        has_warm_start: whether the search can start from the last contact point; see
            :meth:`warm_start_code`.
        max_evaluations: evaluations of the surface that a servo tick may take in a warm-started
            search; `make bench` measures their time.
        bounds_force_error: whether the error bound of a truncated search bounds the error of the
            force over the stiffness; else it bounds how much nearer another point may be.
        has_potential_field: whether a law on this contact may be rendered as a baked potential
            field.
        parameters: names of parameters that every law on this contact must declare.
        height_names: names of :meth:`sampling_code` in ``height_expression``.
        height_expression: height of the contact point in compiled code [m].
    """

    name: ClassVar[str]
    single_valued: ClassVar[bool] = False
    is_above_probe: ClassVar[bool] = False
    begins_on_texture: ClassVar[bool] = True
    is_determined_by_depth: ClassVar[bool] = True
    relative_cost: ClassVar[float] = 1000.0
    clampable: ClassVar[bool] = False
    supports_state: ClassVar[bool] = False
    has_warm_start: ClassVar[bool] = False
    max_evaluations: ClassVar[float] = 1.0
    bounds_force_error: ClassVar[bool] = False
    has_potential_field: ClassVar[bool] = False
    parameters: ClassVar[tuple[str, ...]] = ()
    height_names: ClassVar[frozenset[str]] = frozenset({"h"})
    height_expression: ClassVar[str] = "h"

    def __str__(self) -> str:
        return self.name

    @property
    def requires_search(self) -> bool:
        """Whether finding the point takes a search."""
        return self.relative_cost > 1.0

    @abstractmethod
    def derivatives(self) -> ContactDerivatives:
        """Return the derivatives of depth and contact point, as SymPy matrices."""

    def formula_symbols(self) -> tuple[Any, ...]:
        """Return the symbols of the contact that a law's force may use."""
        from asperity.contacts.symbols import DEPTH, HX, HY, H

        return (DEPTH, H, HX, HY)

    def contact_vector(self) -> Any:
        """Return the vector from the probe to the contact point in the contact symbols [m]."""
        from asperity.contacts.symbols import DEPTH, unit_normal

        return DEPTH * unit_normal()

    def jacobian_contribution(self, force: Any) -> Any:
        """Return the terms of the Jacobian that are specific to this contact, shape (3, 3)."""
        import sympy as sp

        return sp.zeros(force.shape[0], 3)

    def inward_direction(self) -> Any:
        """Return the unit direction in which the probe moves as the depth alone grows.

        In the contact symbols, at a fixed contact point; ``None`` if it has no closed form.
        """
        return None

    def potential(self, force: Any) -> Any:
        """Return the potential energy [J] of a conservative force in contact.

        This is the work against the force from the onset of contact along
        :meth:`inward_direction`, in the contact symbols; ``None`` if it has no closed form.
        """
        import sympy as sp

        from asperity.contacts.symbols import DEPTH, POSITION

        inward = self.inward_direction()
        if inward is None:
            return None
        push = sp.simplify(-(force.T * inward)[0])
        work = sp.integrate(push, (DEPTH, 0, DEPTH))
        return None if work.has(sp.Integral) or work.free_symbols & set(POSITION) else work

    def kernels(self) -> tuple[ModuleType, ...]:
        """Return the compiled modules of the contact; their loops are compiled, too.

        A function of the same name that a texture kind provides takes precedence. Unless
        :meth:`detection_code` is overridden, one of them provides ``contact_point(x, y, z,
        texture)``, which returns depth, X and Y [m]; the depth is negative out of contact.
        """
        return ()

    def detection_code(self, needed: frozenset[str]) -> tuple[list[str], str]:
        """Return the code by which a compiled function detects contact of its probe ``x, y, z``.

        Args:
            needed: names that must be defined in contact; see :meth:`sampling_code`.

        Returns:
            Lines of Python, and the condition that holds in contact.
        """
        return ["depth, contact_x, contact_y = contact_point(x, y, z, texture)"], "depth > 0.0"

    def sampling_code(self, needed: frozenset[str]) -> list[str]:
        """Return the lines of a compiled function after :meth:`detection_code`, in contact.

        Args:
            needed: names that must be defined after them: the height and its derivatives at the
                contact point, ``h``, ``hx``, ..., ``hyy``, the depth, ``depth``, and other
                symbols of laws on this contact. A parameter is called :func:`parameter_name`.
        """
        return sampler_call(needed, "contact_x, contact_y")

    def depth_code(self) -> list[str]:
        """Return the body of a compiled function: the depth of ``x, y, z``, 0 out of contact."""
        lines, condition = self.detection_code(frozenset())
        sampled_lines = self.sampling_code(frozenset({"depth"}))
        return [*lines, f"if not {condition}:", "    return 0.0", *sampled_lines, "return depth"]

    def warm_start_code(self, needed: frozenset[str]) -> list[str]:
        """Return the lines of :meth:`sampling_code` for a tick that follows another.

        A contact with ``has_warm_start`` reads and updates ``warm_start``, the array of
        :mod:`asperity.contacts.warm_start`, as the last tick left it.
        """
        return self.sampling_code(needed)

    @abstractmethod
    def contact_height(self, texture: HeightField, xy: FloatArray) -> FloatArray:
        """Return the height z [m], (n,), below which there is contact at points (n, 2) [m]."""

    def extremes(self, texture: HeightField) -> tuple[float, float]:
        """Return the least and the greatest height at which contact begins [m]."""
        return texture.extremes

    @abstractmethod
    def depth(self, texture: HeightField, points: FloatArray) -> FloatArray:
        """Return the depths [m], (n,), of probes (n, 3) [m]; negative out of contact."""

    def is_in_contact(self, texture: HeightField, points: FloatArray) -> NDArray[np.bool_]:
        """Return which probes (n, 3) [m] are in contact: depth > 0, as in compiled kernels."""
        return self.depth(texture, points) > 0.0

    def depth_axis(self, texture: HeightField, point: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the line through a probe along which depth grows.

        Args:
            texture: the surface.
            point: a probe in contact [m], shape (3,).

        Returns:
            The point of the line at depth 0 [m], shape (3,), and its unit vector, shape (3,).
        """
        import numpy as np

        top = self.contact_height(texture, np.ascontiguousarray(point[None, :2]))[0]
        return np.array([point[0], point[1], top]), np.array([0.0, 0.0, -1.0])

    def exact_contact(
        self, texture: HeightField, h: ExactHeight, p: list[Any]
    ) -> tuple[Any, ...] | None:
        """Return depth, X and Y [m] of a probe p in mpmath, from h(x, y, m, n) = ∂ᵐ⁺ⁿh/∂xᵐ∂yⁿ.

        ``None`` if the contact has no definition in arbitrary precision to test kernels against.
        """
        return None

    @abstractmethod
    def probe_positions(
        self, xy: FloatArray, depth: FloatArray, derivatives: FloatArray
    ) -> FloatArray:
        """Return the probe positions of contacts.

        Args:
            xy: contact points [m], shape (n, 2).
            depth: [m], shape (n,).
            derivatives: h, h_x, h_y, ... there in SI units, shape (n, 3) or more.

        Returns:
            Positions [m], shape (n, 3).
        """

    @abstractmethod
    def depth_at_height(self, height: float, derivatives: FloatArray) -> FloatArray:
        """Return the depths [m], (n,), at which probes of given contact points reach a height."""

    def lateral_reach(self, max_depth: float) -> float:
        """Return the greatest lateral distance of a contact point from its probe [m]."""
        return max_depth

    def coordinate_scale(self, xy: FloatArray, height: float) -> float:
        """Return the size of the coordinates that the depth is a difference of [m]."""
        return float(abs(height) + abs(xy).max())
