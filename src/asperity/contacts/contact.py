"""What a contact is: the point where a surface is felt, and what follows from it.

A contact has a depth and a point (X, Y, h(X, Y)) of the surface. A law is a formula in both; what
depends on the contact alone is asked of the contact, here and nowhere else.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

from asperity.contacts.sampler import sampled

if TYPE_CHECKING:  # a contact is named at once: NumPy is for who asks it for points
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from asperity.checks import FloatArray


class HeightField(Protocol):
    """What a contact asks of a texture: heights, their derivatives and extremes."""

    @property
    def extremes(self) -> tuple[float, float]:
        """Least and greatest height [m]."""

    def height(self, xy: FloatArray) -> FloatArray:
        """Heights [m], shape (n,), at points (n, 2) [m]."""

    def gradient(self, xy: FloatArray) -> FloatArray:
        """Slopes [1], shape (n, 2), at points (n, 2) [m]."""

    def nearest(self, points: ArrayLike) -> FloatArray:
        """Nearest surface points [m], shape (n, 3), of probes (n, 3) [m]."""


# h(x, y, m, n), the derivative of the height of order (m, n), in mpmath.
ExactHeight = Callable[[Any, Any, int, int], Any]


@dataclass(frozen=True)
class ContactDerivatives:
    """Derivatives of a contact by the probe position.

    Attributes:
        depth_gradient: ∇depth, shape (1, 3).
        point_derivative: ∂(X, Y)/∂p, shape (2, 3).
        definitions: names for parts of the above with their values, each in terms of the
            contact symbols and of the names before it; kept apart, because expanding the
            determinant of Q cancels digits near the medial axis.
    """

    depth_gradient: Any
    point_derivative: Any
    definitions: tuple[tuple[Any, Any], ...] = ()


class Contact(ABC):
    """The point where a surface is felt.

    What is a class variable says what a law on this contact may do, and what an analysis may rely
    on; the defaults are those of a contact that promises nothing.

    Attributes:
        name: one word.
        single_valued: whether the contact point depends continuously on the probe.
        above_probe: whether the contact point is straight above or below the probe, so that the
            probe at a given point and depth lies on a vertical line.
        begins_on_texture: whether contact begins at the textured surface.
        given_by_depth: whether point and depth determine the probe; not where the probe is pulled
            to the mean of several points.
        cost: how many heights of a map are found in the time that one contact point takes.
        clampable: whether a law on this contact may have its depth clamped.
        holds_anchor: whether a law on this contact may have state, an anchor that is held while
            there is contact.
        remembers: whether the point is found sooner where the last one is known; see
            :meth:`again_code`.
        looks: evaluations of the surface that a tick of a servo may take where it remembers; the
            time that it takes is in `make bench`.
        gap_is_force: whether what a search leaves open when its looks are used up bounds the error
            of the force over the stiffness; else it bounds how much nearer another point may be.
        parameters: names that a law on this contact must have among its own.
    """

    name: ClassVar[str]
    single_valued: ClassVar[bool] = False
    above_probe: ClassVar[bool] = False
    begins_on_texture: ClassVar[bool] = True
    given_by_depth: ClassVar[bool] = True
    cost: ClassVar[float] = 1000.0
    clampable: ClassVar[bool] = False
    holds_anchor: ClassVar[bool] = False
    remembers: ClassVar[bool] = False
    looks: ClassVar[float] = 1.0
    gap_is_force: ClassVar[bool] = False
    parameters: ClassVar[tuple[str, ...]] = ()

    def __str__(self) -> str:
        return self.name

    @property
    def costly(self) -> bool:
        """Whether finding the point takes a search."""
        return self.cost > 1.0

    @abstractmethod
    def derivatives(self) -> ContactDerivatives:
        """Return how depth and contact point move with the probe, as SymPy matrices."""

    def formula_symbols(self) -> tuple[Any, ...]:
        """Return the symbols of the contact that a law's force may use."""
        from asperity.contacts.symbols import DEPTH, HX, HY, H

        return (DEPTH, H, HX, HY)

    def toward(self) -> Any:
        """Return the vector from the probe to the contact point in the contact symbols [m]."""
        from asperity.contacts.symbols import DEPTH, unit_normal

        return DEPTH * unit_normal()

    def jacobian_part(self, force: Any) -> Any:
        """Return what the Jacobian gets from symbols that only this contact has, (3, 3)."""
        import sympy as sp

        return sp.zeros(force.shape[0], 3)

    def inward(self) -> Any:
        """Return the unit vector along which the probe moves as the depth alone grows, or None.

        In the contact symbols: the contact point stays where it is. ``None`` unless it is known.
        """
        return None

    def potential(self, force: Any) -> Any:
        """Return the potential energy [J] of a conservative force in contact, or None.

        The work against the force from where contact begins, along :meth:`inward`, in the contact
        symbols. ``None`` where it has no closed form.
        """
        import sympy as sp

        from asperity.contacts.symbols import DEPTH, POSITION

        inward = self.inward()
        if inward is None:
            return None
        push = sp.simplify(-(force.T * inward)[0])
        work = sp.integrate(push, (DEPTH, 0, DEPTH))
        return None if work.has(sp.Integral) or work.free_symbols & set(POSITION) else work

    def kernels(self) -> tuple[ModuleType, ...]:
        """Return the compiled modules that the contact brings; their loops go along.

        A texture kind may offer something better under the same name: it is asked first. Unless
        :meth:`begin_code` says otherwise one of them provides ``contact_point(x, y, z, texture)``,
        which returns depth, X and Y of a probe [m], the depth negative out of contact.
        """
        return ()

    def begin_code(self, wanted: frozenset[str]) -> tuple[list[str], str]:
        """Return how a compiled function finds whether its probe ``x, y, z`` is in contact.

        Args:
            wanted: names that must be known in contact, see :meth:`sample_code`.

        Returns:
            Lines of Python, and the condition that holds in contact.
        """
        return ["depth, contact_x, contact_y = contact_point(x, y, z, texture)"], "depth > 0.0"

    def sample_code(self, wanted: frozenset[str]) -> list[str]:
        """Return the lines of a compiled function after :meth:`begin_code`, in contact.

        Args:
            wanted: names that must be known after them: of the height and its derivatives at the
                contact point, ``h``, ``hx``, ..., ``hyy``, of the depth, ``depth``, and of other
                symbols that laws on this contact use.
        """
        return sampled(wanted, "contact_x, contact_y")

    def depth_code(self) -> list[str]:
        """Return the body of a compiled function: the depth of ``x, y, z``, 0 out of contact."""
        lines, condition = self.begin_code(frozenset())
        sampled_lines = self.sample_code(frozenset({"depth"}))
        return [*lines, f"if not {condition}:", "    return 0.0", *sampled_lines, "return depth"]

    def again_code(self, wanted: frozenset[str]) -> list[str]:
        """Return the lines of :meth:`sample_code` for a tick that follows on another.

        Those of a contact that ``remembers`` use and renew ``memory``, the array of
        :mod:`asperity.contacts.memory` as the last tick left it.
        """
        return self.sample_code(wanted)

    @abstractmethod
    def begin(self, texture: HeightField, xy: FloatArray) -> FloatArray:
        """Return the height z [m], (n,), below which there is contact at points (n, 2) [m]."""

    def extremes(self, texture: HeightField) -> tuple[float, float]:
        """Return the least and the greatest height at which contact begins [m]."""
        return texture.extremes

    @abstractmethod
    def depth(self, texture: HeightField, points: FloatArray) -> FloatArray:
        """Return the depths [m], (n,), of probes (n, 3) [m]; negative out of contact."""

    def inside(self, texture: HeightField, points: FloatArray) -> NDArray[np.bool_]:
        """Return which probes (n, 3) [m] are in contact: depth > 0, as in compiled kernels."""
        return self.depth(texture, points) > 0.0

    def column(self, texture: HeightField, point: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the line through a probe along which depth grows.

        Args:
            texture: the surface.
            point: a probe in contact [m], shape (3,).

        Returns:
            Where the line begins, at depth 0 [m], shape (3,), and its unit vector, shape (3,).
        """
        import numpy as np

        top = self.begin(texture, np.ascontiguousarray(point[None, :2]))[0]
        return np.array([point[0], point[1], top]), np.array([0.0, 0.0, -1.0])

    def exact_point(
        self, texture: HeightField, h: ExactHeight, p: list[Any]
    ) -> tuple[Any, ...] | None:
        """Return depth, X and Y [m] of a probe p in mpmath, from h(x, y, m, n), ∂ᵐ⁺ⁿh/∂xᵐ∂yⁿ.

        Nothing where the contact has no definition in many digits to test kernels against.
        """
        return None

    @abstractmethod
    def probe(self, xy: FloatArray, depth: FloatArray, derivatives: FloatArray) -> FloatArray:
        """Return the probe positions of contacts.

        Args:
            xy: contact points [m], shape (n, 2).
            depth: [m], shape (n,).
            derivatives: h, h_x, h_y, ... there in SI units, shape (n, 3) or more.

        Returns:
            Positions [m], shape (n, 3).
        """

    @abstractmethod
    def greatest_depth(self, height: float, derivatives: FloatArray) -> FloatArray:
        """Return the depths [m], (n,), at which probes of given contact points reach a height."""

    def margin(self, max_depth: float) -> float:
        """Return how far beside its probe a contact point may lie [m]."""
        return max_depth

    def coordinate_size(self, xy: FloatArray, height: float) -> float:
        """Return the size of the coordinates that the depth is a difference of [m]."""
        return float(abs(height) + abs(xy).max())
