"""Sandpaper: angular grains of a standard grade, glued to paper."""

from __future__ import annotations

import math

import numpy as np

from asperity.core.arguments import SEED, Argument
from asperity.core.checks import FloatArray
from asperity.textures.library.named import SyntheticPatch, nodes_around

SUMMARY = "abrasive paper, grains by P grade"
SOURCE = (
    "mean grain sizes of FEPA 43-1 / ISO 6344 (P60 269 µm, P80 201, P120 125, P180 82, P240 58.5, "
    "P400 35.0); shape, coverage and how deep the grains are glued in are our choice"
)
GRAIN_SIZES = {
    "P60": 269e-6,
    "P80": 201e-6,
    "P120": 125e-6,
    "P180": 82e-6,
    "P240": 58.5e-6,
    "P400": 35.0e-6,
}
"""Mean grain size [m] by grade: FEPA 43-1, ISO 6344."""
ARGUMENTS = (
    Argument("grit", "grade", default="P120", form="text", choices=tuple(GRAIN_SIZES)),
    Argument("coverage", "grains per square of the grain size", "", 0.9, minimum=0.05, maximum=1.5),
    Argument("embedding", "share of a grain in the glue", "", 0.45, minimum=0.0, maximum=0.9),
    SEED,
)

_NODES = 448
_NODES_PER_GRAIN = 16.0
_FACETS = 7
# Steps of the additive recurrence with the plastic number 1.3247...: 1/p and 1/p².
_RECURRENCE_STEPS = (0.7548776662466927, 0.5698402909980532)
_JITTER = 1.2


def synthesize(grit: str, coverage: float, embedding: float, seed: int) -> SyntheticPatch:
    """Return a square of 28 grain sizes."""
    size = GRAIN_SIZES[grit]
    side = _NODES / _NODES_PER_GRAIN
    rng = np.random.default_rng(seed)
    # Flat glue; the low-pass filter forms menisci at the grains.
    heights = np.full((_NODES, _NODES), embedding)
    dice = rng.random((round(coverage * side**2), 3 + 3 * _FACETS))
    # Electrostatic coating distributes grains evenly: a jittered low-discrepancy sequence.
    even = np.outer(np.arange(len(dice)), _RECURRENCE_STEPS)
    dice[:, :2] = np.mod(even + _JITTER * dice[:, :2] / side, 1.0)
    for numbers in dice:
        _add_grain(heights, numbers)
    pitch = size / _NODES_PER_GRAIN
    return SyntheticPatch(heights * size, (pitch, pitch))


def _add_grain(heights: FloatArray, random_numbers: FloatArray) -> None:
    """Add a convex polyhedron, bounded above by its lowest facet; lengths in grain sizes."""
    pitch = 1.0 / _NODES_PER_GRAIN
    radius = 0.5 * (0.75 + 0.5 * random_numbers[2])
    columns, rows = (
        nodes_around(d * _NODES * pitch, 1.3 * radius, _NODES, pitch) for d in random_numbers[:2]
    )
    x = (columns * pitch - random_numbers[0] * _NODES * pitch)[None, :]
    y = (rows * pitch - random_numbers[1] * _NODES * pitch)[:, None]
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
    where = np.ix_(rows % _NODES, columns % _NODES)
    heights[where] = np.maximum(heights[where], top)
