"""Magnify, scale and filter a texture that was not measured: drawn, or a sum of waves.

Sums of waves stay what they are, exactly: each wave keeps what the filter lets through. Other
textures become the spline through the nodes that they have, or that show them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from asperity.arguments import described
from asperity.checks import FloatArray
from asperity.errors import ParameterError
from asperity.measured.arguments import DRAWN
from asperity.measured.filters import ALPHA, find_cutoffs, gaussian_filter
from asperity.measured.length_words import length_text, positive_number
from asperity.measured.preparation import factors, magnified_text
from asperity.measured.stylus import apply_tip, check_radius
from asperity.textures.fourier import Fourier
from asperity.textures.heightmap import HeightMap
from asperity.textures.profile import Profile
from asperity.textures.sinusoid import Sinusoid
from asperity.textures.texture import Texture


@described(DRAWN)
def prepare_texture(  # noqa: D417 - the others are described where they are declared
    texture: Texture,
    *,
    height_range: float | None = None,
    cutoff: float | None = None,
    l_cutoff: float | None = None,
    tip_radius: float | None = None,
    magnify: float = 1.0,
    magnify_height: float | None = None,
) -> Texture:
    """Return a texture that was prepared like a measured surface, as far as it is asked for.

    In this order: scale, filter (S, then L), feel with a tip, magnify. Nothing is filtered that
    was not asked for. What was done is in the ``preparation`` of the result.

    Args:
        texture: any; it stays as it is.
        {arguments}

    Raises:
        ParameterError: for an argument that cannot be used.

    Example:
        >>> half = prepare_texture(Sinusoid(1e-3, 2e-3), cutoff=2e-3, magnify=3)
        >>> round(half.amplitude, 9), half.period, half.preparation[-1]
        (0.0015, 0.006, 'magnified 3 times laterally and in height')
    """
    size = _Size(*factors(magnify, magnify_height), _scale(texture, height_range))
    steps = [*texture.preparation]
    if height_range is not None:
        before, after = length_text(texture.peak_to_valley), length_text(height_range)
        steps.append(f"heights scaled from {before} to {after} peak to valley")
    prepared = (
        _waves(texture, size, cutoff, l_cutoff, steps)
        if texture.waves is not None and tip_radius is None
        else _spline(texture, size, cutoff, l_cutoff, tip_radius, steps)
    )
    if not size.lateral == size.upward == 1.0:
        steps.append(magnified_text(size.lateral, size.upward))
    prepared.preparation = tuple(steps)
    return prepared


@dataclass(frozen=True)
class _Size:
    """By how much all grows: to the side and in height, and before that the heights."""

    lateral: float
    upward: float
    scale: float

    @property
    def height(self) -> float:
        return self.scale * self.upward


def _scale(texture: Texture, height_range: float | None) -> float:
    if height_range is None:
        return 1.0
    wanted = positive_number("height_range", height_range)
    if texture.peak_to_valley == 0.0:
        raise ParameterError("height_range", "cannot be reached: the surface is flat")
    return wanted / texture.peak_to_valley


def _waves(
    texture: Texture,
    size: _Size,
    cutoff: float | None,
    l_cutoff: float | None,
    steps: list[str],
) -> Texture:
    """Return the sum of the waves as the filters leave them."""
    waves = texture.waves
    assert waves is not None  # asked before
    numbers = np.hypot(*waves.wavevectors.T)
    amplitudes = waves.amplitudes * size.height
    for name, length in (("cutoff", cutoff), ("l_cutoff", l_cutoff)):
        if length is None:
            continue
        short = ALPHA * positive_number(name, length) * numbers / (2.0 * math.pi)
        passed = np.exp(-math.pi * short**2)
        amplitudes = amplitudes * (passed if name == "cutoff" else 1.0 - passed)
    steps += _filtered(cutoff, l_cutoff)
    if (one := texture.single_wave) is not None:
        return Sinusoid(float(amplitudes[0]), one.period * size.lateral, one.phase, one.direction)
    return Fourier(amplitudes, waves.wavevectors / size.lateral, waves.phases)


def _spline(
    texture: Texture,
    size: _Size,
    cutoff: float | None,
    l_cutoff: float | None,
    tip_radius: float | None,
    steps: list[str],
) -> Texture:
    """Return the spline through the nodes as filters and tip leave them."""
    if not texture.preparation:
        steps.insert(0, f"made from {texture!r}")
    nodes, spacing, periodic = texture.samples() if texture.waves is None else _dense(texture)
    if abs(float(texture.domain.spans[0] @ (0.0, 1.0))) > 0.0:
        raise ParameterError("tip_radius", "needs a texture whose waves run along x")
    heights = np.array(nodes[0] if texture.is_profile else nodes) * size.scale
    pitch = spacing[: heights.ndim]
    if cutoff is not None or l_cutoff is not None:
        # Refuses what cannot be; from the last node the next period's first is one pitch away.
        whole = tuple(count + periodic for count in heights.shape)
        find_cutoffs(whole, pitch, cutoff, l_cutoff)
    if cutoff is not None:
        heights = gaussian_filter(heights, pitch, cutoff, periodic=periodic)
    if l_cutoff is not None:
        heights -= gaussian_filter(heights, pitch, l_cutoff, periodic=periodic)
    steps += _filtered(cutoff, l_cutoff)
    if tip_radius is not None:
        heights, sentence = _felt(heights, pitch, tip_radius, periodic=periodic)
        steps.append(sentence)
    grown = tuple(step * size.lateral for step in pitch)
    heights *= size.upward
    if heights.ndim == 1:
        return Profile(heights, grown[0], periodic=periodic, filled=texture.filled)
    return HeightMap(heights, grown, periodic=periodic, filled=texture.filled)


def _dense(texture: Texture) -> tuple[FloatArray, tuple[float, float], bool]:
    """Return heights of waves like :meth:`Texture.samples`, so dense that a tip feels each."""
    points, spacing, repeats = texture.domain.grid(texture.sample_counts())
    return texture.height(points.reshape(-1, 2)).reshape(points.shape[:2]), spacing, repeats


def _felt(
    heights: FloatArray, pitch: tuple[float, ...], radius: float, *, periodic: bool
) -> tuple[FloatArray, str]:
    """Return what a tip feels; of a surface that repeats, its neighbours too."""
    if not periodic:
        return apply_tip(heights, pitch, radius)
    check_radius(heights.shape, pitch, radius)
    margins = [(math.ceil(radius / step),) * 2 for step in reversed(pitch)]
    felt, sentence = apply_tip(np.pad(heights, margins, mode="wrap"), pitch, radius)
    inner = tuple(slice(before, -after) for before, after in margins)
    return np.ascontiguousarray(felt[inner]), sentence


def _filtered(cutoff: float | None, l_cutoff: float | None) -> list[str]:
    said = [] if cutoff is None else [f"filtered: Gaussian S-filter, cut-off {length_text(cutoff)}"]
    if l_cutoff is not None:
        said.append(f"waviness removed: Gaussian L-filter, cut-off {length_text(l_cutoff)}")
    return said
