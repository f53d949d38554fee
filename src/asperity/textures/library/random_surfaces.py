"""Named surfaces of random parts: brushed metal, sandpaper and wood."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.textures.synthetic import Patch, SelfAffineSpectrum, low_pass, rough_field


def _nodes_around(position: float, half_width: float, count: int, pitch: float) -> NDArray[np.intp]:
    """Return the indices of the nodes within half_width of a position, also beyond the period.

    Modulo the count they are nodes; times the pitch they are positions around the given one, to add
    a feature across the border of a period.
    """
    first = int(np.ceil((position - half_width) / pitch))
    last = int(np.floor((position + half_width) / pitch))
    # A feature longer than the period would overlap itself: it is cut to one period.
    return np.arange(first, min(last, first + count - 1) + 1, dtype=np.intp)


# --- brushed metal: long fine scratches along one direction ---------------------------------------

_METAL_NODES = (512, 256)
_NODES_PER_WIDTH = 8.0
# Length of the patch, in scratches.
_PATCH_LENGTHS = 2.0
_SCRATCHES = 1500
_TILT = 0.15


def brush_metal(rms: float, scratch_width: float, scratch_length: float, seed: int) -> Patch:
    """Return 64 scratch widths by two scratch lengths, scratched 1500 times."""
    nx, ny = _METAL_NODES
    pitch = (scratch_width / _NODES_PER_WIDTH, _PATCH_LENGTHS * scratch_length / ny)
    rng = np.random.default_rng(seed)
    heights = np.zeros((ny, nx))
    for numbers in rng.random((_SCRATCHES, 6)):
        _add_scratch(heights, pitch, scratch_width, scratch_length, numbers)
    heights -= heights.mean()
    # The rms is that of the finished surface, after the low-pass.
    return heights * (rms / low_pass(heights).std()), pitch


def _add_scratch(
    heights: FloatArray,
    pitch: tuple[float, float],
    width: float,
    length: float,
    random_numbers: FloatArray,
) -> None:
    """Add a slightly tilted groove with raised lips and tapered ends."""
    ny, nx = heights.shape
    x0 = random_numbers[0] * nx * pitch[0]
    y0 = random_numbers[1] * ny * pitch[1]
    wide = width * (0.5 + random_numbers[2] ** 2)
    half = 0.5 * length * (0.3 + 0.7 * random_numbers[3])
    # Few scratches are deep.
    depth = 0.15 + random_numbers[4] ** 4
    tilt = _TILT * (2.0 * random_numbers[5] - 1.0) * width / length * 8.0
    rows = _nodes_around(y0, half, ny, pitch[1])
    along = (rows * pitch[1] - y0)[:, None]
    columns = _nodes_around(x0, 1.5 * wide + abs(tilt) * half, nx, pitch[0])
    u = (columns * pitch[0] - x0)[None, :] - tilt * along
    # The second derivative of a Gaussian: a groove between two lips, of no net volume.
    square = (2.5 * u / wide) ** 2
    groove = (square - 1.0) * np.exp(-0.5 * square)
    ends = np.cos(0.5 * np.pi * np.clip(along / half, -1.0, 1.0)) ** 2
    heights[np.ix_(rows % ny, columns % nx)] += depth * ends * groove


# --- sandpaper: angular grains of a standard grade, glued to paper --------------------------------

_PAPER_NODES = 448
_SURFACES = Path(__file__).with_name("surfaces.toml").read_text("utf-8")
GRAIN_SIZES: dict[str, float] = tomllib.loads(_SURFACES)["sandpaper"]["grain_sizes"]
"""Mean grain size [m] by grade: FEPA 43-1, ISO 6344."""
_NODES_PER_GRAIN = 16.0
_FACETS = 7
# Steps of the additive recurrence with the plastic number 1.3247...: 1/p and 1/p².
_RECURRENCE_STEPS = (0.7548776662466927, 0.5698402909980532)
_JITTER = 1.2


def glue_sandpaper(grit: str, coverage: float, embedding: float, seed: int) -> Patch:
    """Return a square of 28 grain sizes."""
    size = GRAIN_SIZES[grit]
    side = _PAPER_NODES / _NODES_PER_GRAIN
    rng = np.random.default_rng(seed)
    # Flat glue; the low-pass filter forms menisci at the grains.
    heights = np.full((_PAPER_NODES, _PAPER_NODES), embedding)
    dice = rng.random((round(coverage * side**2), 3 + 3 * _FACETS))
    # Electrostatic coating distributes grains evenly: a jittered low-discrepancy sequence.
    even = np.outer(np.arange(len(dice)), _RECURRENCE_STEPS)
    dice[:, :2] = np.mod(even + _JITTER * dice[:, :2] / side, 1.0)
    for numbers in dice:
        _add_grain(heights, numbers)
    pitch = size / _NODES_PER_GRAIN
    return heights * size, (pitch, pitch)


def _add_grain(heights: FloatArray, random_numbers: FloatArray) -> None:
    """Add a convex polyhedron, bounded above by its lowest facet; lengths in grain sizes."""
    pitch = 1.0 / _NODES_PER_GRAIN
    radius = 0.5 * (0.75 + 0.5 * random_numbers[2])
    columns, rows = (
        _nodes_around(d * _PAPER_NODES * pitch, 1.3 * radius, _PAPER_NODES, pitch)
        for d in random_numbers[:2]
    )
    x = (columns * pitch - random_numbers[0] * _PAPER_NODES * pitch)[None, :]
    y = (rows * pitch - random_numbers[1] * _PAPER_NODES * pitch)[:, None]
    turn, lean, reach = random_numbers[3:].reshape(3, _FACETS)
    upper = np.full((len(rows), len(columns)), np.inf)
    for i in range(_FACETS):
        azimuth = 2.0 * math.pi * (i + 0.8 * turn[i]) / _FACETS
        # Facets are inclined by 25° to 70° and touch a ball of about the radius of the grain.
        slope = math.radians(25.0 + 45.0 * lean[i])
        touch = radius * (0.75 + 0.35 * reach[i])
        along = x * math.cos(azimuth) + y * math.sin(azimuth)
        facet = (touch - along * math.sin(slope)) / math.cos(slope)
        upper = np.minimum(upper, facet)
    # The sieve limits the height of a grain.
    top = radius + np.minimum(upper, 1.1 * radius)
    where = np.ix_(rows % _PAPER_NODES, columns % _PAPER_NODES)
    heights[where] = np.maximum(heights[where], top)


# --- wood: an open-pored board, planed along the grain --------------------------------------------

_RINGS = 4
_BOARD_NODES = (512, 256)
# Length of the patch over its width.
_ASPECT = 1.6
_PORES_PER_RING = 60
_PORE_LENGTH = 12.0
_EARLY = 0.35
_FIBRE = 0.04


def plane_wood(
    ring_spacing: float, ring_height: float, pore_width: float, pore_depth: float, seed: int
) -> Patch:
    """Return four rings across the grain."""
    nx, ny = _BOARD_NODES
    width = _RINGS * ring_spacing
    pitch = (width / nx, _ASPECT * width / ny)
    rng = np.random.default_rng(seed)
    # Rings sway slowly along the grain.
    slow = SelfAffineSpectrum(2.0, 0.5, 0.12)
    sway = rough_field((ny, nx), (1.0, 0.5), slow, 0.1, seed)
    rings = np.arange(nx)[None, :] * _RINGS / nx + sway
    heights = ring_height * _late_wood(rings)
    # Fine streaks, twenty times longer than wide.
    streaks = SelfAffineSpectrum(0.6, 2.0, 0.25)
    rms = _FIBRE * (ring_height + pore_depth)
    heights += rough_field((ny, nx), (20.0, 1.0), streaks, rms, seed + 1)
    pores = np.zeros((ny, nx))
    for numbers in rng.random((_RINGS * _PORES_PER_RING, 5)):
        _add_pore(pores, pitch, sway, pore_width, numbers)
    return heights - pore_depth * pores, pitch


def _late_wood(rings: FloatArray) -> FloatArray:
    """Return 0 in early wood, rising to 1 at the end of the ring, then falling steeply."""
    phase = np.mod(rings, 1.0)
    rise = np.clip((phase - 0.15) / 0.8, 0.0, 1.0)
    fall = np.clip((1.0 - phase) / 0.05, 0.0, 1.0)
    return np.asarray(rise**2 * (3.0 - 2.0 * rise) * fall)


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
    rows = _nodes_around(y0, half, ny, pitch[1])
    columns = _nodes_around(x0, wide, nx, pitch[0])
    along = (rows * pitch[1] - y0)[:, None] / half
    u = (columns * pitch[0] - x0)[None, :] / (0.5 * wide)
    trough = np.clip(1.0 - u**2, 0.0, 1.0) ** 0.5 * np.clip(1.0 - along**4, 0.0, 1.0)
    where = np.ix_(rows % ny, columns % nx)
    pores[where] = np.maximum(pores[where], trough * wide / width / (1.0 if early else 0.7))
