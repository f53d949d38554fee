"""Wood: an open-pored board, planed along the grain."""

from __future__ import annotations

import numpy as np

from asperity.arguments import SEED, Argument
from asperity.checks import FloatArray
from asperity.textures.library.named import Drawing, around
from asperity.textures.waves import Band, random_field, with_rms

SUMMARY = "planed oak, unfinished: pores and rings along y"
SOURCE = (
    "typical of a ring-porous wood such as oak, chosen by us: vessels of the early wood 0.2 to "
    "0.3 mm wide and visible as grooves some millimetres long, rings 2 to 4 mm apart"
)
ARGUMENTS = (
    Argument("ring_spacing", "of the year rings", "m", 3e-3, low=1e-5, high=0.1),
    Argument("ring_height", "late wood above early wood", "m", 30e-6, low=0.0, high=0.05),
    Argument("pore_width", "of a large vessel", "m", 0.25e-3, low=1e-6, high=0.005),
    Argument("pore_depth", "of a cut vessel", "m", 0.1e-3, low=0.0, high=0.05),
    SEED,
)

_RINGS = 4
_NODES = (512, 256)
# The patch is twice as long as wide.
_ASPECT = 1.6
_PORES_PER_RING = 60
_PORE_LENGTH = 12.0
_EARLY = 0.35
_FIBRE = 0.04


def draw(
    ring_spacing: float, ring_height: float, pore_width: float, pore_depth: float, seed: int
) -> Drawing:
    """Return four rings across the grain."""
    nx, ny = _NODES
    width = _RINGS * ring_spacing
    pitch = (width / nx, _ASPECT * width / ny)
    rng = np.random.default_rng(seed)
    # Rings sway slowly, more across than along: the field is stretched along the grain.
    sway = with_rms(random_field((ny, nx), (1.0, 0.5), Band(2.0, 0.5, 0.12), seed), 0.1)
    rings = np.arange(nx)[None, :] * _RINGS / nx + sway
    heights = ring_height * _late_wood(rings)
    heights += _fibres((ny, nx), _FIBRE * (ring_height + pore_depth), seed + 1)
    pores = np.zeros((ny, nx))
    for one in rng.random((_RINGS * _PORES_PER_RING, 5)):
        _pore(pores, pitch, sway, pore_width, one)
    return Drawing(heights - pore_depth * pores, pitch)


def _late_wood(rings: FloatArray) -> FloatArray:
    """Return 0 in early wood, rising to 1 at the end of the year, then falling steeply."""
    phase = np.mod(rings, 1.0)
    rise = np.clip((phase - 0.15) / 0.8, 0.0, 1.0)
    fall = np.clip((1.0 - phase) / 0.05, 0.0, 1.0)
    return np.asarray(rise**2 * (3.0 - 2.0 * rise) * fall)


def _fibres(shape: tuple[int, int], rms: float, seed: int) -> FloatArray:
    """Return fine streaks, twenty times longer than wide."""
    ny, nx = shape
    streaks = random_field(shape, (20.0, 1.0), Band(0.6, 2.0, 0.25), seed)
    return with_rms(streaks, rms) if rms > 0.0 else np.zeros((ny, nx))


def _pore(
    pores: FloatArray, pitch: tuple[float, float], sway: FloatArray, width: float, dice: FloatArray
) -> None:
    """Cut one vessel open: a trough with round ends, in the early wood of a ring."""
    ny, nx = pores.shape
    y0 = dice[1] * ny * pitch[1]
    row = int(dice[1] * ny)
    # Large vessels stand in the early wood; small ones are scattered over the rest.
    number, share = divmod(dice[0] * _RINGS, 1.0)
    early = dice[2] < 0.8
    wide = width * (0.7 + 0.5 * dice[3]) if early else 0.45 * width
    place = number + (_EARLY * share if early else share)
    ring = nx * pitch[0] / _RINGS
    x0 = (place - sway[row, round(place * nx / _RINGS) % nx]) * ring
    half = 0.5 * _PORE_LENGTH * wide * (0.4 + dice[4])
    rows, columns = around(y0, half, ny, pitch[1]), around(x0, wide, nx, pitch[0])
    along = (rows * pitch[1] - y0)[:, None] / half
    u = (columns * pitch[0] - x0)[None, :] / (0.5 * wide)
    trough = np.clip(1.0 - u**2, 0.0, 1.0) ** 0.5 * np.clip(1.0 - along**4, 0.0, 1.0)
    where = np.ix_(rows % ny, columns % nx)
    pores[where] = np.maximum(pores[where], trough * wide / width / (1.0 if early else 0.7))
