"""Measures of a Jacobian: its norm, its greatest symmetric eigenvalue, its curl.

All three are convex functions of the matrix and change by at most its change in the Frobenius
norm, the curl by √2 times it, so on a cell where the matrix is affine up to a known error they are
greatest at a corner.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from asperity.core.checks import FloatArray

Measure = Callable[[FloatArray], FloatArray]

# The closed form of an eigenvalue loses half the digits where the greatest two are nearly equal:
# arccos turns an error of 16 units near -1 into √(32 units), of which a third times √3 remains.
_FAST_ERROR = 1e-7
_LAPACK_ERROR = 1e-14


def spectral_norm(matrices: FloatArray) -> FloatArray:
    """Return the largest singular values, shape (n,), of matrices (n, 3, 3)."""
    a, b, c = matrices[:, :, 0].T, matrices[:, :, 1].T, matrices[:, :, 2].T
    pairs = ((a, a), (b, b), (c, c), (a, b), (a, c), (b, c))
    return np.sqrt(_largest_eigenvalue(*(_dot_rows(x, y) for x, y in pairs)))


def _dot_rows(a: FloatArray, b: FloatArray) -> FloatArray:
    result: FloatArray = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return result


def one_sided(matrices: FloatArray) -> FloatArray:
    """Return λ_max of minus the symmetric part, shape (n,), of matrices (n, 3, 3)."""
    m = -matrices
    xy, xz, yz = (0.5 * (m[:, i, j] + m[:, j, i]) for i, j in ((0, 1), (0, 2), (1, 2)))
    return _largest_eigenvalue(m[:, 0, 0], m[:, 1, 1], m[:, 2, 2], xy, xz, yz)


def curl_norm(matrices: FloatArray) -> FloatArray:
    """Return |curl f|, shape (n,), of Jacobians (n, 3, 3)."""
    m = matrices
    x, y, z = m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]
    return np.sqrt(x * x + y * y + z * z)


def _largest_eigenvalue(
    xx: FloatArray, yy: FloatArray, zz: FloatArray, xy: FloatArray, xz: FloatArray, yz: FloatArray
) -> FloatArray:
    """Closed form for symmetric 3 × 3 matrices (Smith 1961).

    Accurate to about 1e-14 of the norm, but only to 1e-8 for nearly equal greatest eigenvalues.
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
    return _apply_to_finite(
        lambda m: np.asarray(np.linalg.svd(m, compute_uv=False)[..., 0]), matrices
    )


def precise_one_sided(matrices: FloatArray) -> FloatArray:
    """Return λ_max of minus the symmetric part by LAPACK, NaN where it is not finite."""
    symmetric = -0.5 * (matrices + np.swapaxes(matrices, -1, -2))
    return _apply_to_finite(lambda m: np.asarray(np.linalg.eigvalsh(m)[..., -1]), symmetric)


def _apply_to_finite(measure: Measure, matrices: FloatArray) -> FloatArray:
    """Return a measure of the matrices that are finite: LAPACK fails on any other."""
    finite = np.isfinite(matrices).all(axis=(-2, -1))
    if finite.all():
        return np.asarray(measure(matrices))
    result = np.full(finite.shape, np.nan)
    result[finite] = measure(matrices[finite])
    return result


@dataclass(frozen=True)
class JacobianMeasure:
    """A convex measure of J/k, with a fast and an accurate implementation.

    Attributes:
        name: name of the measure.
        fast: for many matrices; its error is at most ``fast_error`` times the Frobenius norm.
        accurate: by a backward stable method.
        fast_error: see ``fast``.
        lipschitz: Lipschitz constant with respect to the Frobenius norm.
    """

    name: str
    fast: Measure
    accurate: Measure
    fast_error: float
    lipschitz: float = 1.0

    def upper_bounds(
        self, c: FloatArray, g: FloatArray, e: FloatArray, threshold: float
    ) -> FloatArray:
        """Return proved upper bounds over cells where the matrix is c + Σ g_i ξ_i ± e.

        Args:
            c: shape (n, 3, 3).
            g: shape (d, n, 3, 3).
            e: shape (n, 3, 3), not negative, entry by entry.
            threshold: cells whose coarse bound is below this are not refined.
        """
        size, unknown = _frobenius_norms(c), self.lipschitz * _frobenius_norms(e) * (1.0 + 1e-12)
        moved = np.sqrt(np.einsum("dnij,dnij->dn", g, g)).sum(axis=0)
        moved *= self.lipschitz * (1.0 + 1e-12)
        slack = self.fast_error * (size + moved)
        bound = self.fast(c) + moved + unknown + slack
        bound = np.where(np.isnan(bound), np.inf, bound)
        close = np.flatnonzero((bound > threshold) & np.isfinite(bound))
        best = _max_at_corners(self.fast, c[close], g[:, close]) + unknown[close]
        bound[close] = np.minimum(bound[close], best + slack[close])
        # Where only the error of the fast measure decides, use the accurate one.
        close = close[(best + slack[close] > threshold) & (best - slack[close] <= threshold)]
        best = _max_at_corners(self.accurate, c[close], g[:, close]) + unknown[close]
        accurate_slack = _LAPACK_ERROR * (size[close] + moved[close])
        bound[close] = np.minimum(bound[close], best + accurate_slack)
        return np.asarray(bound)


def _max_at_corners(measure: Measure, c: FloatArray, g: FloatArray) -> FloatArray:
    """Return the greatest value at the corners of each cell."""
    best = np.full(len(c), -np.inf)
    for corner in range(2 ** len(g)):
        moved = c.copy()
        for axis, part in enumerate(g):
            moved += part if corner >> axis & 1 else -part
        best = np.maximum(best, measure(moved))
    # A value that overflows is unknown.
    return np.where(np.isnan(best), np.inf, best)


def _frobenius_norms(matrices: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.einsum("nij,nij->n", matrices, matrices)))


NORM = JacobianMeasure("norm", spectral_norm, precise_norm, _FAST_ERROR)
ONE_SIDED = JacobianMeasure("one-sided", one_sided, precise_one_sided, _FAST_ERROR)
CURL = JacobianMeasure("curl", curl_norm, curl_norm, 4e-15, math.sqrt(2.0))
