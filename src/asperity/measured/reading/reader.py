"""What a reader of surface files is: a format's name, its mark, and how heights come from it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from pathlib import Path

from asperity.errors import ParameterError, SurfaceFileError
from asperity.measured.reading.length_units import metres_of
from asperity.measured.reading.raw import RawSurface


@dataclass(frozen=True)
class SurfaceFile:
    """A file that somebody wants to be read.

    Attributes:
        path: where it lies.
        head: its first 4096 bytes, or all if it has fewer.
    """

    path: Path
    head: bytes

    @property
    def name(self) -> str:
        """For messages: its name without the folder."""
        return self.path.name or str(self.path)

    @property
    def content(self) -> bytes:
        """All its bytes, read anew each time: a large file is not kept in memory."""
        return self.path.read_bytes()

    @property
    def is_text(self) -> bool:
        """False where control characters show that this is no text."""
        content = self.content
        if content.startswith((b"\xff\xfe", b"\xfe\xff")):  # UTF-16 text has NULs
            return True
        sample = content[:65536]
        controls = sum(sample.count(c) for c in range(32) if c not in b"\t\n\v\f\r\x1a")
        return b"\x00" not in content and controls <= len(sample) // 100


@dataclass(frozen=True)
class ReadingOptions:
    """The arguments of :func:`asperity.measured.reading.read_surface`.

    Attributes:
        channel: name or number (from 0) of the height channel, for a file with several.
        unit: unit of length of a file that has none.
        integrate_normals: integrate a normal map (an image of slopes) to heights.
        resample: pitch [m] to which points on no regular grid are interpolated.
    """

    channel: str | int | None = None
    unit: str | None = None
    integrate_normals: bool = False
    resample: float | None = None

    @property
    def metres(self) -> float | None:
        """Length of the unit [m]; None where none is given."""
        return None if self.unit is None else metres_of(self.unit)


Read = Callable[[SurfaceFile, ReadingOptions], RawSurface | None]


@dataclass(frozen=True)
class Reader:
    """Recognises one format by its content, and reads it.

    Attributes:
        name: of the format with its article, such as "an X3P file"; no two readers have the same.
        recognises: whether the content of a file is of this format.
        read: makes heights of a file that was recognised. None leaves the file to the readers
            after this one, as if it had not been recognised.
        arguments: those of ``read_surface`` that say something about this format.
        certain: whether a file that was recognised cannot be of another format. Where it can (any
            text may be a table of numbers), a refusal leaves the file to the readers after this
            one, and counts only if none of them reads it.

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
    read: Read
    arguments: tuple[str, ...] = ()
    certain: bool = True

    def check(self, file: SurfaceFile, options: ReadingOptions) -> None:
        """Refuse an argument that says nothing about this format.

        Raises:
            ParameterError: for the first such argument that is given.
        """
        for argument, why in (
            ("channel", "has no channels to choose from"),
            ("unit", "has its own unit, or none at all"),
            ("integrate_normals", "is no image"),
            ("resample", "is no list of points"),
        ):
            given = getattr(options, argument)
            absent = given is None or given is False  # a channel may be number 0
            if not absent and argument not in self.arguments:
                raise ParameterError(
                    argument, f"must not be given: {file.name} ({self.name}) {why}", given
                )


def naming(read: Read) -> Read:
    """Let the refusals of a reader begin with the name of the file."""

    @wraps(read)
    def named(file: SurfaceFile, options: ReadingOptions) -> RawSurface | None:
        try:
            return read(file, options)
        except SurfaceFileError as error:
            raise SurfaceFileError(f"{file.name}: {error}") from error

    return named
