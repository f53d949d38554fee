"""Bathroom tile: a glazed mosaic with sunk joints."""

from __future__ import annotations

import numpy as np

from asperity.arguments import SEED, Argument
from asperity.checks import FloatArray
from asperity.errors import ParameterError
from asperity.textures.library.named import Drawing
from asperity.textures.waves import Band, random_field, with_rms

SUMMARY = "glazed square mosaic with sunk, sandy joints"
SOURCE = "typical of a 25 mm bathroom mosaic, chosen by us"
ARGUMENTS = (
    Argument("tile_size", "from joint to joint", "m", 23e-3, low=1e-4, high=1.0),
    Argument("joint_width", "between the tiles", "m", 2e-3, low=1e-5, high=0.5),
    Argument("joint_depth", "below the tiles", "m", 0.8e-3, low=1e-6, high=0.1),
    Argument("lippage", "rms difference of neighbours", "m", 0.05e-3, high=0.05),
    SEED,
)

_TILES = 2
_NODES = 480
# The rounded edge and the waves of the glaze, as shares of joint width and depth.
_EDGE = 0.9
_GLAZE = 0.012
_SAND = 0.06


def draw(
    tile_size: float, joint_width: float, joint_depth: float, lippage: float, seed: int
) -> Drawing:
    """Return 2 x 2 tiles."""
    if joint_width > tile_size:
        raise ParameterError(
            "joint_width", f"must be at most the tile, {tile_size:g} m", joint_width
        )
    cell = tile_size + joint_width
    pitch = _TILES * cell / _NODES
    inside = _distance_from_edge(tile_size, joint_width)
    rise = np.clip(inside / (_EDGE * joint_width), 0.0, 1.0)
    tiles = joint_depth * (np.sqrt(1.0 - (1.0 - rise) ** 2) - 1.0)
    tiles += lippage * _levels(seed) + joint_depth * _GLAZE * _rough(0.5, 0.125, seed + 1)
    joint = -joint_depth * (1.0 + _SAND * _rough(0.04, 0.02, seed + 2))
    heights = np.where(inside > 0.0, np.maximum(tiles, joint), joint)
    return Drawing(heights, (pitch, pitch))


def _distance_from_edge(tile: float, joint: float) -> FloatArray:
    """Return how far inside its tile every node is [m]; negative in the joint; round corners."""
    cell = tile + joint
    # The border, and with it the scan line half a patch further, runs through the tiles' middles.
    along = (np.arange(_NODES) + 0.5) * _TILES * cell / _NODES + 0.5 * cell
    from_middle = np.abs(np.mod(along, cell) - 0.5 * cell)
    corner = min(joint, 0.25 * tile)
    beyond = from_middle - (0.5 * tile - corner)
    outside = np.hypot(np.maximum(beyond[:, None], 0.0), np.maximum(beyond[None, :], 0.0))
    within = np.minimum(np.maximum(beyond[:, None], beyond[None, :]), 0.0)
    return np.asarray(corner - outside - within)


def _levels(seed: int) -> FloatArray:
    """Return one height per tile, rms about one."""
    levels = np.random.default_rng(seed).standard_normal((_TILES, _TILES))
    half = _NODES // _TILES // 2
    whole = np.kron(levels, np.ones((2 * half, 2 * half)))
    return np.roll(whole, (half, half), axis=(0, 1))


def _rough(rolloff: float, cutoff: float, seed: int) -> FloatArray:
    """Return a rough field of rms 1; lengths are shares of the patch."""
    return with_rms(random_field((_NODES, _NODES), (1.0, 1.0), Band(1.5, rolloff, cutoff), seed), 1)
