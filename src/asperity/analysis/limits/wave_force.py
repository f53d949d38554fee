"""The force that each wave of a texture makes on a scan at constant height."""

from __future__ import annotations

import math

import numpy as np

from asperity.analysis.energy.merit import scan_height
from asperity.analysis.gain.answers import at_unit_stiffness, kept_answer
from asperity.analysis.limits.spectrum import BANDS_PER_OCTAVE, Spectrum, banded
from asperity.checks import FloatArray
from asperity.surface import Surface
from asperity.textures.texture import Texture

# Points of the fit to a sum of waves, and of a side of the patch of a map; fewer where every
# force searches a nearest point.
_FIT_POINTS = {False: 16384, True: 4096}
_LINE_POINTS = {False: 2**15, True: 4096}
_SIDE_POINTS = {False: 1024, True: 96}
# A sum that never repeats is fitted over so many of its longest waves.
_WAVES_OF_AN_ENDLESS_SUM = 64.0
_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


def wave_forces(surface: Surface, spectrum: Spectrum) -> FloatArray:
    """Return the amplitude of the force at the wavelength of every wave.

    The probe moves at constant height, as deep as
    :func:`~asperity.analysis.energy.merit.merit` scans; a law with state slides at full
    deflection. For a sum of waves the force is fitted by the same waves (least squares); for bands
    it is the square root of twice the force's variance in the
    band, by way of the ratio to the variance of the heights on the same patch. The components of
    the force are added as squares.

    Args:
        surface: texture, law and stiffness.
        spectrum: of its texture.

    Returns:
        A_F [N], shape (n,).

    Example:
        >>> from asperity.analysis.limits.spectrum import spectrum
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> texture = Sinusoid(amplitude=1e-4, period=1e-3)
        >>> wave_forces(Surface(texture, "A", stiffness=500.0), spectrum(texture)).round(9)
        array([0.05])
    """
    if not spectrum.waves:
        return np.zeros(0)
    unit = at_unit_stiffness(surface)
    forces = _fitted if spectrum.exact else _by_bands
    asked = repr((spectrum.exact, spectrum.waves))
    found = kept_answer("wave forces", unit, lambda: forces(unit, spectrum), asked)
    return found * (surface.stiffness / unit.stiffness)


def scan_forces(surface: Surface, xy: FloatArray) -> FloatArray:
    """Return the forces [N], shape (n, 3), at points (n, 2) [m] of the scan's height."""
    probes = np.column_stack([xy, np.full(len(xy), scan_height(surface))])
    if not surface.law.stateful:
        return surface.force(probes)
    direction = surface.texture.scan_line().direction
    return surface.force(
        probes, np.tile(surface.parameter("max_deflection") * direction, (len(xy), 1))
    )


def _fitted(surface: Surface, spectrum: Spectrum) -> FloatArray:
    """Return the amplitudes of the waves that fit the force best."""
    xy = _fit_points(surface.texture, spectrum, _FIT_POINTS[surface.law.contact.costly])
    vectors = np.array([wave.vector for wave in spectrum.waves])
    angles = xy @ vectors.T + np.array([wave.phase for wave in spectrum.waves])
    columns = np.hstack([np.ones((len(xy), 1)), np.sin(angles), np.cos(angles)])
    fit = np.linalg.lstsq(columns, scan_forces(surface, xy), rcond=None)[0][1:]
    squares = np.sum(fit**2, axis=1)
    return np.asarray(np.sqrt(squares[: len(vectors)] + squares[len(vectors) :]))


def _fit_points(texture: Texture, spectrum: Spectrum, count: int) -> FloatArray:
    """Return points (n, 2) [m] spread evenly over one period, or over many waves."""
    domain, steps = texture.domain, np.arange(count)
    spans = domain.spans
    if not domain.periodic:
        side = _WAVES_OF_AN_ENDLESS_SUM * float(spectrum.wavelengths.max())
        spans = side * spans / np.hypot(*spans.T)[:, None]
    # Equal steps along the first span, the golden ratio across: a lattice without short waves.
    fractions = [(steps + 0.5) / count, (steps * _GOLDEN) % 1.0][: len(spans)]
    return np.asarray(domain.origin + np.stack(fractions, axis=-1) @ spans)


def _by_bands(surface: Surface, spectrum: Spectrum) -> FloatArray:
    """Return the amplitude of each band, from the ratio of force to height on a patch."""
    texture, costly = surface.texture, surface.law.contact.costly
    most = (_LINE_POINTS if texture.is_profile else _SIDE_POINTS)[costly]
    points, spacing, repeats = texture.domain.grid(texture.grid_counts(), most)
    flat = points.reshape(-1, 2)
    shape = points.shape[:2]
    heights = banded(texture.height(flat).reshape(1, *shape), spacing, repeats)
    forces = scan_forces(surface, flat).T.reshape(3, *shape)
    pushed = banded(np.ascontiguousarray(forces), spacing, repeats)
    known = heights.variance > 1e-12 * heights.variance.max()
    ratio = np.sqrt(pushed.variance[known] / heights.variance[known])
    wanted = np.floor(BANDS_PER_OCTAVE * np.log2(1.0 / spectrum.wavelengths))
    # A wave longer than the patch is taken to push as the longest that fits.
    nearest = np.abs(heights.number[known] - wanted[:, None]).argmin(axis=1)
    return np.asarray(spectrum.amplitudes * ratio[nearest])
