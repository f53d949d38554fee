"""Measures of a Jacobian, their proved bounds, and the witnesses at which they are attained."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from asperity.analysis.bounds.branch_and_bound import DIFFERENCE_AMPLIFICATION, ROUNDING_ERROR
from asperity.core.checks import FloatArray
from asperity.core.display import Displayable
from asperity.core.errors import InternalError
from asperity.core.files import Serializable, written
from asperity.surface import Surface

Method = Literal["theorem", "closed form", "certified", "sampled"]


@dataclass(frozen=True)
class Bound(Serializable, Displayable):
    """A supremum between bounds.

    Attributes:
        lower: a value that is attained at ``at``.
        upper: a proved upper bound; infinity without proof.
        method: ``"theorem"``, ``"closed form"``, ``"certified"`` or ``"sampled"``.
        at: the probe position [m] that attains ``lower``, or approaches it from inside; for an
            infinite number the point where it first diverges; ``None`` if there is none.
        note: derivation of the number, in one sentence.
        deflection: deflection [m], shape (2,), of the anchor at ``at``; ``None`` for a law without
            state.
        sliding: whether that anchor slides.

    Example:
        >>> Bound(2.0, math.inf, "sampled", (0.0, 0.0, -1e-3)).value
        2.0
    """

    lower: float
    upper: float
    method: Method
    at: tuple[float, float, float] | None = None
    note: str = ""
    deflection: tuple[float, float] | None = None
    sliding: bool = False

    @property
    @written
    def value(self) -> float:
        """``upper`` where one is proved, else ``lower``."""
        if math.isinf(self.upper):
            return self.lower
        return self.upper

    def __float__(self) -> float:
        """Return :attr:`value`."""
        return self.value

    @property
    def gap(self) -> float:
        """Relative gap (upper - lower)/lower; zero where both are infinite."""
        if math.isinf(self.lower):
            return 0.0
        if self.lower <= 0.0:
            return math.inf
        return (self.upper - self.lower) / self.lower


def scale_upper_bound(bound: float, factor: float) -> float:
    """Return a proved upper bound times a factor; one unit in the last place covers rounding."""
    if bound <= 0.0:
        return 0.0
    return math.nextafter(factor * bound, math.inf)


# A witness is strictly inside: at depth zero there is no force.
_MIN_RELATIVE_DEPTH = 1e-9
_MIN_COORDINATE_DEPTH = 1e-14
_AGREEMENT = 1e-13


@dataclass(frozen=True)
class Witness:
    """A probe position and the measure of the Jacobian there.

    Attributes:
        value: measure of J/k [1].
        size: Frobenius norm of J/k [1].
        at: probe position [m].
        deflection: deflection of the anchor [m], for a law with state.
        sliding: whether the anchor slides.
    """

    value: float
    size: float
    at: tuple[float, float, float]
    deflection: tuple[float, float] | None = None
    sliding: bool = False


def probe_position(surface: Surface, xy: FloatArray, depth: float) -> FloatArray:
    """Return the probe position (3,) [m] in contact at a point of the plane, at a depth."""
    contact = surface.law.contact
    derivatives = surface.texture.derivatives(np.ascontiguousarray(xy[None]))
    # Deep enough that rounding of the position does not matter.
    size = contact.coordinate_scale(xy, float(derivatives[0, 0]))
    least = max(_MIN_RELATIVE_DEPTH * surface.max_depth, _MIN_COORDINATE_DEPTH * size)
    level = min(max(depth, least), surface.max_depth)
    if surface.effective_clamp.changes_force:
        # Slightly above the clamp, so that rounding does not decide on which side the probe is.
        level = min(level, (1.0 - _MIN_RELATIVE_DEPTH) * surface.max_depth)
    return np.asarray(contact.probe_positions(xy[None], np.array([level]), derivatives)[0])


def checked_upper_bound(
    surface: Surface, measure: JacobianMeasure, upper: float, witness: Witness
) -> float:
    """Return a proved bound, or the attained value where it exceeds the bound by rounding only.

    Raises:
        InternalError: if the witness contradicts the bound.
    """
    if not witness.value > upper:
        return upper
    allowed = _witness_rounding(surface, witness, upper) * max(witness.size, upper)
    if not witness.value <= upper + allowed:
        state = "" if witness.deflection is None else f", deflection {witness.deflection} m"
        raise InternalError(
            f"the {measure.name} of {surface!r} is proved to be at most {upper:.17g}, but "
            f"{witness.value:.17g} is attained at {witness.at} m{state}. No number of this surface "
            "can be trusted; please report it"
        )
    return witness.value


def _witness_rounding(surface: Surface, witness: Witness, upper: float) -> float:
    """Return the relative error of a witness.

    Rounded coordinates change the depth relative to its size, and J is sensitive to that by
    1/(1 - y) = 1 + y/(1 - y) <= 1 + q. The effect of rounded heights grows with their size.
    """
    xy = np.array(witness.at[:2])
    depth = surface.max_depth
    height = float(surface.texture.derivatives(xy[None])[0, 0])
    moved = surface.law.contact.coordinate_scale(xy, height) / depth * (1.0 + upper)
    return ROUNDING_ERROR * (DIFFERENCE_AMPLIFICATION * (1.0 + abs(height) / depth) + moved)


def witness_in_contact(
    surface: Surface,
    measure: JacobianMeasure,
    xy: FloatArray,
    depth: float,
    deflection: FloatArray | None = None,
    *,
    sliding: bool = False,
) -> Witness:
    """Return the witness of the surface's own Jacobian for a contact."""
    probe = probe_position(surface, xy, depth)
    if deflection is None:
        return _make_witness(measure, probe, surface.jacobian(probe[None]) / surface.stiffness)
    jacobian = surface.jacobian(probe[None], deflection[None], np.array([sliding]))
    witness = _make_witness(measure, probe, jacobian / surface.stiffness)
    x, y = deflection.tolist()
    return replace(witness, deflection=(x, y), sliding=sliding)


def witness_at_depth(
    surface: Surface, measure: JacobianMeasure, xy: FloatArray, depth: float
) -> Witness:
    """Return the witness of the surface's own Jacobian at a contact point and any depth [m]."""
    derivatives = surface.texture.derivatives(np.ascontiguousarray(xy[None]))
    probe = surface.law.contact.probe_positions(xy[None], np.array([depth]), derivatives)
    return _make_witness(measure, probe[0], surface.jacobian(probe) / surface.stiffness)


def _make_witness(measure: JacobianMeasure, probe: FloatArray, jacobian: FloatArray) -> Witness:
    """Return the witness of a probe position (3,) and J/k there, shape (1, 3, 3)."""
    x, y, z = probe.tolist()
    value = float(measure.accurate(jacobian)[0])
    return Witness(value, float(np.linalg.norm(jacobian)), (x, y, z))


def checked_lower_bound(
    surface: Surface, measure: JacobianMeasure, value: float, witness: Witness
) -> float:
    """Return the attained value of a number from a theorem, equal to it up to rounding.

    Raises:
        InternalError: if the witness contradicts the theorem.
    """
    checked_upper_bound(surface, measure, value, witness)
    if witness.value >= value * (1.0 - _AGREEMENT):
        return value
    return witness.value


def bound_from_theorem(
    surface: Surface,
    measure: JacobianMeasure,
    value: float,
    method: Method,
    note: str,
    xy: FloatArray,
    depths: Sequence[float],
) -> Bound:
    """Return a number from a theorem, with the best witness of several depths.

    Raises:
        InternalError: if the witness contradicts the theorem.
    """
    witnesses = [witness_in_contact(surface, measure, xy, depth) for depth in depths]
    best = max(witnesses, key=lambda witness: witness.value)
    return Bound(checked_lower_bound(surface, measure, value, best), value, method, best.at, note)


# --- measures of a Jacobian -----------------------------------------------------------------------
#
# All three are convex functions of the matrix and change by at most its change in the Frobenius
# norm, the curl by √2 times it, so on a cell where the matrix is affine up to a known error they
# are greatest at a corner.

Measure = Callable[[FloatArray], FloatArray]

# The closed form of an eigenvalue loses half the digits where the greatest two are nearly equal:
# arccos turns an error of 16 units near -1 into √(32 units), of which a third times √3 remains.
_FAST_ERROR = 1e-7
_LAPACK_ERROR = 1e-14
_LEAST_SPREAD = 1e-100  # its cube is a floating-point number


def spectral_norm(matrices: FloatArray) -> FloatArray:
    """Return the largest singular values, shape (n,), of matrices (n, 3, 3)."""
    a = matrices[:, :, 0].T
    b = matrices[:, :, 1].T
    c = matrices[:, :, 2].T
    pairs = ((a, a), (b, b), (c, c), (a, b), (a, c), (b, c))
    products = (x[0] * y[0] + x[1] * y[1] + x[2] * y[2] for x, y in pairs)
    return np.sqrt(_largest_eigenvalue(*products))


def one_sided(matrices: FloatArray) -> FloatArray:
    """Return λ_max of minus the symmetric part, shape (n,), of matrices (n, 3, 3)."""
    m = -matrices
    xy, xz, yz = (0.5 * (m[:, i, j] + m[:, j, i]) for i, j in ((0, 1), (0, 2), (1, 2)))
    return _largest_eigenvalue(m[:, 0, 0], m[:, 1, 1], m[:, 2, 2], xy, xz, yz)


def curl_norm(matrices: FloatArray) -> FloatArray:
    """Return |curl f|, shape (n,), of Jacobians (n, 3, 3)."""
    m = matrices
    x = m[:, 2, 1] - m[:, 1, 2]
    y = m[:, 0, 2] - m[:, 2, 0]
    z = m[:, 1, 0] - m[:, 0, 1]
    return np.sqrt(x * x + y * y + z * z)


def _largest_eigenvalue(
    xx: FloatArray, yy: FloatArray, zz: FloatArray, xy: FloatArray, xz: FloatArray, yz: FloatArray
) -> FloatArray:
    """Closed form for symmetric 3 × 3 matrices (Smith 1961).

    Accurate to about 1e-14 of the norm, but only to 1e-8 for nearly equal greatest eigenvalues.
    """
    centre = (xx + yy + zz) / 3.0
    x = xx - centre
    y = yy - centre
    z = zz - centre
    spread = np.sqrt((x * x + y * y + z * z + 2.0 * (xy * xy + xz * xz + yz * yz)) / 6.0)
    det = x * (y * z - yz * yz) - xy * (xy * z - yz * xz) + xz * (xy * yz - y * xz)
    cube = np.where(spread > _LEAST_SPREAD, spread, 1.0) ** 3
    angle = np.arccos(np.clip(0.5 * det / cube, -1.0, 1.0)) / 3.0
    return np.asarray(centre + 2.0 * spread * np.cos(angle))


def precise_norm(matrices: FloatArray) -> FloatArray:
    """Return the largest singular values by LAPACK, NaN for a matrix that is not finite."""
    finite, known = _finite_matrices(matrices)
    return np.where(finite, np.linalg.svd(known, compute_uv=False)[..., 0], np.nan)


def precise_one_sided(matrices: FloatArray) -> FloatArray:
    """Return λ_max of minus the symmetric part by LAPACK, NaN where it is not finite."""
    finite, known = _finite_matrices(-0.5 * (matrices + np.swapaxes(matrices, -1, -2)))
    return np.where(finite, np.linalg.eigvalsh(known)[..., -1], np.nan)


def _finite_matrices(matrices: FloatArray) -> tuple[NDArray[np.bool_], FloatArray]:
    """Return which matrices are finite, and the others as zeros, on which LAPACK does not fail."""
    finite = np.asarray(np.isfinite(matrices).all(axis=(-2, -1)))
    return finite, np.where(finite[..., None, None], matrices, 0.0)


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
        size = _frobenius_norms(c)
        unknown = self.lipschitz * _frobenius_norms(e) * (1.0 + 1e-12)
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
