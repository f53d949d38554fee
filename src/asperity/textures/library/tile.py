"""Bathroom tile: a glazed mosaic with sunk joints."""

from __future__ import annotations

import numpy as np

from asperity.core.arguments import SEED, Argument
from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.textures.library.named import SyntheticPatch
from asperity.textures.synthetic import SelfAffineSpectrum, random_field, scale_to_rms

SUMMARY = "glazed square mosaic with sunk, sandy joints"
SOURCE = "typical of a 25 mm bathroom mosaic, our choice"
ARGUMENTS = (
    Argument("tile_size", "from joint to joint", "m", 23e-3, minimum=1e-4, maximum=1.0),
    Argument("joint_width", "between the tiles", "m", 2e-3, minimum=1e-5, maximum=0.5),
    Argument("joint_depth", "below the tiles", "m", 0.8e-3, minimum=1e-6, maximum=0.1),
    Argument("lippage", "rms difference of neighbours", "m", 0.05e-3, maximum=0.05),
    SEED,
)

_TILES = 2
_NODES = 480
# The rounded edge and the waves of the glaze, as shares of joint width and depth.
_EDGE = 0.9
_GLAZE = 0.012
_SAND = 0.06


def synthesize(
    tile_size: float, joint_width: float, joint_depth: float, lippage: float, seed: int
) -> SyntheticPatch:
    """Return 2 x 2 tiles."""
    if joint_width > tile_size:
        limit = f"must be at most the tile, {tile_size:g} m"
        raise ParameterError("joint_width", limit, joint_width)
    cell = tile_size + joint_width
    pitch = _TILES * cell / _NODES
    inside = _distance_from_edge(tile_size, joint_width)
    rise = np.clip(inside / (_EDGE * joint_width), 0.0, 1.0)
    tiles = joint_depth * (np.sqrt(1.0 - (1.0 - rise) ** 2) - 1.0)
    glaze = joint_depth * _GLAZE * _rough_field(0.5, 0.125, seed + 1)
    tiles += lippage * _tile_levels(seed) + glaze
    joint = -joint_depth * (1.0 + _SAND * _rough_field(0.04, 0.02, seed + 2))
    heights = np.where(inside > 0.0, np.maximum(tiles, joint), joint)
    return SyntheticPatch(heights, (pitch, pitch))


def _distance_from_edge(tile: float, joint: float) -> FloatArray:
    """Return the distance of every node from the edge of its tile [m], negative in the joint."""
    cell = tile + joint
    # The border and the scan line, half a patch away, run through the middle of the tiles.
    along = (np.arange(_NODES) + 0.5) * _TILES * cell / _NODES + 0.5 * cell
    from_middle = np.abs(np.mod(along, cell) - 0.5 * cell)
    corner = min(joint, 0.25 * tile)
    beyond = from_middle - (0.5 * tile - corner)
    outside = np.hypot(np.maximum(beyond[:, None], 0.0), np.maximum(beyond[None, :], 0.0))
    within = np.minimum(np.maximum(beyond[:, None], beyond[None, :]), 0.0)
    return np.asarray(corner - outside - within)


def _tile_levels(seed: int) -> FloatArray:
    """Return one height per tile, rms about one."""
    levels = np.random.default_rng(seed).standard_normal((_TILES, _TILES))
    half = _NODES // _TILES // 2
    whole = np.kron(levels, np.ones((2 * half, 2 * half)))
    return np.roll(whole, (half, half), axis=(0, 1))


def _rough_field(rolloff: float, cutoff: float, seed: int) -> FloatArray:
    """Return a rough field of rms 1; lengths are shares of the patch."""
    spectrum = SelfAffineSpectrum(1.5, rolloff, cutoff)
    return scale_to_rms(random_field((_NODES, _NODES), (1.0, 1.0), spectrum, seed), 1)
