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
from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.core.units import format_quantity
from asperity.export.abi import ABI_VERSION

ForceFunction = Callable[[Any], ArrayLike]
"""Forces [N] at points [m], shape (n, 3) each, or at one point, shape (3,)."""

STATE_BYTES = 2**16
"""Size of the state of a library without ``NAME_state_size``."""
_ALIGNMENT = 64
_LINES_AT_ONCE = 200
"""Lines to a program at once: they and their answers fit into the buffer of a pipe."""
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

    def call_times(self, points: FloatArray) -> FloatArray:
        """Return the time of a call at each point [s], shape (n,)."""

    def close(self) -> None:
        """Release the renderer."""


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


class LocalRenderer(ABC):
    """A renderer in this process, which is called point by point at the rate of its own loop.

    Args:
        unit: unit of position.
        rate: update rate of its own loop [Hz], 0 for none.

    Attributes:
        progress: number of the call in progress, shape (1,), in memory that outlives a crash.
    """

    def __init__(self, unit: str, rate: float) -> None:
        self.scale = 1.0 / UNITS[unit]
        self.rate = rate
        self.progress = np.zeros(1, dtype=np.int64)
        self._due = time.perf_counter()

    @abstractmethod
    def reset(self) -> None:
        """Forget what was before."""

    @abstractmethod
    def force(self, point: FloatArray) -> ArrayLike:
        """Return the force [N] at a point in its unit, shape (3,)."""

    def forces(self, paths: FloatArray) -> FloatArray:
        """Return forces along paths; see :class:`Renderer`."""
        forces = np.empty_like(paths)
        for number, path in enumerate(self.scale * paths):
            self.reset()
            for index, point in enumerate(path):
                self.progress[0] = number * len(path) + index
                self.wait()
                forces[number, index] = _checked_forces(self.force(point), point)
        return forces

    def call_times(self, points: FloatArray) -> FloatArray:
        """Return the time of a call at each point [s], shape (n,)."""
        times = np.empty(len(points))
        for index, point in enumerate(points):
            began = time.perf_counter()
            self.forces(point[None, None])
            times[index] = time.perf_counter() - began
        return times

    def wait(self) -> None:
        """Wait until the next call of its loop is due."""
        if self.rate:
            self._due = max(self._due + 1.0 / self.rate, time.perf_counter())
            time.sleep(max(self._due - time.perf_counter(), 0.0))

    def close(self) -> None:
        """Release what it holds."""
        return


class FunctionRenderer(LocalRenderer):
    """A function in Python; a method ``reset`` of it is called before each path.

    Args:
        function: forces [N] at points of the given unit, shape (n, 3), or at one point, shape (3,).
        unit: unit of position.
        rate: update rate of its own loop [Hz], 0 for none.

    Raises:
        RendererError: if it accepts neither points nor a point.
    """

    def __init__(self, function: ForceFunction, unit: str = "m", rate: float = 0.0) -> None:
        super().__init__(unit, rate)
        self._function = function
        self._takes_many = not hasattr(function, "reset") and not rate and self._accepts_many()

    def forces(self, paths: FloatArray) -> FloatArray:
        """Return forces along paths; see :class:`Renderer`."""
        if not self._takes_many:
            return super().forces(paths)
        points = self.scale * paths.reshape(-1, 3)
        try:
            forces = self._function(points)
        except Exception as error:  # of a user's function: at which point?
            for index in range(len(points)):
                self.progress[0] = index
                self._function(points[index : index + 1])
            text = f"raised {type(error).__name__}: {error}; at {len(points)} points together only"
            raise RendererError(text) from error
        return _checked_forces(forces, paths)

    def reset(self) -> None:
        """Call the function's method ``reset``, if it has one."""
        getattr(self._function, "reset", lambda: None)()

    def force(self, point: FloatArray) -> ArrayLike:
        """Return the force at a point."""
        return self._function(point)

    def _accepts_many(self) -> bool:
        two = np.zeros((2, 3))
        try:
            return np.shape(self._function(two)) == two.shape
        except Exception:  # any error of a function of one point
            return False


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


class LibraryRenderer(LocalRenderer):
    """A shared library with ``NAME_reset(state)`` and ``NAME_force(state, position, force)``.

    The state is what ``NAME_open(text)`` returns, else ``NAME_state_size()`` bytes of zeros, else
    64 KiB of zeros. ``NAME_set_pose(state, rotation)``, ``NAME_set_time_step(state, seconds)`` and
    ``NAME_rate(state)`` are called where they exist: with the identity, with the sample period, and
    for the update rate [Hz] of a loop that the renderer runs by itself. ``NAME_close(state)`` ends.

    Raises:
        RendererError: if the library cannot be loaded, lacks a function, or is exported code of
            another ABI or in single precision.
    """

    def __init__(self, source: RendererSource) -> None:
        from asperity.certification import call_loop
        from asperity.kernels.fuse import fuse_module

        super().__init__(source.unit, source.rate)
        try:
            self._library = ctypes.CDLL(str(Path(source.target).resolve()))
        except OSError as error:
            raise RendererError(f"{source.target} cannot be loaded: {error}") from None
        self._prefix = source.name
        self._check_abi()
        self._addresses = [self._address("reset"), self._address("force")]
        self._is_opened = self._has_function("open")
        self._state = ctypes.c_void_p(self._find_state(source.text))
        self.rate = source.rate or self._call("rate", ctypes.c_double, self._state) or 0.0
        rotation = (ctypes.c_double * 9)(1, 0, 0, 0, 1, 0, 0, 0, 1)
        self._call("set_pose", None, self._state, rotation)
        period = 1.0 / self.rate if self.rate else 1e-3
        self._call("set_time_step", None, self._state, ctypes.c_double(period))
        self._loop: Callable[..., None] = fuse_module(call_loop).call_renderer
        self.forces(np.zeros((0, 1, 3)))  # compiles, and calls nothing

    def forces(self, paths: FloatArray) -> FloatArray:
        """Return forces along paths; see :class:`Renderer`."""
        if self.rate:
            return super().forces(paths)
        points = np.ascontiguousarray(self.scale * paths)
        forces = np.zeros_like(points)
        self._loop(*self._addresses, self._state.value, points, forces, self.progress)
        return forces

    def reset(self) -> None:
        """Call the library's function ``reset``."""
        self._call("reset", None, self._state)

    def force(self, point: FloatArray) -> ArrayLike:
        """Return the force at a point."""
        force = (ctypes.c_double * 3)()
        self._call("force", None, self._state, (ctypes.c_double * 3)(*point), force)
        return list(force)

    def close(self) -> None:
        """Close the renderer of a library that opens one."""
        if self._is_opened:
            self._call("close", None, self._state)

    def _check_abi(self) -> None:
        """Refuse an exported library of another ABI, or in single precision."""
        abi = self._call("abi_version", ctypes.c_int)
        if abi is None:
            return
        name = self._library._name
        if abi != ABI_VERSION:
            raise RendererError(f"{name} has ABI {abi}, this version calls ABI {ABI_VERSION}")
        facts = (ctypes.c_uint32 * 4)(16)
        self._call("info", None, facts)
        if facts[2] != ctypes.sizeof(ctypes.c_double):
            raise RendererError(f"{name} is in single precision; export it in double precision")

    def _find_state(self, text: str) -> int:
        """Return the address of the state."""
        if self._is_opened:
            state = self._call("open", ctypes.c_void_p, ctypes.c_char_p(text.encode()))
            if not state:
                raise RendererError(f"{self._prefix}_open({text!r}) returned no renderer")
            return int(state)
        size = self._call("state_size", ctypes.c_size_t) or STATE_BYTES
        self._memory = np.zeros(size + _ALIGNMENT, dtype=np.uint8)
        address = int(self._memory.ctypes.data)
        return address + -address % _ALIGNMENT

    def _call(self, name: str, result: Any, *arguments: Any) -> Any:
        """Call a function of the library; ``None`` if it has none of this name."""
        if not self._has_function(name):
            return None
        function = getattr(self._library, f"{self._prefix}_{name}")
        function.restype = result
        return function(*arguments)

    def _has_function(self, name: str) -> bool:
        return hasattr(self._library, f"{self._prefix}_{name}")

    def _address(self, name: str) -> int:
        if not self._has_function(name):
            raise RendererError(
                f"{self._library._name} has no function {self._prefix}_{name}: the functions of"
                f" a renderer begin with its name, here {self._prefix}"
            )
        function = getattr(self._library, f"{self._prefix}_{name}")
        return int(ctypes.cast(function, ctypes.c_void_p).value or 0)


class PipeRenderer(LocalRenderer):
    """A program that reads positions from standard input and writes forces to standard output.

    It reads ``reset``, to which it does not answer, or three numbers in a line, to which it answers
    with the three numbers of the force [N] in a line.

    Raises:
        RendererError: if it cannot be started.
    """

    def __init__(self, source: RendererSource) -> None:
        super().__init__(source.unit, source.rate)
        try:
            self._program = subprocess.Popen(
                shlex.split(source.target), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
            )
        except (OSError, ValueError, IndexError) as error:
            raise RendererError(f"{source.target!r} cannot be started: {error}") from None

    def forces(self, paths: FloatArray) -> FloatArray:
        """Return forces along paths; see :class:`Renderer`."""
        if self.rate:
            return super().forces(paths)
        lines: list[str] = []
        for path in self.scale * paths:
            lines.append("reset\n")
            lines.extend([_line(point) for point in path])
        forces: list[list[float]] = []
        for start in range(0, len(lines), _LINES_AT_ONCE):
            sent = lines[start : start + _LINES_AT_ONCE]
            self._write("".join(sent))
            for _ in range(len(sent) - sent.count("reset\n")):
                self.progress[0] = len(forces)
                forces.append(self._read_force())
        return np.array(forces).reshape(paths.shape)

    def reset(self) -> None:
        """Send the line ``reset``."""
        self._write("reset\n")

    def force(self, point: FloatArray) -> ArrayLike:
        """Return the force at a point."""
        self._write(_line(point))
        return self._read_force()

    def close(self) -> None:
        """End the program."""
        self._program.kill()
        self._program.wait()

    def _write(self, text: str) -> None:
        stream = self._program.stdin
        assert stream is not None  # it was started with a pipe
        with suppress(OSError):  # the program has ended, which the reader reports
            stream.write(text)
            stream.flush()

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


def _line(point: FloatArray) -> str:
    x, y, z = point.tolist()
    return f"{x:.17g} {y:.17g} {z:.17g}\n"


def crash_error(point: FloatArray, reason: str) -> RendererError:
    """Return the error of a renderer that ended or stopped at a position."""
    place = ", ".join(format_quantity(value, "m") for value in point.tolist())
    return RendererError(f"{reason} at the position ({place})")
