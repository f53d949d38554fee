"""The loop over probe points that gives the potential of the split god-object."""

from asperity.checks import FloatArray
from asperity.compiled import Kernels
from asperity.contacts.sampler import height
from asperity.contacts.split.solver import split_energy

KERNELS = Kernels(requires=("height", "split_energy"), loops=("split_batch",))


def split_batch(points: FloatArray, out: FloatArray, continuity: float, texture: object) -> None:
    """Write potential/k [m²], number of atoms and gap [m²] (n, 3) at points (n, 3) [m]."""
    for i in range(points.shape[0]):
        x = points[i, 0]
        y = points[i, 1]
        z = points[i, 2]
        value = 0.0
        count = 0
        gap = 0.0
        if height(x, y, texture) > z:
            value, count, gap = split_energy(x, y, z, continuity, texture)
        out[i, 0] = value
        out[i, 1] = count
        out[i, 2] = gap
