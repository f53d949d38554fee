"""What the split god-object of law H does at given points, and where a thin body gives way."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from asperity.checks import FloatArray, positive
from asperity.checks import points as read_points
from asperity.contacts.split.contact import SPLIT
from asperity.errors import ParameterError
from asperity.surface import Surface


@dataclass(frozen=True)
class SplitState:
    """The split god-object at n probe points.

    Attributes:
        potential: energy k U [J], shape (n,); zero outside the body.
        atoms: into how many points the god-object has split, shape (n,); zero outside.
        gap: energy [J] between primal and dual, shape (n,): the force is exact to
            √(2 (1 + c) k gap) [N].
    """

    potential: FloatArray
    atoms: NDArray[np.intp]
    gap: FloatArray

    def __repr__(self) -> str:
        most = int(np.max(self.atoms, initial=0))
        return f"<SplitState of {np.size(self.atoms)} points, into {most} points at most>"


def split_state(surface: Surface, points: ArrayLike) -> SplitState:
    """Return potential, number of atoms and certified gap of law H.

    U(p) = min over weights on the free set of ½ [|p - z̄|² + (1 - μ) Var w], μ = 1/(1 + c).

    Args:
        surface: a surface with a law on the split contact.
        points: probe positions [m], shape (n, 3), or (3,) for one, whose state is three numbers.

    Raises:
        ParameterError: for another law, another shape, or positions that are not finite.

    Reference:
        MATH section 6, item 2.

    Example:
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> steep = Surface(Sinusoid(amplitude=0.8e-3, period=1e-3), "H")
        >>> split_state(steep, [[0.25e-3, 0.0, 0.0], [0.0, 0.0, -1e-5]]).atoms.tolist()
        [2, 1]
    """
    _need_split(surface)
    probes = read_points("points", points, 3, "m")
    out = np.empty((probes.count, 3))
    surface._loops.split_batch(probes.rows, out, surface.continuity, surface.texture.arguments)
    potential, atoms, gap = out.T
    k = surface.stiffness
    return SplitState(
        potential=probes.answer(k * potential),
        atoms=probes.answer(atoms.astype(np.intp)),
        gap=probes.answer(k * gap),
    )


@dataclass(frozen=True)
class PopThrough:
    """What holds if the body ends at a flat underside.

    Law H knows a height function, a body without an end. The law of a plate would pull a probe
    that is deep enough out of the other side.

    Attributes:
        underside: z of the underside [m].
        depth: depth below the highest point of the surface [m] down to which the law is exactly
            that of the plate, (1 - μ) thickness/2; deeper the plate's law may pull downwards.
        barrier: energy [J] that it takes at least to push a probe through the plate with law H,
            (1 - μ) k t²/8 with t the least thickness.
        barrier_god_object: the same with law D, k t²/8.
        highest: z of the highest point of the surface [m].
    """

    underside: float
    depth: float
    barrier: float
    barrier_god_object: float
    highest: float

    def beyond(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Return which probes are so deep that the law is no longer certainly that of the plate.

        Args:
            points: probe positions [m], shape (n, 3), or (3,) for one.
        """
        probes = read_points("points", points, 3, "m")
        return probes.answer(np.asarray(probes.rows[:, 2] < self.highest - self.depth))


def pop_through(surface: Surface, thickness: float) -> PopThrough:
    """Return down to which depth law H is that of a plate with a flat underside.

    The nearest free point of y = p - (z̄ - p)/c is on the upper side as long as y is in the upper
    half, y_z >= (max h + underside)/2, and y_z >= p_z - (max h - p_z)/c. A plate contains the flat
    plate between min h and the underside, and its potential is not smaller; halfway through, that
    one's is (1 - μ) t²/8.

    Args:
        surface: a surface with law H.
        thickness: of the plate from the highest point of the surface to the underside [m]; more
            than the peak-to-valley height.

    Raises:
        ParameterError: for another law, or a thickness at which the plate has holes.

    Example:
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> surface = Surface(Sinusoid(amplitude=0.1e-3, period=1e-3), "H")
        >>> plate = pop_through(surface, 2e-3)
        >>> round(plate.depth * 1e3, 9), plate.beyond([[0, 0, -0.3e-3], [0, 0, -0.5e-3]]).tolist()
        (0.5, [False, True])
    """
    _need_split(surface)
    low, high = surface.texture.extremes
    total = positive("thickness", thickness, "m")
    least = total - (high - low)
    if not least > 0.0:
        limit = f"must be more than the peak-to-valley height, {high - low:.4g} m"
        raise ParameterError("thickness", limit, thickness)
    c = surface.parameter("continuity")
    share = c / (1.0 + c)
    energy = surface.stiffness * least**2 / 8.0
    return PopThrough(high - total, 0.5 * share * total, share * energy, energy, high)


def _need_split(surface: Surface) -> None:
    if surface.law.contact is not SPLIT:
        raise ParameterError("surface", f"must have a law on the split contact, not {surface.law}")
