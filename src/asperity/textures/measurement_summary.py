"""Summary of a measured surface: roughness parameters after each preparation step."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from asperity.core.checks import FloatArray
from asperity.core.display import Reportable
from asperity.core.files import to_plain_data
from asperity.measured.decomposition import SurfaceDecomposition, decompose_surface
from asperity.measured.parameters import correlation_parameters
from asperity.measured.prepared import PreparationStage, PreparedSurface
from asperity.textures.texture_loading import prepare_file

Pitch = tuple[float, ...]
_MAX_SIDE_POINTS = 360
"""Greatest number of points along each side of a map in pictures."""
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
        parts: its form, waviness and texture.
        correlation: autocorrelation length Sal [m] and texture aspect ratio Str of it; None for
            those that are not defined, as for a profile.
        changes: the steps that removed something; none for a prepared file.
    """

    source: str
    prepared: PreparedSurface
    parts: SurfaceDecomposition
    correlation: tuple[float | None, float | None] = (None, None)
    changes: tuple[StepChange, ...] = field(default=())

    def __repr__(self) -> str:
        return f"<MeasurementSummary {self.source}, {self.prepared.heights.size} points>"

    @property
    def sides(self) -> tuple[float, ...]:
        """Width and depth of the prepared surface, or its length [m]."""
        return _sides(self.prepared.heights, self.prepared.pitch)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        parts = ("form", "waviness", "texture", "nesting")
        return {
            **self.prepared.to_dict(),
            "source": self.source,
            "parts": {name: to_plain_data(getattr(self.parts, name)) for name in parts},
            "Sal": self.correlation[0],
            "Str": self.correlation[1],
        }


def summarize_file(
    path: str | os.PathLike[str], *, progress: Callable[[str], None] | None = None, **arguments: Any
) -> MeasurementSummary:
    """Summarize a measured surface after each preparation step.

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
            sides = _sides(after, pitch)
            changes.append(StepChange(stage, decimate(before), decimate(after), sides))

    prepared = prepare_file(path, progress=progress, watch=watch, **arguments)
    if progress is not None:
        progress("measure")
    heights, pitch = prepared.heights, prepared.pitch
    parts = decompose_surface(heights, pitch, periodic=prepared.periodic)
    found: tuple[float | None, float | None] = (None, None)
    if len(pitch) == 2:
        found = correlation_parameters(heights, (pitch[0], pitch[1]))
    return MeasurementSummary(os.path.basename(path), prepared, parts, found, tuple(changes))


def decimate(heights: FloatArray) -> FloatArray:
    """Return every n-th point, as many as a picture can show."""
    most = _MAX_LINE_POINTS if heights.ndim == 1 else _MAX_SIDE_POINTS
    every = tuple(slice(None, None, -(-n // most)) for n in heights.shape)
    return heights[every].copy()


def _sides(heights: FloatArray, pitch: Pitch) -> tuple[float, ...]:
    return tuple((n - 1) * p for n, p in zip(heights.shape[::-1], pitch, strict=True))
