"""Read in a process of its own, with limits of time and memory.

SurfaceTopography, trimesh (text STL and OBJ) and tifffile (with Pillow behind it) parse a whole
file in ways of their own: a small one may keep them busy for ever, ask for all memory or crash
them. The other readers stay in this process, which costs no start: they are ours, and what they
hand on, a PNG's pixels to Pillow, has its chunks, checksums and sizes checked before.
"""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import tempfile
import threading
from dataclasses import asdict
from functools import wraps
from importlib import import_module
from pathlib import Path
from typing import IO, Any

import numpy as np

from asperity.errors import ParameterError, SurfaceFileError
from asperity.files import plain, record
from asperity.measured.reading.raw import RawSurface
from asperity.measured.reading.reader import Read, ReadingOptions, SurfaceFile

SECONDS = 20.0
"""Time of the processor that the reading of a small file may take."""
MEMORY = 10**9
"""Bytes that the reading of a small file may take."""
_PATIENCE = 6  # times as long by the clock: other work on the machine is no fault of the file
_SECONDS_PER_BYTE, _BYTES_PER_BYTE = 1e-6, 50  # what a large file explains
_KEPT = ("pitch", "source", "notes", "has_units", "relative", "per_pitch")
_ADVICE = (
    "save the heights in another format (X3P, NPY, text), or, if you trust the file, raise"
    " SECONDS or MEMORY of asperity.measured.reading.child"
)


def in_child(read: Read) -> Read:
    """Let a reader, a function at the top of its module, work in a process of its own."""

    @wraps(read)
    def guarded(file: SurfaceFile, options: ReadingOptions) -> RawSurface | None:
        return call(read, file, options)

    return guarded


def call(read: Read, file: SurfaceFile, options: ReadingOptions) -> RawSurface | None:
    """Return what a reader makes of a file in a process of its own.

    Raises:
        SurfaceFileError: as the reader; or it took too long, too much memory, or crashed.
    """
    size = file.path.stat().st_size
    seconds = SECONDS + _SECONDS_PER_BYTE * size
    memory = MEMORY + _BYTES_PER_BYTE * size
    with tempfile.TemporaryFile() as answer:
        code = start(read, file, options, (seconds, memory), answer)
        answer.seek(0)
        said = json.loads(answer.readline() or "{}")
        if code is None or -code == getattr(signal, "SIGXCPU", None):
            fault = f"takes more than {seconds:.0f} s to be read, the limit; {_ADVICE}"
        elif "memory" in said:
            fault = f"takes more than {memory / 1e9:.1f} GB to be read, the limit; {_ADVICE}"
        elif code or not said:
            fault = f"ends its reader with {_ending(code)}: damaged, or not what it seems"
        else:
            return _told(said, answer)
    raise SurfaceFileError(f"{file.name} {fault}")


def start(
    read: Read,
    file: SurfaceFile,
    options: ReadingOptions,
    limits: tuple[float, int],
    answer: IO[bytes],
) -> int | None:
    """Run a reader in a new process until it ends.

    Args:
        read: the reader.
        file: what it reads.
        options: how it reads.
        limits: seconds of the processor and bytes.
        answer: file that receives what it found, see :func:`serve`.

    Returns:
        The exit code, minus the number of a signal; None if it took too long.
    """
    where = [read.__module__, read.__name__, os.fspath(file.path), plain(asdict(options)), limits]
    program = f"import sys; sys.path[:] = {sys.path!r}; from {__name__} import main; main()"
    with subprocess.Popen(
        [sys.executable, "-P", "-c", program, json.dumps(where)],
        stdin=subprocess.PIPE,  # never written to: it ends when this process does
        stdout=answer,
        stderr=subprocess.DEVNULL,
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
    ) as process:
        try:
            return process.wait(_PATIENCE * limits[0])
        except subprocess.TimeoutExpired:
            return None
        finally:
            process.kill()


def _ending(code: int) -> str:
    return f"signal {signal.Signals(-code).name}" if code < 0 else f"code {code}"


def _told(said: dict[str, Any], answer: IO[bytes]) -> RawSurface | None:
    """Return the surface that a child has found, or raise what it raised."""
    if "error" in said:
        raise OSError(said["error"])
    if "refused" in said:
        argument, requirement, given = said["refused"]
        if argument is None:
            raise SurfaceFileError(requirement)
        raise ParameterError(argument, requirement, given)
    if "surface" not in said:
        return None
    found = said["surface"]
    for name in ("pitch", "notes"):
        found[name] = None if found[name] is None else tuple(found[name])
    return RawSurface(np.lib.format.read_array(answer, allow_pickle=False), **found)


# --- in the child -------------------------------------------------------------------------------


def main() -> None:
    """Be the child: read the file that the argument names, answer on standard output."""
    module, name, path, options, limits = json.loads(sys.argv[1])
    threading.Thread(target=_end_with_parent, daemon=True).start()
    answer = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever a library prints
    read = getattr(import_module(module), name).__wrapped__
    limit(*limits)
    with Path(path).open("rb") as stream:
        file = SurfaceFile(Path(path), stream.read(4096))
    serve(read, file, ReadingOptions(**options), answer)


def _end_with_parent() -> None:
    os.read(0, 1)  # nothing comes until the other end is closed, by whatever end of the parent
    os._exit(1)


def limit(seconds: float, memory: int) -> None:
    """Limit this process, where the system can: elsewhere the parent's clock must do."""
    try:
        import resource
    except ModuleNotFoundError:
        return
    # Data, not addresses: libraries that are mapped do not count.
    for name, most in {"DATA": memory, "CPU": math.ceil(seconds), "CORE": 0}.items():
        kind = getattr(resource, f"RLIMIT_{name}")
        hard = resource.getrlimit(kind)[1]
        resource.setrlimit(kind, (most if hard < 0 else min(most, hard), hard))


def serve(read: Read, file: SurfaceFile, options: ReadingOptions, answer: IO[bytes]) -> None:
    """Write what a reader makes of a file: a line of JSON, then the heights as NPY."""
    raw = None
    try:
        raw = read(file, options)
        said: dict[str, Any] = {"left": True}
        if raw is not None:
            said = {"surface": record(raw, *_KEPT)}
    except MemoryError:
        said = {"memory": True}
    except OSError as error:
        said = {"error": error.strerror or str(error)}
    except ParameterError as error:
        argument = None if isinstance(error, SurfaceFileError) else error.argument
        said = {"refused": [argument, error.requirement, error.given]}
    answer.write(json.dumps(said, default=str).encode() + b"\n")
    if raw is not None:
        np.lib.format.write_array(answer, raw.heights, allow_pickle=False)
    answer.flush()
