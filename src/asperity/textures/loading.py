"""From a file to a texture: read, prepare, fit the spline."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from asperity.arguments import described
from asperity.errors import ParameterError
from asperity.files import open_input
from asperity.kept import content_digest, kept
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
    asked = {**given, "magnify": magnify, "magnify_height": magnify_height}

    def make() -> Prepared:
        reading = {a.name: asked.pop(a.name) for a in READING if a.name in asked}
        return prepare(read_surface(path, **reading), progress=progress, watch=watch, **asked)

    return kept("prepared", None if watch is not None else _content(path, asked), make)


def _content(path: str | os.PathLike[str], asked: Mapping[str, Any]) -> str | None:
    """Return what a prepared surface depends on; ``None`` where readers of others may have a part.

    The name counts: what is said of a surface may name the file.
    """
    from asperity.measured.reading.registry import outside_readers

    library = outside_readers()
    if library is None:
        return None
    try:
        with open_input(path) as stream:
            whole = hashlib.file_digest(stream, "sha256").hexdigest()
    except (OSError, ValueError):  # the reader says what is wrong with it
        return None
    said = tuple((name, _plain(value)) for name, value in sorted(asked.items()))
    return content_digest(whole, os.path.basename(os.fspath(path)), library, said)


def _plain(value: Any) -> Any:
    """Return a pitch that is a list or an array as a tuple."""
    return (
        value if value is None or isinstance(value, (str, float, int)) else tuple(map(float, value))
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
