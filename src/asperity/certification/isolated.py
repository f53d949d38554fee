"""A renderer in a process of its own, which reports where it crashed or does not return."""

from __future__ import annotations

import mmap
import os
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from asperity.certification.renderers import Renderer, RendererError, RendererSource, crash_error
from asperity.core.checks import FloatArray
from asperity.core.processes import end_with_parent

_START_TIMEOUT = 60.0
_CALL_TIMEOUT = 10.0
"""Times [s] after which a renderer that does not open, or a call, is given up."""
_MIN_CALLS = 64
_MAX_CALLS = 100_000
_PIECE_TIME = 0.2
"""Calls of one message, and the time [s] that it should take."""


class IsolatedRenderer:
    """A renderer in a process of its own.

    Args:
        source: where it is.

    Raises:
        RendererError: if it cannot be opened.
    """

    def __init__(self, source: RendererSource) -> None:
        self._counter = tempfile.NamedTemporaryFile()  # noqa: SIM115  # closed with the process
        self._counter.write(bytes(8))
        self._counter.flush()
        self._progress = _progress_array(self._counter.name)
        context = get_context("spawn")
        self._connection, remote = context.Pipe()
        arguments = (source, self._counter.name, remote)
        self._process = context.Process(target=_serve, args=arguments, daemon=True)
        self._process.start()
        remote.close()
        try:
            if not self._connection.poll(_START_TIMEOUT):
                raise RendererError(f"did not open within {_START_TIMEOUT:g} s")
            self._receive(np.zeros((1, 1, 3)))
        except RendererError:
            self.close()
            raise
        self._piece_calls = _MIN_CALLS

    def forces(self, paths: FloatArray) -> FloatArray:
        """Return forces along paths; see :class:`~asperity.certification.renderers.Renderer`.

        Raises:
            RendererError: if it crashes or does not return, with the position.
        """
        forces = np.empty_like(paths)
        start = 0
        while start < len(paths):
            count = max(1, self._piece_calls // paths.shape[1])
            forces[start : start + count] = self._piece_forces(paths[start : start + count])
            start += count
        return forces

    def call_times(self, points: FloatArray) -> FloatArray:
        """Return the time of a call at each point [s], shape (n,)."""
        return self._request("call_times", points)

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.join()
        self._connection.close()
        self._counter.close()

    def _piece_forces(self, paths: FloatArray) -> FloatArray:
        began = time.monotonic()
        forces = self._request("forces", paths)
        duration = max(time.monotonic() - began, 1e-6)
        calls = int(self._piece_calls * min(2.0, _PIECE_TIME / duration))
        self._piece_calls = min(max(calls, _MIN_CALLS), _MAX_CALLS)
        return forces

    def _request(self, method: str, points: FloatArray) -> FloatArray:
        self._connection.send((method, points))
        self._wait(points)
        answer: FloatArray = self._receive(points)
        return answer

    def _wait(self, paths: FloatArray) -> None:
        """Wait for an answer as long as calls return."""
        calls = int(self._progress[0])
        changed = time.monotonic()
        while not self._connection.poll(0.1):
            now = time.monotonic()
            if self._progress[0] != calls:
                calls = int(self._progress[0])
                changed = now
            if now - changed > _CALL_TIMEOUT:
                self.close()
                reason = f"did not return in {_CALL_TIMEOUT:g} s"
                raise crash_error(self._point(paths, calls), reason)

    def _receive(self, paths: FloatArray) -> Any:
        try:
            answer = self._connection.recv()
        except (EOFError, ConnectionError):
            self._process.join()
            code = self._process.exitcode
            point = self._point(paths, int(self._progress[0]))
            raise crash_error(point, f"crashed with exit code {code}") from None
        if isinstance(answer, RendererError):
            raise answer
        return answer

    @staticmethod
    def _point(paths: FloatArray, call: int) -> FloatArray:
        points: FloatArray = paths.reshape(-1, 3)
        return np.asarray(points[min(call, len(points) - 1)])


def _progress_array(path: str) -> Any:
    with open(path, "r+b") as stream:
        return np.frombuffer(mmap.mmap(stream.fileno(), 8), dtype=np.int64)


def _serve(source: RendererSource, counter: str, connection: Connection) -> None:
    """Answer requests until the connection is closed."""
    end_with_parent()
    progress = _progress_array(counter)
    request: tuple[str, FloatArray]
    try:
        renderer = source.load()
        renderer.progress = progress
        connection.send("opened")
        while True:
            request = connection.recv()
            connection.send(_answer(renderer, *request, progress))
    except RendererError as error:
        connection.send(error)
    except EOFError:
        pass  # the other side has closed the connection
    os._exit(0)  # threads of the renderer may not end


def _answer(
    renderer: Renderer, method: str, points: FloatArray, progress: Any
) -> FloatArray | RendererError:
    """Return what a method of the renderer returns, or its error."""
    methods = {"forces": renderer.forces, "call_times": renderer.call_times}
    try:
        answer = methods[method](points)
    except RendererError as error:
        return error
    except Exception as error:  # of a user's function
        return RendererError(f"raised {type(error).__name__}: {error}")
    progress[0] += 1
    return answer


class RendererPool:
    """Copies of a renderer in several processes, which share the paths.

    Args:
        source: where it is.
        copies: number of processes.
    """

    def __init__(self, source: RendererSource, copies: int) -> None:
        self._renderers: list[IsolatedRenderer] = []
        for _ in range(copies):
            self._renderers.append(IsolatedRenderer(source))
        self._threads = ThreadPoolExecutor(copies)

    def forces(self, paths: FloatArray) -> FloatArray:
        """Return forces along paths; see :class:`IsolatedRenderer`."""
        if len(paths) < _MIN_CALLS:
            return self._renderers[0].forces(paths)
        parts = np.array_split(paths, len(self._renderers))
        return np.concatenate(list(self._threads.map(_part_forces, self._renderers, parts)))

    def call_times(self, points: FloatArray) -> FloatArray:
        """Return the time of a call at each point [s], shape (n,)."""
        return self._renderers[0].call_times(points)

    def close(self) -> None:
        """End the processes."""
        for renderer in self._renderers:
            renderer.close()
        self._threads.shutdown()


def _part_forces(renderer: IsolatedRenderer, paths: FloatArray) -> FloatArray:
    return renderer.forces(paths)
