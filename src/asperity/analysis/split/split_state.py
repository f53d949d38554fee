"""The split god-object of law H at given points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from asperity.contacts.split.split_contact import SPLIT
from asperity.core.checks import FloatArray, check_points
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
    if surface.law.contact is not SPLIT:
        raise ParameterError("surface", f"must have a law on the split contact, not {surface.law}")
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
