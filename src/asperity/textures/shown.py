"""A measured file in numbers: parameters step by step, form, waviness and texture, and its lay."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from asperity.checks import FloatArray
from asperity.display import Reported
from asperity.files import plain
from asperity.measured.correlation import correlation
from asperity.measured.history import Stage
from asperity.measured.parts import Parts, texture_part
from asperity.measured.prepared import Prepared
from asperity.textures.loading import prepare_file

_SIDE = 360
"""Points along each side of a map for pictures, at most."""
_LINE = 4096


@dataclass(frozen=True, eq=False)
class Change:
    """Some heights before and after a step, for a picture: every so many points.

    Attributes:
        stage: the surface after the step.
        before: [m], shape (ny, nx) or (n,); NaN where missing.
        after: likewise.
        sides: width and depth of the surface, or its length [m].
    """

    stage: Stage
    before: FloatArray
    after: FloatArray
    sides: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Shown(Reported):
    """A measured file in numbers.

    Attributes:
        source: name of the file.
        prepared: the surface at the end, with what was done to it.
        parts: form, waviness and texture of it.
        correlation: autocorrelation length Sal [m] and texture aspect ratio Str of it; None for
            what it has not, a profile neither.
        changes: the steps that took something away; none of a file that was prepared before.
    """

    source: str
    prepared: Prepared
    parts: Parts
    correlation: tuple[float | None, float | None] = (None, None)
    changes: tuple[Change, ...] = field(default=())

    def __repr__(self) -> str:
        return f"<Shown {self.source}, {self.prepared.heights.size} points>"

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
            "parts": {name: plain(getattr(self.parts, name)) for name in parts},
            "Sal": self.correlation[0],
            "Str": self.correlation[1],
        }


def show_file(
    path: str | os.PathLike[str],
    *,
    progress: Callable[[str], None] | None = None,
    **arguments: Any,
) -> Shown:
    """Read and prepare a measured surface, and say it in numbers.

    Args:
        path: the file, also one that was prepared before.
        progress: called with the name of each stage before it begins.
        **arguments: those of :func:`asperity.load_texture`.

    Raises:
        SurfaceFileError: for a file that cannot be read, with the reason.
        ParameterError: for an argument that cannot be used.
    """
    changes: list[Change] = []

    def watch(
        stage: Stage, pitch: tuple[float, ...], after: FloatArray, before: FloatArray | None
    ) -> None:
        if before is not None:
            changes.append(Change(stage, thinned(before), thinned(after), _sides(after, pitch)))

    prepared = prepare_file(path, progress=progress, watch=watch, **arguments)
    if progress is not None:
        progress("measure")
    heights, pitch = prepared.heights, prepared.pitch
    parts = texture_part(heights, pitch, periodic=prepared.periodic)
    found: tuple[float | None, float | None] = (None, None)
    if len(pitch) == 2:
        found = correlation(heights, (pitch[0], pitch[1]))
    return Shown(os.path.basename(path), prepared, parts, found, tuple(changes))


def thinned(heights: FloatArray) -> FloatArray:
    """Return every so many points, as many as a picture shows."""
    most = _LINE if heights.ndim == 1 else _SIDE
    every = tuple(slice(None, None, -(-n // most)) for n in heights.shape)
    return heights[every].copy()


def _sides(heights: FloatArray, pitch: tuple[float, ...]) -> tuple[float, ...]:
    return tuple((n - 1) * p for n, p in zip(heights.shape[::-1], pitch, strict=True))
