"""Brushed metal: long fine scratches along one direction."""

from __future__ import annotations

import numpy as np

from asperity.core.arguments import SEED, Argument
from asperity.core.checks import FloatArray
from asperity.textures.library.named import SyntheticPatch, nodes_around
from asperity.textures.synthetic import low_pass

SUMMARY = "ground along y, like the door of a lift"
SOURCE = (
    "typical, our choice: stainless steel with a brushed finish (2J of EN 10088-2, No. 4 of "
    "ASTM A480) has an arithmetic mean roughness of some tenths of a micrometre across the grain"
)
ARGUMENTS = (
    Argument("rms", "root mean square height", "m", 0.6e-6, minimum=1e-9, maximum=1e-2),
    Argument("scratch_width", "of a typical scratch", "m", 40e-6, minimum=1e-7, maximum=1e-2),
    Argument("scratch_length", "of a typical scratch", "m", 2e-3, minimum=1e-6, maximum=1.0),
    SEED,
)

_NODES = (512, 256)
_NODES_PER_WIDTH = 8.0
# Length of the patch, in scratches.
_LENGTHS = 2.0
_SCRATCHES = 1500
_TILT = 0.15


def synthesize(
    rms: float, scratch_width: float, scratch_length: float, seed: int
) -> SyntheticPatch:
    """Return 64 scratch widths by two scratch lengths, scratched 1500 times."""
    nx, ny = _NODES
    pitch = (scratch_width / _NODES_PER_WIDTH, _LENGTHS * scratch_length / ny)
    rng = np.random.default_rng(seed)
    heights = np.zeros((ny, nx))
    for numbers in rng.random((_SCRATCHES, 6)):
        _add_scratch(heights, pitch, scratch_width, scratch_length, numbers)
    heights -= heights.mean()
    # The rms is that of the finished surface, after the low-pass.
    return SyntheticPatch(heights * (rms / low_pass(heights).std()), pitch)


def _add_scratch(
    heights: FloatArray,
    pitch: tuple[float, float],
    width: float,
    length: float,
    random_numbers: FloatArray,
) -> None:
    """Add a slightly tilted groove with raised lips and tapered ends."""
    ny, nx = heights.shape
    x0, y0 = random_numbers[0] * nx * pitch[0], random_numbers[1] * ny * pitch[1]
    wide = width * (0.5 + random_numbers[2] ** 2)
    half = 0.5 * length * (0.3 + 0.7 * random_numbers[3])
    # Few scratches are deep.
    depth = 0.15 + random_numbers[4] ** 4
    tilt = _TILT * (2.0 * random_numbers[5] - 1.0) * width / length * 8.0
    rows = nodes_around(y0, half, ny, pitch[1])
    along = (rows * pitch[1] - y0)[:, None]
    columns = nodes_around(x0, 1.5 * wide + abs(tilt) * half, nx, pitch[0])
    u = (columns * pitch[0] - x0)[None, :] - tilt * along
    # The second derivative of a Gaussian: a groove between two lips, of no net volume.
    square = (2.5 * u / wide) ** 2
    groove = (square - 1.0) * np.exp(-0.5 * square)
    ends = np.cos(0.5 * np.pi * np.clip(along / half, -1.0, 1.0)) ** 2
    heights[np.ix_(rows % ny, columns % nx)] += depth * ends * groove
