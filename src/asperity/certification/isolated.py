"""A renderer in processes of its own, which reports where it crashed or does not return."""

from __future__ import annotations

import mmap
import os
import tempfile
import time
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from asperity.certification.renderers import (
    LocalRenderer,
    RendererError,
    RendererSource,
    crash_error,
)
from asperity.core.checks import FloatArray
from asperity.core.processes import ShieldedContext, end_with_parent, ignore_interrupts

_START_TIMEOUT = 60.0
_CALL_TIMEOUT = 10.0
"""Times [s] after which a renderer that does not open, or a call, is given up."""
_LEAST_SHARED = 64
"""Number of paths from which on processes share them."""


class IsolatedRenderer:
    """A renderer in a process of its own.

    Args:
        source: where it is.
    """

    def __init__(self, source: RendererSource) -> None:
        context = ShieldedContext()
        self._counter = tempfile.NamedTemporaryFile()  # noqa: SIM115  # closed with the process
        self._counter.write(bytes(8))
        self._counter.flush()
        self._progress = _progress_array(self._counter.name)
        self._connection, remote = context.Pipe()
        arguments = (source, self._counter.name, remote)
        self._process = context.Process(target=_serve, args=arguments, daemon=True)
        self._process.start()
        remote.close()

    def check_opened(self) -> None:
        """Wait until the renderer is open.

        Raises:
            RendererError: if it cannot be opened.
        """
        if not self._connection.poll(_START_TIMEOUT):
            raise RendererError(f"did not open within {_START_TIMEOUT:g} s")
        try:
            answer = self._connection.recv()
        except (EOFError, ConnectionError):
            self._process.join()
            reason = f"ended with exit code {self._process.exitcode} while it was opened"
            raise RendererError(reason) from None
        if isinstance(answer, RendererError):
            raise answer

    def send(self, method: str, points: FloatArray) -> None:
        """Call a method of the renderer without waiting for its result."""
        self._connection.send((method, points))

    def receive(self, points: FloatArray) -> FloatArray:
        """Return the result of the method that was called with points.

        Raises:
            RendererError: if it crashed or does not return, with the position.
        """
        self._wait(points)
        try:
            answer: FloatArray | RendererError = self._connection.recv()
        except (EOFError, ConnectionError):
            self._process.join()
            reason = f"crashed with exit code {self._process.exitcode}"
            raise self._error(points, reason) from None
        if isinstance(answer, RendererError):
            raise answer
        return answer

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.join()
        self._connection.close()
        self._counter.close()

    def _wait(self, points: FloatArray) -> None:
        """Wait for an answer as long as calls return."""
        calls = int(self._progress[0])
        changed = time.monotonic()
        while not self._connection.poll(0.1):
            now = time.monotonic()
            if self._progress[0] != calls:
                calls = int(self._progress[0])
                changed = now
            if now - changed > _CALL_TIMEOUT:
                raise self._error(points, f"did not return in {_CALL_TIMEOUT:g} s")

    def _error(self, points: FloatArray, reason: str) -> RendererError:
        places: FloatArray = points.reshape(-1, 3)
        return crash_error(places[min(int(self._progress[0]), len(places) - 1)], reason)


def _progress_array(path: str) -> Any:
    with open(path, "r+b") as stream:
        return np.frombuffer(mmap.mmap(stream.fileno(), 8), dtype=np.int64)


def _serve(source: RendererSource, counter: str, connection: Connection) -> None:
    """Answer requests until the connection is closed."""
    end_with_parent()
    ignore_interrupts()
    try:
        renderer = source.load()
        renderer.progress = _progress_array(counter)
        connection.send("opened")
        while True:
            method, points = connection.recv()
            connection.send(_answer(renderer, method, points))
    except RendererError as error:
        connection.send(error)
    except EOFError:
        pass  # the other side has closed the connection
    os._exit(0)  # threads of the renderer may not end


def _answer(renderer: LocalRenderer, method: str, points: FloatArray) -> FloatArray | RendererError:
    """Return what a method of the renderer returns, or its error."""
    try:
        answer: FloatArray = getattr(renderer, method)(points)
    except RendererError as error:
        return error
    except Exception as error:  # of a user's function
        reason = f"raised {type(error).__name__}: {error}"
        if method != "forces":
            return RendererError(reason)
        return crash_error(points.reshape(-1, 3)[int(renderer.progress[0])], reason)
    renderer.progress[0] += 1
    return answer


class RendererPool:
    """Copies of a renderer in several processes, which share the paths.

    Args:
        source: where it is.
        copies: number of processes.

    Raises:
        RendererError: if it cannot be opened.
    """

    def __init__(self, source: RendererSource, copies: int) -> None:
        self._renderers = [IsolatedRenderer(source) for _ in range(copies)]
        try:
            for renderer in self._renderers:
                renderer.check_opened()
        except RendererError:
            self.close()
            raise

    def forces(self, paths: FloatArray) -> FloatArray:
        """Return forces along paths; see :class:`~asperity.certification.renderers.Renderer`.

        Raises:
            RendererError: if it crashes or does not return, with the position.
        """
        copies = len(self._renderers) if len(paths) >= _LEAST_SHARED else 1
        parts = np.array_split(paths, copies)
        for renderer, part in zip(self._renderers, parts, strict=False):
            renderer.send("forces", part)
        pairs = zip(self._renderers, parts, strict=False)
        return np.concatenate([renderer.receive(part) for renderer, part in pairs])

    def call_times(self, points: FloatArray) -> FloatArray:
        """Return the time of a call at each point [s], shape (n,)."""
        self._renderers[0].send("call_times", points)
        return self._renderers[0].receive(points)

    def close(self) -> None:
        """End the processes."""
        for renderer in self._renderers:
            renderer.close()
