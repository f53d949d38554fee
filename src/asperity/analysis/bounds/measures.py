"""What is measured of a Jacobian: its norm, its greatest symmetric eigenvalue, its curl.

All three are convex functions of the matrix and change by at most its change in the Frobenius
norm, the curl by √2 times it, so on a cell where the matrix is affine up to a known error they are
greatest at a corner.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from asperity.checks import FloatArray

Measure = Callable[[FloatArray], FloatArray]

# The closed form of an eigenvalue loses half the digits where the greatest two are nearly equal:
# arccos turns an error of 16 units near -1 into √(32 units), of which a third times √3 is left.
_QUICK_SLACK = 1e-7
_LAPACK_SLACK = 1e-14


def spectral_norm(matrices: FloatArray) -> FloatArray:
    """Return the largest singular values, shape (n,), of matrices (n, 3, 3)."""
    a, b, c = matrices[:, :, 0].T, matrices[:, :, 1].T, matrices[:, :, 2].T
    gram = (_dot(a, a), _dot(b, b), _dot(c, c), _dot(a, b), _dot(a, c), _dot(b, c))
    return np.sqrt(_largest_eigenvalue(*gram))


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    result: FloatArray = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return result


def one_sided(matrices: FloatArray) -> FloatArray:
    """Return λ_max of minus the symmetric part, shape (n,), of matrices (n, 3, 3)."""
    m = -matrices
    xy, xz, yz = (0.5 * (m[:, i, j] + m[:, j, i]) for i, j in ((0, 1), (0, 2), (1, 2)))
    return _largest_eigenvalue(m[:, 0, 0], m[:, 1, 1], m[:, 2, 2], xy, xz, yz)


def curl(matrices: FloatArray) -> FloatArray:
    """Return |curl f|, shape (n,), of Jacobians (n, 3, 3)."""
    m = matrices
    x, y, z = m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]
    return np.sqrt(x * x + y * y + z * z)


def _largest_eigenvalue(
    xx: FloatArray, yy: FloatArray, zz: FloatArray, xy: FloatArray, xz: FloatArray, yz: FloatArray
) -> FloatArray:
    """Closed form for symmetric 3 × 3 matrices (Smith 1961).

    Good to about 1e-14 of the norm, but for nearly equal greatest eigenvalues only to 1e-8.
    """
    centre = (xx + yy + zz) / 3.0
    x, y, z = xx - centre, yy - centre, zz - centre
    spread = np.sqrt((x * x + y * y + z * z + 2.0 * (xy * xy + xz * xz + yz * yz)) / 6.0)
    det = x * (y * z - yz * yz) - xy * (xy * z - yz * xz) + xz * (xy * yz - y * xz)
    cube = np.where(spread > 0.0, spread, 1.0) ** 3
    angle = np.arccos(np.clip(0.5 * det / cube, -1.0, 1.0)) / 3.0
    result: FloatArray = centre + 2.0 * spread * np.cos(angle)
    return result


def precise_norm(matrices: FloatArray) -> FloatArray:
    """Return the largest singular values by LAPACK, NaN for a matrix that is not finite."""
    return _of_finite(lambda m: np.asarray(np.linalg.svd(m, compute_uv=False)[..., 0]), matrices)


def precise_one_sided(matrices: FloatArray) -> FloatArray:
    """Return λ_max of minus the symmetric part by LAPACK, NaN where it is not finite."""
    symmetric = -0.5 * (matrices + np.swapaxes(matrices, -1, -2))
    return _of_finite(lambda m: np.asarray(np.linalg.eigvalsh(m)[..., -1]), symmetric)


def _of_finite(measure: Measure, matrices: FloatArray) -> FloatArray:
    """Return a measure of the matrices that are finite: LAPACK fails on any other."""
    finite = np.isfinite(matrices).all(axis=(-2, -1))
    if finite.all():
        return np.asarray(measure(matrices))
    result = np.full(finite.shape, np.nan)
    result[finite] = measure(matrices[finite])
    return result


@dataclass(frozen=True)
class Number:
    """A convex measure of J/k, with a quick and a careful way to compute it.

    Attributes:
        name: in words.
        quick: for many matrices; its error is at most ``quick_slack`` times the Frobenius norm.
        careful: by a backward stable method.
        quick_slack: see ``quick``.
        rate: the most that it changes per change of the matrix in the Frobenius norm.
    """

    name: str
    quick: Measure
    careful: Measure
    quick_slack: float
    rate: float = 1.0

    def at_most(self, c: FloatArray, g: FloatArray, e: FloatArray, above: float) -> FloatArray:
        """Return proved upper bounds over cells where the matrix is c + Σ g_i ξ_i ± e.

        Args:
            c: shape (n, 3, 3).
            g: shape (d, n, 3, 3).
            e: shape (n, 3, 3), not negative, entry by entry.
            above: cells that a rough bound leaves below this are not looked at more closely.
        """
        size, unknown = _frobenius(c), self.rate * _frobenius(e) * (1.0 + 1e-12)
        moved = np.sqrt(np.einsum("dnij,dnij->dn", g, g)).sum(axis=0)
        moved *= self.rate * (1.0 + 1e-12)
        slack = self.quick_slack * (size + moved)
        bound = self.quick(c) + moved + unknown + slack
        bound = np.where(np.isnan(bound), np.inf, bound)
        close = np.flatnonzero((bound > above) & np.isfinite(bound))
        best = _at_corners(self.quick, c[close], g[:, close]) + unknown[close]
        bound[close] = np.minimum(bound[close], best + slack[close])
        # Where only the error of the quick way decides, take the careful one.
        close = close[(best + slack[close] > above) & (best - slack[close] <= above)]
        best = _at_corners(self.careful, c[close], g[:, close]) + unknown[close]
        careful_slack = _LAPACK_SLACK * (size[close] + moved[close])
        bound[close] = np.minimum(bound[close], best + careful_slack)
        return np.asarray(bound)


def _at_corners(measure: Measure, c: FloatArray, g: FloatArray) -> FloatArray:
    """Return the greatest value at the corners of each cell."""
    best = np.full(len(c), -np.inf)
    for corner in range(2 ** len(g)):
        moved = c.copy()
        for axis, part in enumerate(g):
            moved += part if corner >> axis & 1 else -part
        best = np.maximum(best, measure(moved))
    # A number that overflows on the way is not known.
    return np.where(np.isnan(best), np.inf, best)


def _frobenius(matrices: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.einsum("nij,nij->n", matrices, matrices)))


NORM = Number("norm", spectral_norm, precise_norm, _QUICK_SLACK)
ONE_SIDED = Number("one-sided", one_sided, precise_one_sided, _QUICK_SLACK)
CURL = Number("curl", curl, curl, 4e-15, math.sqrt(2.0))
