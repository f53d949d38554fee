"""A subprocess that runs readers on many files, in place of one subprocess for each file."""

from __future__ import annotations

import contextlib
import io
import multiprocessing
import pickle
import time
from dataclasses import replace
from multiprocessing.connection import Connection
from multiprocessing.context import ForkServerProcess
from typing import IO, Any, Self

from asperity.core.platform.process_control import limit_process
from asperity.measured.reading import ReadingOptions, SurfaceFile, isolation

LIBRARIES = ("SurfaceTopography.IO", "trimesh", "tifffile")
FILES = 500  # files read by one process: libraries may hold memory after each file
# Forks of a small server: those of a test run would inherit gigabytes and exceed the limit at once.
_FORK_SERVER = multiprocessing.get_context("forkserver")


class ReadingWorker:
    """A forked process that reads one file after the other.

    Each file has the usual limits. The fork is replaced after a file that exceeds them.
    """

    _left: int  # files until the process is replaced
    _pipe: Connection
    _process: ForkServerProcess

    def __enter__(self) -> Self:
        """Import the libraries of the readers in the server, so that every fork has them."""
        _FORK_SERVER.set_forkserver_preload([*LIBRARIES, __name__])
        self._start_process()
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def start(
        self,
        read: Any,
        file: SurfaceFile,
        options: ReadingOptions,
        limits: tuple[float, int],
        output: IO[bytes],
    ) -> int:
        """Replace ``isolation.run_subprocess``."""
        if self._left == 0:
            self._end()
            self._start_process()
        self._left -= 1
        try:
            absolute = replace(
                file, path=file.path.absolute()
            )  # the server has a folder of its own
            self._pipe.send((read, absolute, options, limits))
            result = self._pipe.recv_bytes()
        except EOFError:
            self._left = 0
            self._process.join()
            return self._process.exitcode or 0
        except BaseException:  # the time is over
            self._left = 0
            raise
        if isinstance(pickle.loads(result), MemoryError):
            self._left = 0
        output.write(result)
        return 0

    def _start_process(self) -> None:
        self._left = FILES
        self._pipe, there = _FORK_SERVER.Pipe()
        self._process = _FORK_SERVER.Process(target=_serve, args=(there,), daemon=True)
        self._process.start()
        there.close()

    def _end(self) -> None:
        self._pipe.close()
        self._process.kill()
        self._process.join()


def _serve(pipe: Connection) -> None:
    with contextlib.suppress(EOFError):
        while True:
            read, file, options, (seconds, memory) = pipe.recv()
            limit_process(time.process_time() + seconds, memory)
            output = io.BytesIO()
            isolation.write_result(read, file, options, output)
            pipe.send_bytes(output.getvalue())
