"""Renderers as black boxes: a force function in Python, a shared library, or a program on a pipe.

A renderer computes the forces along paths. Each path begins after a reset, so that the forces on
one do not depend on another. Libraries, files and programs run in a process of their own: one that
crashes or never returns is reported with the position at which it did.
"""

from __future__ import annotations

import ctypes
import importlib.util
import inspect
import shlex
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from threading import Thread
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.core.units import format_quantity

ForceFunction = Callable[[Any], ArrayLike]
"""Forces [N] at points [m], shape (n, 3) each, or at one point, shape (3,)."""

STATE_BYTES = 2**16
"""Size of the state of a library without ``NAME_state_size``."""
_ALIGNMENT = 64
UNITS = {"m": 1.0, "mm": 1e-3}
"""Units of position of a renderer [m]."""


class RendererError(ParameterError):
    """A renderer that cannot be called: it crashed, does not return, or returns no forces."""

    def __init__(self, reason: str) -> None:
        super().__init__("renderer", reason)


class Renderer(Protocol):
    """A force function that nobody wrote down."""

    def forces(self, paths: FloatArray) -> FloatArray:
        """Return forces [N] along paths [m], each after a reset, shape (n, m, 3) both."""
        ...

    def call_times(self, points: FloatArray) -> FloatArray:
        """Return the time of a call at each point [s], shape (n,)."""
        ...

    def close(self) -> None:
        """Release the renderer."""
        ...


class LocalRenderer(Renderer, Protocol):
    """A renderer in this process.

    Attributes:
        progress: number of the call in progress, shape (1,), in memory that outlives a crash.
    """

    progress: NDArray[np.int64]


@dataclass(frozen=True)
class RendererSource:
    """Where a renderer is, and how it is called.

    Attributes:
        kind: ``"library"``, ``"python"`` or ``"pipe"``.
        target: path of the library or file, or the command of a program.
        name: prefix of the library's functions, or name of the function in a file.
        text: text with which a library's renderer is opened.
        unit: unit of position, ``"m"`` or ``"mm"``.
        rate: update rate of the renderer's own loop [Hz], at which it is called; 0 for none.
    """

    kind: str
    target: str
    name: str = "texture"
    text: str = ""
    unit: str = "m"
    rate: float = 0.0

    def load(self) -> LocalRenderer:
        """Return the renderer in this process.

        Raises:
            RendererError: if it cannot be loaded.
        """
        loaders: dict[str, Callable[[RendererSource], LocalRenderer]] = {
            "library": LibraryRenderer,
            "python": _load_function,
            "pipe": PipeRenderer,
        }
        return loaders[self.kind](self)


class Pace:
    """Calls a renderer at the rate of its own loop."""

    def __init__(self, rate: float) -> None:
        self._period = 1.0 / rate if rate else 0.0
        self._due = time.perf_counter()

    def wait(self) -> None:
        """Wait until the next call is due."""
        if self._period:
            self._due = max(self._due + self._period, time.perf_counter())
            time.sleep(max(self._due - time.perf_counter(), 0.0))


class FunctionRenderer:
    """A function in Python; a method ``reset`` of it is called before each path.

    Args:
        function: forces [N] at points of the given unit, shape (n, 3), or at one point, shape (3,).
        unit: unit of position.
        rate: update rate of its own loop [Hz], 0 for none.

    Raises:
        RendererError: if it accepts neither points nor a point.
    """

    def __init__(self, function: ForceFunction, unit: str = "m", rate: float = 0.0) -> None:
        self._function = function
        self._scale = 1.0 / UNITS[unit]
        self._reset: Callable[[], object] | None = getattr(function, "reset", None)
        self._pace = Pace(rate)
        self.progress = np.zeros(1, dtype=np.int64)
        self._takes_many = self._reset is None and not rate and self._accepts_many()

    def forces(self, paths: FloatArray) -> FloatArray:
        """Return forces along paths; see :class:`Renderer`."""
        points = self._scale * paths
        if self._takes_many:
            return _checked_forces(self._function(points.reshape(-1, 3)), paths)
        forces = np.empty_like(paths)
        for number, (path, force) in enumerate(zip(points, forces, strict=True)):
            if self._reset is not None:
                self._reset()
            for index, point in enumerate(path):
                self.progress[0] = number * len(path) + index
                self._pace.wait()
                force[index] = _checked_forces(self._function(point), point)
        return forces

    def call_times(self, points: FloatArray) -> FloatArray:
        """Return the time of a call at each point [s], shape (n,)."""
        return time_calls(self, points)

    def close(self) -> None:
        """Do nothing: the function is the caller's."""

    def _accepts_many(self) -> bool:
        two = np.zeros((2, 3))
        try:
            return np.shape(self._function(two)) == two.shape
        except Exception:  # any error of a function of one point
            return False


def time_calls(renderer: LocalRenderer, points: FloatArray) -> FloatArray:
    """Return the time of a call of a renderer at each point [s], shape (n,)."""
    times = np.empty(len(points))
    for index, point in enumerate(points):
        began = time.perf_counter()
        renderer.forces(point[None, None])
        times[index] = time.perf_counter() - began
        renderer.progress[0] = index + 1
    return times


def _checked_forces(values: ArrayLike, points: FloatArray) -> FloatArray:
    """Return forces as floats.

    Raises:
        RendererError: for another shape.
    """
    try:
        forces = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise RendererError(f"returned {type(values).__name__}, not numbers") from None
    if forces.size != points.size:
        raise RendererError(
            f"returned {forces.size} numbers for {points.size // 3} points; 3 a point are needed"
        )
    return forces.reshape(points.shape)


def _load_function(source: RendererSource) -> FunctionRenderer:
    """Return the renderer of a function in a file of Python."""
    path = Path(source.target)
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None:
        raise RendererError(f"{path} is no file of Python")
    module = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(path.parent.resolve()))
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # of a user's file
        raise RendererError(f"{path} cannot be imported: {error}") from None
    function: Any = getattr(module, source.name, None)
    if not callable(function):
        raise RendererError(f"{path} has no function {source.name}")
    if inspect.isclass(function):
        function = function()
    return FunctionRenderer(function, source.unit, source.rate)


class LibraryRenderer:
    """A shared library with ``NAME_reset(state)`` and ``NAME_force(state, position, force)``.

    The state is what ``NAME_open(text)`` returns, else ``NAME_state_size()`` bytes of zeros, else
    64 KiB of zeros. ``NAME_set_pose(state, rotation)``, ``NAME_set_time_step(state, seconds)`` and
    ``NAME_rate(state)`` are called where they exist: with the identity, with the sample period, and
    for the update rate [Hz] of a loop that the renderer runs by itself. ``NAME_close(state)`` ends.

    Raises:
        RendererError: if the library cannot be loaded, or lacks a function.
    """

    def __init__(self, source: RendererSource) -> None:
        from asperity.certification import call_loop
        from asperity.kernels.fuse import fuse_module

        try:
            self._library = ctypes.CDLL(str(Path(source.target).resolve()))
        except OSError as error:
            raise RendererError(f"{source.target} cannot be loaded: {error}") from None
        self._prefix = source.name
        self._scale = 1.0 / UNITS[source.unit]
        self._reset = self._address("reset")
        self._force = self._address("force")
        self._memory = np.zeros(self._state_size() + _ALIGNMENT, dtype=np.uint8)
        self._state = self._open(source.text)
        self.rate = source.rate or self._call_number("rate", ctypes.c_double, 0.0)
        self._configure()
        self._pace = Pace(self.rate)
        self.progress = np.zeros(1, dtype=np.int64)
        self._call: Callable[..., None] = fuse_module(call_loop).call_renderer
        self.forces(np.zeros((0, 1, 3)))  # compiles, and calls nothing

    def forces(self, paths: FloatArray) -> FloatArray:
        """Return forces along paths; see :class:`Renderer`."""
        points = np.ascontiguousarray(self._scale * paths)
        forces = np.zeros_like(points)
        if not self.rate:
            self._call(self._reset, self._force, self._state, points, forces, self.progress)
            return forces
        reset = ctypes.CFUNCTYPE(None, ctypes.c_void_p)(self._reset)
        force = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 3)(self._force)
        for i, path in enumerate(points):
            reset(self._state)
            for j, point in enumerate(path):
                self.progress[0] = i * points.shape[1] + j
                self._pace.wait()
                force(self._state, point.ctypes.data, forces[i, j].ctypes.data)
        return forces

    def call_times(self, points: FloatArray) -> FloatArray:
        """Return the time of a call at each point [s], shape (n,)."""
        paths = np.ascontiguousarray(self._scale * points[:, None, None])
        force = np.zeros((1, 1, 3))
        times = np.empty(len(paths))
        for index, path in enumerate(paths):
            began = time.perf_counter()
            self._call(self._reset, self._force, self._state, path, force, self.progress)
            times[index] = time.perf_counter() - began
        return times

    def close(self) -> None:
        """Close the renderer of a library that opens one."""
        if self._has("open") and self._has("close"):
            self._function("close", None, ctypes.c_void_p)(self._state)

    def _configure(self) -> None:
        if self._has("set_pose"):
            rotation = (ctypes.c_double * 9)(1, 0, 0, 0, 1, 0, 0, 0, 1)
            self._function("set_pose", None, *[ctypes.c_void_p] * 2)(self._state, rotation)
        if self._has("set_time_step"):
            step = 1.0 / self.rate if self.rate else 1e-3
            self._function("set_time_step", None, ctypes.c_void_p, ctypes.c_double)(
                self._state, step
            )

    def _open(self, text: str) -> int:
        """Return the address of the state."""
        if self._has("open"):
            state = self._function("open", ctypes.c_void_p, ctypes.c_char_p)(text.encode())
            if not state:
                raise RendererError(f"{self._prefix}_open({text!r}) returned no renderer")
            return int(state)
        address = int(self._memory.ctypes.data)
        return address + -address % _ALIGNMENT

    def _state_size(self) -> int:
        if not self._has("state_size"):
            return STATE_BYTES
        return int(self._function("state_size", ctypes.c_size_t)())

    def _call_number(self, name: str, kind: Any, default: float) -> float:
        if not self._has(name):
            return default
        return float(self._function(name, kind, ctypes.c_void_p)(self._state))

    def _has(self, name: str) -> bool:
        return hasattr(self._library, f"{self._prefix}_{name}")

    def _function(self, name: str, result: Any, *arguments: Any) -> Any:
        function = getattr(self._library, f"{self._prefix}_{name}")
        function.restype = result
        function.argtypes = arguments
        return function

    def _address(self, name: str) -> int:
        if not self._has(name):
            raise RendererError(
                f"{self._library._name} has no function {self._prefix}_{name}; "
                "the prefix of its functions is the argument name"
            )
        function = getattr(self._library, f"{self._prefix}_{name}")
        return int(ctypes.cast(function, ctypes.c_void_p).value or 0)


class PipeRenderer:
    """A program that reads positions from standard input and writes forces to standard output.

    It reads ``reset``, to which it does not answer, or three numbers in a line, to which it answers
    with the three numbers of the force [N] in a line.

    Raises:
        RendererError: if it cannot be started.
    """

    def __init__(self, source: RendererSource) -> None:
        self._scale = 1.0 / UNITS[source.unit]
        self._pace = Pace(source.rate)
        self._is_paced = bool(source.rate)
        self.progress = np.zeros(1, dtype=np.int64)
        try:
            self._program = subprocess.Popen(
                shlex.split(source.target), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
            )
        except (OSError, ValueError, IndexError) as error:
            raise RendererError(f"{source.target!r} cannot be started: {error}") from None

    def forces(self, paths: FloatArray) -> FloatArray:
        """Return forces along paths; see :class:`Renderer`."""
        lines: list[str] = []
        for path in (self._scale * paths).tolist():
            lines.append("reset\n")
            lines.extend(f"{x:.17g} {y:.17g} {z:.17g}\n" for x, y, z in path)
        writer = Thread(target=self._write, args=(lines,), daemon=True)
        writer.start()
        forces = np.empty((paths.shape[0] * paths.shape[1], 3))
        for index in range(len(forces)):
            self.progress[0] = index
            forces[index] = self._read_force()
        writer.join()
        return forces.reshape(paths.shape)

    def call_times(self, points: FloatArray) -> FloatArray:
        """Return the time of a call at each point [s], shape (n,)."""
        return time_calls(self, points)

    def close(self) -> None:
        """End the program."""
        self._program.kill()
        self._program.wait()

    def _write(self, lines: Sequence[str]) -> None:
        stream = self._program.stdin
        assert stream is not None  # it was started with a pipe
        try:
            if not self._is_paced:
                stream.write("".join(lines))
            else:
                for line in lines:
                    self._pace.wait()
                    stream.write(line)
                    stream.flush()
            stream.flush()
        except OSError:
            pass  # the program has ended, which the reader reports

    def _read_force(self) -> list[float]:
        stream = self._program.stdout
        assert stream is not None  # it was started with a pipe
        line = stream.readline()
        if not line:
            raise RendererError(f"ended with exit code {self._program.wait()} before it answered")
        try:
            force = [float(number) for number in line.replace(",", " ").split()]
        except ValueError:
            force = []
        if len(force) != 3:
            raise RendererError(f"answered {line.strip()!r}; three numbers [N] are needed")
        return force


def crash_error(point: FloatArray, reason: str) -> RendererError:
    """Return the error of a renderer that ended or stopped at a position."""
    place = ", ".join(format_quantity(value, "m") for value in point.tolist())
    return RendererError(f"{reason} at the position ({place})")
