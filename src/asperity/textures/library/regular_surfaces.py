"""Named surfaces of repeated parts: cloth, knurl and tile."""

from __future__ import annotations

import math

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.textures.synthetic import Patch, SelfAffineSpectrum, rough_field

# --- woven cloth: plain weave of twisted yarns ----------------------------------------------------

_YARNS = 8
_NODES_PER_YARN = 56
_STRANDS = 6.0
_STRAND_DEPTH = 0.09


def weave_cloth(
    spacing: float, cover: float, yarn_thickness: float, irregularity: float, seed: int
) -> Patch:
    """Return 8 x 8 yarns: at every point the higher of warp and weft."""
    count = _YARNS * _NODES_PER_YARN
    yarn = 0.5 * cover, yarn_thickness / spacing
    warp = _yarns(count, *yarn, irregularity, seed, over_first=True)
    weft = _yarns(count, *yarn, irregularity, seed + 1, over_first=False).T
    # The gaps between yarns end at the middle of the lower yarns.
    floor = -0.5 * yarn_thickness
    pitch = spacing / _NODES_PER_YARN
    heights = np.maximum(np.maximum(warp, weft) * spacing, floor)
    return heights, (pitch, pitch)


def _yarns(
    count: int, half_width: float, thickness: float, irregularity: float, seed: int,
    *, over_first: bool,
) -> FloatArray:  # fmt: skip
    """Return the upper side of yarns along y; lengths are in spacings."""
    period = float(_YARNS)
    # The border and the scan line, half a patch away, run along the middle of a yarn.
    along = (np.arange(count)[:, None] + 0.5) / _NODES_PER_YARN + 0.5
    across = (np.arange(count)[None, :] + 0.5) / _NODES_PER_YARN + 0.5
    slow = SelfAffineSpectrum(1.5, 4.0, 0.5)
    sway, swell = (
        rough_field((count, count), (period, period), slow, irregularity, 2 * seed + i)
        for i in (0, 1)
    )
    across = across + sway
    number = np.floor(across)
    offset = across - number - 0.5
    # Over and under alternate along a yarn, and between neighbours.
    sign = 1.0 if over_first else -1.0
    parity = 1.0 - 2.0 * np.mod(number, 2.0)
    centre = sign * parity * 0.5 * thickness * np.sin(np.pi * along)
    side = offset / (half_width * (1.0 + swell))
    # Strands wind around the yarn: straight lines in the angle about its axis.
    angle = np.arcsin(np.clip(side, -1.0, 1.0))
    strand = np.cos(_STRANDS * angle - 4.0 * np.pi * along)
    # A lens, not an ellipse: pressed yarns have no vertical sides. Its flanks go on downwards
    # beyond the width, where the yarn overhangs and a height map cannot follow.
    lens = 1.0 - side**2 + _STRAND_DEPTH * strand * np.cos(angle) ** 2
    return np.asarray(centre + 0.5 * thickness * lens)


# --- diamond knurl: pyramids pressed into metal by two crossed rolls ------------------------------

_KNURL_CELLS = (4, 2)
_KNURL_NODES = (384, 320)


def press_knurl(spacing: float, groove_angle: float, profile_angle: float, flat: float) -> Patch:
    """Return 4 x 2 cells of the lattice, two pyramids each."""
    cell = spacing / np.array([math.cos(groove_angle), math.sin(groove_angle)])
    (cx, cy) = _KNURL_CELLS
    (nx, ny) = _KNURL_NODES
    u = (np.arange(nx) + 0.5) * cx / nx
    v = (np.arange(ny)[:, None] + 0.5) * cy / ny
    # Distance from the bottom of the nearest groove [spacings], for both families of grooves.
    both = [np.abs(phase - np.round(phase)) for phase in (u + v, u - v)]
    rise = np.minimum(*both)
    steep = spacing / math.tan(0.5 * profile_angle)
    heights = steep * np.minimum(rise, 0.5 * (1.0 - flat))
    return heights, (float(cell[0] * cx / nx), float(cell[1] * cy / ny))


# --- bathroom tile: a glazed mosaic with sunk joints ----------------------------------------------

_TILES = 2
_TILE_NODES = 480
# The rounded edge and the waves of the glaze, as shares of joint width and depth.
_EDGE = 0.9
_GLAZE = 0.012
_SAND = 0.06


def lay_tiles(
    tile_size: float, joint_width: float, joint_depth: float, lippage: float, seed: int
) -> Patch:
    """Return 2 x 2 tiles."""
    if joint_width > tile_size:
        limit = f"must be at most the tile, {tile_size:g} m"
        raise ParameterError("joint_width", limit, joint_width)
    cell = tile_size + joint_width
    pitch = _TILES * cell / _TILE_NODES
    inside = _distance_from_edge(tile_size, joint_width)
    rise = np.clip(inside / (_EDGE * joint_width), 0.0, 1.0)
    tiles = joint_depth * (np.sqrt(1.0 - (1.0 - rise) ** 2) - 1.0)
    glaze = joint_depth * _GLAZE * _glaze_field(0.5, 0.125, seed + 1)
    tiles += lippage * _tile_levels(seed) + glaze
    joint = -joint_depth * (1.0 + _SAND * _glaze_field(0.04, 0.02, seed + 2))
    heights = np.where(inside > 0.0, np.maximum(tiles, joint), joint)
    return heights, (pitch, pitch)


def _distance_from_edge(tile: float, joint: float) -> FloatArray:
    """Return the distance of every node from the edge of its tile [m], negative in the joint."""
    cell = tile + joint
    # The border and the scan line, half a patch away, run through the middle of the tiles.
    along = (np.arange(_TILE_NODES) + 0.5) * _TILES * cell / _TILE_NODES + 0.5 * cell
    from_middle = np.abs(np.mod(along, cell) - 0.5 * cell)
    corner = min(joint, 0.25 * tile)
    beyond = from_middle - (0.5 * tile - corner)
    outside = np.hypot(np.maximum(beyond[:, None], 0.0), np.maximum(beyond[None, :], 0.0))
    within = np.minimum(np.maximum(beyond[:, None], beyond[None, :]), 0.0)
    return np.asarray(corner - outside - within)


def _tile_levels(seed: int) -> FloatArray:
    """Return one height per tile, rms about one."""
    levels = np.random.default_rng(seed).standard_normal((_TILES, _TILES))
    half = _TILE_NODES // _TILES // 2
    whole = np.kron(levels, np.ones((2 * half, 2 * half)))
    return np.roll(whole, (half, half), axis=(0, 1))


def _glaze_field(rolloff: float, cutoff: float, seed: int) -> FloatArray:
    """Return a rough field of rms 1; lengths are shares of the patch."""
    spectrum = SelfAffineSpectrum(1.5, rolloff, cutoff)
    return rough_field((_TILE_NODES, _TILE_NODES), (1.0, 1.0), spectrum, 1.0, seed)
