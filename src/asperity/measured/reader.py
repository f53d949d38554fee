"""File readers, the surface that they return before any preparation, and what readers share."""

from __future__ import annotations

import math
import struct
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.core.files import open_input
from asperity.core.memory import require_memory
from asperity.core.units import count_text
from asperity.measured.lengths import unit_to_metres

MAX_POINTS = 2**27
"""Maximum number of points of a surface: 1 GiB of heights."""

ZIP_MAGIC = (b"PK\x03\x04", b"PK\x05\x06")  # the second is that of an empty archive
# RuntimeError: an encrypted member, or a compression that zipfile does not support.
_DAMAGED = (zipfile.BadZipFile, zlib.error, struct.error, EOFError, KeyError, ValueError)
ARCHIVE_ERRORS = (*_DAMAGED, RuntimeError)
"""Errors that zipfile raises for a damaged archive."""


@dataclass(frozen=True, eq=False)
class RawSurface:
    """Heights read from a file, in metres unless the file has no unit of length.

    Row i, column j lies at y = i * pitch[1], x = j * pitch[0].

    Attributes:
        heights: [m], shape (ny, nx) for a map, (n,) for a profile; NaN is a missing point.
        pitch: distance of neighbouring points [m], (px, py) or (px,) for a profile;
            None if the file has none (NPY, text matrix, image).
        source: name of the file.
        notes: assumptions and peculiarities of the file, one sentence each.
        has_units: whether the unit of the heights is known; if not, metres are assumed, which
            ``read_surface`` notes.
        relative: whether the heights are not lengths (pixel values of an image): a height range
            converts them to lengths.
        lacks_unit: whether relative heights are lengths, whose unit ``read_surface`` accepts.
        in_pitches: whether the heights are in units of the pitch, which is to be given.
        is_periodic: whether the file states that the surface repeats; see :func:`states_periodic`.

    Example:
        >>> flat = RawSurface(np.zeros((4, 5)), (1e-6, 1e-6), "flat.npy", ())
        >>> flat.heights.shape, flat.is_profile
        ((4, 5), False)
    """

    heights: FloatArray
    pitch: tuple[float, ...] | None
    source: str
    notes: tuple[str, ...]
    has_units: bool = True
    relative: bool = False
    lacks_unit: bool = False
    in_pitches: bool = False
    is_periodic: bool = False

    @property
    def is_profile(self) -> bool:
        """Whether the surface is a profile h(x) rather than a map h(x, y)."""
        return self.heights.ndim == 1


def states_periodic(text: str) -> bool:
    """Return whether the text in a map of asperity states that the surface repeats."""
    return text.rstrip().endswith("; periodic")


def check_point_count(*counts: int) -> None:
    """Refuse a grid that is too large, before any memory is allocated.

    Args:
        counts: number of points along x, or along x and y.

    Raises:
        SurfaceFileError: there are too many points, or not enough memory for them.
    """
    if math.prod(counts) > MAX_POINTS:
        size = " x ".join(map(str, counts))
        raise SurfaceFileError(f"{size} points; at most {MAX_POINTS} are read")
    require_memory(*counts)


def mask_missing(values: NDArray[Any], code: float) -> tuple[NDArray[Any], tuple[str, ...]]:
    """Return the values with NaN for each that equals the code of a missing point, and the note.

    Example:
        >>> mask_missing(np.array([1.0, -9999.0]), -9999.0)
        (array([ 1., nan]), ('1 point of -9999, which marks a missing point',))
    """
    missing = values.astype(np.float64, copy=False) == code
    if not missing.any():
        return values, ()
    points = count_text(int(missing.sum()), "point")
    note = f"{points} of {code:g}, which marks a missing point"
    return np.where(missing, np.nan, values), (note,)


@dataclass(frozen=True)
class SurfaceFile:
    """A file to be read.

    Attributes:
        path: path of the file.
        head: its first 4096 bytes, or all if it has fewer.
    """

    path: Path
    head: bytes

    @classmethod
    def open(cls, path: Path) -> SurfaceFile:
        """Return the file at a path."""
        with open_input(path) as stream:
            return cls(path, stream.read(4096))

    @property
    def name(self) -> str:
        """Name of the file without its folder, for messages."""
        return self.path.name or str(self.path)

    @property
    def content(self) -> bytes:
        """All bytes of the file, read from disk at each access to save memory."""
        return self.path.read_bytes()

    @property
    def is_text(self) -> bool:
        """Whether the file is text: without NUL and with few other control characters."""
        content = self.content
        if content.startswith((b"\xff\xfe", b"\xfe\xff")):  # UTF-16 text has NULs
            return True
        sample = content[:65536]
        controls = sum(sample.count(c) for c in range(32) if c not in b"\t\n\v\f\r\x1a")
        return b"\x00" not in content and controls <= len(sample) // 100


@dataclass(frozen=True)
class ReadingOptions:
    """The arguments of :func:`asperity.read_surface`.

    Attributes:
        channel: name or number (from 0) of the height channel, for a file with several.
        unit: unit of length of a file that has none.
        green: direction that the green channel of a normal map encodes, "up" or "down".
    """

    channel: str | int | None = None
    unit: str | None = None
    green: str | None = None

    @property
    def metres_per_unit(self) -> float | None:
        """Length of the unit [m]; None if no unit was given."""
        return None if self.unit is None else unit_to_metres(self.unit)

    def resolve_unit(
        self, name: str, stated: float | None = None
    ) -> tuple[float | None, tuple[str, ...]]:
        """Return the length of a file's unit [m] and the note about it.

        Args:
            name: name of the file.
            stated: length of the unit that the file names [m]; None if it names none.

        Returns:
            The unit of the file or of the option, None if there is neither; and the notes.

        Raises:
            ParameterError: a unit was given for a file that names its stated.
        """
        if self.metres_per_unit is None:
            return stated, ()
        if stated is not None:
            raise ParameterError("unit", f"must not be given: {name} names its unit")
        note = f"no unit in the file: {self.metres_per_unit:g} m as given"
        return self.metres_per_unit, (note,)


ReadFunction = Callable[[SurfaceFile, ReadingOptions], RawSurface | None]


@dataclass(frozen=True)
class Reader:
    """A reader of one file format.

    Attributes:
        name: name of the format with its article, such as "an X3P file"; unique among readers.
        recognises: whether a file is of this format, from its content.
        read: returns the surface of a recognised file; None leaves the file to the readers
            that follow, as if it had not been recognised.
        arguments: arguments of ``read_surface`` that apply to this format.
        certain: whether a recognised file cannot be of another format. If it can (any text may be
            a table of numbers), a file that ``read`` refuses is left to the readers that follow,
            and the refusal is raised only if none of them reads it.
        is_isolated: whether ``read``, then a function at module level, runs in a subprocess with
            limits of time and memory.

    Example:
        >>> import numpy as np
        >>> def read(file, options):
        ...     heights = np.frombuffer(file.content, "<f8", offset=6)
        ...     return RawSurface(heights, (1e-6,), file.name, ())
        >>> Reader("a GROOVE file", lambda file: file.head.startswith(b"GROOVE"), read).certain
        True
    """

    name: str
    recognises: Callable[[SurfaceFile], bool]
    read: ReadFunction
    arguments: tuple[str, ...] = ()
    certain: bool = True
    is_isolated: bool = False

    def check_options(self, file: SurfaceFile, options: ReadingOptions) -> None:
        """Refuse an argument that does not apply to this format.

        Raises:
            ParameterError: for the first such argument that is given.
        """
        for argument, reason in (
            ("channel", "has no channels to choose from"),
            ("unit", "has its own unit, or none at all"),
            ("green", "is no image"),
        ):
            value = getattr(options, argument)
            if value is not None and argument not in self.arguments:
                requirement = f"must not be given: {file.name} ({self.name}) {reason}"
                raise ParameterError(argument, requirement, value)


# A thousandth of a step does not change a texture and covers positions stored in float32.
_TOLERANCE = 1e-3
# If most steps are one printed digit, a lost sample is indistinguishable from rounding.
_COARSE_FRACTION = 0.9


@dataclass(frozen=True)
class Spacing:
    """Step of a list of positions, and its deviation from uniform spacing.

    Attributes:
        step: (last - first) / (n - 1), in the unit of the positions.
        median: median distance of two neighbours; a lost sample does not change it.
        deviation: largest difference of such a distance from the median.
        index: first of the two neighbours with this difference.
        is_uniform: whether rounding explains every deviation.
    """

    step: float
    median: float
    deviation: float
    index: int
    is_uniform: bool


def measure_spacing(positions: FloatArray, resolution: FloatArray | float) -> Spacing:
    """Return the deviation of increasing positions from a uniform grid a + p i.

    The positions are uniform if for some a and p every a + p i is within half a resolution of the
    printed position. The excess is convex in p, so that a ternary search finds the best p.

    Args:
        positions: strictly increasing, shape (n,), n at least 2.
        resolution: value of the last printed digit, one for all or shape (n,).

    Returns:
        The step, the largest deviation and whether the positions are uniform.

    Example:
        >>> measure_spacing(np.array([0.0, 0.2, 0.3, 0.5, 0.6]), 0.1).is_uniform
        True
        >>> measure_spacing(np.array([0.0, 0.2, 0.3, 0.5, 0.9]), 0.1).is_uniform
        False
    """
    n = len(positions)
    index = np.arange(n, dtype=np.float64)
    step = float(positions[-1] - positions[0]) / (n - 1)
    offset = positions - (positions[0] + step * index)
    distances = np.diff(positions)
    median = float(np.median(distances))
    deviations = np.abs(distances - median)
    half = np.broadcast_to(np.asarray(resolution, dtype=np.float64) / 2, (n,))
    if float(half.max()) * 2 > _COARSE_FRACTION * median:
        half = np.zeros(n)
    half = np.maximum(half, _TOLERANCE * step)
    uniform = _min_excess(offset, index, half) <= _TOLERANCE * step
    return Spacing(step, median, float(deviations.max()), int(deviations.argmax()), uniform)


def _min_excess(offset: FloatArray, index: FloatArray, half: FloatArray) -> float:
    """Return the least width, over all slopes, by which the offsets exceed half a resolution."""

    def width(slope: float) -> float:
        line = offset - slope * index
        return float(np.max(line - half) - np.min(line + half))

    # The ends are exact to half a resolution each, which bounds the slope's error.
    high = float(half[0] + half[-1]) / max(len(offset) - 1, 1)
    low = -high
    for _ in range(48):
        third = (high - low) / 3
        if width(low + third) <= width(high - third):
            high -= third
        else:
            low += third
    return width((low + high) / 2)


INTERPOLATE = "interpolate them to a grid first, such as with scipy.interpolate.griddata"
"""Advice for points that are on no grid."""
