"""What of a surface is texture: its heights as form + waviness + texture."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from asperity.checks import FloatArray
from asperity.errors import ParameterError
from asperity.measured.filling import fill_in_place
from asperity.measured.filters import gaussian_filter
from asperity.measured.form import fit_form, most_degree
from asperity.measured.length_words import positive_number

FORM_DEGREE = 2
"""Degree of the F-operation: a plane takes the tilt, a second degree also bow and cylinder."""

LONGEST = 8e-3
"""The longest wave [m] that counts as texture unless told otherwise.

At 0.1 m/s it passes at 12.5 Hz. Slower ups and downs the hand follows, and feels them as a shape:
it moves with at most 5 to 10 Hz (T. L. Brooks, Telerobotic response requirements, 1990).
"""


@dataclass(frozen=True)
class Part:
    """How high a part of a surface is, over the points that were measured.

    Attributes:
        rms: root mean square of its heights about their mean [m].
        range: greatest minus least height [m].
    """

    rms: float
    range: float


@dataclass(frozen=True, eq=False)
class Parts:
    """A surface taken apart: heights = form + waviness + texture, point by point.

    Attributes:
        form: the least-squares polynomial of second degree; flat for a surface that repeats.
        waviness: what the L-filter took from the rest: the waves longer than about ``nesting``.
        texture: what is left.
        nesting: nesting index (cut-off wavelength) of the L-filter, L [m].
        heights: of the texture [m], as the surface's shape; NaN where that is.
    """

    form: Part
    waviness: Part
    texture: Part
    nesting: float
    heights: FloatArray


def default_nesting(shape: tuple[int, ...], pitch: tuple[float, ...], periodic: bool) -> float:
    """Return the nesting index [m] that tells waviness from texture unless one is given.

    The longest of 8, 2.5, 0.8, 0.25, 0.08 mm ... (ISO 25178-3, ISO 21920-3) of which the surface
    holds enough: one along the shorter side of a map (ISO 25178-3: the evaluation area is as long
    as the nesting index), five along a profile (ISO 21920-3: five section lengths). A surface that
    repeats has no end. Longer than 8 mm it never is, see :data:`LONGEST`.

    Args:
        shape: (ny, nx) or (n,).
        pitch: (px, py) or (px,) [m].
        periodic: whether the surface repeats.

    Example:
        >>> default_nesting((256, 918), (2.58e-6, 2.58e-6), False)  # 2.4 mm x 0.66 mm
        0.00025
        >>> default_nesting((9600,), (1.5e-3 / 9600,), False), default_nesting((64,), (1e-5,), True)
        (0.00025, 0.008)
    """
    if periodic:
        return LONGEST
    shortest = min((n - 1) * p for n, p in zip(shape[::-1], pitch, strict=True))
    room = shortest / (5 if len(shape) == 1 else 1)
    room *= 1 + 1e-9  # a map exactly as long as a nesting index must not fail on rounding
    exponent = math.floor(math.log10(room))
    fitting = (float(f"{digits}e{exponent}") for digits in (8, 2.5, 0.8))
    return min(LONGEST, next(length for length in fitting if length <= room))


def texture_part(
    heights: FloatArray,
    pitch: tuple[float, ...],
    *,
    periodic: bool = False,
    nesting: float | None = None,
) -> Parts:
    """Take a surface apart into form, waviness and texture.

    The form is the least-squares polynomial of second degree (F-operation of ISO 25178-3), the
    waviness what the Gaussian filter of ISO 16610-21 or -61 with nesting index L keeps of the
    rest; texture is what remains: a wave of length l keeps 1 - 2^-(L/l)² of its amplitude in it,
    half at l = L. A surface that repeats has no form but its mean, and is filtered as a wave
    without end. The lengths are those of the heights as given: of a magnified surface, as it is
    felt.

    Args:
        heights: raw or prepared [m], shape (ny, nx), (n,) or (1, n); NaN where missing. With
            ``heights, pitch, periodic = texture.samples()`` those of any texture.
        pitch: (px, py) or (px,) [m].
        periodic: whether the surface repeats after n times the pitch.
        nesting: L [m]; by default see :func:`default_nesting`.

    Returns:
        RMS and range of each part, and the heights of the texture.

    Raises:
        ParameterError: for a nesting index that is not positive, or longer than the surface.

    Reference:
        ISO 25178-3:2012 (F-operation, L-filter and their nesting indices), ISO 16610-61.

    Example:
        >>> x = np.linspace(0.0, 10e-3, 2001)
        >>> bow, grain = 4.0 * (x - 5e-3) ** 2, 1e-6 * np.sin(2 * np.pi * x / 100e-6)
        >>> parts = texture_part(bow + grain, (5e-6,))
        >>> f"{1e6 * parts.form.range:.0f} {1e6 * parts.texture.rms:.3f} {1e3 * parts.nesting}"
        '100 0.707 0.8'
    """
    whole, heights = heights.shape, np.squeeze(heights)
    pitch = pitch[: heights.ndim]
    if nesting is None:
        nesting = default_nesting(heights.shape, pitch, periodic)
    else:
        nesting = positive_number("nesting", nesting)
        longest = max((n - 1) * p for n, p in zip(heights.shape[::-1], pitch, strict=True))
        if not periodic and nesting > longest * (1 + 5e-7):
            raise ParameterError("nesting", f"must be at most the length {longest:g} m", nesting)
    missing = np.isnan(heights)
    degree = 0 if periodic else min(FORM_DEGREE, most_degree(heights))
    form = fit_form(heights, degree).rows(slice(None))
    rest = heights - form
    fill_in_place(rest, pitch)
    waviness = gaussian_filter(rest, pitch, nesting, periodic=periodic)
    rest -= waviness
    rest[missing] = np.nan
    form_part, wavy, texture = (_part(part[~missing]) for part in (form, waviness, rest))
    return Parts(form_part, wavy, texture, nesting, rest.reshape(whole))


def _part(heights: FloatArray) -> Part:
    return Part(float(np.std(heights)), float(np.ptp(heights)))
