"""The friction of a surface: what acts beside the force of its law.

:class:`~asperity.surface.Surface` derives from it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from asperity.core.checks import FloatArray, Points
from asperity.core.display import Plottable
from asperity.core.errors import ParameterError
from asperity.derive.facts import LawFacts, law_facts
from asperity.kernels.fuse import energy_kernel_source
from asperity.laws import REGISTERED_LAWS, Law, check_parameters_apply
from asperity.laws.friction import (
    FLAT_SHARE,
    FRICTION,
    FRICTION_ARGUMENTS,
    TEXTURED_SHARE,
    Friction,
    friction_jacobian,
    make_friction,
)
from asperity.textures.texture import Texture

# Height above the texture [m] at which there is no contact.
_CLEARANCE = 1.0


def check_arguments_apply(requested: Mapping[str, Any], laws: Sequence[Law]) -> None:
    """Check that each requested argument of a law, or of friction, acts on one of the laws.

    Raises:
        ParameterError: otherwise; the message names the laws that take the argument.
    """
    check_parameters_apply(requested, laws)
    for name in FRICTION_ARGUMENTS.keys() & requested.keys():
        taking = [law for law in laws if _takes(law, name)]
        if requested[name] and not taking:
            letters = ", ".join([law.letter for law in laws])
            takers = [law.letter for law in REGISTERED_LAWS.values() if _takes(law, name)]
            reason = f"law {letters} cannot have it, law {', '.join(takers)} can"
            raise ParameterError(name, f"has no effect: {reason}")


def _takes(law: Law, name: str) -> bool:
    return name in law.parameters or accepts_friction(law)


def accepts_friction(law: Law) -> bool:
    """Return whether a surface with a law may have friction: a potential, and no own state.

    Example:
        >>> [law.letter for law in REGISTERED_LAWS.values() if accepts_friction(law)]
        ['W', 'C', 'D', 'H']
    """
    is_field = law_facts(law).conservative and not law.stateful
    return is_field and bool(energy_kernel_source(law))


class Frictional(Plottable, ABC):
    """A surface whose law may be joined by friction."""

    texture: Texture
    law: Law
    stiffness: float
    max_depth: float
    law_parameters: Mapping[str, float]
    _explicit_parameters: Mapping[str, float]

    @property
    @abstractmethod
    def facts(self) -> LawFacts:
        """Symbolic facts about the clamped law."""

    @property
    @abstractmethod
    def depends_on_texture(self) -> bool:
        """Whether the force depends on the texture."""

    @property
    @abstractmethod
    def law_arguments(self) -> tuple[float, ...]:
        """Arguments of the law's kernels."""

    @abstractmethod
    def _replace(self, **values: Any) -> Self:
        """Return a copy with other values."""

    @abstractmethod
    def trace(self, path: ArrayLike, warm_start: FloatArray | None = None) -> FloatArray:
        """Return the forces along a path."""

    @abstractmethod
    def force_and_jacobian(
        self, points: ArrayLike, deflection: Any = None, sliding: Any = None
    ) -> tuple[FloatArray, FloatArray]:
        """Return forces and Jacobians."""

    @property
    def friction(self) -> float:
        """μ [1] of the surface, or of law F."""
        if "friction" in self.law_parameters:
            return self.law_parameters["friction"]
        return 0.0 if self.contact_friction is None else self.contact_friction.coefficient

    @cached_property
    def contact_friction(self) -> Friction | None:
        """Friction of the surface; ``None`` without friction, and for law F."""
        parameters = self._explicit_parameters
        if not parameters.get("friction") or "friction" in self.law.parameters:
            return None
        if not (self.facts.conservative and accepts_friction(self.law)):
            return None
        share = TEXTURED_SHARE if self.depends_on_texture else FLAT_SHARE
        return make_friction(parameters, self.stiffness, share, in_space=self.texture.is_body)

    @property
    def friction_values(self) -> dict[str, float]:
        """Arguments of the friction that acts, by name; κ only where it is given."""
        if self.contact_friction is None:
            return {}
        parameters = self._explicit_parameters
        return {name: parameters[name] for name in FRICTION_ARGUMENTS if name in parameters}

    def without_friction(self) -> Self:
        """Return a copy without friction, whose force is that of the law alone."""
        parameters = self._explicit_parameters.items()
        rest = {name: value for name, value in parameters if name not in FRICTION_ARGUMENTS}
        return self._replace(_explicit_parameters=rest)

    def to_friction(self, friction: float) -> Self:
        """Return a copy with another friction coefficient μ [1]; 0 is without friction.

        It is that of the surface, or of law F. A law that cannot have friction keeps it for the
        next law.
        """
        if not friction and "friction" not in self.law.parameters:
            return self.without_friction()
        values = {FRICTION.name: FRICTION.validate(friction)}
        result = self._replace(_explicit_parameters={**self._explicit_parameters, **values})
        result._check_friction()
        return result

    def _check_friction(self) -> None:
        """Check the friction that was given; on a law with curl it has no effect."""
        parameters = self._explicit_parameters
        for name in FRICTION_ARGUMENTS.keys() & parameters.keys():
            if self.law.stateful and name not in self.law.parameters:
                reason = f"cannot be used with law {self.law}, which has state of its own"
                raise ParameterError(name, reason, parameters[name])
        friction = self.contact_friction
        if friction is not None and friction.modulation and self.texture.is_body:
            raise ParameterError(
                "friction_modulation",
                "must be 0 on a closed body, whose height is no texture",
                friction.modulation,
            )

    @property
    def loop_arguments(self) -> tuple[float, ...]:
        """Arguments of the functions of a tick: those of the law, and of friction."""
        friction = self.contact_friction
        if friction is None:
            return self.law_arguments
        stiffness, *middle_and_half = self.law_arguments[:3]
        if friction.modulation:
            low, high = self.texture.extremes
            middle_and_half = [0.5 * (low + high), 0.5 * (high - low) or 1.0]
        return (stiffness, *middle_and_half, *self.law_arguments[3:], *friction.arguments)

    def _deflected_force(self, rows: FloatArray, deflections: FloatArray) -> FloatArray:
        """Return forces with friction (n, 3) [N]; a probe out of contact sets each anchor.

        In space a path of two points for each.
        """
        if deflections.shape[1] > 2:
            paths = np.stack([rows - deflections, rows], axis=1)
            return np.array([self.trace(path)[1] for path in paths]).reshape(-1, 3)
        path = np.repeat(rows, 2, axis=0)
        path[::2, :2] -= deflections
        path[::2, 2] = self.law.contact.extremes(self.texture)[1] + _CLEARANCE
        return self.trace(path)[1::2]

    def deflection_beyond_limit(self, friction: Friction, points: FloatArray) -> float:
        """Return a deflection [m] at which an anchor slides at all of points (n, 3).

        It is greater than μ k D/κ, with the greatest depth D that any contact may have there.
        """
        top = self.law.contact.extremes(self.texture)[1]
        depth = max(top - float(points[:, 2].min()), 0.0)
        limit = friction.coefficient * self.stiffness * depth / friction.presliding_stiffness
        return 2.0 * limit + self.max_depth

    def _with_friction(
        self,
        friction: Friction,
        probes: Points,
        deflection: ArrayLike | None,
        sliding: ArrayLike | None,
    ) -> tuple[FloatArray, FloatArray]:
        """Return forces and Jacobians of a surface with friction; see :func:`friction_jacobian`."""
        if friction.in_space:
            raise ParameterError("deflection", "has no Jacobian on a closed body: leave it out")
        flags = probes.check_flags_per_point("sliding", sliding)
        deflections = np.zeros((probes.count, 2))
        if deflection is not None:
            deflections = probes.check_array_per_point("deflection", deflection, 2, "m")
        law = self.without_friction()
        force, jacobian = law.force_and_jacobian(probes.rows)
        gradient = np.zeros((probes.count, 3))
        if flags.any():
            gradient = self._slip_limit_gradient(friction, probes.rows, force, jacobian)
        jacobian += friction_jacobian(friction.presliding_stiffness, deflections, flags, gradient)
        force = self._deflected_force(probes.rows, deflections)
        return probes.restore_shape(force), probes.restore_shape(jacobian)

    def _slip_limit_gradient(
        self, friction: Friction, rows: FloatArray, force: FloatArray, jacobian: FloatArray
    ) -> FloatArray:
        """Return the gradient of μ N (1 - a (1 + ĥ)/2) [N/m], (n, 3), from force and Jacobian."""
        plain = self._replace(
            _explicit_parameters={**self._explicit_parameters, "friction_modulation": 0.0}
        )
        shift = np.tile([self.deflection_beyond_limit(friction, rows), 0.0], (len(rows), 1))
        normal = (force - plain._deflected_force(rows, shift))[:, 0] / friction.coefficient
        contact = normal > 0.0
        slope = np.zeros_like(force)
        slope[contact] = -self.stiffness * force[contact] / normal[contact, None]
        if friction.modulation:
            height = rows[:, 2] + force[:, 2] / self.stiffness
            rise = jacobian[:, 2] / self.stiffness + np.array([0.0, 0.0, 1.0])
            if self.law.contact.is_above_probe:
                height, *slopes = self.texture.derivatives(rows[:, :2])[:, :3].T
                rise = np.column_stack([*slopes, np.zeros(len(rows))])
            _k, middle, half = self.loop_arguments[:3]
            relative = (height - middle) / half
            share = 1.0 - 0.5 * friction.modulation * (1.0 + relative)
            falling = 0.5 * friction.modulation * normal[:, None] * rise / half
            slope = share[:, None] * slope - falling
        return np.asarray(friction.coefficient * slope)
