"""Scale, filter and magnify synthetic textures.

Sums of waves remain exact sums of waves: each amplitude is multiplied by the transfer of the
filters. Other textures, and all that a ball traces, become the spline through their nodes, or
through samples.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from asperity.core.arguments import document_arguments
from asperity.core.checks import FloatArray, check_positive
from asperity.core.errors import ParameterError
from asperity.measured import filters
from asperity.measured.file_arguments import SYNTHETIC_ARGUMENTS
from asperity.measured.lengths import format_length
from asperity.measured.preparation import describe_magnification, magnification_factors
from asperity.textures.kinds.fourier import Fourier
from asperity.textures.kinds.sinusoid import Sinusoid
from asperity.textures.plane_waves import PlaneWaves
from asperity.textures.spline.spline_texture import fit_spline
from asperity.textures.texture import Texture

# Points per node of a grid for a sum of waves that a tip traces: it leaves creases.
_TIP_REFINEMENT = 16
_MAX_TIP_POINTS = 1024  # along a side


@document_arguments(SYNTHETIC_ARGUMENTS)
def prepare_texture(  # noqa: D417 - the others are described where they are declared
    texture: Texture,
    *,
    height_range: float | None = None,
    s_cutoff: float | None = None,
    l_cutoff: float | None = None,
    tip_radius: float | None = None,
    magnify: float = 1.0,
    magnify_height: float | None = None,
) -> Texture:
    """Return a texture prepared like a measured surface.

    The steps are, in this order: scale, filter (S, then L), dilate by a tip, magnify. Only the
    requested ones are done; the ``preparation`` of the result lists them.

    Args:
        texture: any texture; it is not changed.
        {arguments}

    Raises:
        ParameterError: for an argument that cannot be used.

    Example:
        >>> half = prepare_texture(Sinusoid(1e-3, 2e-3), s_cutoff=2e-3, magnify=3)
        >>> round(half.amplitude, 9), half.period, half.preparation[-1]
        (0.0015, 0.006, 'magnified 3 times laterally and in height')
    """
    lateral, vertical = magnification_factors(magnify, magnify_height)
    if tip_radius is not None and texture.waves is not None:
        filtered = prepare_texture(
            texture, height_range=height_range, s_cutoff=s_cutoff, l_cutoff=l_cutoff
        )
        nodes = _sampled_waves(filtered)
        return prepare_texture(
            nodes, tip_radius=tip_radius, magnify=magnify, magnify_height=magnify_height
        )
    steps = [*texture.preparation]
    scale = 1.0
    if height_range is not None:
        before = format_length(texture.peak_to_valley)
        after = format_length(height_range)
        steps.append(f"heights scaled from {before} to {after} peak to valley")
        scale = _height_scale(texture, height_range)
    prepared: Texture
    if texture.waves is not None:
        amplitudes = _filter_amplitudes(texture.waves, scale * vertical, s_cutoff, l_cutoff)
        prepared = _scaled_waves(texture, texture.waves, amplitudes, lateral)
        steps += _filter_steps(s_cutoff, l_cutoff)
    else:
        if not texture.preparation:
            steps.insert(0, f"made from {texture!r}")
        heights, pitch, periodic = _sample(texture)
        heights = _filter_heights(scale * heights, pitch, periodic, s_cutoff, l_cutoff)
        steps += _filter_steps(s_cutoff, l_cutoff)
        if tip_radius is not None:
            heights, sentence = filters.apply_tip(heights, pitch, tip_radius, periodic=periodic)
            steps.append(sentence)
        grown = heights * vertical
        spacing = tuple(step * lateral for step in pitch)
        mask = texture.filled_mask
        prepared = fit_spline(grown, spacing, periodic=periodic, filled_mask=mask)
    if not lateral == vertical == 1.0:
        steps.append(describe_magnification(lateral, vertical))
    prepared.preparation = tuple(steps)
    return prepared


def _sampled_waves(texture: Texture) -> Texture:
    """Return the spline through samples of a sum of waves."""
    own = texture.grid_counts()
    counts = [max(count, min(_TIP_REFINEMENT * count, _MAX_TIP_POINTS)) for count in own]
    points, spacing, periodic = texture.domain.grid(counts)
    heights = texture.height(points.reshape(-1, 2)).reshape(points.shape[:2])
    if texture.is_profile:
        heights = heights[0]
    nodes = fit_spline(heights, spacing[: heights.ndim], periodic=periodic)
    nodes.preparation = texture.preparation or (f"made from {texture!r}",)
    return nodes


def _height_scale(texture: Texture, height_range: float) -> float:
    height = check_positive("height_range", height_range, "m")
    if texture.peak_to_valley == 0.0:
        raise ParameterError("height_range", "cannot be reached: the surface is flat")
    return height / texture.peak_to_valley


def _filter_amplitudes(
    waves: PlaneWaves, factor: float, s_cutoff: float | None, l_cutoff: float | None
) -> FloatArray:
    """Return the amplitudes times a factor and the transfer of the filters."""
    numbers = np.hypot(*waves.wavevectors.T)
    amplitudes = waves.amplitudes * factor
    for name, length in (("s_cutoff", s_cutoff), ("l_cutoff", l_cutoff)):
        if length is not None:
            short = filters.ALPHA * check_positive(name, length, "m") * numbers / (2.0 * math.pi)
            transfer = np.exp(-math.pi * short**2)
            if name == "l_cutoff":
                transfer = 1.0 - transfer
            amplitudes = amplitudes * transfer
    return amplitudes


def _scaled_waves(
    texture: Texture, waves: PlaneWaves, amplitudes: FloatArray, lateral: float
) -> Texture:
    wave = texture.single_wave
    if wave is not None:
        return Sinusoid(float(amplitudes[0]), wave.period * lateral, wave.phase, wave.direction)
    return Fourier(amplitudes, waves.wavevectors / lateral, waves.phases)


def _sample(texture: Texture) -> tuple[FloatArray, tuple[float, ...], bool]:
    """Return heights, (n,) or (ny, nx), pitch and whether they are periodic."""
    nodes, spacing, periodic = texture.samples()
    if abs(float(texture.domain.spans[0] @ (0.0, 1.0))) > 0.0:
        raise ParameterError("texture", "must have its period along x to be sampled")
    heights = np.array(nodes[0] if texture.is_profile else nodes)
    return heights, spacing[: heights.ndim], periodic


def _filter_heights(
    heights: FloatArray,
    pitch: tuple[float, ...],
    periodic: bool,
    s_cutoff: float | None,
    l_cutoff: float | None,
) -> FloatArray:
    if s_cutoff is not None or l_cutoff is not None:
        # Checks the cut-offs; the first node of the next period is one pitch from the last one.
        shape = tuple(count + periodic for count in heights.shape)
        filters.find_cutoffs(shape, pitch, s_cutoff, l_cutoff)
    if s_cutoff is not None:
        heights = filters.gaussian_filter(heights, pitch, s_cutoff, periodic=periodic)
    if l_cutoff is not None:
        heights = heights - filters.gaussian_filter(heights, pitch, l_cutoff, periodic=periodic)
    return heights


def _filter_steps(s_cutoff: float | None, l_cutoff: float | None) -> Iterator[str]:
    if s_cutoff is not None:
        yield f"filtered: Gaussian S-filter, cut-off {format_length(s_cutoff)}"
    if l_cutoff is not None:
        yield f"waviness removed: Gaussian L-filter, cut-off {format_length(l_cutoff)}"
