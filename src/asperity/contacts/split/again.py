"""The split god-object, tick after tick: the atoms of the last tick are where the search starts.

They move along with the probe by Newton's method on the conditions of optimality; one query at the
new y then shows that no point of the surface is nearer, so that the answer is the one that a search
from nothing finds. Where it is not, the search goes on from there.
"""

import math
from typing import Any

import numpy as np

from asperity.checks import FloatArray
from asperity.compiled import Kernels, local_array
from asperity.contacts.memory import BUDGET, FIRST, POINTS
from asperity.contacts.nearest.again import note_gap
from asperity.contacts.split.solver import split_atoms

KERNELS = Kernels(provides=("split_again",), requires=("note_gap", "split_atoms"), iterates=True)


def split_again(
    x: float, y: float, z: float, continuity: float, memory: FloatArray, texture: object
) -> tuple[float, float, float]:
    """Return z̄ - p, from the probe to the mean of the split god-object [m].

    The gap that is noted is that of this vector, √(2 (1 + c) gap); 0 where the budget was enough.
    """
    atoms = local_array((5, 4))
    p = local_array((3,))
    pull = local_array((3,))
    known: Any = np.int64(memory[POINTS])
    for i in range(known):
        for d in range(4):
            atoms[i, d] = memory[FIRST + 4 * i + d]
    count, gap, looks, short = split_atoms(
        x, y, z, continuity, known, memory[BUDGET], p, atoms, pull, texture
    )
    memory[POINTS] = count
    for i in range(count):
        for d in range(4):
            memory[FIRST + 4 * i + d] = atoms[i, d]
    error = math.sqrt(2.0 * (1.0 + continuity) * gap) if short else 0.0
    note_gap(memory, error, looks)
    return pull[0], pull[1], pull[2]
