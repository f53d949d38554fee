"""Wood: an open-pored board, planed along the grain."""

from __future__ import annotations

import numpy as np

from asperity.core.arguments import SEED, Argument
from asperity.core.checks import FloatArray
from asperity.textures.library.named import SyntheticPatch, nodes_around
from asperity.textures.synthetic import SelfAffineSpectrum, random_field, scale_to_rms

SUMMARY = "planed oak, unfinished: pores and rings along y"
SOURCE = (
    "typical of a ring-porous wood such as oak, our choice: vessels of the early wood 0.2 to "
    "0.3 mm wide and visible as grooves some millimetres long, rings 2 to 4 mm apart"
)
ARGUMENTS = (
    Argument("ring_spacing", "of the year rings", "m", 3e-3, minimum=1e-5, maximum=0.1),
    Argument("ring_height", "late wood above early wood", "m", 30e-6, minimum=0.0, maximum=0.05),
    Argument("pore_width", "of a large vessel", "m", 0.25e-3, minimum=1e-6, maximum=0.005),
    Argument("pore_depth", "of a cut vessel", "m", 0.1e-3, minimum=0.0, maximum=0.05),
    SEED,
)

_RINGS = 4
_NODES = (512, 256)
# Length of the patch over its width.
_ASPECT = 1.6
_PORES_PER_RING = 60
_PORE_LENGTH = 12.0
_EARLY = 0.35
_FIBRE = 0.04


def synthesize(
    ring_spacing: float, ring_height: float, pore_width: float, pore_depth: float, seed: int
) -> SyntheticPatch:
    """Return four rings across the grain."""
    nx, ny = _NODES
    width = _RINGS * ring_spacing
    pitch = (width / nx, _ASPECT * width / ny)
    rng = np.random.default_rng(seed)
    # Rings sway slowly along the grain.
    sway = scale_to_rms(
        random_field((ny, nx), (1.0, 0.5), SelfAffineSpectrum(2.0, 0.5, 0.12), seed), 0.1
    )
    rings = np.arange(nx)[None, :] * _RINGS / nx + sway
    heights = ring_height * _late_wood(rings)
    heights += _fibres((ny, nx), _FIBRE * (ring_height + pore_depth), seed + 1)
    pores = np.zeros((ny, nx))
    for numbers in rng.random((_RINGS * _PORES_PER_RING, 5)):
        _add_pore(pores, pitch, sway, pore_width, numbers)
    return SyntheticPatch(heights - pore_depth * pores, pitch)


def _late_wood(rings: FloatArray) -> FloatArray:
    """Return 0 in early wood, rising to 1 at the end of the ring, then falling steeply."""
    phase = np.mod(rings, 1.0)
    rise = np.clip((phase - 0.15) / 0.8, 0.0, 1.0)
    fall = np.clip((1.0 - phase) / 0.05, 0.0, 1.0)
    return np.asarray(rise**2 * (3.0 - 2.0 * rise) * fall)


def _fibres(shape: tuple[int, int], rms: float, seed: int) -> FloatArray:
    """Return fine streaks, twenty times longer than wide."""
    ny, nx = shape
    streaks = random_field(shape, (20.0, 1.0), SelfAffineSpectrum(0.6, 2.0, 0.25), seed)
    return scale_to_rms(streaks, rms) if rms > 0.0 else np.zeros((ny, nx))


def _add_pore(
    pores: FloatArray,
    pitch: tuple[float, float],
    sway: FloatArray,
    width: float,
    random_numbers: FloatArray,
) -> None:
    """Add one cut vessel: a trough with round ends, in the early wood of a ring."""
    ny, nx = pores.shape
    y0 = random_numbers[1] * ny * pitch[1]
    row = int(random_numbers[1] * ny)
    # Large vessels are in the early wood; small ones are spread over the rest.
    number, share = divmod(random_numbers[0] * _RINGS, 1.0)
    early = random_numbers[2] < 0.8
    wide = width * (0.7 + 0.5 * random_numbers[3]) if early else 0.45 * width
    place = number + (_EARLY * share if early else share)
    ring = nx * pitch[0] / _RINGS
    x0 = (place - sway[row, round(place * nx / _RINGS) % nx]) * ring
    half = 0.5 * _PORE_LENGTH * wide * (0.4 + random_numbers[4])
    rows, columns = nodes_around(y0, half, ny, pitch[1]), nodes_around(x0, wide, nx, pitch[0])
    along = (rows * pitch[1] - y0)[:, None] / half
    u = (columns * pitch[0] - x0)[None, :] / (0.5 * wide)
    trough = np.clip(1.0 - u**2, 0.0, 1.0) ** 0.5 * np.clip(1.0 - along**4, 0.0, 1.0)
    where = np.ix_(rows % ny, columns % nx)
    pores[where] = np.maximum(pores[where], trough * wide / width / (1.0 if early else 0.7))
