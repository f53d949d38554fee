"""Decompose the heights of a surface into form + waviness + texture."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from asperity.core.checks import FloatArray, check_positive
from asperity.core.errors import ParameterError
from asperity.measured.filling import fill_in_place
from asperity.measured.filters import gaussian_filter
from asperity.measured.form import fit_form, max_degree
from asperity.measured.lengths import Pitch, Shape

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
    shortest = min((n - 1) * p for n, p in zip(shape[::-1], pitch, strict=True))
    limit = shortest / (5 if len(shape) == 1 else 1)
    limit *= 1 + 1e-9  # rounding must not exclude a map as long as a nesting index
    exponent = math.floor(math.log10(limit))
    fitting = (float(f"{digits}e{exponent}") for digits in (8, 2.5, 0.8))
    return min(MAX_TEXTURE_WAVELENGTH, next(length for length in fitting if length <= limit))


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
    whole, heights = heights.shape, np.squeeze(heights)
    pitch = pitch[: heights.ndim]
    if nesting is None:
        nesting = default_nesting_index(heights.shape, pitch, periodic)
    else:
        nesting = check_positive("nesting", nesting, "m")
        longest = max((n - 1) * p for n, p in zip(heights.shape[::-1], pitch, strict=True))
        if not periodic and nesting > longest * (1 + 5e-7):
            raise ParameterError("nesting", f"must be at most the length {longest:g} m", nesting)
    missing = np.isnan(heights)
    degree = 0 if periodic else min(FORM_DEGREE, max_degree(heights))
    form = fit_form(heights, degree).evaluate_rows(slice(None))
    rest = heights - form
    fill_in_place(rest, pitch)
    waviness = gaussian_filter(rest, pitch, nesting, periodic=periodic)
    rest -= waviness
    rest[missing] = np.nan
    bow, wave, texture = (_height_statistics(part[~missing]) for part in (form, waviness, rest))
    return SurfaceDecomposition(bow, wave, texture, nesting, rest.reshape(whole))


def _height_statistics(heights: FloatArray) -> HeightStatistics:
    return HeightStatistics(float(np.std(heights)), float(np.ptp(heights)))
