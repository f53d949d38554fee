"""Surface parameters of ISO 25178-2 (maps) and ISO 21920-2 (profiles).

**Discretisation.** Heights are samples of equal weight; z is the height above the mean of all
that were measured. Slopes and areas are those of the triangles through the nodes, over the cells
of which all corners were measured; each cell is cut along both diagonals, and the mean taken. So
Sdq is the root of the mean square of the differences of neighbours over their distance, and Sdr is
exact for the facets. Of a wave of n samples a period Sdq is too small by the factor
sin(π/n)/(π/n): by 2.6 % at 8 samples, 0.4 % at 20.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from asperity.checks import FloatArray

Values = Mapping[str, float | None]
"""Parameters by symbol, SI units; None for what a surface has not (the skewness of a flat one)."""


@dataclass(frozen=True)
class Parameter:
    """What a symbol means.

    Attributes:
        symbol: such as "Sq"; of a profile without P or R, such as "q".
        words: its name.
        formula: with z the height above the mean.
        clause: where it is defined.
        unit: "m", or "" for a number.
    """

    symbol: str
    words: str
    formula: str
    clause: str
    unit: str = "m"


AREAL = (
    Parameter("Sq", "root mean square height", "√⟨z²⟩", "ISO 25178-2:2021, 4.2.2"),
    Parameter("Sa", "arithmetic mean height", "⟨|z|⟩", "ISO 25178-2:2021, 4.2.8"),
    Parameter("Sz", "maximum height", "Sp + Sv", "ISO 25178-2:2021, 4.2.7"),
    Parameter("Sp", "maximum peak height", "max z", "ISO 25178-2:2021, 4.2.5"),
    Parameter("Sv", "maximum pit depth", "-min z", "ISO 25178-2:2021, 4.2.6"),
    Parameter("Ssk", "skewness: below 0 pits, above 0 peaks prevail", "⟨z³⟩/Sq³",
              "ISO 25178-2:2021, 4.2.3", ""),
    Parameter("Sku", "kurtosis: 3 for Gaussian heights, more for single spikes", "⟨z⁴⟩/Sq⁴",
              "ISO 25178-2:2021, 4.2.4", ""),
    Parameter("Sdq", "root mean square gradient", "√⟨z_x² + z_y²⟩",
              "ISO 25178-2:2021, 4.4.2", ""),
    Parameter("Sdr", "developed interfacial area ratio: area beyond that of the plane",
              "⟨√(1 + z_x² + z_y²)⟩ - 1", "ISO 25178-2:2021, 4.4.3", ""),
)  # fmt: skip
"""Of maps, in the order in which they are listed."""

PROFILE = (
    Parameter("q", "root mean square height", "√⟨z²⟩", "ISO 21920-2; ISO 4287, 4.2.2"),
    Parameter("a", "arithmetic mean height", "⟨|z|⟩", "ISO 21920-2; ISO 4287, 4.2.1"),
    Parameter("z", "maximum height, mean over the sections", "⟨p + v⟩ of the sections",
              "ISO 21920-2; ISO 4287, 4.1.3"),
    Parameter("p", "peak height, mean over the sections", "⟨max z⟩ of the sections",
              "ISO 21920-2; ISO 4287, 4.1.1"),
    Parameter("v", "pit depth, mean over the sections", "⟨-min z⟩ of the sections",
              "ISO 21920-2; ISO 4287, 4.1.2"),
    Parameter("t", "total height", "max z - min z", "ISO 21920-2; ISO 4287, 4.1.5"),
    Parameter("sk", "skewness: below 0 pits, above 0 peaks prevail", "⟨z³⟩/q³",
              "ISO 21920-2; ISO 4287, 4.2.3", ""),
    Parameter("ku", "kurtosis: 3 for Gaussian heights, more for single spikes", "⟨z⁴⟩/q⁴",
              "ISO 21920-2; ISO 4287, 4.2.4", ""),
    Parameter("Sm", "mean spacing of profile elements", "mean distance of rising crossings of the"
              " mean line between a pit and a peak deeper and higher than a tenth of z",
              "ISO 21920-2; ISO 4287, 4.3.1"),
    Parameter("dq", "root mean square slope", "√⟨z_x²⟩", "ISO 21920-2; ISO 4287, 4.4.1", ""),
)  # fmt: skip
"""Of profiles; their symbols begin with P, after an L-filter with R."""

_ENOUGH = 0.1  # of Rz: lower peaks and flatter pits make no profile element (ISO 4287, 4.3.1)
_BLOCK = 2**15  # points that are counted at once: they stay in the cache


_DECLARED = {one.symbol: one for one in AREAL} | {
    f"{kind}{one.symbol}": one for kind in "PR" for one in PROFILE
}


def declared(symbol: str) -> Parameter:
    """Return what a symbol means, that of a profile with its P or R.

    Raises:
        KeyError: for a symbol that means nothing here.
    """
    return _DECLARED[symbol]


@np.errstate(over="ignore", invalid="ignore")  # heights that no surface has are refused elsewhere
def parameters(
    heights: FloatArray, pitch: tuple[float, ...], nesting: float | None = None
) -> dict[str, float | None]:
    """Return the parameters of a map, or of a profile.

    A map has those of :data:`AREAL`, a profile those of :data:`PROFILE`, whose symbols begin with
    P (primary profile), or with R if the nesting index L of its L-filter is given: its sections
    are then L long, else it is one section.

    Args:
        heights: [m], shape (ny, nx) or (n,); NaN where missing, not everywhere.
        pitch: (px, py) or (px,) [m].
        nesting: L of the L-filter that the heights went through [m]; None for none.

    Returns:
        The values by symbol, SI units; None for what the surface has not.

    Reference:
        ISO 25178-2:2021, 4.2 and 4.4; ISO 21920-2:2021, which replaces ISO 4287:1997.

    Example:
        >>> x = np.arange(100) / 100
        >>> wave = parameters(np.tile(np.sin(2 * np.pi * x), (100, 1)), (0.01, 0.01))
        >>> f"{wave['Sq']:.4f} {wave['Sa']:.4f} {wave['Sku']:.4f} {wave['Sdq']:.3f}"
        '0.7071 0.6364 1.5000 4.420'
    """
    rows, steps = np.atleast_2d(heights), (pitch[0], pitch[-1])
    mean, low, high = _mean_and_range(rows)
    a, q, skewness, kurtosis = _height_values(rows, mean, high - low)
    gradient, ratio = _facets(rows, steps)
    if heights.ndim > 1:
        values = (q, a, high - low, high - mean, mean - low, skewness, kurtosis, gradient, ratio)
        return dict(zip((one.symbol for one in AREAL), values, strict=True))
    kind, sections = ("P", 1) if nesting is None else ("R", _sections(len(heights), pitch, nesting))
    peak, pit = _peak_and_pit(heights - mean, sections)
    spacing = _spacing(heights - mean, pitch[0], _ENOUGH * (peak + pit))
    line = (q, a, peak + pit, peak, pit, high - low, skewness, kurtosis, spacing, gradient)
    return {f"{kind}{one.symbol}": v for one, v in zip(PROFILE, line, strict=True)}


def _blocks(rows: FloatArray, overlap: int = 0) -> Iterator[FloatArray]:
    """Yield groups of rows; the first ones of the next group belong to each as well."""
    count = max(1, _BLOCK // rows.shape[1])
    for first in range(0, rows.shape[0], count):
        yield rows[first : first + count + overlap]


def _known(block: FloatArray) -> FloatArray:
    """Return the heights that are not missing, as a row."""
    missing = np.isnan(block)
    return block[~missing] if missing.any() else block.ravel()


def _mean_and_range(rows: FloatArray) -> tuple[float, float, float]:
    total, count, low, high = 0.0, 0, math.inf, -math.inf
    for block in _blocks(rows):
        z = _known(block)
        if z.size:
            total, count = total + float(z.sum()), count + z.size
            low, high = min(low, float(z.min())), max(high, float(z.max()))
    return total / count, low, high


def _height_values(
    rows: FloatArray, mean: float, span: float
) -> tuple[float, float, float | None, float | None]:
    """Return Sa, Sq, Ssk and Sku; powers are taken of z over the range, which none overflows."""
    if not 0.0 < span < math.inf:
        return span, span, None, None
    sums, count = np.zeros(4), 0
    for block in _blocks(rows):
        z = (_known(block) - mean) / span
        square = z * z
        sums += np.abs(z).sum(), square.sum(), (square * z).sum(), (square * square).sum()
        count += z.size
    a, second, third, fourth = (float(value) for value in sums / count)
    q = math.sqrt(second)
    return a * span, q * span, third / q**3, fourth / q**4


def _facets(rows: FloatArray, pitch: tuple[float, float]) -> tuple[float | None, float | None]:
    """Return Sdq and Sdr of the facets; None without a cell of which all corners are known."""
    if rows.shape[0] == 1:
        rows = np.repeat(rows, 2, axis=0)  # a profile: the same along y
    squares, excess, cells = 0.0, 0.0, 0
    for block in _blocks(rows, overlap=1):
        along, across = np.diff(block, axis=1) / pitch[0], np.diff(block, axis=0) / pitch[1]
        lower, upper, left, right = along[:-1], along[1:], across[:, :-1], across[:, 1:]
        corners = [part**2 for part in (lower, upper, left, right)]
        known = ~np.isnan(lower + upper)
        if not known.all():
            corners = [part[known] for part in corners]
        squares += 0.5 * float(sum(part.sum() for part in corners))
        excess += 0.25 * sum(_excess(x + y) for x in corners[:2] for y in corners[2:])
        cells += corners[0].size
    return (math.sqrt(squares / cells), excess / cells) if cells else (None, None)


def _excess(square: FloatArray) -> float:
    """Return the sum of √(1 + g²) - 1, also where g² is next to nothing."""
    return float((square / (1.0 + np.sqrt(1.0 + square))).sum())


def _sections(count: int, pitch: tuple[float, ...], nesting: float) -> int:
    return max(1, math.floor((count - 1) * pitch[0] / nesting * (1 + 1e-9)))


def _peak_and_pit(z: FloatArray, sections: int) -> tuple[float, float]:
    """Return the means over the sections of their greatest heights and depths."""
    parts = [part[~np.isnan(part)] for part in np.array_split(z, sections)]
    held = [part for part in parts if part.size]
    peaks, pits = [float(part.max()) for part in held], [-float(part.min()) for part in held]
    return sum(peaks) / len(held), sum(pits) / len(held)


def _spacing(z: FloatArray, pitch: float, enough: float) -> float | None:
    """Return the mean distance of rising crossings; None for fewer than two.

    A peak or pit counts where it is higher or deeper than enough, so that noise on the mean line
    is no element. Missing points are passed over.
    """
    place = np.flatnonzero(~np.isnan(z))
    z = z[place]
    side = np.where(z > enough, 1, np.where(z < -enough, -1, 0))
    counted = np.flatnonzero(side)
    rising = counted[1:][(side[counted[1:]] == 1) & (side[counted[:-1]] == -1)]
    # The last crossing before each counted peak: where the line last was below zero.
    below = np.flatnonzero(z < 0.0)
    if len(rising) < 2:
        return None
    before = below[np.searchsorted(below, rising) - 1]
    share = z[before] / (z[before] - z[before + 1])
    crossings = place[before] + share * (place[before + 1] - place[before])
    return float(crossings[-1] - crossings[0]) / (len(crossings) - 1) * pitch
