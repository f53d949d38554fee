"""The readers that asperity brings."""

from __future__ import annotations

from collections.abc import Callable

from asperity.errors import SurfaceFileError
from asperity.measured.reading.archive import ZIP_MAGIC, archive_kind
from asperity.measured.reading.arrays import NPY_MAGIC, read_npy
from asperity.measured.reading.foreign import is_foreign, refuse_foreign, too_large
from asperity.measured.reading.image import Pixels, surface_of_pixels
from asperity.measured.reading.instrument_tiff import is_instrument_tiff
from asperity.measured.reading.instruments import has_library, read_instrument
from asperity.measured.reading.mesh import mesh_kind, read_mesh
from asperity.measured.reading.png import PNG_MAGIC, read_png
from asperity.measured.reading.raw import RawSurface
from asperity.measured.reading.reader import Reader, ReadingOptions, SurfaceFile
from asperity.measured.reading.sdf import is_sdf, read_sdf
from asperity.measured.reading.text import read_text
from asperity.measured.reading.tiff import TIFF_MAGIC, read_tiff
from asperity.measured.reading.x3p import read_x3p

_MOST_TEXT = 5 * 10**8  # numbers in text take several times their size while they are read


def _image(
    name: str, is_one: Callable[[SurfaceFile], bool], decode: Callable[[bytes], Pixels]
) -> Reader:
    def read(file: SurfaceFile, options: ReadingOptions) -> RawSurface:
        try:
            pixels = decode(file.content)
            integrate = options.integrate_normals
            return surface_of_pixels(pixels, file.name, integrate_normals=integrate)
        except SurfaceFileError as error:
            raise SurfaceFileError(f"{file.name}: {error}") from error

    return Reader(name, is_one, read, ("integrate_normals",))


def _mesh(kind: str) -> Reader:
    def read(file: SurfaceFile, options: ReadingOptions) -> RawSurface:
        return read_mesh(file.content, kind, file.name, options.metres)

    return Reader(f"an {kind} mesh", lambda file: mesh_kind(file.content) == kind, read, ("unit",))


def _is_x3p(file: SurfaceFile) -> bool:
    return file.head.startswith(ZIP_MAGIC) and archive_kind(file.path) == "X3P"


def _is_picture(file: SurfaceFile) -> bool:
    return file.head.startswith(TIFF_MAGIC) and not is_instrument_tiff(file.content)


def _read_text(file: SurfaceFile, options: ReadingOptions) -> RawSurface:
    content = file.content
    if len(content) > _MOST_TEXT:
        raise too_large(file.name, len(content), _MOST_TEXT, " of text")
    return read_text(content, file.name, options.metres)


def _read_instrument(file: SurfaceFile, options: ReadingOptions) -> RawSurface | None:
    if not has_library():
        return None
    return read_instrument(
        file.path,
        file.name,
        channel=options.channel,
        metres=options.metres,
        sure=file.is_text,  # some of these readers take any text for theirs
    )


MARKED = (
    Reader("an X3P file", _is_x3p, lambda file, _: read_x3p(file.path)),
    Reader(
        "an NPY file",
        lambda file: file.head.startswith(NPY_MAGIC),
        lambda file, options: read_npy(file.path, options.metres),
        ("unit",),
    ),
    _image("a PNG image", lambda file: file.head.startswith(PNG_MAGIC), read_png),
    _image("a TIFF image", _is_picture, read_tiff),
    Reader(
        "an SDF file",
        lambda file: is_sdf(file.head),
        lambda file, _: read_sdf(file.content, file.name),
    ),
    _mesh("STL"),
    _mesh("OBJ"),
)
"""Those that know a file by its own mark."""

LAST = (
    Reader("a file of another kind", is_foreign, refuse_foreign),
    Reader("a text file", lambda file: file.is_text, _read_text, ("unit",), certain=False),
    Reader(
        "an instrument's file", lambda _: True, _read_instrument, ("channel", "unit"), certain=False
    ),
)
"""Those that take what is left, or refuse it."""
