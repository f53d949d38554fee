"""Remove the form of a surface, or decompose it into form + waviness + texture."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import legder, legval, legvander

from asperity.core.checks import FloatArray, check_positive
from asperity.core.errors import ParameterError
from asperity.measured.defects import fill_in_place
from asperity.measured.filters import gaussian_filter, required_sections
from asperity.measured.lengths import Pitch, Shape, format_length, side_lengths

MAX_DEGREE = 10
"""Greatest degree; the L-filter removes shorter waves."""

# Beyond this the points do not determine the coefficients; up to it the second pass of the fit,
# with the square of the first one's error, is accurate to rounding.
_MAX_CONDITION = 1e10


@dataclass(frozen=True, eq=False)
class FormPolynomial:
    """A polynomial over a grid.

    h(x, y) = Σ c[b, a] P_a(u) P_b(v) with Legendre polynomials P and u, v from -1 to 1 along
    the edges of the grid. A profile has c[a] only.

    Attributes:
        degree: total degree, a + b <= degree.
        coefficients: [m], shape (degree + 1, degree + 1), or (degree + 1,) for a profile.
        shape: of the grid, (ny, nx) or (n,).
    """

    degree: int
    coefficients: FloatArray
    shape: Shape

    def evaluate(self) -> FloatArray:
        """Return the heights [m] at all points of the grid."""
        bases = _legendre_bases(self.shape, self.degree)
        values = bases[0] @ self.coefficients
        if len(self.shape) == 2:
            values = values @ bases[1].T
        return np.asarray(values)


def check_degree(degree: int) -> int:
    """Return the degree of a form.

    Raises:
        ParameterError: it is not a whole number from 0 to MAX_DEGREE.
    """
    whole = not isinstance(degree, bool) and isinstance(degree, (int, float, np.integer))
    if not whole or degree != degree // 1 or not 0 <= degree <= MAX_DEGREE:
        raise ParameterError("form", f"must be a whole number from 0 to {MAX_DEGREE}", degree)
    return int(degree)


def max_degree(heights: FloatArray) -> int:
    """Return the greatest degree that the valid points support: two coordinates per coefficient.

    With fewer the fit would absorb the texture.
    """
    return _count_valid_coordinates(heights) // 2 - 1


def fit_form(heights: FloatArray, degree: int = 1) -> FormPolynomial:
    """Fit the polynomial of a total degree to the valid points by least squares.

    The basis is orthogonal over the whole grid, and a second fit to the residual of the first makes
    the result accurate to rounding even if points are missing.

    Args:
        heights: [m], shape (ny, nx) or (n,), NaN for missing points.
        degree: total degree of the polynomial, 0 to 10.

    Returns:
        The polynomial.

    Raises:
        ParameterError: the valid points do not support the degree.

    Example:
        >>> x = np.arange(9.0)
        >>> parabola = 3.0 - x + 0.5 * x**2
        >>> bool(np.allclose(fit_form(parabola, 2).evaluate(), parabola))
        True
    """
    degree = check_degree(degree)
    limit = max_degree(heights)
    if degree > limit:
        points = f"{_count_valid_coordinates(heights)} points along the shorter side"
        raise ParameterError("form", f"must be at most {limit} for {points}", degree)
    orders = np.indices((degree + 1,) * heights.ndim).sum(axis=0)
    terms = np.flatnonzero(orders <= degree)
    gram, right = _normal_equations(heights, degree, None)
    normal = gram[np.ix_(terms, terms)]
    if np.linalg.cond(normal) > _MAX_CONDITION:
        raise ParameterError("form", f"of degree {degree} is not determined by the valid points")
    coefficients = np.zeros(right.size)
    form = FormPolynomial(degree, coefficients.reshape(right.shape), heights.shape)
    coefficients[terms] = np.linalg.solve(normal, right.ravel()[terms])
    _, right = _normal_equations(heights, degree, form)
    coefficients[terms] += np.linalg.solve(normal, right.ravel()[terms])
    return form


def subtract_form(heights: FloatArray, form: FormPolynomial, pitch: Pitch) -> str:
    """Subtract a form in place.

    Args:
        heights: [m], shape (ny, nx) or (n,), NaN for missing points; changed in place.
        form: the polynomial of :func:`fit_form`.
        pitch: (px, py) or (px,) [m], for the slopes in the sentence.

    Returns:
        A sentence that describes the form.
    """
    values = form.evaluate()
    heights -= values
    measured = HeightStatistics.of(values[~np.isnan(heights)])
    if form.degree == 0:
        mean = format_length(float(form.coefficients.flat[0]))
        return f"mean height {mean} subtracted; not levelled"
    slopes = " and ".join([f"{slope:.2g}" for slope in _central_slopes(form, pitch)])
    shape = "plane"
    word = "slopes"
    if heights.ndim == 1:
        shape = "line"
        word = "slope"
    if form.degree == 1:
        return f"levelled: subtracted the least-squares {shape}, {word} {slopes}"
    return (
        f"form removed: subtracted the least-squares polynomial of degree {form.degree}, its RMS"
        f" {format_length(measured.rms)}, peak to valley {format_length(measured.range)},"
        f" {word} in the middle {slopes}"
    )


def _legendre_bases(shape: Shape, degree: int) -> list[FloatArray]:
    """Return the Legendre polynomials at the nodes of each axis, shape (n, degree + 1)."""
    return [np.asarray(legvander(np.linspace(-1.0, 1.0, n), degree)) for n in shape]


def _normal_equations(
    heights: FloatArray, degree: int, previous: FormPolynomial | None
) -> tuple[FloatArray, FloatArray]:
    """Return the Gram matrix of all products and the right side, for the residual of a fit."""
    bases = _legendre_bases(heights.shape, degree)
    k = degree + 1
    pairs = [(b[:, :, None] * b[:, None, :]).reshape(-1, k * k) for b in bases]
    rest = heights - previous.evaluate() if previous is not None else heights
    weight = (~np.isnan(rest)).astype(np.float64)
    rest = np.nan_to_num(rest)
    if heights.ndim == 1:
        return (weight @ pairs[0]).reshape(k, k), rest @ bases[0]
    gram = pairs[0].T @ (weight @ pairs[1])
    # Indices b, b', a, a' become the pairs (b, a), (b', a').
    gram = gram.reshape(k, k, k, k).transpose(0, 2, 1, 3).reshape(k * k, k * k)
    return gram, bases[0].T @ (rest @ bases[1])


def _count_valid_coordinates(heights: FloatArray) -> int:
    """Return the number of coordinates with a valid point, along the axis with the fewest."""
    valid = np.atleast_2d(~np.isnan(heights))
    counts = [int(valid.any(axis=axis).sum()) for axis in range(heights.ndim)]
    return min(counts)


def _central_slopes(form: FormPolynomial, pitch: Pitch) -> list[float]:
    """Return the slopes along x and y in the middle of the surface."""
    shape = form.shape
    c = form.coefficients
    at_zero = legval(0.0, np.eye(form.degree + 1))
    rise = legval(0.0, legder(np.eye(form.degree + 1)))
    scales = [2.0 / ((n - 1) * p) for n, p in zip(shape[::-1], pitch, strict=True)]
    if len(shape) == 1:
        return [float(rise @ c) * scales[0]]
    return [float(at_zero @ c @ rise) * scales[0], float(rise @ c @ at_zero) * scales[1]]


FORM_DEGREE = 2
"""Degree of the F-operation: 1 removes the tilt, 2 also bow and cylinder."""

MAX_TEXTURE_WAVELENGTH = 8e-3
"""Default for the longest wave [m] that counts as texture.

At 0.1 m/s it passes at 12.5 Hz. The hand follows slower variations and perceives them as shape: it
moves with at most 5 to 10 Hz (T. L. Brooks, Telerobotic response requirements, 1990).
"""


@dataclass(frozen=True)
class HeightStatistics:
    """Height statistics of a part of a surface, over the measured points.

    Attributes:
        rms: root mean square of its heights about their mean [m].
        range: greatest minus least height [m].
    """

    rms: float
    range: float

    @classmethod
    def of(cls, heights: FloatArray) -> HeightStatistics:
        """Return the statistics of heights [m] without missing points."""
        return cls(float(np.std(heights)), float(np.ptp(heights)))


@dataclass(frozen=True, eq=False)
class SurfaceDecomposition:
    """The parts of a surface: heights = form + waviness + texture at each point.

    Attributes:
        form: the least-squares polynomial of second degree; flat for a periodic surface.
        waviness: the waves longer than about ``nesting``, removed by the L-filter.
        texture: the rest.
        nesting: nesting index (cut-off wavelength) of the L-filter, L [m].
        heights: heights of the texture [m], shape of the surface; NaN for missing points.
    """

    form: HeightStatistics
    waviness: HeightStatistics
    texture: HeightStatistics
    nesting: float
    heights: FloatArray


def default_nesting_index(shape: Shape, pitch: Pitch, periodic: bool) -> float:
    """Return the default nesting index [m], which separates waviness from texture.

    The longest of 8, 2.5, 0.8, 0.25, 0.08 mm ... (ISO 25178-3, ISO 21920-3) that fits: once into
    the shorter side of a map (ISO 25178-3: the evaluation area is as long as the nesting index),
    five times into a profile (ISO 21920-3: five section lengths). A periodic surface is unlimited.
    The maximum is 8 mm, see :data:`MAX_TEXTURE_WAVELENGTH`.

    Args:
        shape: (ny, nx) or (n,).
        pitch: (px, py) or (px,) [m].
        periodic: whether the surface repeats.

    Example:
        >>> default_nesting_index((256, 918), (2.58e-6, 2.58e-6), False)  # 2.4 mm x 0.66 mm
        0.00025
        >>> default_nesting_index((9600,), (1.5e-3 / 9600,), False)
        0.00025
        >>> default_nesting_index((64,), (1e-5,), True)
        0.008
    """
    if periodic:
        return MAX_TEXTURE_WAVELENGTH
    limit = min(side_lengths(shape, pitch)) / required_sections(shape)
    limit *= 1 + 1e-9  # rounding must not exclude a map as long as a nesting index
    exponent = math.floor(math.log10(limit))
    lengths = [float(f"{digits}e{exponent}") for digits in (8, 2.5, 0.8)]
    return min(MAX_TEXTURE_WAVELENGTH, max(length for length in lengths if length <= limit))


def decompose_surface(
    heights: FloatArray, pitch: Pitch, *, periodic: bool = False, nesting: float | None = None
) -> SurfaceDecomposition:
    """Decompose a surface into form, waviness and texture.

    The form is the least-squares polynomial of second degree (F-operation of ISO 25178-3). The
    waviness is the rest after the Gaussian low-pass of ISO 16610-21 or -61 with nesting index L,
    and the texture is the remainder, with 1 - 2^-(L/l)² of the amplitude of a wave of length l,
    half at l = L. The form of a periodic surface is its mean, and its filter is periodic. All
    lengths are those of the given heights, hence those of a magnified surface after magnification.

    Args:
        heights: raw or prepared [m], shape (ny, nx), (n,) or (1, n); NaN for missing points. For
            any texture: ``heights, pitch, periodic = texture.samples()``.
        pitch: (px, py) or (px,) [m].
        periodic: whether the surface repeats after n times the pitch.
        nesting: L [m]; default :func:`default_nesting_index`.

    Returns:
        RMS and range of each part, and the heights of the texture.

    Raises:
        ParameterError: the nesting index is not positive, or longer than the surface.

    Reference:
        ISO 25178-3:2012 (F-operation, L-filter and their nesting indices), ISO 16610-61.

    Example:
        >>> x = np.linspace(0.0, 10e-3, 2001)
        >>> bow, grain = 4.0 * (x - 5e-3) ** 2, 1e-6 * np.sin(2 * np.pi * x / 100e-6)
        >>> parts = decompose_surface(bow + grain, (5e-6,))
        >>> f"{1e6 * parts.form.range:.0f} {1e6 * parts.texture.rms:.3f} {1e3 * parts.nesting}"
        '100 0.707 0.8'
    """
    whole = heights.shape
    heights = np.squeeze(heights)
    pitch = pitch[: heights.ndim]
    if nesting is None:
        nesting = default_nesting_index(heights.shape, pitch, periodic)
    else:
        nesting = check_positive("nesting", nesting, "m")
        longest = max(side_lengths(heights.shape, pitch))
        if not periodic and nesting > longest * (1 + 5e-7):
            raise ParameterError("nesting", f"must be at most the length {longest:g} m", nesting)
    missing = np.isnan(heights)
    degree = 0 if periodic else min(FORM_DEGREE, max_degree(heights))
    form = fit_form(heights, degree).evaluate()
    rest = heights - form
    fill_in_place(rest, pitch)
    waviness = gaussian_filter(rest, pitch, nesting, periodic=periodic)
    rest -= waviness
    rest[missing] = np.nan
    return SurfaceDecomposition(
        HeightStatistics.of(form[~missing]),
        HeightStatistics.of(waviness[~missing]),
        HeightStatistics.of(rest[~missing]),
        nesting,
        rest.reshape(whole),
    )
