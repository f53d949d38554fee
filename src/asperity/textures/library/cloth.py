"""Woven cloth: plain weave of twisted yarns."""

from __future__ import annotations

import numpy as np

from asperity.core.arguments import SEED, Argument
from asperity.core.checks import FloatArray
from asperity.textures.library.named import SyntheticPatch
from asperity.textures.synthetic import SelfAffineSpectrum, random_field, scale_to_rms

SUMMARY = "plain-woven cotton, as firm as canvas"
SOURCE = (
    "typical of a cotton canvas, our choice; Peirce's formula (1937), diameter = 1/(28 √count) "
    "inch, gives 0.29 mm for a yarn of English count 10, here pressed flat"
)
ARGUMENTS = (
    Argument("spacing", "from yarn to yarn", "m", 0.42e-3, minimum=1e-5, maximum=0.1),
    Argument("cover", "width of a yarn, share of spacing", "", 0.88, minimum=0.2, maximum=1.0),
    Argument("yarn_thickness", "of the flattened yarn", "m", 0.22e-3, minimum=1e-7, maximum=0.1),
    Argument("irregularity", "of place and width, share", "", 0.05, maximum=0.2),
    SEED,
)

_YARNS = 8
_NODES_PER_YARN = 56
_STRANDS = 6.0
_STRAND_DEPTH = 0.09


def synthesize(
    spacing: float, cover: float, yarn_thickness: float, irregularity: float, seed: int
) -> SyntheticPatch:
    """Return 8 x 8 yarns: at every point the higher of warp and weft."""
    count = _YARNS * _NODES_PER_YARN
    yarn = 0.5 * cover, yarn_thickness / spacing
    warp = _yarns(count, *yarn, irregularity, seed, over_first=True)
    weft = _yarns(count, *yarn, irregularity, seed + 1, over_first=False).T
    # The gaps between yarns end at the middle of the lower yarns.
    floor = -0.5 * yarn_thickness
    pitch = spacing / _NODES_PER_YARN
    heights = np.maximum(np.maximum(warp, weft) * spacing, floor)
    return SyntheticPatch(heights, (pitch, pitch))


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
        scale_to_rms(
            random_field((count, count), (period, period), slow, 2 * seed + i), irregularity
        )
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
