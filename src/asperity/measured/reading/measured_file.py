"""A measured file: read and prepared once, and a summary of its roughness."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from asperity.core.cache import get_or_compute
from asperity.core.checks import FloatArray
from asperity.core.display import Reportable
from asperity.core.errors import ParameterError
from asperity.core.files import content_digest, open_input, to_plain_data
from asperity.measured.file_arguments import READING_ARGUMENTS
from asperity.measured.form import SurfaceDecomposition, decompose_surface
from asperity.measured.lengths import Pitch, side_lengths
from asperity.measured.parameters import correlation_parameters
from asperity.measured.prepared import (
    PreparationStage,
    PreparedSurface,
    StageCallback,
    is_prepared,
    load_prepared,
)


def prepare_file(
    path: str | os.PathLike[str],
    *,
    progress: Callable[[str], None] | None = None,
    watch: StageCallback | None = None,
    magnify: float = 1.0,
    magnify_height: float | None = None,
    **arguments: Any,
) -> PreparedSurface:
    """Read and prepare a surface, or load a prepared one.

    Args:
        path: the file.
        progress: called with the name of each stage before it starts.
        watch: called with the heights after each step, see :mod:`asperity.measured.prepared`.
        magnify: see :func:`load_texture`; also for a prepared surface.
        magnify_height: see :func:`load_texture`; also for a prepared surface.
        **arguments: the others of :func:`load_texture`; None and False mean not given.

    Raises:
        SurfaceFileError: for a file that cannot be read, with the reason.
        ParameterError: for an argument that cannot be used, or that does not apply to a prepared
            surface.
    """
    from asperity.measured.preparation import magnify_surface, prepare
    from asperity.measured.reading import read_surface

    provided = {k: v for k, v in arguments.items() if v is not None and v is not False}
    if progress is not None:
        progress("read")
    if is_prepared(path):
        for name in provided:
            raise ParameterError(name, f"cannot be applied: {os.fspath(path)} was prepared already")
        return magnify_surface(load_prepared(path), magnify, magnify_height)
    options = {**provided, "magnify": magnify, "magnify_height": magnify_height}
    key = None if watch is not None else _source_digest(path, options)

    def read_and_prepare() -> PreparedSurface:
        reading = {a.name: options.pop(a.name) for a in READING_ARGUMENTS if a.name in options}
        return prepare(read_surface(path, **reading), progress=progress, on_stage=watch, **options)

    return get_or_compute("prepared", key, read_and_prepare)


def _source_digest(path: str | os.PathLike[str], options: Mapping[str, Any]) -> str | None:
    """Return the cache key of a prepared surface; ``None`` if external readers may take part.

    The name of the file counts, because sentences about a surface may contain it.
    """
    from asperity.measured.reading.readers import external_reader_version

    library = external_reader_version()
    if library is None:
        return None
    try:
        with open_input(path) as stream:
            whole = hashlib.file_digest(stream, "sha256").hexdigest()
    except (OSError, ValueError):  # the reader reports the error
        return None
    values = dict(options)
    if "pitch" in values:
        values["pitch"] = tuple(np.ravel(values["pitch"]).tolist())
    named = tuple(sorted(values.items()))
    return content_digest(whole, os.path.basename(os.fspath(path)), library, named)


# Greatest number of points along each side of a map in pictures.
_MAX_SIDE_POINTS = 360
_MAX_LINE_POINTS = 4096


@dataclass(frozen=True, eq=False)
class StepChange:
    """Decimated heights before and after a preparation step, for a picture.

    Attributes:
        stage: the surface after the step.
        before: [m], shape (ny, nx) or (n,); NaN where missing.
        after: likewise.
        sides: width and depth of the surface, or its length [m].
    """

    stage: PreparationStage
    before: FloatArray
    after: FloatArray
    sides: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class MeasurementSummary(Reportable):
    """Roughness parameters of a measured file.

    Attributes:
        source: name of the file.
        prepared: the prepared surface with its preparation steps.
        parts: its form, waviness and texture; None after an L-filter, which has separated them.
        correlation: autocorrelation length Sal [m] and texture aspect ratio Str of it; None for
            those that are not defined, as for a profile.
        changes: the steps that removed something; none for a prepared file.
    """

    source: str
    prepared: PreparedSurface
    parts: SurfaceDecomposition | None
    correlation: tuple[float | None, float | None] = (None, None)
    changes: tuple[StepChange, ...] = ()

    def __repr__(self) -> str:
        return f"<MeasurementSummary {self.source}, {self.prepared.heights.size} points>"

    @property
    def sides(self) -> tuple[float, ...]:
        """Width and depth of the prepared surface, or its length [m]."""
        return side_lengths(self.prepared.heights.shape, self.prepared.pitch)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        names = ("form", "waviness", "texture", "nesting")
        parts = self.parts
        return {
            **self.prepared.to_dict(),
            "source": self.source,
            "parts": parts and {name: to_plain_data(getattr(parts, name)) for name in names},
            "Sal": self.correlation[0],
            "Str": self.correlation[1],
        }


def show(
    path: str | os.PathLike[str], *, progress: Callable[[str], None] | None = None, **arguments: Any
) -> MeasurementSummary:
    """Report the roughness parameters of a measured surface, as ``asperity show`` does.

    Args:
        path: the file, also a prepared one.
        progress: called with the name of each stage before it begins.
        **arguments: arguments of :func:`asperity.load_texture`.

    Raises:
        SurfaceFileError: for a file that cannot be read, with the reason.
        ParameterError: for an argument that cannot be used.
    """
    changes: list[StepChange] = []

    def watch(
        stage: PreparationStage, pitch: Pitch, after: FloatArray, before: FloatArray | None
    ) -> None:
        if before is not None:
            sides = side_lengths(after.shape, pitch)
            changes.append(StepChange(stage, decimate(before), decimate(after), sides))

    prepared = prepare_file(path, progress=progress, watch=watch, **arguments)
    if progress is not None:
        progress("measure")
    heights = prepared.heights
    pitch = prepared.pitch
    parts = None
    if not prepared.history or prepared.history[-1].nesting is None:
        parts = decompose_surface(heights, pitch, periodic=prepared.periodic)
    correlation: tuple[float | None, float | None] = (None, None)
    if len(pitch) == 2:
        correlation = correlation_parameters(heights, pitch)
    return MeasurementSummary(os.path.basename(path), prepared, parts, correlation, tuple(changes))


def decimate(heights: FloatArray) -> FloatArray:
    """Return every n-th point, as many as a picture can show."""
    if heights.ndim == 1:
        return heights[:: -(-len(heights) // _MAX_LINE_POINTS)].copy()
    rows, columns = [-(-n // _MAX_SIDE_POINTS) for n in heights.shape]
    return heights[::rows, ::columns].copy()
