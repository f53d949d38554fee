"""The split god-object of law H at given points, and pop-through of thin plates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from asperity.contacts.split.split_contact import SPLIT
from asperity.core.checks import FloatArray, check_points, check_positive
from asperity.core.errors import ParameterError
from asperity.surface import Surface


@dataclass(frozen=True)
class SplitState:
    """The split god-object at n probe points.

    Attributes:
        potential: energy k U [J], shape (n,); zero outside the body.
        atoms: number of points of the split god-object, shape (n,); zero outside.
        gap: duality gap of the energy [J], shape (n,): the force is exact to
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
        points: probe positions [m], shape (n, 3), or (3,) for one, with scalar results.

    Raises:
        ParameterError: for another law, another shape, or positions that are not finite.

    Reference:
        docs/theory/split.md.

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> steep = Surface(Sinusoid(amplitude=0.8e-3, period=1e-3), "H")
        >>> split_state(steep, [[0.25e-3, 0.0, 0.0], [0.0, 0.0, -1e-5]]).atoms.tolist()
        [2, 1]
    """
    _require_split_contact(surface)
    probes = check_points("points", points, 3, "m")
    out = np.empty((probes.count, 3))
    surface._loops.split_batch(probes.rows, out, surface.continuity, surface.texture.arguments)
    potential, atoms, gap = out.T
    k = surface.stiffness
    return SplitState(
        potential=probes.restore_shape(k * potential),
        atoms=probes.restore_shape(atoms.astype(np.intp)),
        gap=probes.restore_shape(k * gap),
    )


@dataclass(frozen=True)
class PopThrough:
    """Validity of law H for a plate with a flat underside.

    Law H assumes a height function, a body without an underside. The law of a plate would pull a
    deep probe out of the other side.

    Attributes:
        underside: z of the underside [m].
        depth: depth below the highest point of the surface [m] down to which the law equals that
            of the plate, (1 - μ) thickness/2; deeper the plate's law may pull downwards.
        barrier: least energy [J] to push a probe through the plate with law H, (1 - μ) k t²/8 with
            t the least thickness.
        barrier_god_object: the same with law D, k t²/8.
        highest: z of the highest point of the surface [m].
    """

    underside: float
    depth: float
    barrier: float
    barrier_god_object: float
    highest: float

    def beyond(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Return which probes are so deep that the law may differ from that of the plate.

        Args:
            points: probe positions [m], shape (n, 3), or (3,) for one.
        """
        probes = check_points("points", points, 3, "m")
        return probes.restore_shape(np.asarray(probes.rows[:, 2] < self.highest - self.depth))


def pop_through(surface: Surface, thickness: float) -> PopThrough:
    """Return the depth down to which law H equals that of a plate with a flat underside.

    The nearest free point of y = p - (z̄ - p)/c is on the upper side as long as y is in the upper
    half, y_z >= (max h + underside)/2, and y_z >= p_z - (max h - p_z)/c. A plate contains the flat
    plate between min h and the underside, so its potential is not smaller; halfway through, that
    of the flat plate is (1 - μ) t²/8.

    Args:
        surface: a surface with law H.
        thickness: thickness of the plate from the highest point of the surface to the underside
            [m]; more than the peak-to-valley height.

    Raises:
        ParameterError: for another law, or a thickness at which the plate has holes.

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> surface = Surface(Sinusoid(amplitude=0.1e-3, period=1e-3), "H")
        >>> plate = pop_through(surface, 2e-3)
        >>> round(plate.depth * 1e3, 9), plate.beyond([[0, 0, -0.3e-3], [0, 0, -0.5e-3]]).tolist()
        (0.5, [False, True])
    """
    _require_split_contact(surface)
    low, high = surface.texture.extremes
    total = check_positive("thickness", thickness, "m")
    least = total - (high - low)
    if not least > 0.0:
        limit = f"must be more than the peak-to-valley height, {high - low:.4g} m"
        raise ParameterError("thickness", limit, thickness)
    c = surface.parameter("continuity")
    share = c / (1.0 + c)
    energy = surface.stiffness * least**2 / 8.0
    return PopThrough(high - total, 0.5 * share * total, share * energy, energy, high)


def _require_split_contact(surface: Surface) -> None:
    if surface.law.contact is not SPLIT:
        raise ParameterError("surface", f"must have a law on the split contact, not {surface.law}")
