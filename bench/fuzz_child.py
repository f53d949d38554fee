"""A reading child that stays: it does what ``child.start`` does, without a start for each file."""

from __future__ import annotations

import contextlib
import importlib
import io
import multiprocessing
import time
import warnings
from multiprocessing.connection import Connection
from multiprocessing.context import ForkProcess
from typing import IO, Any, Self

from asperity.measured.reading import ReadingOptions, SurfaceFile, child

LIBRARIES = ("SurfaceTopography.IO", "trimesh", "tifffile")
FILES = 500  # of one child: what a library keeps of one file should not limit many others
_FORK = multiprocessing.get_context("fork")


class Reading:
    """A fork of this process that reads one file after the other.

    Each file has the limits that a file always has. What stops the child, or needs more memory than
    there is, costs a new one.
    """

    _left: int  # files until it is replaced
    _pipe: Connection
    _process: ForkProcess

    def __enter__(self) -> Self:
        """Load what the readers need, which every child then has."""
        for library in LIBRARIES:
            with contextlib.suppress(ModuleNotFoundError), warnings.catch_warnings():
                warnings.simplefilter("ignore")
                importlib.import_module(library)
        self._begin()
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def start(
        self,
        read: Any,
        file: SurfaceFile,
        options: ReadingOptions,
        limits: tuple[float, int],
        answer: IO[bytes],
    ) -> int:
        """Do what ``child.start`` does."""
        if self._left == 0:
            self._end()
            self._begin()
        self._left -= 1
        try:
            self._pipe.send((read.__module__, read.__name__, file, options, limits))
            said = self._pipe.recv_bytes()
        except EOFError:
            self._left = 0
            self._process.join()
            return self._process.exitcode or 0
        except BaseException:  # the time is over
            self._left = 0
            raise
        if said.startswith(b'{"memory"'):
            self._left = 0
        answer.write(said)
        return 0

    def _begin(self) -> None:
        self._left = FILES
        self._pipe, there = _FORK.Pipe()
        self._process = _FORK.Process(target=_serve, args=(self._pipe, there), daemon=True)
        self._process.start()
        there.close()

    def _end(self) -> None:
        self._pipe.close()
        self._process.kill()
        self._process.join()


def _serve(parents: Connection, pipe: Connection) -> None:
    parents.close()  # or this process would not see it end
    with contextlib.suppress(EOFError):
        while True:
            module, name, file, options, (seconds, memory) = pipe.recv()
            read = getattr(importlib.import_module(module), name).__wrapped__
            child.limit(time.process_time() + seconds, memory)
            answer = io.BytesIO()
            child.serve(read, file, options, answer)
            pipe.send_bytes(answer.getvalue())
