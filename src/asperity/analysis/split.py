"""What the split god-object of law H does at given points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from asperity.checks import FloatArray, array
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


def split_state(surface: Surface, points: ArrayLike) -> SplitState:
    """Return potential, number of atoms and certified gap of law H.

    U(p) = min over weights on the free set of ½ [|p - z̄|² + (1 - μ) Var w], μ = 1/(1 + c).

    Args:
        surface: a surface with a law on the split contact.
        points: probe positions [m], shape (n, 3).

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
    if surface.law.contact != "split":
        raise ParameterError("surface", f"must have a law on the split contact, not {surface.law}")
    probes = array("points", points, (None, 3), "m")
    out = np.empty((len(probes), 3))
    surface._loops.split_batch(probes, out, surface.texture.arguments, surface.law_arguments)
    potential, atoms, gap = out.T
    k = surface.stiffness
    return SplitState(k * potential, atoms.astype(np.intp), k * gap)
