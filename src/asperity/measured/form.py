"""Remove the form of a surface: the least-squares polynomial, a plane unless told otherwise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import legder, legval, legvander
from numpy.typing import NDArray

from asperity.checks import FloatArray
from asperity.errors import ParameterError
from asperity.measured.length_words import length_text

MOST_DEGREE = 10
"""Largest degree: waves shorter than that are the business of the L-filter."""

# Beyond, the points do not fix the coefficients; up to there the second turn of the fit, whose
# error is the square of the first's, is good to rounding.
_WORST_CONDITION = 1e10
_BLOCK = 2**22


@dataclass(frozen=True, eq=False)
class Form:
    """A polynomial over the grid.

    h(x, y) = Σ c[b, a] P_a(u) P_b(v) with Legendre polynomials P and u, v from -1 to 1 along
    the edges of the grid. A profile has c[a] only.

    Attributes:
        degree: total degree, a + b <= degree.
        coefficients: [m], shape (degree + 1, degree + 1), or (degree + 1,) for a profile.
        shape: of the grid, (ny, nx) or (n,).
    """

    degree: int
    coefficients: FloatArray
    shape: tuple[int, ...]

    def rows(self, part: slice) -> FloatArray:
        """Return the heights [m] in some rows of a map, or points of a profile."""
        bases = _bases(self.shape, self.degree)
        if len(self.shape) == 1:
            return np.asarray(bases[0][part] @ self.coefficients)
        return np.asarray(bases[0][part] @ self.coefficients @ bases[1].T)


def check_degree(degree: int) -> int:
    """Return the degree of a form.

    Raises:
        ParameterError: unless it is a whole number from 0 to MOST_DEGREE.
    """
    whole = not isinstance(degree, bool) and isinstance(degree, (int, float, np.integer))
    if not whole or degree != degree // 1 or not 0 <= degree <= MOST_DEGREE:
        raise ParameterError("form", f"must be a whole number from 0 to {MOST_DEGREE}", degree)
    return int(degree)


def most_degree(heights: FloatArray) -> int:
    """Return the greatest degree that the valid points support: two coordinates a coefficient.

    With fewer the fit eats the texture.
    """
    return _points_across(heights) // 2 - 1


def fit_form(heights: FloatArray, degree: int = 1) -> Form:
    """Fit the polynomial of total degree n to the valid points, by least squares.

    The basis is orthogonal over the whole grid, and the fit is repeated on what the first one
    left, so that the result is good to rounding also where points are missing.

    Args:
        heights: [m], shape (ny, nx) or (n,), NaN where missing.
        degree: total degree of the polynomial, 0 to 10.

    Returns:
        The polynomial.

    Raises:
        ParameterError: for a degree that the valid points do not support.

    Example:
        >>> x = np.arange(9.0)
        >>> parabola = 3.0 - x + 0.5 * x**2
        >>> bool(np.allclose(fit_form(parabola, 2).rows(slice(None)), parabola))
        True
    """
    degree = check_degree(degree)
    _check_support(heights, degree)
    where = _terms(heights.ndim, degree)
    gram, right = _normal_equations(heights, degree, None)
    normal = gram[np.ix_(where, where)]
    if np.linalg.cond(normal) > _WORST_CONDITION:
        raise ParameterError(
            "form", f"of degree {degree} is not determined by the points that are not missing"
        )
    coefficients = np.zeros(right.size)
    form = Form(degree, coefficients.reshape(right.shape), heights.shape)
    for turn in range(2):
        if turn:
            _, right = _normal_equations(heights, degree, form)
        coefficients[where] += np.linalg.solve(normal, right.ravel()[where])
    return form


def subtract_form(heights: FloatArray, form: Form, pitch: tuple[float, ...]) -> str:
    """Subtract a form where the heights are.

    Args:
        heights: [m], shape (ny, nx) or (n,), NaN where missing; replaced.
        form: the polynomial of :func:`fit_form`.
        pitch: (px, py) or (px,) [m], for the slopes in the sentence.

    Returns:
        What was done, in one sentence.
    """
    total, squares, low, high, count = 0.0, 0.0, np.inf, -np.inf, 0
    middle = float(form.coefficients.flat[0])
    for part in _parts(heights.shape):
        values = form.rows(part)
        heights[part] -= values
        measured = values[~np.isnan(heights[part])] - middle
        if measured.size:
            low, high = min(low, float(measured.min())), max(high, float(measured.max()))
        total, squares = total + float(measured.sum()), squares + float(measured @ measured)
        count += measured.size
    mean = total / count
    rms = float(np.sqrt(max(squares / count - mean**2, 0.0)))
    if form.degree == 0:
        return f"mean height {length_text(middle)} subtracted; not levelled"
    slopes = " and ".join(f"{slope:.2g}" for slope in _slopes(form, pitch))
    one = heights.ndim == 1
    if form.degree == 1:
        kind = "line, slope" if one else "plane, slopes"
        return f"levelled: subtracted the least-squares {kind} {slopes}"
    return (
        f"form removed: subtracted the least-squares polynomial of degree {form.degree}, its RMS"
        f" {length_text(rms)}, peak to valley {length_text(high - low)},"
        f" {'slope' if one else 'slopes'} in the middle {slopes}"
    )


def _bases(shape: tuple[int, ...], degree: int) -> list[FloatArray]:
    """Return the Legendre polynomials at the nodes of each axis, shape (n, degree + 1)."""
    return [np.asarray(legvander(np.linspace(-1.0, 1.0, n), degree)) for n in shape]


def _terms(axes: int, degree: int) -> NDArray[np.intp]:
    """Return the positions of the terms up to the total degree among all products."""
    order = np.arange(degree + 1)
    total = order if axes == 1 else order[:, None] + order[None, :]
    return np.flatnonzero(total <= degree)


def _parts(shape: tuple[int, ...]) -> list[slice]:
    count = _BLOCK if len(shape) == 1 else max(1, _BLOCK // shape[1])
    return [slice(first, first + count) for first in range(0, shape[0], count)]


def _normal_equations(
    heights: FloatArray, degree: int, fitted: Form | None
) -> tuple[FloatArray, FloatArray]:
    """Return the Gram matrix of all products, and the right side, of what a fit has left."""
    bases = _bases(heights.shape, degree)
    k = degree + 1
    pairs = [(b[:, :, None] * b[:, None, :]).reshape(-1, k * k) for b in bases]
    gram: FloatArray = np.zeros((k * k,) * heights.ndim)
    right: FloatArray = np.zeros((k,) * heights.ndim)
    for part in _parts(heights.shape):
        rest = heights[part] if fitted is None else heights[part] - fitted.rows(part)
        valid = ~np.isnan(rest)
        rest = np.where(valid, rest, 0.0)
        weight = valid.astype(np.float64)
        if heights.ndim == 1:
            gram += weight @ pairs[0][part]
            right += rest @ bases[0][part]
        else:
            gram += pairs[0][part].T @ (weight @ pairs[1])
            right += bases[0][part].T @ (rest @ bases[1])
    if heights.ndim == 1:
        return gram.reshape(k, k), right
    # Indices b, b', a, a' become the pairs (b, a), (b', a').
    return gram.reshape(k, k, k, k).transpose(0, 2, 1, 3).reshape(k * k, k * k), right


def _points_across(heights: FloatArray) -> int:
    """Return how many coordinates hold a valid point, along the axis where they are fewest."""
    valid = ~np.isnan(heights)
    axes = range(heights.ndim)
    return min(
        int(valid.any(axis=tuple(other for other in axes if other != axis)).sum()) for axis in axes
    )


def _check_support(heights: FloatArray, degree: int) -> None:
    most = most_degree(heights)
    if degree > most:
        raise ParameterError(
            "form",
            f"must be at most {most} for {_points_across(heights)} points along the shorter side",
            degree,
        )


def _slopes(form: Form, pitch: tuple[float, ...]) -> list[float]:
    """Return the slopes along x and y in the middle of the surface."""
    shape, c = form.shape, form.coefficients
    at_zero = legval(0.0, np.eye(form.degree + 1))
    rise = legval(0.0, legder(np.eye(form.degree + 1)))
    scales = [2.0 / ((n - 1) * p) for n, p in zip(shape[::-1], pitch, strict=True)]
    if len(shape) == 1:
        return [float(rise @ c) * scales[0]]
    return [float(at_zero @ c @ rise) * scales[0], float(rise @ c @ at_zero) * scales[1]]
