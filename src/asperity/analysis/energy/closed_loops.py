"""Closed loops on which a field gains energy: the worst one, and what absorbs it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from enum import Enum, auto
from typing import Literal

import numpy as np

from asperity.analysis.bounds.bound import scale_upper_bound
from asperity.core.checks import FloatArray, check_positive
from asperity.core.display import Text
from asperity.core.files import OMITTED, Serializable, written
from asperity.surface import Surface
from asperity.textures.texture import ScanLine

EnergyBalance = Literal["conservative", "dissipative", "leaking"]
"""Energy on closed paths: none, taken from the hand wherever an anchor slips, or also given."""


def energy_balance(surface: Surface) -> EnergyBalance:
    """Return whether closed paths in a surface take energy from the hand, or give it.

    With friction of constant presliding stiffness the hand gains nothing on any closed path that
    starts without deflection (docs/theory/friction.md).

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> surfaces = [Surface(Sinusoid(1e-4, 1e-3), law, friction=0.4) for law in "HA"]
        >>> [energy_balance(surface) for surface in surfaces]
        ['dissipative', 'leaking']
    """
    if not surface.facts.conservative:
        return "leaking"
    return "conservative" if surface.contact_friction is None else "dissipative"


class LoopKind(Enum):
    """What the worst loop is."""

    EVERY_LOOP = auto()
    """Every closed loop: a conservative law."""
    NO_GAIN = auto()
    """No evaluated loop gains energy."""
    CURL_BY_DEPTH = auto()
    """Around the region of one sign of the curl, down to a depth."""
    CURL_BY_DISTANCE = auto()
    """Around the region of one sign of the curl within a distance of the surface."""
    FRICTION_PATH = auto()
    """The paper's path of (27): along in light contact, back at depth."""
    IN_PLANE = auto()
    """In the plane at a depth, about an anchor that sticks."""
    TOO_STEEP = auto()
    """Unknown: the surface is too steep to integrate around a loop."""


@dataclass(frozen=True)
class LoopOrigin:
    """How the worst loop was found.

    Attributes:
        kind: what it is.
        depth: depth or distance that bounds it [m].
        starts: number of starting points of which it is the worst.
        deflection: distance along in light contact [m].
        lines: number of lines of which it is the worst.
        directions: number of directions of these lines.
    """

    kind: LoopKind
    depth: float = 0.0
    starts: int = 1
    deflection: float = 0.0
    lines: int = 1
    directions: int = 1


def polygon_length(vertices: FloatArray) -> float:
    """Return the length of a closed polygon (n, 3) [m]."""
    edges = vertices - np.roll(vertices, 1, axis=0)
    return float(np.linalg.norm(edges, axis=1).sum())


@dataclass(frozen=True)
class AbsorbingFriction(Serializable):
    """Dry friction of a device that absorbs what a field gains on closed paths, at every speed.

    Dry friction f_c takes f_c times the length of a path, whatever the speed. It ends the gain
    exactly from f_c* = sup W/length on, over all closed paths.

    Attributes:
        found: greatest W/length found [N], attained on ``vertices``: f_c* is at least that.
        upper: proved upper bound of f_c* [N]; infinite without proof.
        energy: W on that path [J].
        vertices: the path as a closed polygon (n, 3) [m]; empty if none gains energy.
        planes: number of vertical planes that were searched.
    """

    found: float
    upper: float
    energy: float
    vertices: FloatArray
    planes: int = 1

    @property
    @written
    def length(self) -> float:
        """Length of the path [m]."""
        return polygon_length(self.vertices)

    def scale(self, factor: float) -> AbsorbingFriction:
        """Return the friction for a field scaled by a factor; a bound is rounded up."""
        upper = scale_upper_bound(self.upper, factor)
        return replace(self, found=self.found * factor, upper=upper, energy=self.energy * factor)


NO_FRICTION = AbsorbingFriction(0.0, 0.0, 0.0, np.zeros((0, 3)))
"""That of a conservative field: none is needed."""


@dataclass(frozen=True)
class Leak(Serializable):
    """The worst simple loop, traversed once, in a vertical plane along a scan line.

    Its energy is the larger of ∬curl⁺ and ∬curl⁻ over the length of the line and the depth range,
    curl = ∂f_t/∂z - ∂f_z/∂t, t along the line. For a law with state loops in a plane of constant
    depth are evaluated too.

    Attributes:
        energy: work of the field on the probe around ``vertices`` [J]; 0 for a conservative law.
        upper_per_period: proved bound for every simple loop in that plane [J] within one period of
            the line, or within its length where it does not repeat; a loop around n periods may
            gain n times as much. Infinite without proof.
        line: the scan line of the plane.
        method: ``"theorem"`` (zero by proof), ``"certified"`` or ``"sampled"``.
        origin: how the loop was found.
        vertices: the loop as a closed polygon (n, 3) [m], empty if no loop gains energy;
            ``loop_work(surface, vertices)`` is ``energy``.
        thrust: mean tangential force on a straight scan along the line at the scan height [N],
            > 0 along it; ``None`` for a law with state, whose friction opposes the motion, and for
            a conservative law on a line that does not repeat.
        absorbing: dry friction of a device that absorbs the gain of every loop, with the loop of
            greatest energy per length.
        steady: for a law with state, the work in a turn once every turn is like the one before [J],
            the greatest of the evaluated loops and of paths that load the anchor on both sides of
            where they began; ``None`` without state.
    """

    energy: float
    upper_per_period: float
    line: ScanLine
    method: str
    origin: LoopOrigin = field(metadata=OMITTED)
    vertices: FloatArray
    thrust: float | None
    absorbing: AbsorbingFriction = NO_FRICTION
    steady: float | None = None
    description = Text[str]("The loop in words.")
    energy_text = Text[str](
        "The energy that it gains, per period or line length if that is proved.", is_written=False
    )

    def __repr__(self) -> str:
        upper = f"at most {self.upper_per_period:.4g} J per period"
        return f"<Leak: {self.energy:.4g} J per traversal, {upper}, {self.method}>"

    @property
    def worst_per_period(self) -> float:
        """``upper_per_period`` where one is proved, else ``energy`` [J]."""
        if math.isinf(self.upper_per_period):
            return self.energy
        return self.upper_per_period

    @property
    @written
    def length(self) -> float:
        """Length of the loop [m]."""
        return polygon_length(self.vertices)

    @property
    @written
    def per_length(self) -> float:
        """Energy over the length of the line [J/m]: a mean thrust [N]."""
        return self.energy / self.line.length

    def scale(self, factor: float) -> Leak:
        """Return the same loop in a field scaled by a factor; a bound is rounded up."""
        if factor == 1.0:
            return self
        return replace(
            self,
            energy=self.energy * factor,
            upper_per_period=scale_upper_bound(self.upper_per_period, factor),
            thrust=None if self.thrust is None else self.thrust * factor,
            absorbing=self.absorbing.scale(factor),
            steady=None if self.steady is None else self.steady * factor,
        )

    def critical_speed(self, damping: float) -> float:
        """Return v* = f_c*/σ₀ [m/s], the speed below which damping does not absorb every loop.

        Of the loop of greatest energy per length that was found, not of the loop of greatest
        energy.

        Args:
            damping: σ₀(B), the least damping of the device [N s/m].

        Raises:
            ParameterError: for a damping that is not positive.
        """
        return self.absorbing.found / check_positive("damping", damping, "N s/m")
