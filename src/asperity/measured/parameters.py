"""Surface parameters of ISO 25178-2 (maps) and ISO 21920-2 (profiles).

**Discretisation.** Heights are samples of equal weight; z is the height above the mean of all
measured ones. Slopes and areas are those of the triangles through the nodes, over the cells with
four measured corners; each cell is cut along both diagonals, and the mean taken. So Sdq is the
root mean square of the difference quotients of neighbours, and Sdr is exact for the facets. For a
wave of n samples per period Sdq is too small by the factor sin(π/n)/(π/n): by 2.6 % at 8 samples,
0.4 % at 20.
"""

from __future__ import annotations

import itertools
import math
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from asperity.core.checks import FloatArray, IntArray
from asperity.measured.lengths import Pitch

ParameterValues = Mapping[str, float | None]
"""Parameters by symbol, SI units; None for an undefined one (the skewness of a flat surface)."""


@dataclass(frozen=True)
class SurfaceParameter:
    """Definition of a parameter.

    Attributes:
        symbol: symbol such as "Sq"; for profiles without P or R, such as "q".
        description: its name.
        formula: formula, with z the height above the mean.
        clause: clause of ISO 25178-2:2021 or, for profiles, of ISO 4287.
        unit: "m", or "" for a number.
    """

    symbol: str
    description: str
    formula: str
    clause: str
    unit: str = "m"

    @property
    def reference(self) -> str:
        """Standard and clause."""
        standard = "ISO 25178-2:2021" if self in AREAL_PARAMETERS else "ISO 21920-2; ISO 4287"
        return f"{standard}, {self.clause}"


_TABLES = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))


def _read_definitions(table: str) -> tuple[SurfaceParameter, ...]:
    return tuple(SurfaceParameter(symbol, **entry) for symbol, entry in _TABLES[table].items())


AREAL_PARAMETERS = _read_definitions("areal")
"""Parameters of maps, in the order in which they are listed."""

PROFILE_PARAMETERS = _read_definitions("profile")
"""Parameters of profiles; their symbols begin with P, after an L-filter with R."""

# Relative to Rz: smaller peaks and pits are no profile elements (ISO 4287, 4.3.1).
_MIN_PEAK_FRACTION = 0.1
_BLOCK = 2**15  # points processed at once, which fit into the cache

_PARAMETERS_BY_SYMBOL = {parameter.symbol: parameter for parameter in AREAL_PARAMETERS} | {
    f"{kind}{parameter.symbol}": parameter for kind in "PR" for parameter in PROFILE_PARAMETERS
}


def find_parameter(symbol: str) -> SurfaceParameter:
    """Return the definition of a symbol; that of a profile has its P or R.

    Raises:
        KeyError: the symbol is unknown.
    """
    return _PARAMETERS_BY_SYMBOL[symbol]


@np.errstate(over="ignore", invalid="ignore")  # extreme heights are refused elsewhere
def compute_parameters(
    heights: FloatArray, pitch: Pitch, nesting: float | None = None
) -> dict[str, float | None]:
    """Return the parameters of a map or of a profile.

    A map has those of :data:`AREAL_PARAMETERS`, a profile those of :data:`PROFILE_PARAMETERS`. The
    symbols of a profile begin with P (primary profile), or with R if the nesting index L of its
    L-filter is given: it is evaluated over as many sections of the length L as there are, in its
    middle, otherwise over one section.

    Args:
        heights: [m], shape (ny, nx) or (n,); NaN for missing points, not all.
        pitch: (px, py) or (px,) [m].
        nesting: L of the L-filter applied to the heights [m]; None for none.

    Returns:
        The values by symbol, SI units; None for those that are undefined.

    Reference:
        ISO 25178-2:2021, 4.2 and 4.4; ISO 21920-2:2021, which replaces ISO 4287:1997.

    Example:
        >>> x = np.arange(100) / 100
        >>> wave = compute_parameters(np.tile(np.sin(2 * np.pi * x), (100, 1)), (0.01, 0.01))
        >>> f"{wave['Sq']:.4f} {wave['Sa']:.4f} {wave['Sku']:.4f} {wave['Sdq']:.3f}"
        '0.7071 0.6364 1.5000 4.420'
    """
    if heights.ndim == 1:
        ends = _section_ends(len(heights), math.inf if nesting is None else nesting / pitch[0])
        heights = heights[ends[0] : ends[-1] + 1]
        ends = ends - ends[0]
    rows = np.atleast_2d(heights)
    steps = (pitch[0], pitch[-1])
    measured = rows[~np.isnan(rows)]
    mean = float(measured.mean())
    low = float(measured.min())
    high = float(measured.max())
    a, q, skewness, kurtosis = _height_moments(measured, mean, high - low)
    gradient, ratio = _facet_parameters(rows, steps)
    if heights.ndim > 1:
        values = (q, a, high - low, high - mean, mean - low, skewness, kurtosis, gradient, ratio)
        return {p.symbol: value for p, value in zip(AREAL_PARAMETERS, values, strict=True)}
    kind = "P" if nesting is None else "R"
    peak, pit = _mean_peak_and_pit(heights - mean, ends)
    spacing = _element_spacing(heights - mean, pitch[0], _MIN_PEAK_FRACTION * (peak + pit))
    line = (q, a, peak + pit, peak, pit, high - low, skewness, kurtosis, spacing, gradient)
    return {f"{kind}{p.symbol}": value for p, value in zip(PROFILE_PARAMETERS, line, strict=True)}


def _row_blocks(rows: FloatArray, overlap: int = 0) -> Iterator[FloatArray]:
    """Yield groups of rows, each with the first rows of the next group as overlap."""
    count = max(1, _BLOCK // rows.shape[1])
    for first in range(0, rows.shape[0], count):
        yield rows[first : first + count + overlap]


def _height_moments(
    heights: FloatArray, mean: float, span: float
) -> tuple[float, float, float | None, float | None]:
    """Return Sa, Sq, Ssk and Sku; powers are taken of z / range, which cannot overflow."""
    if not 0.0 < span < math.inf:
        return span, span, None, None
    z = (heights - mean) / span
    square = z * z
    q = math.sqrt(square.mean())
    third = float((square * z).mean())
    fourth = float((square * square).mean())
    return float(np.abs(z).mean()) * span, q * span, third / q**3, fourth / q**4


def _facet_parameters(rows: FloatArray, pitch: Pitch) -> tuple[float | None, float | None]:
    """Return Sdq and Sdr of the facets; None if no cell has four measured corners."""
    if rows.shape[0] == 1:
        rows = np.repeat(rows, 2, axis=0)  # a profile: the same along y
    squares = 0.0
    excess = 0.0
    cells = 0
    for block in _row_blocks(rows, overlap=1):
        along = np.diff(block, axis=1) / pitch[0]
        across = np.diff(block, axis=0) / pitch[1]
        lower = along[:-1]
        upper = along[1:]
        left = across[:, :-1]
        right = across[:, 1:]
        corners = [part**2 for part in (lower, upper, left, right)]
        known = ~np.isnan(lower + upper)
        if not known.all():
            corners = [part[known] for part in corners]
        squares += 0.5 * float(sum([part.sum() for part in corners]))
        excess += 0.25 * sum([_sum_area_excess(x + y) for x in corners[:2] for y in corners[2:]])
        cells += corners[0].size
    if not cells:
        return None, None
    return math.sqrt(squares / cells), excess / cells


def _sum_area_excess(square: FloatArray) -> float:
    """Return the sum of √(1 + g²) - 1, without cancellation for small g²."""
    return float((square / (1.0 + np.sqrt(1.0 + square))).sum())


def _section_ends(count: int, width: float) -> IntArray:
    """Return the first point of each section of a profile, and the last one of the last.

    As many sections of a width, in points, as there is room for, in the middle of the profile; or
    the whole of one that is shorter.
    """
    sections = math.floor((count - 1) / width * (1 + 1e-9))
    if sections == 0:
        return np.array([0, count - 1])
    first = 0.5 * (count - 1 - sections * width)
    ends: IntArray = np.rint(first + width * np.arange(sections + 1)).astype(np.intp)
    return ends


def _mean_peak_and_pit(z: FloatArray, ends: IntArray) -> tuple[float, float]:
    """Return the means over the sections of their greatest heights and depths."""
    sections = [z[first : last + 1] for first, last in itertools.pairwise(ends)]
    parts = [part[~np.isnan(part)] for part in sections]
    parts = [part for part in parts if part.size]
    peaks = [float(part.max()) for part in parts]
    pits = [-float(part.min()) for part in parts]
    return sum(peaks) / len(parts), sum(pits) / len(parts)


def _element_spacing(z: FloatArray, pitch: float, threshold: float) -> float | None:
    """Return the mean distance of rising crossings; None for fewer than two.

    Only peaks and pits beyond the threshold count, so that noise on the mean line is no element.
    Missing points are ignored.
    """
    index = np.flatnonzero(~np.isnan(z))
    z = z[index]
    side = np.where(z > threshold, 1, np.where(z < -threshold, -1, 0))
    counted = np.flatnonzero(side)
    rising = counted[1:][(side[counted[1:]] == 1) & (side[counted[:-1]] == -1)]
    # The last crossing before each counted peak is after the last point below zero.
    below = np.flatnonzero(z < 0.0)
    if len(rising) < 2:
        return None
    before = below[np.searchsorted(below, rising) - 1]
    share = z[before] / (z[before] - z[before + 1])
    crossings = index[before] + share * (index[before + 1] - index[before])
    return float(crossings[-1] - crossings[0]) / (len(crossings) - 1) * pitch


CORRELATION_LEVEL = 0.2
"""Level of the autocorrelation that defines the length (the default of ISO 25178-2)."""

MAX_CORRELATION_POINTS = 2**22
"""Maximum number of points for the autocorrelation, which takes some twenty times their memory."""

_N_DIRECTIONS = 180


def correlation_parameters(heights: FloatArray, pitch: Pitch) -> tuple[float | None, float | None]:
    """Return the autocorrelation length Sal [m] and the texture aspect ratio Str [1] of a map.

    f(t) = ⟨z(r) z(r + t)⟩ / ⟨z²⟩, the mean over all pairs of measured points with that offset. Sal
    is the least distance, over all directions, at which f has decayed to 0.2, Str its ratio to the
    greatest: near 1 for an isotropic surface, near 0 for one with a lay.

    f is computed by the Fourier transform up to half of each side, and evaluated by bilinear
    interpolation along one direction per degree, every half pitch.

    Args:
        heights: [m], shape (ny, nx); NaN for missing points.
        pitch: (px, py) [m].

    Returns:
        Sal, None if f decays to 0.2 along no direction within half of the map; Str, None if it does
        not along every direction; both None for a flat map or one of more than
        ``MAX_CORRELATION_POINTS``.

    Reference:
        ISO 25178-2:2021, 4.3.2 and 4.3.3.

    Example:
        >>> x, y = np.meshgrid(np.arange(200), np.arange(200))
        >>> wave = np.cos(2 * np.pi * x / 40) * np.cos(2 * np.pi * y / 80)
        >>> [round(value, 2) for value in correlation_parameters(wave, (1.0, 1.0))]
        [8.5, 0.51]
    """
    if heights.size > MAX_CORRELATION_POINTS or np.nanmax(heights) == np.nanmin(heights):
        return None, None
    distances = _decay_distances(_autocorrelation(heights), heights.shape, pitch)
    known = [distance for distance in distances if distance is not None]
    shortest = min(known, default=None)
    if shortest is None or len(known) < len(distances):
        return shortest, None
    return shortest, shortest / max(known)


def _autocorrelation(heights: FloatArray) -> FloatArray:
    """Return f at offsets up to half of the map, wrapped as by a Fourier transform."""
    from scipy.fft import irfft2, next_fast_len, rfft2

    known = ~np.isnan(heights)
    z = np.where(known, heights - np.nanmean(heights), 0.0)
    # Zero padding prevents wrap-around at offsets up to half of the map.
    shape = [next_fast_len(n + n // 2 + 1, real=True) for n in heights.shape]
    products = irfft2(np.abs(rfft2(z, shape)) ** 2, shape)
    pairs = irfft2(np.abs(rfft2(known.astype(np.float64), shape)) ** 2, shape)
    products /= np.maximum(pairs, 0.5)  # 0 except for rounding if no two points have the offset
    return np.asarray(products / products[0, 0])


def _decay_distances(
    autocorrelation: FloatArray, shape: tuple[int, ...], pitch: Pitch
) -> list[float | None]:
    """Return the distance [m] at which f decays to the level along each direction."""
    from scipy.ndimage import map_coordinates

    half = [(n // 2) * p for n, p in zip(shape[::-1], pitch, strict=True)]
    step = 0.5 * min(pitch)
    distances: list[float | None] = []
    for angle in np.arange(_N_DIRECTIONS) * math.pi / _N_DIRECTIONS:
        direction = math.cos(angle), math.sin(angle)
        reach = min([side / max(abs(c), 1e-12) for side, c in zip(half, direction, strict=True)])
        along = np.arange(0.0, reach + 0.5 * step, step)
        indices = [along * direction[1] / pitch[1], along * direction[0] / pitch[0]]
        values = map_coordinates(autocorrelation, indices, order=1, mode="grid-wrap")
        steps = _steps_to_level(values)
        distances.append(None if steps is None else steps * step)
    return distances


def _steps_to_level(values: FloatArray) -> float | None:
    """Return after how many steps values fall to the level; ``None`` if they do not."""
    low = int(np.argmax(values < CORRELATION_LEVEL))
    if values[low] >= CORRELATION_LEVEL:
        return None
    share = (values[low - 1] - CORRELATION_LEVEL) / (values[low - 1] - values[low])
    return float(low - 1 + share)
