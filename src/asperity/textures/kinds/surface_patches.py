"""One period of each named surface, made from its parts.

Brushed metal, sandpaper and wood have random parts; cloth, knurl and tile repeat theirs.
"""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.textures.kinds.noise import Patch, SelfAffineSpectrum, low_pass, rough_field


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
    x0 = random_numbers[0] * _PAPER_NODES * pitch
    y0 = random_numbers[1] * _PAPER_NODES * pitch
    columns = _nodes_around(x0, 1.3 * radius, _PAPER_NODES, pitch)
    rows = _nodes_around(y0, 1.3 * radius, _PAPER_NODES, pitch)
    x = (columns * pitch - x0)[None, :]
    y = (rows * pitch - y0)[:, None]
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
    depth = 1.0
    if random_numbers[2] < 0.8:
        wide = width * (0.7 + 0.5 * random_numbers[3])
        share *= _EARLY
    else:
        wide = 0.45 * width
        depth = 0.7
    place = number + share
    ring = nx * pitch[0] / _RINGS
    x0 = (place - sway[row, round(place * nx / _RINGS) % nx]) * ring
    half = 0.5 * _PORE_LENGTH * wide * (0.4 + random_numbers[4])
    rows = _nodes_around(y0, half, ny, pitch[1])
    columns = _nodes_around(x0, wide, nx, pitch[0])
    along = (rows * pitch[1] - y0)[:, None] / half
    u = (columns * pitch[0] - x0)[None, :] / (0.5 * wide)
    trough = np.clip(1.0 - u**2, 0.0, 1.0) ** 0.5 * np.clip(1.0 - along**4, 0.0, 1.0)
    where = np.ix_(rows % ny, columns % nx)
    pores[where] = np.maximum(pores[where], trough * wide / width / depth)


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
    count: int,
    half_width: float,
    thickness: float,
    irregularity: float,
    seed: int,
    *,
    over_first: bool,
) -> FloatArray:
    """Return the upper side of yarns along y; lengths are in spacings."""
    period = float(_YARNS)
    # The border and the scan line, half a patch away, run along the middle of a yarn.
    along = (np.arange(count)[:, None] + 0.5) / _NODES_PER_YARN + 0.5
    across = (np.arange(count)[None, :] + 0.5) / _NODES_PER_YARN + 0.5
    slow = SelfAffineSpectrum(1.5, 4.0, 0.5)
    shape = (count, count)
    sway = rough_field(shape, (period, period), slow, irregularity, 2 * seed)
    swell = rough_field(shape, (period, period), slow, irregularity, 2 * seed + 1)
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
        raise ParameterError(
            "joint_width", f"must be at most the tile, {tile_size:g} m", joint_width
        )
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
