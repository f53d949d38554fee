"""Read the files of instruments through SurfaceTopography (the extra ``asperity[formats]``)."""

from __future__ import annotations

import contextlib
import io
import os
import warnings
from collections.abc import Iterator
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.errors import ParameterError, SurfaceFileError
from asperity.measured.reading.child import in_child
from asperity.measured.reading.length_units import metres_of
from asperity.measured.reading.raw import MAX_POINTS, RawSurface
from asperity.measured.reading.reader import ReadingOptions, SurfaceFile, naming
from asperity.measured.reading.scatter import advice, resampled_line

# asperity reads these itself, or refuses them for a reason; HGT takes any file of a square size.
LIBRARY = "SurfaceTopography"
"""Of others, which reads the files of instruments."""

_OURS = frozenset(("sdf", "xyz", "asc", "npy", "npz", "x3p", "hgt"))
_INFLATION = 1032  # deflate, which all compressed formats use, packs at most so many bytes into one
_HEAD = 512


@in_child
@naming
def read_instrument(file: SurfaceFile, options: ReadingOptions) -> RawSurface | None:
    """Read a file that one of SurfaceTopography's readers recognises.

    Of a text only those readers are asked that know it by its first bytes: some take any.

    Returns:
        Heights [m]; None where no reader recognises the file, or the extra is not installed.

    Raises:
        SurfaceFileError: recognised, but it cannot be read.
        ParameterError: the channel or the unit must be given, or must not.
    """
    try:
        library = _library()
    except ModuleNotFoundError:
        return None
    without = ""
    with _quiet(), _Bounded(io.FileIO(file.path)) as stream:
        for reader in _recognised(library, stream, sure=file.is_text):
            with contextlib.closing(reader):
                try:
                    chosen = _chosen(reader, file.name, options.channel)
                    if chosen is not None:
                        return _surface(reader, chosen, file, options)
                    without = without or _channels(reader)
                except (SurfaceFileError, ParameterError, MemoryError):
                    raise
                except Exception as error:  # a damaged file can raise anything in there
                    what = f"{reader.name()} file, damaged"
                    raise SurfaceFileError(f"{what} ({_reason(error)})") from error
    if without:
        raise SurfaceFileError(f"no height channel; the file has: {without}")
    return None


class _Bounded(io.BufferedReader):
    """A file that is never asked for more than it has.

    Python reserves the memory that a read asks for, and a damaged header may ask for terabytes.
    """

    def read(self, size: int | None = -1, /) -> bytes:
        left = max(os.fstat(self.fileno()).st_size - self.tell(), 0)
        return super().read(left if size is None or size < 0 else min(size, left))


def has_library() -> bool:
    """Tell whether the extra is installed, without the seconds that its import takes."""
    return find_spec(LIBRARY) is not None


def _library() -> Any:
    """Import SurfaceTopography.IO, which takes seconds."""
    with _quiet():
        try:
            from importlib import import_module

            return import_module(f"{LIBRARY}.IO")
        except ModuleNotFoundError:
            raise
        except Exception as error:  # a broken installation counts as none
            raise ModuleNotFoundError(str(error)) from error


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep what the readers print and warn away from the user: the result says what matters."""
    with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
        warnings.simplefilter("ignore")
        yield


def _recognised(library: Any, stream: _Bounded, *, sure: bool) -> Iterator[Any]:
    """Yield the file as each reader that recognises it has opened it."""
    head = stream.read(_HEAD)
    for kind in library.readers:
        if kind.format() in _OURS:
            continue
        match = kind.can_read(head).value
        if match == "no" or (sure and match != "yes"):
            continue
        stream.seek(0)
        try:
            opened = kind(stream)
        except MemoryError:
            raise
        except Exception as error:  # each reader says "not mine" in its own way
            if match == "yes":
                what = f"{kind.name()} file, damaged"
                raise SurfaceFileError(f"{what} ({_reason(error)})") from error
        else:
            yield opened


def _reason(error: Exception) -> str:
    text = " ".join(str(error).split())
    return text if 0 < len(text) <= 120 else f"{text[:117]}..." if text else type(error).__name__


def _surface(reader: Any, chosen: Any, file: SurfaceFile, options: ReadingOptions) -> RawSurface:
    name, metres = file.name, options.metres
    size = chosen.nb_grid_pts
    points = int(np.prod([int(n) for n in size])) if size is not None else 0
    if points > MAX_POINTS or points > _INFLATION * file.path.stat().st_size:
        raise SurfaceFileError(f"{points} points, more than are read or the file can hold")
    unit = _unit(chosen, name, metres)
    heights, pitch, said = _data(chosen, unit, options.resample)
    notes = [f"{reader.name()} file, read by SurfaceTopography", *said]
    if len(reader.channels) > 1:
        notes.append(f"channel {chosen.name!r} of {len(reader.channels)}")
    if metres is not None:
        notes.append(f"no unit in the file: {metres:g} m as given")
    with np.errstate(over="ignore"):
        scaled = heights * unit
    lateral = None if pitch is None else tuple(float(p) * unit for p in pitch)
    if lateral is not None and not all(np.isfinite(lateral) & (np.array(lateral) > 0)):
        raise SurfaceFileError(f"the file's pitch {lateral} is not positive")
    return RawSurface(scaled, lateral, name, tuple(notes))


def _channels(reader: Any) -> str:
    return ", ".join(f"{c.name!r} ({c.data_kind.value})" for c in reader.channels) or "none"


def _chosen(reader: Any, name: str, channel: str | int | None) -> Any | None:
    """Return the only height channel, or the one that is named; None where there is none."""
    heights = [c for c in reader.channels if c.data_kind.value == "height" and c.dim in (1, 2)]
    if not heights:
        return None
    if channel is None and len(heights) == 1:
        return heights[0]
    names = ", ".join(f"{c.index}: {c.name!r}" for c in heights)
    if channel is None:
        raise ParameterError(
            "channel", f"must be given: {name} has {len(heights)} height channels: {names}"
        )
    matching = [c for c in heights if c.name == channel]
    if not matching:
        matching = [c for c in heights if str(c.index) == str(channel)]
    if len(matching) != 1:
        raise ParameterError("channel", f"must be one of the height channels {names}", channel)
    return matching[0]


def _unit(chosen: Any, name: str, metres: float | None) -> float:
    if chosen.unit is None:
        if metres is None:
            raise ParameterError(
                "unit", f"is required: {name} has no unit; say what it is in, such as 'um'"
            )
        return metres
    if metres is not None:
        raise ParameterError("unit", f"must not be given: {name} is in {chosen.unit}")
    return metres_of(str(chosen.unit))


def _data(
    chosen: Any, unit: float, resample: float | None
) -> tuple[NDArray[np.float64], tuple[float, ...] | None, list[str]]:
    """Return heights with x along the last axis, the pitch, both in the file's unit, and notes."""
    options: dict[str, Any] = {}
    # It must be told something, unless its points are uneven; the pitch is dropped again.
    if chosen.physical_sizes is None and chosen.is_uniform is not False:
        options["physical_sizes"] = tuple(1.0 for _ in chosen.nb_grid_pts)
    if chosen.unit is None:
        options["unit"] = "m"
    topography = chosen.topography(**options)
    if not topography.is_uniform:
        return _uneven(topography, unit, resample)
    if chosen.is_uniform is False:
        raise SurfaceFileError("sampling is not uniform, yet the points have no positions")
    if resample is not None:
        raise ParameterError("resample", "must not be given: the points are on a grid", resample)
    stored = np.ma.masked_array(topography.heights(), dtype=np.float64)
    heights = np.ascontiguousarray(stored.filled(np.nan).T)
    if heights.ndim not in (1, 2) or heights.size == 0:
        raise SurfaceFileError(f"heights of shape {heights.shape}")
    if chosen.physical_sizes is None:
        return heights, None, []
    sizes = np.atleast_1d(np.asarray(chosen.physical_sizes, dtype=np.float64))
    return heights, tuple(sizes / np.array(heights.shape[::-1])), []


def _uneven(
    topography: Any, unit: float, resample: float | None
) -> tuple[NDArray[np.float64], tuple[float, ...], list[str]]:
    """Return a profile of uneven points, interpolated; see :func:`_data`."""
    positions = np.asarray(topography.positions(), dtype=np.float64).ravel()
    heights = np.ma.masked_array(topography.heights(), dtype=np.float64).filled(np.nan).ravel()
    steps = np.diff(positions)
    if len(positions) != len(heights) or len(steps) == 0 or not np.all(steps > 0):
        raise SurfaceFileError("sampling is not uniform, and the positions do not increase")
    if resample is None:
        raise SurfaceFileError(f"sampling is not uniform; {advice(float(steps.mean()) * unit)}")
    line, said = resampled_line(positions * unit, heights * unit, resample)
    return line / unit, (resample / unit,), [said]
