"""From a file to a texture: read, prepare, fit the spline."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from asperity.arguments import described
from asperity.errors import ParameterError
from asperity.measured.arguments import FILE_ARGUMENTS, READING
from asperity.textures.heightmap import HeightMap
from asperity.textures.profile import Profile

if TYPE_CHECKING:
    from asperity.measured.history import Watch
    from asperity.measured.prepared import Prepared


@described(FILE_ARGUMENTS)
def load_texture(  # noqa: D417 - the others are described where they are declared
    path: str | os.PathLike[str],
    *,
    channel: str | int | None = None,
    unit: str | None = None,
    integrate_normals: bool = False,
    resample: float | None = None,
    pitch: float | Sequence[float] | None = None,
    height_range: float | None = None,
    outliers: float | None = None,
    max_missing: float | None = None,
    form: int | None = None,
    cutoff: float | None = None,
    l_cutoff: float | None = None,
    tip_radius: float | None = None,
    periodic: bool = False,
    blend: float | None = None,
    magnify: float = 1.0,
    magnify_height: float | None = None,
) -> HeightMap | Profile:
    """Return a measured surface as a texture.

    Reads the file and prepares it: remove outliers, fill missing points, level, Gaussian band
    limit, stylus tip, periodic continuation, magnify. What was done is in the ``preparation`` of
    the result. A file that ``asperity prepare`` has written is taken as it is.

    Args:
        path: the file; its kind is told by its content.
        {arguments}

    Raises:
        SurfaceFileError: for a file that cannot be read, with the reason.
        ParameterError: for an argument that cannot be used.
    """
    return texture_of(prepare_file(**locals()))  # every argument under its own name


def prepare_file(
    path: str | os.PathLike[str],
    *,
    progress: Callable[[str], None] | None = None,
    watch: Watch | None = None,
    magnify: float = 1.0,
    magnify_height: float | None = None,
    **arguments: Any,
) -> Prepared:
    """Read and prepare a surface, or load one that was prepared before.

    Args:
        path: the file.
        progress: called with the name of each stage before it begins.
        watch: told the heights after each step, see :mod:`asperity.measured.history`.
        magnify: see :func:`load_texture`; also for a prepared surface.
        magnify_height: see :func:`load_texture`; also for a prepared surface.
        **arguments: the others of :func:`load_texture`; None and False mean not given.

    Raises:
        SurfaceFileError: for a file that cannot be read, with the reason.
        ParameterError: for an argument that cannot be used, or one that would prepare a second
            time.
    """
    from asperity.measured.preparation import magnified, prepare
    from asperity.measured.prepared import is_prepared, load_prepared
    from asperity.measured.reading import read_surface

    given = {k: v for k, v in arguments.items() if v is not None and v is not False}
    begin = progress or (lambda _stage: None)
    begin("read")
    if is_prepared(path):
        for name in given:
            raise ParameterError(name, f"cannot be applied: {os.fspath(path)} was prepared already")
        return magnified(load_prepared(path), magnify, magnify_height)
    reading = {a.name: given.pop(a.name) for a in READING if a.name in given}
    return prepare(
        read_surface(path, **reading),
        magnify=magnify,
        magnify_height=magnify_height,
        progress=progress,
        watch=watch,
        **given,
    )


def texture_of(prepared: Prepared) -> HeightMap | Profile:
    """Return the spline through a prepared surface."""
    rest: dict[str, Any] = {
        "periodic": prepared.periodic,
        "preparation": prepared.steps,
        "filled": prepared.filled,
    }
    texture: HeightMap | Profile
    if prepared.heights.ndim == 1:
        texture = Profile(prepared.heights, prepared.pitch[0], **rest)
    else:
        texture = HeightMap(prepared.heights, prepared.pitch, **rest)
    texture.history = prepared.history
    return texture
